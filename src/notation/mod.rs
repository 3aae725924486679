#![doc = include_str!("notation.md")]

#[cfg(test)]
mod tests {
    use std::path::Path;

    /// Tags such as `[Heitz 2018]`, `[Veach 1997, 9.2]` or `[Walter et al. 2007 (20)]` in a text: author and year.
    fn tags(text: &str) -> Vec<String> {
        text.match_indices('[')
            .filter_map(|(at, _)| {
                let inside = &text[at + 1..][..text[at + 1..].find(']')?];
                (inside.starts_with(char::is_uppercase) && inside.len() < 100).then_some(inside)
            })
            .flat_map(|inside| inside.split(';'))
            .filter_map(|tag| {
                let tag = tag.trim();
                let year = tag.match_indices([' ', '-']).find_map(|(i, _)| {
                    let digits = tag.get(i + 1..i + 5)?;
                    let alone = !tag[i + 5..].starts_with(|c: char| c.is_ascii_digit());
                    let is_year =
                        digits.starts_with(['1', '2']) && digits.bytes().all(|b| b.is_ascii_digit());
                    (is_year && alone).then_some(i + 5)
                })?;
                Some(tag[..year].to_owned())
            })
            .collect()
    }

    fn sources(folder: &Path, found: &mut Vec<(String, String)>) {
        for entry in std::fs::read_dir(folder).expect("the sources are there") {
            let path = entry.expect("a readable entry").path();
            if path.is_dir() {
                sources(&path, found);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = std::fs::read_to_string(&path).expect("UTF-8");
                let comments: Vec<&str> = text.lines().filter(|l| l.trim_start().starts_with("//")).collect();
                found.extend(tags(&comments.join("\n")).into_iter().map(|t| (path.display().to_string(), t)));
            }
        }
    }

    #[test]
    fn every_tag_resolves_to_a_reference() {
        let known = tags(include_str!("notation.md"));
        let mut used = Vec::new();
        sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut used);
        assert!(used.len() > 30, "the tags are found at all");
        let unknown: Vec<_> = used.iter().filter(|(_, tag)| !known.contains(tag)).collect();
        assert!(unknown.is_empty(), "not among the references of notation.md: {unknown:?}");
    }

    #[test]
    fn tags_are_told_from_other_brackets() {
        let text = "[Heitz 2018] `a[i]` [`Link`] [Walter et al. 2007 (20)] [Welch 1947; Fieller 1954] [0, 1]";
        assert_eq!(tags(text), ["Heitz 2018", "Walter et al. 2007", "Welch 1947", "Fieller 1954"]);
    }
}
