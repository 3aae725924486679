//! A lathe's profile: the points and curves of the file as one polyline.

use super::schema::{CurveDef, ProfilePiece};
use super::source::{Source, Span};
use crate::error::Result;
use glam::Vec2;
use toml::Spanned;

const DEFAULT_STEPS: u32 = 12;
/// A profile longer than this is a slip of the pen, not a vessel.
const MAX_POINTS: usize = 100_000;

/// The points (radius, height) of the profile. An error where a radius is negative or a curve has nothing to start
/// from.
pub(super) fn points(source: &Source, profile: &Spanned<Vec<Spanned<ProfilePiece>>>) -> Result<Vec<Vec2>> {
    let mut points: Vec<Vec2> = Vec::new();
    for piece in profile.get_ref() {
        let added = match piece.get_ref() {
            ProfilePiece::Point(p) => vec![p.0],
            ProfilePiece::Curve(curve) => {
                let Some(start) = points.last() else {
                    return Err(source.error(
                        piece.span(),
                        "a profile starts with a point [radius, height], not with a curve",
                    ));
                };
                sample(source, piece.span(), *start, curve)?
            }
        };
        for p in added {
            // A curve may bulge across the axis by rounding where it ends on it.
            let p = if p.x < 0.0 && p.x > -1e-6 { Vec2::new(0.0, p.y) } else { p };
            if p.x < 0.0 {
                let message =
                    format!("the profile's radius is negative here: {}, at the height {}", p.x, p.y);
                return Err(source.error(piece.span(), message));
            }
            points.push(p);
        }
        if points.len() > MAX_POINTS {
            return Err(
                source.error(piece.span(), format!("the profile has more than {MAX_POINTS} points by here"))
            );
        }
    }
    Ok(points)
}

fn sample(source: &Source, span: Span, start: Vec2, curve: &CurveDef) -> Result<Vec<Vec2>> {
    let steps = curve.steps.map_or(DEFAULT_STEPS, |s| s.0).min(MAX_POINTS as u32);
    let parameters = move || (1..=steps).map(move |i| i as f32 / steps as f32);
    match (&curve.bezier, &curve.through) {
        (Some([c1, c2, end]), None) => {
            Ok(parameters().map(|t| cubic([start, c1.0, c2.0, end.0], t)).collect())
        }
        (None, Some(through)) => {
            if through.len() * steps as usize > MAX_POINTS {
                return Err(source.error(span, format!("the curve has more than {MAX_POINTS} points")));
            }
            let knots: Vec<Vec2> = std::iter::once(start).chain(through.iter().map(|p| p.0)).collect();
            Ok((1..knots.len())
                .flat_map(|i| parameters().map(move |t| (i, t)))
                .map(|(i, t)| spline(&knots, i, t))
                .collect())
        }
        _ => Err(source.error(span, "a curve has either `bezier` or `through`, one of the two")),
    }
}

/// Bézier's cubic.
fn cubic([a, b, c, d]: [Vec2; 4], t: f32) -> Vec2 {
    let s = 1.0 - t;
    a * (s * s * s) + b * (3.0 * s * s * t) + c * (3.0 * s * t * t) + d * (t * t * t)
}

/// The uniform Catmull-Rom spline from knot `i − 1` to knot `i`, as a cubic; the ends have the tangent to their
/// neighbour.
fn spline(knots: &[Vec2], i: usize, t: f32) -> Vec2 {
    let (a, d) = (knots[i - 1], knots[i]);
    let before = if i >= 2 { knots[i - 2] } else { a };
    let after = knots.get(i + 1).copied().unwrap_or(d);
    cubic([a, a + (d - before) / 6.0, d - (after - a) / 6.0, d], t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Deserialize)]
    struct Profile {
        profile: Spanned<Vec<Spanned<ProfilePiece>>>,
    }

    fn read(pieces: &str) -> Result<Vec<Vec2>> {
        let source = Source::from_text("a.toml", format!("profile = [\n{pieces}\n]"));
        points(&source, &source.parse::<Profile>()?.profile)
    }

    #[test]
    fn curves_go_through_their_points() {
        let p = read("[0, 0], [1, 0], { bezier = [[1.5, 0], [1.5, 1], [1, 1]], steps = 4 }").unwrap();
        assert_eq!(p.len(), 6);
        assert!((p[3] - Vec2::new(1.375, 0.5)).length() < 1e-6, "the middle of the cubic: {}", p[3]);
        assert_eq!(p[5], Vec2::ONE);
        let p = read("[1, 0], { through = [[2, 1], [1, 2], [0, 3]], steps = 5 }").unwrap();
        assert_eq!(
            (p.len(), p[5], p[10], p[15]),
            (16, Vec2::new(2.0, 1.0), Vec2::new(1.0, 2.0), Vec2::new(0.0, 3.0))
        );
    }

    #[test]
    fn bad_profiles_are_refused_at_their_line() {
        for (pieces, place, word) in [
            ("[0, 0],\n[-1, 2]", "a.toml:3:1", "negative"),
            ("{ through = [[1, 1]] },\n[0, 0]", "a.toml:2:1", "starts with a point"),
            ("[0, 0],\n{ steps = 3 }", "a.toml:3:1", "bezier"),
            ("[0, 0],\n{ bezier = [[-9, 0], [-9, 1], [1, 1]] }", "a.toml:3:1", "negative"),
            ("[0, 0],\n{ through = [[1, 1], [2, 2]], steps = 4000000000 }", "a.toml:3:1", "points"),
        ] {
            let message = read(pieces).unwrap_err().to_string();
            assert!(message.starts_with(place) && message.contains(word), "{message}");
        }
    }
}
