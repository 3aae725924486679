//! Which paths count: light path expressions [Heckbert 1990], from the lens to the light.
//!
//! A path is a word: `E` for the lens, then a letter a vertex — `S` for a specular event on a surface, `D` for any other
//! on a surface, `M` for a scattering in a medium — and `L` for the light. An expression says which words count, in the
//! notation of regular expressions: one after the other, `|`, `*`, `+`, `?`, parentheses, and `.` for any of `S`, `D`
//! and `M`. `ES*M(S|D|M)*L` are the paths that enter a medium before they meet anything that is not specular.
//!
//! An expression becomes the one smallest automaton that accepts its words. A camera subpath carries the state that
//! its vertices lead to; a light subpath, which reads its word from the end, carries the set of states from which the
//! rest of the word is accepted. Where both meet, the state has to be in the set.

mod automaton;
mod parse;
#[cfg(test)]
mod tests;

use crate::error::{Error, Result};
use automaton::Automaton;
use std::fmt;

/// What happens to light at a vertex of a path that is neither on the lens nor on the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Label {
    /// S: reflection or refraction by a lobe that is a Dirac.
    Specular,
    /// D: any other event on a surface.
    Surface,
    /// M: scattering in a medium.
    Medium,
}

/// Expressions that have a name.
const NAMED: [(&str, &str); 3] = [("all", "E.*L"), ("media", "E.*M.*L"), ("surfaces", "E(S|D)*L")];

/// Longest text of an expression, in bytes: it is kept inline, and each letter is a bit of a set.
const MAX_TEXT: usize = 120;

/// A set of paths. Two are equal where they are the same set, however they were written.
#[derive(Clone, Copy)]
pub struct Expression {
    automaton: Automaton,
    text: [u8; MAX_TEXT],
    length: u8,
}

impl Expression {
    /// All paths.
    pub const ALL: Self = {
        let mut text = [0; MAX_TEXT];
        (text[0], text[1], text[2]) = (b'a', b'l', b'l');
        Self { automaton: Automaton::EVERYTHING, text, length: 3 }
    };

    /// Whether no path is left out.
    pub fn is_all(&self) -> bool {
        *self == Self::ALL
    }

    /// Reads an expression, or one of the names `all`, `media` (at least one scattering in a medium) and `surfaces`
    /// (none).
    ///
    /// # Errors
    /// Where it is none, with the column of what is wrong; where it is too long, or takes too many states.
    pub fn parse(text: &str) -> Result<Self> {
        let fail = |message: String| Error::usage(format!("path expression `{text}`{message}"));
        if text.len() > MAX_TEXT {
            return Err(fail(format!(": it has {} bytes, and at most {MAX_TEXT} can be", text.len())));
        }
        let named = NAMED.iter().find(|(name, _)| *name == text.trim());
        let meaning = named.map_or(text, |(_, meaning)| meaning);
        let parsed = parse::parse(meaning).map_err(|slip| {
            let hint = parse::hint(text, NAMED.iter().map(|(name, _)| *name));
            fail(format!(", column {}: {}{hint}", slip.column, slip.message))
        })?;
        let automaton = Automaton::of(&parsed).map_err(|message| fail(format!(": {message}")))?;
        let mut bytes = [0; MAX_TEXT];
        bytes[..text.len()].copy_from_slice(text.as_bytes());
        Ok(Self { automaton, text: bytes, length: text.len() as u8 })
    }

    /// As it was written.
    pub fn text(&self) -> &str {
        std::str::from_utf8(&self.text[..usize::from(self.length)]).expect("it was copied from a text")
    }

    /// Bytes that are the same for all texts of the same set, and different for different sets.
    pub fn fingerprint(&self) -> Vec<u8> {
        self.automaton.bytes()
    }

    /// Camera side: the state after E.
    #[inline]
    pub fn start(&self) -> u8 {
        0
    }

    /// Camera side: the state after one more vertex.
    #[inline]
    pub fn step(&self, state: u8, label: Label) -> u8 {
        self.automaton.step(state, label)
    }

    /// Light side: the states, as bits, from which L alone is accepted.
    #[inline]
    pub fn ends(&self) -> u32 {
        self.automaton.ends()
    }

    /// Light side, one more vertex: the states from which `label` leads into one of `ends`.
    #[inline]
    pub fn before(&self, ends: u32, label: Label) -> u32 {
        self.automaton.before(ends, label)
    }

    /// Whether a path counts of which the camera side led to `state`, and the light side to `ends`.
    #[inline]
    pub fn accepts(state: u8, ends: u32) -> bool {
        ends >> state & 1 == 1
    }
}

impl PartialEq for Expression {
    fn eq(&self, other: &Self) -> bool {
        self.automaton == other.automaton
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.text())
    }
}

impl fmt::Debug for Expression {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "Expression({})", self.text())
    }
}
