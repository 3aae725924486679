//! HTML and SVG text in which every element that is opened is closed, and every text is escaped.

use super::palette::{Ink, Role};
use std::fmt::{self, Display, Write};

/// An attribute: its name, and anything that prints.
pub(super) type Attribute<'a> = (&'a str, &'a dyn Display);

/// HTML or SVG being written. Elements nest as the closures that fill them do, so tags are balanced by construction.
#[derive(Default)]
pub(super) struct Markup {
    text: String,
}

/// Escapes what is written through it, for use in text and in quoted attributes.
struct Escaped<'a>(&'a mut String);

impl Write for Escaped<'_> {
    fn write_str(&mut self, s: &str) -> fmt::Result {
        for c in s.chars() {
            match c {
                '&' => self.0.push_str("&amp;"),
                '<' => self.0.push_str("&lt;"),
                '>' => self.0.push_str("&gt;"),
                '"' => self.0.push_str("&quot;"),
                '\'' => self.0.push_str("&#39;"),
                // Not allowed in XML, and of no use to a reader.
                c if c.is_control() && !matches!(c, '\n' | '\t') => self.0.push('\u{fffd}'),
                c => self.0.push(c),
            }
        }
        Ok(())
    }
}

impl Markup {
    /// The text so far.
    pub fn into_string(self) -> String {
        self.text
    }

    /// Text, escaped.
    pub fn text(&mut self, text: impl Display) {
        write!(Escaped(&mut self.text), "{text}").expect("writing to a string does not fail");
    }

    /// Markup that is already well-formed: what another `Markup` made, or a constant of the program.
    pub fn raw(&mut self, markup: &str) {
        self.text.push_str(markup);
    }

    /// An element with content.
    pub fn tag(&mut self, name: &str, attributes: &[Attribute], fill: impl FnOnce(&mut Self)) {
        self.open(name, attributes);
        self.text.push('>');
        fill(self);
        self.text.push_str("</");
        self.text.push_str(name);
        self.text.push('>');
    }

    /// A part that a narrow window scrolls, also by keys: a `div` with these attributes.
    pub fn region(&mut self, attributes: &[Attribute], label: &dyn Display, fill: impl FnOnce(&mut Self)) {
        let region: [Attribute; 3] = [("tabindex", &0), ("role", &"region"), ("aria-label", label)];
        self.tag("div", &[attributes, &region].concat(), fill);
    }

    /// An element that holds only text.
    pub fn leaf(&mut self, name: &str, attributes: &[Attribute], text: impl Display) {
        self.tag(name, attributes, |m| m.text(text));
    }

    /// An element without content: `img`, `line`, `path`.
    pub fn void(&mut self, name: &str, attributes: &[Attribute]) {
        self.open(name, attributes);
        self.text.push_str("/>");
    }

    /// A line break in the source, so that it can be read and diffed.
    pub fn newline(&mut self) {
        self.text.push('\n');
    }

    fn open(&mut self, name: &str, attributes: &[Attribute]) {
        self.text.push('<');
        self.text.push_str(name);
        for (key, value) in attributes {
            self.text.push(' ');
            self.text.push_str(key);
            self.text.push_str("=\"");
            self.text_of(value);
            self.text.push('"');
        }
    }

    fn text_of(&mut self, value: &dyn Display) {
        write!(Escaped(&mut self.text), "{value}").expect("writing to a string does not fail");
    }
}

/// An SVG drawing with letters of one size: the content of a file of its own, on white where it is for paper. `attributes` are
/// more of its root's.
pub(super) fn svg(
    title: &str,
    [width, height]: [f64; 2],
    font: f64,
    ink: Ink,
    attributes: &[Attribute],
    fill: impl FnOnce(&mut Markup),
) -> String {
    let view = format!("0 0 {width} {height}");
    let (text, ground) = (ink.color(Role::Text), ink.color(Role::Ground));
    let mut root: Vec<Attribute> = vec![
        ("xmlns", &"http://www.w3.org/2000/svg"),
        ("viewBox", &view),
        ("width", &width),
        ("height", &height),
        ("font-size", &font),
        ("fill", &text),
    ];
    root.extend(attributes);
    let mut m = Markup::default();
    m.tag("svg", &root, |m| {
        m.leaf("title", &[], title);
        if ink == Ink::Paper {
            m.void("rect", &[("width", &width), ("height", &height), ("fill", &ground)]);
        }
        fill(m);
    });
    m.into_string()
}

/// A name as part of an id or a file name: ASCII letters, digits and single dashes; never empty.
pub(super) fn slug(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_ascii_alphanumeric() {
            out.push(c.to_ascii_lowercase());
        } else if !out.ends_with('-') && !out.is_empty() {
            out.push('-');
        }
    }
    let out = out.trim_end_matches('-');
    if out.is_empty() { "unnamed".into() } else { out.into() }
}

/// Slugs of names, made different where two would be the same.
pub(super) fn unique_slugs<'a>(names: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for name in names {
        let base = slug(name);
        let mut candidate = base.clone();
        let mut n = 2;
        while out.contains(&candidate) {
            candidate = format!("{base}-{n}");
            n += 1;
        }
        out.push(candidate);
    }
    out
}

/// What is not balanced in a text of HTML or SVG, by a small scan of its tags.
#[cfg(test)]
pub(super) fn imbalance(markup: &str) -> Option<String> {
    const VOID: [&str; 8] = ["meta", "link", "img", "br", "hr", "input", "col", "wbr"];
    let mut open: Vec<&str> = Vec::new();
    let mut rest = markup;
    while let Some(at) = rest.find('<') {
        rest = &rest[at + 1..];
        if rest.starts_with('!') {
            rest = &rest[rest.find('>')? + 1..];
            continue;
        }
        let Some(end) = rest.find('>') else { return Some("a tag that does not end".into()) };
        let tag = &rest[..end];
        if tag.contains('<') {
            return Some(format!("a '<' within the tag '{tag}'"));
        }
        rest = &rest[end + 1..];
        if let Some(name) = tag.strip_prefix('/') {
            match open.pop() {
                Some(opened) if opened == name => {}
                other => return Some(format!("</{name}> closes {other:?}")),
            }
            continue;
        }
        let name = tag.split([' ', '/', '\n']).next().unwrap_or_default();
        if tag.matches('"').count() % 2 == 1 {
            return Some(format!("quotes of '{tag}'"));
        }
        if name == "script" || name == "style" {
            let close = format!("</{name}>");
            match rest.find(&close) {
                Some(at) => rest = &rest[at + close.len()..],
                None => return Some(format!("<{name}> is not closed")),
            }
        } else if !tag.ends_with('/') && !VOID.contains(&name) {
            open.push(name);
        }
    }
    (!open.is_empty()).then(|| format!("left open: {open:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_attributes_are_escaped() {
        let mut m = Markup::default();
        m.tag("p", &[("title", &"a\"b<c")], |m| {
            m.text("R&D <script>'\u{7}'");
            m.void("img", &[("alt", &"x > y")]);
        });
        let text = m.into_string();
        assert_eq!(
            text,
            "<p title=\"a&quot;b&lt;c\">R&amp;D &lt;script&gt;&#39;\u{fffd}&#39;<img alt=\"x &gt; y\"/></p>"
        );
        assert_eq!(imbalance(&text), None);
    }

    #[test]
    fn the_check_sees_what_is_wrong() {
        assert!(imbalance("<p><b></p></b>").is_some());
        assert!(imbalance("<p>").is_some());
        assert!(imbalance("<p title=\"></p>").is_some());
        assert!(imbalance("<!doctype html><p><br><img src=\"a\"/></p>").is_none());
    }

    #[test]
    fn slugs_are_clean_and_different() {
        assert_eq!(slug("  Veach's room <\"&> №1 "), "veach-s-room-1");
        assert_eq!(slug("…"), "unnamed");
        assert_eq!(unique_slugs(["a b", "a-b", "a_b"]), ["a-b", "a-b-2", "a-b-3"]);
    }
}
