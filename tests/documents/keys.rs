//! `scenes/README.md` and `experiments/README.md` are the documentation of the structures that the files are read into: so
//! they name every key there is, with what the code says of it.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use syn::parse::{Parse, ParseStream};
use syn::{Attribute, Fields, GenericArgument, Item, PathArguments, Type, Variant};

/// A key of a table.
struct Key {
    name: String,
    value: Type,
    docs: String,
    required: bool,
}

/// What stands in a file for one type of the code.
enum Shape {
    /// A table with these keys.
    Table(Vec<Key>),
    /// A table with exactly one of these keys.
    Choice(Vec<Key>),
    /// One of these words.
    Words(Vec<(String, String)>),
    /// One of several things that look different: what is said of each, and the names and types of its parts.
    Either(Vec<(String, Vec<Part>)>),
}

/// A part of a variant, by its name where it has one.
type Part = (Option<String>, Type);

struct Described {
    docs: String,
    shape: Shape,
}

#[derive(Default)]
struct Types(BTreeMap<String, Described>);

/// `choice! { pub enum Name { "key" => Variant(Type), … } }`.
struct ChoiceMacro {
    docs: String,
    name: String,
    keys: Vec<Key>,
}

impl Parse for ChoiceMacro {
    fn parse(input: ParseStream) -> syn::Result<Self> {
        let docs = docs(&input.call(Attribute::parse_outer)?);
        let _: syn::Visibility = input.parse()?;
        let _: syn::Token![enum] = input.parse()?;
        let name: syn::Ident = input.parse()?;
        let body;
        syn::braced!(body in input);
        let mut keys = Vec::new();
        while !body.is_empty() {
            let docs = self::docs(&body.call(Attribute::parse_outer)?);
            let key: syn::LitStr = body.parse()?;
            let _: syn::Token![=>] = body.parse()?;
            let _: syn::Ident = body.parse()?;
            let value;
            syn::parenthesized!(value in body);
            keys.push(Key { name: key.value(), value: value.parse()?, docs, required: false });
            let _: Option<syn::Token![,]> = body.parse()?;
        }
        Ok(Self { docs, name: name.to_string(), keys })
    }
}

/// The documentation, without links into the code.
fn docs(attributes: &[Attribute]) -> String {
    let mut text = String::new();
    for attribute in attributes {
        let syn::Meta::NameValue(pair) = &attribute.meta else { continue };
        let syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(line), .. }) = &pair.value else { continue };
        if pair.path.is_ident("doc") {
            text += &format!("{} ", line.value().trim());
        }
    }
    for inner in ["super::", "crate::"] {
        while let Some(end) = text.find(&format!("[`{inner}")) {
            // With the bracket or the comma before it, and to the end of what is in the brackets.
            let start = text[..end].rfind(['(', ';', ',', ':']).unwrap_or(end);
            let stop = text[end..].find("`]").map_or(text.len(), |i| end + i + 2);
            let stop = stop + usize::from(text[stop..].starts_with(')') && text[start..].starts_with('('));
            text.replace_range(start..stop, "");
        }
    }
    text.replace("[`", "`").replace("`]", "`").replace(" ;", ";").replace(" .", ".").trim().to_owned()
}

/// The text of `#[serde(name = "…")]`, or whether there is `#[serde(name)]`.
fn serde_says(attributes: &[Attribute], name: &str) -> Option<String> {
    let mut found = None;
    for attribute in attributes.iter().filter(|a| a.path().is_ident("serde")) {
        let _ = attribute.parse_nested_meta(|meta| {
            let value = match meta.value() {
                Ok(value) => value.parse::<syn::LitStr>()?.value(),
                Err(_) => String::new(),
            };
            if meta.path.is_ident(name) {
                found = Some(value);
            }
            Ok(())
        });
    }
    found
}

impl Types {
    fn read(&mut self, file: &str) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        let text = std::fs::read_to_string(&path).expect("a file of the project");
        for item in syn::parse_file(&text).expect("a file that compiles").items {
            match item {
                Item::Struct(item) => {
                    let Fields::Named(fields) = item.fields else { continue };
                    let all_default = serde_says(&item.attrs, "default").is_some();
                    let key = |field: syn::Field| Key {
                        name: serde_says(&field.attrs, "rename")
                            .unwrap_or_else(|| field.ident.expect("a named field").to_string()),
                        docs: docs(&field.attrs),
                        required: !all_default
                            && serde_says(&field.attrs, "default").is_none()
                            && !["Option", "bool"].contains(&outermost(&field.ty).as_str()),
                        value: field.ty,
                    };
                    let shape = Shape::Table(fields.named.into_iter().map(key).collect());
                    self.0.insert(item.ident.to_string(), Described { docs: docs(&item.attrs), shape });
                }
                Item::Enum(item) => {
                    let shape = Shape::of_variants(&item.attrs, item.variants.into_iter());
                    self.0.insert(item.ident.to_string(), Described { docs: docs(&item.attrs), shape });
                }
                Item::Macro(item) if item.mac.path.is_ident("choice") => {
                    let choice: ChoiceMacro = item.mac.parse_body().expect("a choice");
                    let shape = Shape::Choice(choice.keys);
                    self.0.insert(choice.name, Described { docs: choice.docs, shape });
                }
                _ => {}
            }
        }
    }
}

impl Shape {
    fn of_variants(attributes: &[Attribute], variants: impl Iterator<Item = Variant>) -> Self {
        let variants: Vec<Variant> = variants.filter(|v| serde_says(&v.attrs, "skip").is_none()).collect();
        let lowered = serde_says(attributes, "rename_all").is_some();
        if lowered && variants.iter().all(|v| v.fields.is_empty()) {
            let word = |v: &Variant| (v.ident.to_string().to_lowercase(), docs(&v.attrs));
            return Self::Words(variants.iter().map(word).collect());
        }
        let types = |v: &Variant| match &v.fields {
            Fields::Unit => Vec::new(),
            fields => {
                fields.iter().map(|f| (f.ident.as_ref().map(ToString::to_string), f.ty.clone())).collect()
            }
        };
        Self::Either(variants.iter().map(|v| (docs(&v.attrs), types(v))).collect())
    }
}

fn outermost(of: &Type) -> String {
    match of {
        Type::Path(path) => path.path.segments.last().expect("a path").ident.to_string(),
        _ => String::new(),
    }
}

/// The arguments of a type such as `Option<T>`.
fn arguments(of: &Type) -> Vec<&GenericArgument> {
    let Type::Path(path) = of else { return Vec::new() };
    match &path.path.segments.last().expect("a path").arguments {
        PathArguments::AngleBracketed(list) => list.args.iter().collect(),
        _ => Vec::new(),
    }
}

fn inner(of: &Type) -> Option<&Type> {
    arguments(of).into_iter().find_map(|a| if let GenericArgument::Type(t) = a { Some(t) } else { None })
}

/// A page about all that can be reached from one type.
struct Page<'a> {
    types: &'a Types,
    /// In the order in which they are met.
    sections: Vec<String>,
}

impl Page<'_> {
    /// What a type is in a file.
    fn words(&mut self, of: &Type) -> String {
        if let Type::Array(array) = of {
            let syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Int(count), .. }) = &array.len else {
                panic!("an array of a known length")
            };
            return format!("list of {count}: {}", self.words(&array.elem));
        }
        let rule = inner(of).map(outermost);
        match (outermost(of).as_str(), rule.as_deref()) {
            ("Option" | "Spanned" | "Box", _) => self.words(inner(of).expect("of something")),
            ("Vec", _) => format!("list: {}", self.words(inner(of).expect("of something"))),
            ("Named", _) => format!("by name: {}", self.words(inner(of).expect("of something"))),
            ("String", _) => "text".into(),
            ("bool", _) => "`true` or `false`".into(),
            ("f32" | "Number", _) => "number".into(),
            ("u64" | "i32", _) => "whole number".into(),
            ("Count", _) => {
                let least = arguments(of).into_iter().find_map(|a| match a {
                    GenericArgument::Const(syn::Expr::Lit(syn::ExprLit {
                        lit: syn::Lit::Int(n), ..
                    })) => Some(n.to_string()),
                    _ => None,
                });
                format!("whole number, {} or more", least.expect("a least number"))
            }
            ("Positive", _) => "number above 0".into(),
            ("NonNegative", _) => "number, 0 or more".into(),
            ("Checked", Some("Fraction")) => "number from 0 to 1".into(),
            ("Pair", _) => "`[x, y]`".into(),
            ("Triple", _) => "`[x, y, z]`".into(),
            ("Row", _) => "`[a, b, c, d]`".into(),
            ("Color", Some("Fraction")) => "colour, 0 to 1".into(),
            ("Color", Some("AboveZero")) => "colour, above 0".into(),
            ("Color", Some("AnyNumber")) => "`[x, y, z]` or a number".into(),
            ("Color", None) => "colour".into(),
            (name, _) => self.of_named(name),
        }
    }

    fn of_named(&mut self, name: &str) -> String {
        let described = self.types.0.get(name).unwrap_or_else(|| panic!("{name} is in none of the files"));
        if let Shape::Words(words) = &described.shape {
            let quoted: Vec<String> = words.iter().map(|(word, _)| format!("`\"{word}\"`")).collect();
            return quoted.join(", ");
        }
        if !self.sections.iter().any(|s| s == name) {
            self.sections.push(name.to_owned());
        }
        format!("[{0}](#{0})", heading(name))
    }

    /// What the words that a value may be mean.
    fn meanings(&self, of: &Type) -> String {
        let mut of = of;
        while matches!(outermost(of).as_str(), "Option" | "Spanned" | "Box" | "Vec") {
            of = inner(of).expect("of something");
        }
        match self.types.0.get(&outermost(of)).map(|d| &d.shape) {
            Some(Shape::Words(words)) => words
                .iter()
                .map(|(word, docs)| format!(" `{word}`: {}{}", docs[..1].to_lowercase(), &docs[1..]))
                .collect(),
            _ => String::new(),
        }
    }

    fn keys(&mut self, keys: &[Key], text: &mut String) {
        writeln!(text, "\n| key | value | |\n|---|---|---|").unwrap();
        for Key { name, value, docs, required } in keys {
            let (words, meanings) = (self.words(value), self.meanings(value));
            let required = if *required { "; must be there" } else { "" };
            writeln!(text, "| `{name}` | {words}{required} | {}{meanings} |", docs.replace('|', "\\|"))
                .unwrap();
        }
    }

    fn write(mut self, root: &str, head: &str) -> String {
        let mut text = head.to_owned();
        self.sections.push(root.to_owned());
        let mut at = 0;
        while let Some(name) = self.sections.get(at).cloned() {
            at += 1;
            let described = &self.types.0[&name];
            write!(text, "\n## {}\n\n{}\n", heading(&name), described.docs).unwrap();
            match &described.shape {
                Shape::Table(keys) => self.keys(keys, &mut text),
                Shape::Choice(keys) => {
                    writeln!(text, "\nExactly one of:").unwrap();
                    self.keys(keys, &mut text);
                }
                Shape::Either(variants) => {
                    text.push('\n');
                    for (docs, types) in variants {
                        let of = types.iter().map(|(name, of)| match name {
                            Some(name) => format!("`{{ {name} = {} }}`", self.words(of)),
                            None => self.words(of),
                        });
                        let of: Vec<String> = of.collect();
                        let of = if of.is_empty() { String::new() } else { format!(" ({})", of.join(", ")) };
                        writeln!(text, "- {}{of}", docs.trim_end_matches('.')).unwrap();
                    }
                }
                Shape::Words(_) => unreachable!("these stand where they are used"),
            }
        }
        text
    }
}

/// `SpotDef` is `spot`.
fn heading(name: &str) -> String {
    let mut text = String::new();
    for c in name.trim_end_matches("Def").chars() {
        if c.is_uppercase() && !text.is_empty() {
            text.push('-');
        }
        text.extend(c.to_lowercase());
    }
    text
}

fn compare(file: &str, expected: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    if std::env::var_os("TYNDALL_BLESS").is_some() {
        std::fs::write(&path, expected).expect("a file that can be written");
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        found == expected,
        "{file} is not what the code says: TYNDALL_BLESS=1 cargo test --test documents writes it again"
    );
}

#[test]
fn keys_of_scene_files() {
    let mut types = Types::default();
    for file in ["mod", "appearance", "media"] {
        types.read(&format!("src/scene/file/schema/{file}.rs"));
    }
    let page = Page { types: &types, sections: Vec::new() };
    compare("scenes/README.md", &page.write("SceneFile", include_str!("scenes.md")));
}

#[test]
fn keys_of_experiment_files() {
    let mut types = Types::default();
    for file in [
        "experiment/file",
        "transport/merge/file",
        "transport/merge/settings",
        "transport/merge/kernel",
        "transport/settings",
    ] {
        types.read(&format!("src/{file}.rs"));
    }
    let page = Page { types: &types, sections: Vec::new() };
    compare("experiments/README.md", &page.write("ExperimentFile", include_str!("experiments.md")));
}
