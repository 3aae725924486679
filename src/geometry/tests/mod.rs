//! Tests of whole queries, of the offsets of rays, of sampling, and of shapes under transforms.

mod offsets;
mod parallelograms;
mod queries;
mod sampling;
mod shapes;

use super::TriangleMesh;
use crate::math::{Stream, StreamKind, warp};
use glam::{Affine3A, Quat, Vec3, Vec3A};

pub(super) fn stream(index: u64) -> Stream {
    Stream::new(11, 0, StreamKind::Other, index)
}

pub(super) fn direction(s: &mut Stream) -> Vec3A {
    warp::uniform_sphere(s.next_2d()).normalize()
}

pub(super) fn point(s: &mut Stream) -> Vec3A {
    Vec3A::new(s.next_1d(), s.next_1d(), s.next_1d()) * 2.0 - Vec3A::ONE
}

/// Any rotation.
pub(super) fn turn(s: &mut Stream) -> Quat {
    Quat::from_axis_angle(direction(s).into(), 6.0 * s.next_1d())
}

/// To `centre`, turned anyhow, with half-axes of up to `scale`.
pub(super) fn placed(s: &mut Stream, scale: f32, centre: Vec3A) -> Affine3A {
    let turn = turn(s);
    let size = Vec3::new(s.next_1d(), s.next_1d(), s.next_1d()) * 0.9 + Vec3::splat(0.1);
    Affine3A::from_scale_rotation_translation(size * scale, turn, centre.into())
}

/// A closed mesh: a sphere with bumps, of 2·n·(n − 1)·2 triangles.
pub(super) fn bumpy_sphere(n: u32, bumps: f32, centre: Vec3, scale: f32) -> TriangleMesh {
    let (rings, around) = (n, 2 * n);
    let mut positions = vec![centre + Vec3::Y * scale, centre - Vec3::Y * scale];
    for i in 1..rings {
        for j in 0..around {
            let theta = std::f32::consts::PI * i as f32 / rings as f32;
            let phi = std::f32::consts::TAU * j as f32 / around as f32;
            let r = scale * (1.0 + bumps * (7.0 * theta).sin() * (5.0 * phi).sin());
            positions
                .push(centre + r * Vec3::new(theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin()));
        }
    }
    let at = |i: u32, j: u32| match i {
        0 => 0,
        i if i == rings => 1,
        i => 2 + (i - 1) * around + j % around,
    };
    let mut indices = Vec::new();
    for i in 0..rings {
        for j in 0..around {
            if i > 0 {
                indices.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            }
            if i + 1 < rings {
                indices.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    TriangleMesh::new(positions, None, None, indices).unwrap()
}
