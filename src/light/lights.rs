//! All lights of a scene: light subpaths start on them by their power, and toward a point they are selected by what they bring there.

use super::reach::{Reach, Source};
use super::{AreaLight, EmissionSample, Light, LightEnd, LightPoint, LightSample};
use crate::geometry::{Geometry, SurfacePoint};
use crate::math::{Discrete, Frame, Rgb, RgbExt, warp};
use glam::{Vec2, Vec3A};
use std::sync::Arc;

/// What stands for "no light" in the map from shapes, and for "no primitive" in a [`LightPoint`].
const NONE: u32 = u32::MAX;

/// The lights of a scene. For emission a light is selected as it is asked for, or with the probability in proportion to its power's luminance; toward a
/// reference point by what it would bring there ([`super::reach`]), where there are more than one and not too many. A light
/// without power is never selected.
#[derive(Clone, Debug)]
pub struct Lights {
    lights: Vec<Light>,
    selection: Arc<Discrete>,
    /// For the selection toward a point; `None` where the powers have to do.
    reach: Option<Reach>,
    /// Power in W, a light each.
    powers: Vec<Rgb>,
    /// 1 / area of an area light's shape; 0 for other lights.
    inv_areas: Vec<f32>,
    /// Index of the (area) light of a shape, [`NONE`] where it has none or one without power.
    by_shape: Vec<u32>,
    environment: Option<u32>,
    /// A sphere about the scene: rays of infinite lights start on discs of its radius.
    centre: Vec3A,
    radius: f32,
    /// 1 / (πR²).
    inv_disc: f32,
    warnings: Vec<String>,
}

impl Lights {
    /// The lights of a scene with this geometry.
    ///
    /// # Errors
    /// Where there is no light or none has power, an area light's shape does not exist, has no area or has two
    /// lights, or there are two environment lights.
    pub fn new(lights: Vec<Light>, geometry: &Geometry) -> Result<Self, String> {
        if lights.is_empty() {
            return Err("the scene has no light".into());
        }
        let (centre, radius) = covering_sphere(geometry);
        let disc = f64::from(radius).powi(2) * std::f64::consts::PI;
        let mut by_shape = vec![NONE; geometry.shape_count()];
        let mut environment = None;
        let (mut powers, mut inv_areas, mut warnings) = (Vec::new(), Vec::new(), Vec::new());
        for (i, light) in lights.iter().enumerate() {
            let mut inv_area = 0.0;
            let power = match light {
                Light::Area(l) => {
                    let area = checked_area(l, geometry)?;
                    inv_area = 1.0 / area;
                    l.power(area)
                }
                Light::Point(l) => l.power(),
                Light::Spot(l) => l.power(),
                Light::Directional(l) => l.irradiance * disc as f32,
                Light::Environment(l) => l.integral() * disc as f32,
            };
            if !power.is_finite() {
                return Err(format!("light {i} ({}): its power {power} is not finite", light.kind()));
            }
            let has_power = power.luminance() > 0.0;
            if !has_power {
                warnings.push(format!("light {i} ({}) has no power and is never sampled", light.kind()));
            }
            match light {
                Light::Area(l) => {
                    let owner = &mut by_shape[l.shape as usize];
                    if *owner != NONE {
                        return Err(format!("shape {} has two area lights", l.shape));
                    }
                    *owner = i as u32;
                }
                Light::Environment(_) if environment.replace(i as u32).is_some() => {
                    return Err("the scene has two environment lights; there can be one".into());
                }
                _ => {}
            }
            powers.push(power);
            inv_areas.push(inv_area);
        }
        let selection = Discrete::new(powers.iter().map(|p| f64::from(p.luminance())))
            .ok_or("no light of the scene has any power")?;
        // What is never sampled must not be found by rays either, with a density of zero.
        let silent = |i: u32| powers[i as usize].luminance() == 0.0;
        for owner in &mut by_shape {
            if *owner != NONE && silent(*owner) {
                *owner = NONE;
            }
        }
        let environment = environment.filter(|i| !silent(*i));
        let inv_disc = (1.0 / disc) as f32;
        let sources: Vec<Source> = lights.iter().map(|light| source(light, geometry)).collect();
        let reach = Reach::new(&sources, &powers, &selection, disc as f32);
        Ok(Self {
            lights,
            selection: Arc::new(selection),
            reach,
            powers,
            inv_areas,
            by_shape,
            environment,
            centre,
            radius,
            inv_disc,
            warnings,
        })
    }

    /// The lights, by index.
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// Power in W of light `i`; of an infinite light, what enters the disc that covers the scene.
    pub fn power(&self, i: usize) -> Rgb {
        self.powers[i]
    }

    /// Probabilities in proportion to the powers, a light each.
    #[inline]
    pub fn by_power(&self) -> &Arc<Discrete> {
        &self.selection
    }

    /// What the user should know, a message each.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Radius in metres of the disc that rays of infinite lights start on.
    pub fn disc_radius(&self) -> f32 {
        self.radius
    }

    /// The start of a light subpath, on a light that is drawn from `starts`. `None` with probability about zero (rounding).
    #[inline(always)]
    pub fn sample_emission(
        &self,
        geometry: &Geometry,
        starts: &Discrete,
        u_select: f32,
        u_pos: Vec2,
        u_dir: Vec2,
    ) -> Option<EmissionSample> {
        let (i, _) = starts.sample(u_select);
        let select = starts.pdf(i);
        let light = i as u32;
        match &self.lights[i] {
            Light::Area(l) => {
                let s = geometry.sample_place(l.shape, u_pos);
                let (dir, n, pdf_dir) = l.sample_direction(s.ng, u_dir);
                let point = LightPoint { p: s.p, n, light, prim: s.prim };
                let pdf_pos = select * self.inv_areas[i];
                let sample =
                    EmissionSample { point, origin: s.p, dir, pdf_pos, pdf_dir, radiance: l.radiance };
                (pdf_dir > 0.0).then_some(sample)
            }
            Light::Point(l) => {
                let dir = warp::uniform_sphere(u_dir);
                Some(point_emission(light, l.position, dir, select, warp::UNIFORM_SPHERE_PDF, l.intensity))
            }
            Light::Spot(l) => {
                let dir = l.sample_direction(u_dir);
                let pdf_dir = l.pdf_direction(dir);
                (pdf_dir > 0.0)
                    .then(|| point_emission(light, l.position, dir, select, pdf_dir, l.emitted(dir)))
            }
            Light::Directional(l) => {
                Some(self.infinite_emission(light, l.toward, u_pos, select, l.irradiance))
            }
            Light::Environment(l) => {
                let (toward, pdf, radiance) = l.sample(u_dir)?;
                Some(self.infinite_emission(light, toward, u_pos, select * pdf, radiance))
            }
        }
    }

    /// A ray of an infinite light from the direction `toward`: uniform over the disc that covers the scene.
    #[inline]
    fn infinite_emission(
        &self,
        light: u32,
        toward: Vec3A,
        u: Vec2,
        pdf_pos: f32,
        radiance: Rgb,
    ) -> EmissionSample {
        let d = warp::concentric_disc(u);
        let frame = Frame::from_normal(toward);
        let origin = self.centre + self.radius * (toward + frame.s * d.x + frame.t * d.y);
        let point = LightPoint { p: Vec3A::ZERO, n: toward, light, prim: NONE };
        EmissionSample { point, origin, dir: -toward, pdf_pos, pdf_dir: self.inv_disc, radiance }
    }

    /// Whether there is one light: then none need be selected.
    #[inline]
    pub fn is_single(&self) -> bool {
        self.lights.len() == 1
    }

    /// A point on a light for a connection to `from`. `None` where the light that was selected does not shine there.
    #[inline(always)]
    pub fn sample_toward(
        &self,
        geometry: &Geometry,
        from: Vec3A,
        u_select: f32,
        u: Vec2,
    ) -> Option<LightSample> {
        let (i, select) = match &self.reach {
            Some(reach) => reach.sample(from, u_select),
            None => {
                let (i, _) = self.selection.sample(u_select);
                (i, self.selection.pdf(i))
            }
        };
        let light = i as u32;
        match &self.lights[i] {
            Light::Area(l) => area_sample(l, geometry, (light, select, self.inv_areas[i]), from, u),
            other => self.other_sample(other, (light, select), from, u),
        }
    }

    /// [`area_sample`] for a light without an area.
    #[inline(never)]
    fn other_sample(
        &self,
        emitter: &Light,
        (light, select): (u32, f32),
        from: Vec3A,
        u: Vec2,
    ) -> Option<LightSample> {
        let at = |p: Vec3A| LightPoint { p, n: Vec3A::ZERO, light, prim: NONE };
        let toward = |n: Vec3A| LightPoint { p: Vec3A::ZERO, n, light, prim: NONE };
        let (point, (dir, inverse_distance), radiance, pdf) = match emitter {
            Light::Area(_) => unreachable!("it has an area"),
            Light::Point(l) => (at(l.position), direction(from, l.position)?, l.intensity, 1.0),
            Light::Spot(l) => {
                let (dir, inverse_distance) = direction(from, l.position)?;
                let radiance = l.emitted(-dir);
                if radiance.is_black() {
                    return None;
                }
                (at(l.position), (dir, inverse_distance), radiance, 1.0)
            }
            Light::Directional(l) => (toward(l.toward), (l.toward, 0.0), l.irradiance, 1.0),
            Light::Environment(l) => {
                let (dir, pdf, radiance) = l.sample(u)?;
                (toward(dir), (dir, 0.0), radiance, pdf)
            }
        };
        let end = LightEnd {
            cosine: self.cos_at_light(&point, -dir),
            pdf_direction: self.pdf_direction(&point, -dir),
            // Exactly what `pdf_place` would find again.
            pdf_place: pdf,
            infinite: self.is_infinite(&point),
            hittable: self.is_hittable(&point),
        };
        Some(LightSample { point, dir, inverse_distance, radiance, pdf_nee: select * pdf, end })
    }

    /// What `lp` emits along `dir_out` (from the light into the scene): radiance, or a point or spot light's intensity,
    /// or a directional light's irradiance. Infinite lights: what comes from their direction `lp.n`.
    #[inline]
    pub fn emitted(&self, lp: &LightPoint, dir_out: Vec3A) -> Rgb {
        match &self.lights[lp.light as usize] {
            Light::Area(l) => l.emitted(lp.n, dir_out),
            Light::Point(l) => l.intensity,
            Light::Spot(l) => l.emitted(dir_out),
            Light::Directional(l) => l.irradiance,
            Light::Environment(l) => l.radiance(lp.n),
        }
    }

    /// Density of x₀ = `lp` in [`Self::sample_emission`] from `starts`, as [`EmissionSample::pdf_pos`].
    #[inline(always)]
    pub fn pdf_position(&self, starts: &Discrete, lp: &LightPoint) -> f32 {
        starts.pdf(lp.light as usize) * self.pdf_place(lp)
    }

    /// The same, given that the light was selected.
    #[inline(always)]
    fn pdf_place(&self, lp: &LightPoint) -> f32 {
        let i = lp.light as usize;
        match &self.lights[i] {
            Light::Area(_) => self.inv_areas[i],
            Light::Point(_) | Light::Spot(_) | Light::Directional(_) => 1.0,
            Light::Environment(l) => l.pdf(lp.n),
        }
    }

    /// Density of the ray from `lp` along `dir_out`, as [`EmissionSample::pdf_dir`].
    #[inline(always)]
    pub fn pdf_direction(&self, lp: &LightPoint, dir_out: Vec3A) -> f32 {
        match &self.lights[lp.light as usize] {
            Light::Area(l) => l.pdf_direction(lp.n, dir_out),
            Light::Point(_) => warp::UNIFORM_SPHERE_PDF,
            Light::Spot(l) => l.pdf_direction(dir_out),
            Light::Directional(_) | Light::Environment(_) => self.inv_disc,
        }
    }

    /// Density of x₀ = `lp` in [`Self::sample_toward`] from the reference point `from`, as [`LightSample::pdf_nee`].
    #[inline]
    pub fn pdf_toward(&self, geometry: &Geometry, lp: &LightPoint, from: Vec3A) -> f32 {
        let i = lp.light as usize;
        let select = self.reach.as_ref().map_or_else(|| self.selection.pdf(i), |reach| reach.pdf(i, from));
        match &self.lights[i] {
            Light::Area(l) => {
                let place = (lp.p, lp.n, lp.prim);
                select * geometry.pdf_place_toward(l.shape, from, l.two_sided, place)
            }
            Light::Point(_) | Light::Spot(_) | Light::Directional(_) => select,
            Light::Environment(l) => select * l.pdf(lp.n),
        }
    }

    /// D₀ of the light's end of an edge: |cos θ| on an area light, 1 on any other.
    #[inline(always)]
    pub fn cos_at_light(&self, lp: &LightPoint, dir: Vec3A) -> f32 {
        match &self.lights[lp.light as usize] {
            Light::Area(_) => lp.n.dot(dir).abs(),
            _ => 1.0,
        }
    }

    /// The area light at a surface point that a ray found.
    #[inline(always)]
    pub fn at_surface(&self, point: &SurfacePoint) -> Option<LightPoint> {
        let light = self.by_shape[point.shape as usize];
        (light != NONE).then_some(LightPoint { p: point.p, n: point.ng, light, prim: point.prim })
    }

    /// The environment light in the unit direction `dir`, for a ray that leaves the scene.
    #[inline]
    pub fn infinite_toward(&self, dir: Vec3A) -> Option<LightPoint> {
        self.environment.map(|light| LightPoint { p: Vec3A::ZERO, n: dir, light, prim: NONE })
    }

    /// Whether x₀ is a direction.
    #[inline(always)]
    pub fn is_infinite(&self, lp: &LightPoint) -> bool {
        matches!(self.lights[lp.light as usize], Light::Directional(_) | Light::Environment(_))
    }

    /// Whether a camera subpath can find the light by chance (s = 0): area and environment lights.
    #[inline(always)]
    pub fn is_hittable(&self, lp: &LightPoint) -> bool {
        matches!(self.lights[lp.light as usize], Light::Area(_) | Light::Environment(_))
    }

    /// Whether the light's position is a Dirac: point and spot lights.
    #[inline]
    pub fn is_delta_position(&self, lp: &LightPoint) -> bool {
        matches!(self.lights[lp.light as usize], Light::Point(_) | Light::Spot(_))
    }

    /// Whether the light's direction is a Dirac: directional lights.
    #[inline]
    pub fn is_delta_direction(&self, lp: &LightPoint) -> bool {
        matches!(self.lights[lp.light as usize], Light::Directional(_))
    }
}

/// A light as it is seen from afar.
fn source(light: &Light, geometry: &Geometry) -> Source {
    match light {
        Light::Area(l) => {
            let bounds = geometry.shape_bounds(l.shape);
            Source { centre: bounds.centre(), radius: 0.5 * bounds.size().length(), infinite: false }
        }
        Light::Point(l) => Source { centre: l.position, radius: 0.0, infinite: false },
        Light::Spot(l) => Source { centre: l.position, radius: 0.0, infinite: false },
        Light::Directional(_) | Light::Environment(_) => {
            Source { centre: Vec3A::ZERO, radius: 0.0, infinite: true }
        }
    }
}

/// Unit direction from `from` to `to`, and 1 over their distance; `None` where they are one point.
#[inline(always)]
fn direction(from: Vec3A, to: Vec3A) -> Option<(Vec3A, f32)> {
    let between = to - from;
    let inverse_distance = between.length_recip();
    (inverse_distance > 0.0 && inverse_distance < f32::INFINITY)
        .then_some((between * inverse_distance, inverse_distance))
}

#[inline]
fn point_emission(
    light: u32,
    p: Vec3A,
    dir: Vec3A,
    pdf_pos: f32,
    pdf_dir: f32,
    radiance: Rgb,
) -> EmissionSample {
    let point = LightPoint { p, n: Vec3A::ZERO, light, prim: NONE };
    EmissionSample { point, origin: p, dir, pdf_pos, pdf_dir, radiance }
}

/// A point on the area light `light`, selected with the probability `select`, for a connection to `from`.
/// `pdf_place`: see [`LightEnd::pdf_place`].
#[inline(always)]
fn area_sample(
    l: &AreaLight,
    geometry: &Geometry,
    (light, select, pdf_place): (u32, f32, f32),
    from: Vec3A,
    u: Vec2,
) -> Option<LightSample> {
    let (s, pdf) = geometry.sample_place_toward(l.shape, from, l.two_sided, u)?;
    let (dir, inverse_distance) = direction(from, s.p)?;
    let facing = s.ng.dot(dir);
    let radiance = l.emitted_at(-facing);
    if radiance.is_black() || pdf <= 0.0 {
        return None;
    }
    // A two-sided light emits from the side that the reference point is on.
    let n = if facing < 0.0 { s.ng } else { -s.ng };
    let point = LightPoint { p: s.p, n, light, prim: s.prim };
    let cosine = facing.abs();
    let end =
        LightEnd { cosine, pdf_direction: l.pdf_cosine(cosine), pdf_place, infinite: false, hittable: true };
    Some(LightSample { point, dir, inverse_distance, radiance, pdf_nee: select * pdf, end })
}

/// A sphere about the scene that rounding does not bring a ray out of; of radius 1 for an empty scene.
fn covering_sphere(geometry: &Geometry) -> (Vec3A, f32) {
    let (centre, radius) = geometry.bounding_sphere();
    if centre.is_finite() && radius.is_finite() && radius > 0.0 {
        // Coordinates far from the origin are rounded more coarsely than the radius.
        (centre, radius * 1.0001 + 8.0 * f32::EPSILON * centre.abs().max_element())
    } else {
        (Vec3A::ZERO, 1.0)
    }
}

/// The area of an area light's shape.
fn checked_area(light: &AreaLight, geometry: &Geometry) -> Result<f32, String> {
    let n = geometry.shape_count();
    if light.shape as usize >= n {
        return Err(format!("area light: there is no shape {} among {n}", light.shape));
    }
    let area = geometry.area(light.shape);
    if area > 0.0 && (1.0 / area).is_finite() && area.is_finite() {
        Ok(area)
    } else {
        Err(format!("area light: shape {} has the area {area}", light.shape))
    }
}
