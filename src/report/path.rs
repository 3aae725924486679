//! The path data of our own SVGs: straight lines and half circles.

/// Distance of the control points of a quarter of a circle, in radii.
const KAPPA: f64 = 0.552_284_75;

/// A step of a path, with all points as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Starts anew at this point.
    Move([f64; 2]),
    /// A straight line to this point.
    Line([f64; 2]),
    /// A cubic curve by two control points to the third.
    Curve([[f64; 2]; 3]),
    /// Back to where it started.
    Close,
}

/// The steps of a path: half a circle is two curves. What is none of ours is left out.
pub fn steps(d: &str) -> Vec<Step> {
    let mut out = Vec::new();
    let [mut x, mut y] = [0.0, 0.0];
    let starts: Vec<usize> =
        d.char_indices().filter(|(_, c)| c.is_ascii_alphabetic()).map(|(i, _)| i).collect();
    for (n, start) in starts.iter().enumerate() {
        let piece = &d[*start..starts.get(n + 1).copied().unwrap_or(d.len())];
        let numbers: Vec<f64> = piece[1..].split([' ', ',']).filter_map(|v| v.parse().ok()).collect();
        match (&piece[..1], &numbers[..]) {
            ("M", [a, b]) => {
                [x, y] = [*a, *b];
                out.push(Step::Move([x, y]));
            }
            ("L", [a, b]) => {
                [x, y] = [*a, *b];
                out.push(Step::Line([x, y]));
            }
            ("a", [_, _, _, _, _, dx, _]) => {
                let (r, k) = (0.5 * dx, 0.5 * KAPPA * dx);
                let (cx, low) = (x + r, y + r);
                out.push(Step::Curve([[x, y + k], [cx - k, low], [cx, low]]));
                x += dx;
                out.push(Step::Curve([[cx + k, low], [x, y + k], [x, y]]));
            }
            ("Z", _) => out.push(Step::Close),
            _ => {}
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_lines_and_half_circles() {
        let close = [Step::Move([1.0, 2.0]), Step::Line([3.0, -4.5]), Step::Close];
        assert_eq!(steps("M1 2L3,-4.5Z"), close);
        let half = steps("M1 2a1 1 0 0 0 2 0");
        let [Step::Move(_), Step::Curve([_, _, low]), Step::Curve([_, _, end])] = half[..] else {
            panic!("{half:?}")
        };
        assert_eq!((low, end), ([2.0, 3.0], [3.0, 2.0]));
    }
}
