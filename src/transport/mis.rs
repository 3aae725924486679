//! The weights: one line (transport.md, 4), run along both subpaths.
//!
//! Let W_i be the sum of the densities of all techniques on the light side of the cut after vertex i, divided by
//! P_{i+1}. Then
//!
//! ```text
//! W_i = r_i · ( M_i + (c_i + W_{i-1}) / p_i )
//! ```
//!
//! and the camera side is the same line with p and r exchanged. W_{i-1} is linear in r_{i-1}, and of r_{i-1} only the
//! directional density at x_i is unknown when x_i is sampled: so W_{i-1} = A_i · ρ_i, with ρ_i the density with which
//! the other subpath, at x_i, leaves toward x_{i-1}. A vertex carries (p_i, A_i, c_i) and nothing else.
//!
//! | symbol | here | meaning |
//! |---|---|---|
//! | p_i (r_i on the camera side) | [`Link::density`] | own density of the vertex, in its own measure |
//! | A_i | [`Link::behind`] | W_{i-1} / ρ_i |
//! | c_i | [`Link::count`] | samples of the connection that would end the own subpath just before x_i |
//! | M_i | [`Merges`] | sum over the merges at x_i |
//!
//! The densities of merges with beams are relative to the free flight on an edge that ends in x_i. Of one of these two
//! edges a subpath knows all when it is at x_i; the other one, which it goes on by, it knows an edge later. So it carries
//! M_i in two parts, [`Pending`]: what is known, and what still has to be multiplied by b of the other edge.
//!
//! Power heuristic: each of p, r, c and M is raised to β as it enters; nothing else changes [Veach 1997, 9.2].

use super::settings::Heuristic;
use std::ops::{Add, Div, Mul};

/// A floating-point number that the recursion can run in: f32 in the renderer, f64 in the tests.
pub trait Real: Copy + PartialEq + Add<Output = Self> + Mul<Output = Self> + Div<Output = Self> {
    /// Zero.
    const ZERO: Self;
    /// Raised to a power.
    fn power(self, exponent: f32) -> Self;
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    #[inline]
    fn power(self, exponent: f32) -> Self {
        self.powf(exponent)
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    #[inline]
    fn power(self, exponent: f32) -> Self {
        self.powf(f64::from(exponent))
    }
}

impl Heuristic {
    /// A density or count as it enters a weight: raised to β.
    #[inline]
    pub fn raise<F: Real>(self, x: F) -> F {
        match self {
            Self::Balance => x,
            Self::Power(2.0) => x * x,
            Self::Power(beta) => x.power(beta),
        }
    }
}

/// What a subpath's vertex x_i carries for the weights. All three are raised to β.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link<F = f32> {
    /// p_i on a light subpath, r_i on a camera subpath.
    pub density: F,
    /// A_i: the sum over the techniques behind, without the directional density at x_i.
    pub behind: F,
    /// c_i on a light subpath, c_{i+1} on a camera subpath: the connection that ends the own subpath just before
    /// this vertex. It takes x_i to be non-specular; a specular x_i is told to [`Link::leave`].
    pub count: F,
}

impl<F: Real> Link<F> {
    /// The sum over all techniques on this side of the cut after x_i, relative to the technique of the cut: W_i
    /// (V_i on the camera side).
    ///
    /// `merges`: M_i raised; `back`: ρ_i raised, the other side's directional density at x_i toward the vertex before;
    /// `reverse`: r_i raised, the other side's density of x_i itself.
    #[inline]
    pub fn close(&self, merges: F, back: F, reverse: F) -> F {
        reverse * (merges + (self.count + self.behind * back) / self.density)
    }

    /// (c_i + W_{i-1}) / p_i: all techniques on this side, relative to one that joins the subpaths at x_i itself.
    #[inline]
    pub fn apart(&self, back: F) -> F {
        (self.count + self.behind * back) / self.density
    }

    /// The part of the sum that goes with the subpath when it leaves x_i: M_i + (c_i + W_{i-1}) / p_i.
    /// At a specular vertex nothing can be connected or merged: c_i = M_i = 0.
    #[inline]
    pub fn leave(&self, specular: bool, merges: Pending<F>, back: F) -> Pending<F> {
        if specular {
            Pending { known: self.behind * back / self.density, open: F::ZERO }
        } else {
            Pending { known: merges.known + self.apart(back), open: merges.open }
        }
    }

    /// The link of a vertex of a subpath that nothing is joined to: no technique is behind it.
    #[inline]
    pub fn alone(density: F) -> Self {
        Self { density, behind: F::ZERO, count: F::ZERO }
    }

    /// The link of the next vertex: `density` its own density raised, `sum` what [`Link::leave`] gave with all of it
    /// known, `geometry` what turns ρ at the next vertex into the density of this one: D/d² times the other side's
    /// free-flight factor of the edge, raised.
    #[inline]
    pub fn next(density: F, sum: F, geometry: F, count: F) -> Self {
        Self { density, behind: geometry * sum, count }
    }
}

/// A sum with a part that is still to be multiplied by b of the other subpath's edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pending<F = f32> {
    /// What is known.
    pub known: F,
    /// What b multiplies.
    pub open: F,
}

impl<F: Real> Pending<F> {
    /// Nothing.
    pub const NONE: Self = Self { known: F::ZERO, open: F::ZERO };

    /// With b of the other subpath's edge, raised.
    #[inline]
    pub fn with(self, other: F) -> F {
        self.known + self.open * other
    }
}

/// M_i,v of each merge without what depends on the vertex, raised: counts times the measures of kernels
/// (transport.md, 3); 0 where a technique is off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Merges<F = f32> {
    /// N π r².
    pub surface: F,
    /// N 4/3 π r³.
    pub point_point: F,
    /// N π r², to be multiplied by b(T←).
    pub point_beam: F,
    /// N π r², to be multiplied by b(T→).
    pub beam_point: F,
    /// N 2 r, to be multiplied by sin θ, b(T→) and b(T←).
    pub beam_beam: F,
}

impl<F: Real> Merges<F> {
    /// No merges.
    pub const NONE: Self = Self {
        surface: F::ZERO,
        point_point: F::ZERO,
        point_beam: F::ZERO,
        beam_point: F::ZERO,
        beam_beam: F::ZERO,
    };

    /// M_i at a surface.
    #[inline]
    pub fn at_surface(&self) -> Pending<F> {
        Pending { known: self.surface, open: F::ZERO }
    }

    /// M_i at a collision, as a light subpath knows it: `own` is b(T→), and what is open waits for b(T←). `sine` is that of the
    /// angle between the two edges. All raised.
    #[inline]
    pub fn from_light(&self, own: F, sine: F) -> Pending<F> {
        Pending {
            known: self.point_point + self.beam_point * own,
            open: self.point_beam + self.beam_beam * sine * own,
        }
    }

    /// M_i at a collision, as a camera subpath knows it: `own` is b(T←), and what is open waits for b(T→).
    #[inline]
    pub fn from_camera(&self, own: F, sine: F) -> Pending<F> {
        Pending {
            known: self.point_point + self.point_beam * own,
            open: self.beam_point + self.beam_beam * sine * own,
        }
    }
}

/// The weight of a merge at x_i: M_i,v / (M_i + (c_i + W_{i-1})/p_i + (c_{i+1} + V_{i+1})/r_i), all raised; the two quotients
/// are [`Link::apart`] of the two subpaths.
#[inline]
pub fn merge_weight<F: Real>(own: F, all: F, light_side: F, camera_side: F) -> F {
    own / (all + light_side + camera_side)
}

/// The weight of a connection: c_s / (c_s + W_{s-1} + V_s).
#[inline]
pub fn connection_weight<F: Real>(count: F, light_side: F, camera_side: F) -> F {
    count / (count + light_side + camera_side)
}
