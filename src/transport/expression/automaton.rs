//! The smallest deterministic automaton of an expression.

use super::Label;
use super::parse::{Parsed, Positions};
use std::collections::{BTreeMap, HashMap};

/// Most states that an expression may take.
const MAX_STATES: usize = 32;

/// Most states before the equivalent ones are merged.
const MAX_SUBSETS: usize = 4096;

const LABELS: [Label; 3] = [Label::Specular, Label::Surface, Label::Medium];

/// A row of a table of states: where each label leads.
type Row<T> = [T; LABELS.len()];

/// States are numbered in the order in which words reach them, shorter words first; state 0 is the start. So there is
/// one automaton only for each set of words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Automaton {
    next: [Row<u8>; MAX_STATES],
    ends: u32,
    states: u8,
}

impl Automaton {
    /// Accepts every word.
    pub const EVERYTHING: Self = Self { next: [[0; LABELS.len()]; MAX_STATES], ends: 1, states: 1 };

    /// The automaton of a parsed expression.
    ///
    /// # Errors
    /// Where it takes too many states.
    pub fn of(parsed: &Parsed) -> Result<Self, String> {
        let (rows, accepting) = subsets(parsed)?;
        let classes = equivalent(&rows, &accepting);
        Self::numbered(&rows, &accepting, &classes)
    }

    #[inline]
    pub fn step(&self, state: u8, label: Label) -> u8 {
        self.next[usize::from(state) % MAX_STATES][label as usize]
    }

    #[inline]
    pub fn ends(&self) -> u32 {
        self.ends
    }

    #[inline]
    pub fn before(&self, ends: u32, label: Label) -> u32 {
        let states = &self.next[..usize::from(self.states).min(MAX_STATES)];
        let leads_in = |state: usize| ends >> states[state][label as usize] & 1;
        (0..states.len()).fold(0, |all, state| all | leads_in(state) << state)
    }

    /// All of it.
    pub fn bytes(&self) -> Vec<u8> {
        let used = self.next[..usize::from(self.states)].iter().flatten().copied();
        used.chain(self.ends.to_le_bytes()).collect()
    }

    /// With one state a class, in the order in which they are reached.
    fn numbered(rows: &[Row<usize>], accepting: &[bool], classes: &[usize]) -> Result<Self, String> {
        let mut number: HashMap<usize, usize> = HashMap::from([(classes[0], 0)]);
        let mut queue = vec![0];
        let mut automaton = Self { next: [[0; LABELS.len()]; MAX_STATES], ends: 0, states: 0 };
        let mut at = 0;
        while at < queue.len() {
            let state = queue[at];
            for (label, next) in rows[state].iter().enumerate() {
                let to = *number.entry(classes[*next]).or_insert_with(|| {
                    queue.push(*next);
                    queue.len() - 1
                });
                if at < MAX_STATES {
                    automaton.next[at][label] = to as u8;
                }
            }
            if at < MAX_STATES {
                automaton.ends |= u32::from(accepting[state]) << at;
            }
            at += 1;
        }
        if queue.len() > MAX_STATES {
            return Err(format!("it takes {} states, and at most {MAX_STATES} can be", queue.len()));
        }
        automaton.states = queue.len() as u8;
        Ok(automaton)
    }
}

/// Sets of positions as states, the start first: where each label leads from them, and which accept.
fn subsets(parsed: &Parsed) -> Result<(Vec<Row<usize>>, Vec<bool>), String> {
    // The start is not the state of any set, not even of the empty one.
    let mut known: BTreeMap<Positions, usize> = BTreeMap::new();
    let mut sets: Vec<Positions> = vec![0];
    let mut rows = Vec::new();
    while rows.len() < sets.len() {
        let (set, start) = (sets[rows.len()], rows.is_empty());
        let row = LABELS.map(|label| {
            *known.entry(parsed.next(set, start, label)).or_insert_with_key(|next| {
                sets.push(*next);
                sets.len() - 1
            })
        });
        rows.push(row);
        if sets.len() > MAX_SUBSETS {
            return Err(format!("it takes too many states: at most {MAX_STATES} can be"));
        }
    }
    let accepting = |(i, set): (usize, &Positions)| {
        if i == 0 { parsed.whole.empty } else { set & parsed.whole.last != 0 }
    };
    let accepting = sets.iter().enumerate().map(accepting).collect();
    Ok((rows, accepting))
}

/// By state, its class: those of which the same words are accepted are in one [Moore 1956].
fn equivalent(rows: &[Row<usize>], accepting: &[bool]) -> Vec<usize> {
    let mut classes: Vec<usize> = accepting.iter().map(|a| usize::from(*a)).collect();
    let mut count = 0;
    loop {
        let mut known: HashMap<(usize, Row<usize>), usize> = HashMap::new();
        let refined: Vec<usize> = rows
            .iter()
            .zip(&classes)
            .map(|(row, class)| {
                let key = (*class, row.map(|next| classes[next]));
                let fresh = known.len();
                *known.entry(key).or_insert(fresh)
            })
            .collect();
        if known.len() == count {
            return refined;
        }
        (count, classes) = (known.len(), refined);
    }
}
