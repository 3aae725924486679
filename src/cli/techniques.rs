//! `tyndall techniques`: the tables of techniques and presets.

use crate::transport::technique::{PRESETS, TECHNIQUES, TechniqueSet};

/// Both tables as text.
pub fn text() -> String {
    let techniques = TECHNIQUES.iter().map(|t| [t.key, t.label, t.symbol, t.paper].map(str::to_owned));
    let presets = PRESETS.iter().map(|p| {
        let keys: Vec<&str> = p.techniques.iter().map(|t| t.info().key).collect();
        let first = if p.first { " (camera paths end at the first vertex)" } else { "" };
        [p.key.to_owned(), p.label.to_owned(), keys.join(",") + first]
    });
    let mut text = table(["technique", "what it is", "makes", "from"], techniques.collect());
    text.push('\n');
    text.push_str(&table(["preset", "what it is", "techniques"], presets.collect()));
    text.push_str("\nAny set can be named: --techniques nee,lens or, in experiments, techniques = [\"nee\", \"lens\"].\n");
    let tracked: Vec<&str> = TechniqueSet::tracked().iter().map(|t| t.info().key).collect();
    text.push_str(&format!(
        "Sets of {} alone go through grey media on grids by delta and ratio tracking, unless --tracking exact.\n",
        tracked.join(" and ")
    ));
    text
}

fn table<const N: usize>(head: [&str; N], rows: Vec<[String; N]>) -> String {
    let head = head.map(str::to_owned);
    let all: Vec<&[String; N]> = std::iter::once(&head).chain(&rows).collect();
    let width = |column: usize| all.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    let mut text = String::new();
    for row in all {
        let mut line = String::new();
        for (cell, width) in row.iter().zip(widths) {
            line.push_str(&format!("{cell:<width$}   "));
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_technique_and_preset_has_a_line() {
        let text = text();
        let keys: Vec<&str> = TECHNIQUES.iter().map(|t| t.key).chain(PRESETS.iter().map(|p| p.key)).collect();
        for key in &keys {
            // Some presets are called after the technique that they show.
            let expected = keys.iter().filter(|k| *k == key).count();
            assert_eq!(text.lines().filter(|l| l.starts_with(&format!("{key} "))).count(), expected, "{key}");
        }
    }
}
