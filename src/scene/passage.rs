//! Rays through whatever fills space: flights that may end in a collision (the short view), whole rays with all their
//! stretches (the long view), and segments between two points.
//!
//! Index-matched boundaries, and those that another solid hides, change the medium and nothing else: they end no edge.
//! The distance to a collision is drawn once an edge, see [`crate::medium::Draw`], whatever it crosses; not before it comes to
//! a medium that scatters.

use super::Scene;
use super::inside::Inside;
use crate::geometry::{Hit, Ray, SurfacePoint};
use crate::math::{Rgb, RgbExt, Stream};
use crate::medium::{Coefficients, Draw, Medium, Passage};
use glam::Vec3A;

/// A boundary that a wall touches comes after the wall: so much further, relatively, walls are looked for. Otherwise a
/// ray could cross a boundary that a wall coincides with, and start again behind the wall.
const WALL_FIRST: f32 = 1.0 + 1.0 / (1 << 20) as f32;

/// A scattering point in a medium.
#[derive(Clone, Copy, Debug)]
pub struct Collision {
    /// Where.
    pub p: Vec3A,
    /// The medium's coefficients there.
    pub coefficients: Coefficients,
    /// Index of the medium.
    pub medium: u32,
}

/// Where a flight ends, and a vertex lies.
#[derive(Clone, Copy, Debug)]
pub enum Place {
    /// On a surface.
    Surface(SurfacePoint),
    /// In a medium.
    Medium(Collision),
}

/// Where a flight led to.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Where it ends; `None` where the ray left the scene.
    pub place: Option<Place>,
    /// Distance in metres; infinite for an open end.
    pub distance: f32,
    /// What the edge lets through, and its free-flight factors.
    pub passage: Passage,
    /// The solids at the end; at a surface, on the side that the flight came from.
    pub inside: Inside,
}

/// A part of a ray within one medium.
#[derive(Clone, Copy, Debug)]
pub struct Stretch<'a> {
    /// Where it starts.
    pub origin: Vec3A,
    /// The ray's unit direction.
    pub dir: Vec3A,
    /// Distance from the ray's origin to the start (metres).
    pub start: f32,
    /// In metres; may be infinite.
    pub length: f32,
    /// What is in it; `None` for nothing.
    pub medium: Option<&'a Medium>,
    /// Index of the medium.
    pub index: u32,
    /// From the ray's origin to the start.
    pub before: Passage,
}

/// How far a flight gets in one medium.
struct Flown {
    /// Where it collides, if it does before the medium ends.
    collision: Option<f32>,
    through: Through,
}

/// Where a flight's collision shall be.
struct Drawing<'a> {
    /// Once it was drawn.
    draw: Option<Draw>,
    /// Whether media are tracked that can be.
    track: bool,
    random: &'a mut Stream,
}

/// What is known of the medium up to a flight's collision, or to its end.
enum Through {
    /// Nothing: it ends no flight.
    Unknown,
    /// Its optical depth.
    Depth(Rgb),
    /// That it counts as clear.
    Tracked,
}

impl Scene {
    /// The medium at a point inside of these solids.
    #[inline(always)]
    pub fn medium_within(&self, inside: &Inside) -> Option<&Medium> {
        self.media.get(self.solids.medium(inside) as usize)
    }

    /// The first wall on a ray that starts inside of these solids.
    #[inline(always)]
    fn wall(&self, ray: &Ray, inside: &Inside) -> Option<Hit> {
        match self.solids.shell(inside) {
            Some(shape) => self.geometry.intersect_within(shape, ray),
            None => self.geometry.intersect(ray),
        }
    }

    /// The short view: how far light gets along `ray`, which starts inside of the solids `inside`. Draws random numbers
    /// only where something scatters. `track`: whether media are tracked that can be, see
    /// [`Medium::is_tracked`]; the passage then has them as clear.
    #[inline(always)]
    pub fn fly(&self, ray: &Ray, inside: Inside, track: bool, random: &mut Stream) -> Arrival {
        if self.is_void() {
            return self.fly_in_void(ray, inside);
        }
        let drawing = Drawing { draw: None, track, random };
        if self.geometry.has_boundaries() {
            self.fly_through(ray, inside, drawing)
        } else {
            self.fly_to_wall(ray, inside, drawing)
        }
    }

    /// A flight where there are no boundaries: one stretch.
    #[inline(always)]
    fn fly_to_wall(&self, ray: &Ray, inside: Inside, mut drawing: Drawing) -> Arrival {
        let index = self.solids.medium(&inside);
        let medium = self.media.get(index as usize);
        let Flown { collision, through } = fly_in(medium, ray, f32::INFINITY, &mut drawing);
        let reach = collision.unwrap_or(f32::INFINITY);
        let wall = self.wall(&Ray { t_max: reach, ..*ray }, &inside);
        let distance = wall.map_or(reach, |hit| hit.t);
        let place = match (wall, collision, medium) {
            (Some(hit), ..) => Some(Place::Surface(hit.point)),
            (None, Some(t), Some(medium)) => {
                let p = ray.at(t);
                Some(Place::Medium(Collision { p, coefficients: medium.coefficients(p), medium: index }))
            }
            (None, ..) => None,
        };
        let passage = pass(Passage::CLEAR, medium, &through, ray, distance, wall.is_none());
        Arrival { place, distance, passage, inside }
    }

    /// Whether there are neither media nor boundaries, but only walls.
    #[inline]
    pub fn is_void(&self) -> bool {
        self.media.is_empty() && !self.geometry.has_boundaries()
    }

    /// [`Self::fly`] where it is known that [`Self::is_void`].
    #[inline(always)]
    pub fn fly_in_void(&self, ray: &Ray, inside: Inside) -> Arrival {
        let (place, distance) = match self.geometry.intersect(ray) {
            Some(hit) => (Some(Place::Surface(hit.point)), hit.t),
            None => (None, f32::INFINITY),
        };
        Arrival { place, distance, passage: Passage::CLEAR, inside }
    }

    #[inline(never)]
    fn fly_through(&self, ray: &Ray, mut inside: Inside, mut drawing: Drawing) -> Arrival {
        let dir = ray.dir;
        let mut passage = Passage::CLEAR;
        let mut segment = *ray;
        let mut passed = 0.0;
        loop {
            let boundary = self.next_boundary(&segment);
            let limit = boundary.map_or(f32::INFINITY, |h| h.t);
            let medium = self.medium_within(&inside);
            let Flown { collision, through } = fly_in(medium, &segment, limit, &mut drawing);
            let reach = collision.unwrap_or(limit * WALL_FIRST);
            let wall = self.wall(&Ray { t_max: reach, ..segment }, &inside);
            let through = |t: f32| pass(passage, medium, &through, &segment, t, wall.is_none());
            let arrive = |place: Option<Place>, t: f32| Arrival {
                place,
                distance: passed + t,
                passage: through(t),
                inside,
            };
            match (wall, collision, boundary) {
                (Some(hit), ..) => return arrive(Some(Place::Surface(hit.point)), hit.t),
                (None, Some(t), _) => {
                    let p = segment.at(t);
                    let index = self.solids.medium(&inside);
                    let coefficients = self.media[index as usize].coefficients(p);
                    let collision = Collision { p, coefficients, medium: index };
                    return arrive(Some(Place::Medium(collision)), t);
                }
                (None, None, None) => return arrive(None, f32::INFINITY),
                (None, None, Some(hit)) if !self.solids.is_passed(hit.point.shape, &inside) => {
                    return arrive(Some(Place::Surface(hit.point)), hit.t);
                }
                (None, None, Some(hit)) => {
                    passage = through(hit.t);
                    passed += hit.t;
                    inside = self.solids.cross(inside, &hit.point, dir);
                    segment = hit.point.spawn(dir);
                }
            }
        }
    }

    #[inline]
    fn next_boundary(&self, ray: &Ray) -> Option<Hit> {
        if self.geometry.has_boundaries() { self.geometry.boundary(ray) } else { None }
    }

    /// The long view: the whole ray up to the first surface, stretch by stretch in order. Where it is known already how
    /// far that is, `known` says it, or how far the view shall go if that is less.
    pub fn survey<'a>(
        &'a self,
        ray: &Ray,
        mut inside: Inside,
        known: Option<f32>,
        mut visit: impl FnMut(&Stretch<'a>),
    ) {
        let dir = ray.dir;
        let mut before = Passage::CLEAR;
        let mut segment = Ray { t_max: known.unwrap_or(f32::INFINITY), ..*ray };
        let mut start = 0.0;
        loop {
            let boundary = self.next_boundary(&segment);
            let limit = boundary.map_or(segment.t_max, |h| h.t * WALL_FIRST);
            let wall = match known {
                Some(_) => None,
                None => self.wall(&Ray { t_max: limit, ..segment }, &inside),
            };
            let first = wall.or(boundary);
            let length = first.map_or(segment.t_max, |h| h.t);
            let medium = self.medium_within(&inside);
            let index = self.solids.medium(&inside);
            visit(&Stretch { origin: segment.origin, dir, start, length, medium, index, before });
            match (wall, boundary) {
                (Some(_), _) | (None, None) => return,
                (None, Some(hit)) if !self.solids.is_passed(hit.point.shape, &inside) => return,
                (None, Some(hit)) => {
                    if let Some(m) = medium {
                        before = before.then(m.optical_depth(segment.origin, dir, 0.0, length), m.scatters());
                    }
                    start += length;
                    inside = self.solids.cross(inside, &hit.point, dir);
                    segment = Ray { t_max: segment.t_max - length, ..hit.point.spawn(dir) };
                }
            }
        }
    }

    /// What the segment or half-line `ray`, which starts inside of the solids `inside`, lets through; `None` where
    /// a surface is on it. With a `tracker` media are tracked that can be: the transmittance is an estimate, and survival is without
    /// them.
    #[inline(always)]
    pub fn passage(&self, ray: &Ray, inside: Inside, mut tracker: Option<&mut Stream>) -> Option<Passage> {
        if self.geometry.occluded(ray) {
            return None;
        }
        if self.is_void() {
            return Some(Passage::CLEAR);
        }
        if self.geometry.has_boundaries() {
            return self.passage_through(ray, inside, tracker);
        }
        Some(see_through(Passage::CLEAR, self.medium_within(&inside), ray, ray.t_max, &mut tracker))
    }

    /// [`Self::passage`] where it is known that [`Self::is_void`].
    #[inline(always)]
    pub fn passage_in_void(&self, ray: &Ray) -> Option<Passage> {
        (!self.geometry.occluded(ray)).then_some(Passage::CLEAR)
    }

    #[inline(never)]
    fn passage_through(
        &self,
        ray: &Ray,
        mut inside: Inside,
        mut tracker: Option<&mut Stream>,
    ) -> Option<Passage> {
        let mut passage = Passage::CLEAR;
        let mut segment = *ray;
        loop {
            let boundary = self.next_boundary(&segment);
            let length = boundary.map_or(segment.t_max, |h| h.t);
            passage = see_through(passage, self.medium_within(&inside), &segment, length, &mut tracker);
            let Some(hit) = boundary else { return Some(passage) };
            if !self.solids.is_passed(hit.point.shape, &inside) {
                return None;
            }
            inside = self.solids.cross(inside, &hit.point, segment.dir);
            segment = Ray { t_max: segment.t_max - length, ..hit.point.spawn(segment.dir) };
        }
    }

    /// What the media along the whole of `ray` send back to its start (radiance).
    pub fn glow(&self, ray: &Ray, inside: Inside) -> Rgb {
        let mut radiance = Rgb::ZERO;
        self.survey(ray, inside, None, |stretch| {
            if let Some(medium) = stretch.medium.filter(|m| m.is_emissive())
                && !stretch.before.transmittance.is_black()
            {
                let own = medium.emitted(stretch.origin, stretch.dir, 0.0, stretch.length);
                radiance += stretch.before.transmittance * own;
            }
        });
        radiance
    }
}

/// A flight along `ray` in `medium`, which ends at `limit`. What is left of the draw is for what comes behind: depths have no
/// memory, so that a medium that is tracked, with random numbers of its own, leaves it as it is.
#[inline(always)]
fn fly_in(medium: Option<&Medium>, ray: &Ray, limit: f32, drawing: &mut Drawing) -> Flown {
    let Some(medium) = medium.filter(|m| m.scatters()) else {
        return Flown { collision: None, through: Through::Unknown };
    };
    if drawing.track && medium.is_tracked() {
        return Flown {
            collision: medium.track(ray.origin, ray.dir, limit, drawing.random),
            through: Through::Tracked,
        };
    }
    let draw = drawing.draw.get_or_insert_with(|| Draw::new(drawing.random.next_2d()));
    let (end, depth) = medium.fly(ray.origin, ray.dir, limit, draw.channel, draw.depth);
    if let Err(left) = end {
        draw.depth = left;
    }
    Flown { collision: end.ok(), through: Through::Depth(depth) }
}

/// `passage`, and then `ray` through `medium` to `t`; `whole`: as far as `through` is about.
#[inline(always)]
fn pass(
    passage: Passage,
    medium: Option<&Medium>,
    through: &Through,
    ray: &Ray,
    t: f32,
    whole: bool,
) -> Passage {
    match (medium, through) {
        (None, _) | (_, Through::Tracked) => passage,
        (Some(_), Through::Depth(depth)) if whole => passage.then(*depth, true),
        (Some(m), _) => passage.then(m.optical_depth(ray.origin, ray.dir, 0.0, t), m.scatters()),
    }
}

/// `passage`, and then what a shadow ray sees of `medium` up to `length`.
#[inline(always)]
fn see_through(
    passage: Passage,
    medium: Option<&Medium>,
    ray: &Ray,
    length: f32,
    tracker: &mut Option<&mut Stream>,
) -> Passage {
    match (medium, tracker) {
        (None, _) => passage,
        (Some(m), Some(random)) if m.is_tracked() => {
            passage.then_tracked(m.ratio(ray.origin, ray.dir, length, random))
        }
        (Some(m), _) => passage.then(m.optical_depth(ray.origin, ray.dir, 0.0, length), m.scatters()),
    }
}

#[cfg(test)]
mod tests;
