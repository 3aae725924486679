//! From text to the sets that make an automaton [Glushkov 1961]: each letter of the text is a position, and it is
//! enough to know which positions a word can start with, end with, and have after one another.

use super::Label;
use crate::error::{did_you_mean, nearest};
use std::iter::Peekable;
use std::vec::IntoIter;

/// A set of positions.
pub(super) type Positions = u128;

/// An expression without its E and L.
#[derive(Debug, Default)]
pub(super) struct Parsed {
    /// By position, the labels that it stands for, as bits.
    labels: Vec<u8>,
    /// By position, the positions that can come next.
    follow: Vec<Positions>,
    /// How a word starts and ends.
    pub whole: Fragment,
}

/// A part of an expression.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fragment {
    /// Whether it can be nothing.
    pub empty: bool,
    /// Positions that it can start with.
    pub first: Positions,
    /// Positions that it can end with.
    pub last: Positions,
}

/// What is wrong with a text, and where.
#[derive(Debug)]
pub(super) struct Slip {
    /// In characters, from 1.
    pub column: usize,
    /// What is wrong.
    pub message: String,
}

fn slip<T>(column: usize, message: impl Into<String>) -> Result<T, Slip> {
    Err(Slip { column, message: message.into() })
}

/// The elements of a set.
fn each(set: Positions) -> impl Iterator<Item = usize> {
    (0..Positions::BITS as usize).filter(move |p| set >> p & 1 == 1)
}

impl Parsed {
    /// Which of the positions that can come after `set` stand for `label`. `start`: whether it is the beginning of a word.
    pub fn next(&self, set: Positions, start: bool, label: Label) -> Positions {
        let after = each(set).fold(if start { self.whole.first } else { 0 }, |all, p| all | self.follow[p]);
        each(after).filter(|p| self.labels[*p] >> label as u8 & 1 == 1).fold(0, |all, p| all | 1 << p)
    }

    fn join(&mut self, before: Positions, after: Positions) {
        for p in each(before) {
            self.follow[p] |= after;
        }
    }
}

/// Reads an expression.
pub(super) fn parse(text: &str) -> Result<Parsed, Slip> {
    let characters: Vec<(usize, char)> =
        text.chars().enumerate().map(|(i, c)| (i + 1, c)).filter(|(_, c)| !c.is_whitespace()).collect();
    let end = text.chars().count() + 1;
    let mut parser = Parser { rest: characters.into_iter().peekable(), end, parsed: Parsed::default() };
    parser.path()?;
    Ok(parser.parsed)
}

/// "; did you mean …", where a text looks like a name.
pub(super) fn hint<'a>(text: &str, names: impl Iterator<Item = &'a str>) -> String {
    let name = text.trim();
    if name.is_empty() || !name.chars().all(|c| c.is_ascii_lowercase()) {
        return String::new();
    }
    let names: Vec<&str> = names.collect();
    let meant = nearest(name, names.iter().copied());
    let meant = did_you_mean(meant);
    format!(" (names: {}{meant})", names.join(", "))
}

struct Parser {
    rest: Peekable<IntoIter<(usize, char)>>,
    /// The column after the last.
    end: usize,
    parsed: Parsed,
}

impl Parser {
    fn peek(&mut self) -> Option<char> {
        self.rest.peek().map(|(_, c)| *c)
    }

    fn column(&mut self) -> usize {
        self.rest.peek().map_or(self.end, |(column, _)| *column)
    }

    /// E … L, and nothing more.
    fn path(&mut self) -> Result<(), Slip> {
        match self.rest.next() {
            Some((_, 'E')) => {}
            Some((column, other)) => {
                return slip(column, format!("expected `E`, the lens, at the beginning, found `{other}`"));
            }
            None => return slip(1, "it is empty: expected `E`, the lens, at the beginning"),
        }
        self.parsed.whole = self.sequence()?;
        match self.rest.next() {
            Some((_, 'L')) => {}
            Some((column, '|')) => {
                return slip(column, "`|` parts E from L here: put the alternatives into parentheses");
            }
            Some((column, _)) => return slip(column, "there is no `(` to this `)`"),
            None => return slip(self.end, "expected `L`, the light, at the end"),
        }
        match self.rest.next() {
            None => Ok(()),
            Some((column, _)) => slip(column, "nothing can come after `L`, the light"),
        }
    }

    /// One after the other, up to what ends them.
    fn sequence(&mut self) -> Result<Fragment, Slip> {
        let mut whole = Fragment { empty: true, first: 0, last: 0 };
        while !matches!(self.peek(), None | Some('L' | ')' | '|')) {
            let next = self.repeated()?;
            self.parsed.join(whole.last, next.first);
            whole = Fragment {
                empty: whole.empty && next.empty,
                first: whole.first | if whole.empty { next.first } else { 0 },
                last: next.last | if next.empty { whole.last } else { 0 },
            };
        }
        Ok(whole)
    }

    /// One letter or group, with what says how often.
    fn repeated(&mut self) -> Result<Fragment, Slip> {
        let mut part = self.letter()?;
        while let Some(sign @ ('*' | '+' | '?')) = self.peek() {
            self.rest.next();
            if sign != '?' {
                self.parsed.join(part.last, part.first);
            }
            part.empty |= sign != '+';
        }
        Ok(part)
    }

    fn letter(&mut self) -> Result<Fragment, Slip> {
        let column = self.column();
        let bit = |label: Label| 1 << label as u8;
        let labels = match self.rest.next().map(|(_, c)| c) {
            Some('S') => bit(Label::Specular),
            Some('D') => bit(Label::Surface),
            Some('M') => bit(Label::Medium),
            Some('.') => bit(Label::Specular) | bit(Label::Surface) | bit(Label::Medium),
            Some('(') => return self.group(column),
            Some(sign @ ('*' | '+' | '?')) => {
                return slip(column, format!("there is nothing before this `{sign}` that it could repeat"));
            }
            Some('E') => return slip(column, "`E`, the lens, can only stand at the beginning"),
            Some(other) => {
                let message = format!("expected one of S D M . ( ) | * + ? or L at the end, found `{other}`");
                return slip(column, message);
            }
            None => return slip(self.end, "expected `L`, the light, at the end"),
        };
        let position = self.parsed.labels.len();
        self.parsed.labels.push(labels);
        self.parsed.follow.push(0);
        Ok(Fragment { empty: false, first: 1 << position, last: 1 << position })
    }

    /// Alternatives up to the parenthesis that closes the one in column `opened`.
    fn group(&mut self, opened: usize) -> Result<Fragment, Slip> {
        let mut whole = Fragment::default();
        loop {
            let start = self.column();
            let part = self.sequence()?;
            let (column, sign) = (self.column(), self.rest.next().map(|(_, c)| c));
            match sign {
                Some('L') => {
                    return slip(
                        column,
                        format!(
                            "`L`, the light, can only stand at the end, and `(` is open since column {opened}"
                        ),
                    );
                }
                None => return slip(opened, "this `(` is not closed"),
                Some(_) if column == start => {
                    return slip(
                        column,
                        "there is nothing here: what may be there or not is written with `?`",
                    );
                }
                Some(_) => {}
            }
            whole = Fragment {
                empty: whole.empty || part.empty,
                first: whole.first | part.first,
                last: whole.last | part.last,
            };
            if sign == Some(')') {
                return Ok(whole);
            }
        }
    }
}
