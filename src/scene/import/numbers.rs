//! Numbers as a scene file writes them: the shortest decimal that is read back as the same single-precision number.

use std::fmt::Write;

/// A number.
pub fn number(x: f64) -> String {
    let narrow = x as f32;
    let short = format!("{narrow:?}");
    // A decimal is read in double precision first. Where that would round to a neighbour, all digits are written.
    if short.parse::<f64>().is_ok_and(|wide| (wide as f32).to_bits() == narrow.to_bits()) {
        return short;
    }
    format!("{:?}", f64::from(narrow))
}

/// `[a, b, …]`.
pub fn array(numbers: &[f64]) -> String {
    let list: Vec<String> = numbers.iter().map(|x| number(*x)).collect();
    format!("[{}]", list.join(", "))
}

/// A colour: one number where its channels are the same.
pub fn color(rgb: [f64; 3]) -> String {
    if rgb[0] == rgb[1] && rgb[1] == rgb[2] { number(rgb[0]) } else { array(&rgb) }
}

/// A string of TOML, in quotes.
pub fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if (c as u32) < 0x20 || c as u32 == 0x7f => {
                let _ = write!(out, "\\u{:04X}", c as u32);
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(crate::math::testing::fuzz(2000))]

        #[test]
        fn numbers_come_back_as_they_were(bits in any::<u32>()) {
            let x = f32::from_bits(bits);
            prop_assume!(x.is_finite());
            let text = format!("x = {}", number(f64::from(x)));
            let table: toml::Table = text.parse().expect("a number of TOML");
            let back = table["x"].as_float().expect("a float") as f32;
            prop_assert_eq!(back.to_bits(), x.to_bits());
        }

        #[test]
        fn strings_come_back_as_they_were(text in any::<String>()) {
            let table: toml::Table = format!("x = {}", quoted(&text)).parse().expect("a string of TOML");
            prop_assert_eq!(table["x"].as_str(), Some(text.as_str()));
        }
    }
}
