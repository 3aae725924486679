//! Estimators whose threads did not have the processors to themselves: their times are not what they would be alone.

use super::results::{Cell, Run};

/// Share of the time that threads may wait for a processor without a word.
const UNSAID: f64 = 0.05;

/// One warning of all cells whose threads waited, each with the share of their time; none where none did. So many threads rendered.
pub fn warning(cells: &[Cell], threads: usize) -> Option<String> {
    let share = |cell: &Cell| {
        let sum = |of: fn(&Run) -> f64| cell.runs.iter().map(of).sum::<f64>();
        sum(|r| r.waited) / (threads as f64 * sum(|r| r.seconds))
    };
    told(cells.iter().map(|cell| (cell.scene.as_str(), cell.estimator.as_str(), share(cell))))
}

/// Of scenes and estimators, scene by scene.
fn told<'a>(shares: impl Iterator<Item = (&'a str, &'a str, f64)>) -> Option<String> {
    let mut list = String::new();
    let mut last = None;
    for (scene, estimator, share) in shares.filter(|(.., share)| *share > UNSAID) {
        let percent = 100.0 * share;
        if last == Some(scene) {
            list.push_str(&format!(", {estimator} {percent:.0}%"));
        } else {
            let gap = if list.is_empty() { "" } else { "; " };
            list.push_str(&format!("{gap}{scene}: {estimator} {percent:.0}%"));
        }
        last = Some(scene);
    }
    (!list.is_empty()).then(|| {
        format!(
            "threads waited for a processor for a part of the time ({list}): something else ran beside them, and these took longer, \
             or made less in their time, than they do alone"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_waited_are_in_one_warning() {
        let shares = [
            ("box", "pt", 0.123),
            ("box", "bpt", 0.01),
            ("box", "vcm", 0.06),
            ("fog", "pt", f64::NAN),
            ("fog", "vcm", 0.5),
        ];
        let text = told(shares.into_iter()).unwrap();
        assert!(text.contains(" (box: pt 12%, vcm 6%; fog: vcm 50%): "), "{text}");
        assert_eq!(told([("box", "pt", 0.04)].into_iter()), None);
    }
}
