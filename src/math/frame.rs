//! Orthonormal frames.

use glam::Vec3A;

/// A right-handed orthonormal frame; `n` is the local z axis.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Local x axis.
    pub s: Vec3A,
    /// Local y axis.
    pub t: Vec3A,
    /// Local z axis.
    pub n: Vec3A,
}

impl Frame {
    /// A frame about the unit vector `n`, without a branch on its direction [Duff et al. 2017].
    #[inline]
    pub fn from_normal(n: Vec3A) -> Self {
        let sign = 1f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3A::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3A::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// World to local.
    #[inline]
    pub fn to_local(&self, v: Vec3A) -> Vec3A {
        Vec3A::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// Local to world.
    #[inline]
    pub fn to_world(&self, v: Vec3A) -> Vec3A {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_is_orthonormal_and_right_handed() {
        for n in [Vec3A::Z, -Vec3A::Z, Vec3A::X, Vec3A::new(-0.3, 0.9, -0.999_999).normalize()] {
            let f = Frame::from_normal(n);
            assert!((f.s.cross(f.t) - f.n).length() < 1e-5, "{n}");
            assert!(f.s.dot(f.t).abs() < 1e-6 && f.s.dot(f.n).abs() < 1e-6 && f.t.dot(f.n).abs() < 1e-6);
            let v = Vec3A::new(0.2, -0.5, 0.7);
            assert!((f.to_world(f.to_local(v)) - v).length() < 1e-6);
        }
    }
}
