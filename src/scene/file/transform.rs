//! The steps of a shape's transform, put together.

use super::schema::{LookAtDef, RotateDef, StepDef};
use super::source::{Source, Span};
use super::values::Row;
use crate::error::Result;
use glam::{Affine3A, Mat3A, Quat, Vec3, Vec3A};
use toml::Spanned;

/// From the shape's own coordinates to the world's: the first step is applied first. An error where a step is
/// singular or has no direction to turn about.
pub(super) fn compose(source: &Source, steps: &[Spanned<StepDef>]) -> Result<Affine3A> {
    let mut whole = Affine3A::IDENTITY;
    for step in steps {
        let m = one(source, step)?;
        if is_singular(&m) {
            return Err(
                source.error(step.span(), "this transform is singular: it flattens what it is applied to")
            );
        }
        whole = m * whole;
    }
    if let (Some(first), Some(last)) = (steps.first(), steps.last())
        && (!whole.is_finite() || is_singular(&whole))
    {
        let all = first.span().start..last.span().end;
        return Err(source.error(all, "these transforms together leave the range of single precision"));
    }
    Ok(whole)
}

fn one(source: &Source, step: &Spanned<StepDef>) -> Result<Affine3A> {
    Ok(match step.get_ref() {
        StepDef::Translate(by) => Affine3A::from_translation(by.0.into()),
        StepDef::Scale(by) => Affine3A::from_scale(by.0.into()),
        StepDef::Rotate(rotate) => rotation(source, step.span(), rotate)?,
        StepDef::Matrix(rows) => matrix(source, step.span(), rows)?,
        StepDef::LookAt(look) => look_at(source, step.span(), look)?,
    })
}

fn rotation(source: &Source, span: Span, rotate: &RotateDef) -> Result<Affine3A> {
    let Some(axis) = rotate.axis.0.try_normalize() else {
        return Err(source.error(span, "the rotation's axis has no length"));
    };
    Ok(Affine3A::from_quat(Quat::from_axis_angle(axis.into(), rotate.angle.get().to_radians())))
}

fn matrix(source: &Source, span: Span, rows: &[Row]) -> Result<Affine3A> {
    let affine = match rows {
        [_, _, _] => true,
        [_, _, _, last] => last.0 == [0.0, 0.0, 0.0, 1.0],
        _ => false,
    };
    if !affine {
        let message =
            "expected a matrix of 3 rows, or of 4 where the last is [0, 0, 0, 1], each of four numbers";
        return Err(source.error(span, message));
    }
    let column = |j: usize| Vec3A::new(rows[0].0[j], rows[1].0[j], rows[2].0[j]);
    Ok(Affine3A { matrix3: Mat3A::from_cols(column(0), column(1), column(2)), translation: column(3) })
}

fn look_at(source: &Source, span: Span, look: &LookAtDef) -> Result<Affine3A> {
    let up = look.up.map_or(Vec3A::Y, |up| up.0);
    let frame = (look.target.0 - look.origin.0).try_normalize().and_then(|z| {
        let x = up.try_normalize()?.cross(z);
        (x.length() > 1e-4).then(|| Mat3A::from_cols(x.normalize(), z.cross(x.normalize()), z))
    });
    match frame {
        Some(matrix3) => Ok(Affine3A { matrix3, translation: look.origin.0 }),
        None => Err(source.error(
            span,
            "`look_at` needs a target apart from its origin, and an `up` across that direction",
        )),
    }
}

/// Whether a linear map flattens: its volume is none beside the product of its columns' lengths.
fn is_singular(m: &Affine3A) -> bool {
    let unit = |v: Vec3A| Vec3::from(v).as_dvec3().try_normalize();
    match (unit(m.matrix3.x_axis), unit(m.matrix3.y_axis), unit(m.matrix3.z_axis)) {
        (Some(x), Some(y), Some(z)) => x.cross(y).dot(z).abs() < 1e-6,
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Deserialize)]
    struct Steps {
        transform: Vec<Spanned<StepDef>>,
    }

    fn transform(steps: &str) -> Result<Affine3A> {
        let source = Source::from_text("a.toml", format!("transform = [\n{steps}\n]"));
        compose(&source, &source.parse::<Steps>()?.transform)
    }

    #[test]
    fn the_first_step_is_applied_first() {
        let m = transform(
            "{ scale = [2, 1, 1] }, { rotate = { axis = [0, 0, 3], angle = 90 } }, { translate = [0, 0, 5] }",
        );
        let p = m.unwrap().transform_point3a(Vec3A::new(1.0, 0.0, 0.0));
        assert!((p - Vec3A::new(0.0, 2.0, 5.0)).length() < 1e-6, "{p}");
    }

    #[test]
    fn look_at_points_the_z_axis_to_the_target() {
        let m = transform("{ look_at = { origin = [1, 2, 3], target = [4, 2, 3] } }").unwrap();
        assert!((m.transform_point3a(Vec3A::Z * 2.0) - Vec3A::new(3.0, 2.0, 3.0)).length() < 1e-6);
        assert!((m.transform_vector3a(Vec3A::Y) - Vec3A::Y).length() < 1e-6);
        assert!((m.matrix3.determinant() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn matrices_are_by_row() {
        let m = transform("{ matrix = [[1, 0, 0, 7], [0, 0, -1, 8], [0, 1, 0, 9]] }").unwrap();
        assert_eq!(m.transform_point3a(Vec3A::Y), Vec3A::new(7.0, 8.0, 10.0));
    }

    #[test]
    fn singular_and_directionless_steps_are_refused_at_their_line() {
        for (steps, word) in [
            ("{ scale = 2 },\n{ scale = [1, 0, 1] }", "singular"),
            ("{ scale = 2 },\n{ matrix = [[1, 1, 0, 0], [1, 1, 0, 0], [0, 0, 1, 0]] }", "singular"),
            ("{ scale = 2 },\n{ matrix = [[1, 1, 0, 0]] }", "3 rows"),
            ("{ scale = 2 },\n{ rotate = { axis = [0, 0, 0], angle = 3 } }", "no length"),
            ("{ scale = 2 },\n{ look_at = { origin = [0, 0, 0], target = [0, 1, 0] } }", "look_at"),
        ] {
            let message = transform(steps).unwrap_err().to_string();
            assert!(message.starts_with("a.toml:3:1: ") && message.contains(word), "{message}");
        }
        assert!(transform("{ scale = 1e30 }, { scale = 1e30 }").unwrap_err().to_string().contains("range"));
    }
}
