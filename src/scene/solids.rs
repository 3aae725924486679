//! Solids: closed shapes with something in them, a medium or an index of refraction of their own.
//!
//! Solids may overlap and nest: where a point lies in several, the foremost decides what medium is there, and the
//! foremost refracting one what index. Foremost is the one with the higher priority; among equals the smaller one (by
//! its box), so that what lies wholly inside another shows without any priority; then the one that comes later in the
//! file. A boundary that lies inside a refracting solid that is in front of its own is not there for light: so a
//! liquid may reach into the glass that holds it, and ice stick out of it. Index-matched solids hide nothing.

use super::inside::Inside;
use crate::geometry::{Aabb, Geometry, Ray, ShapeDesc, SurfacePoint};
use glam::Vec3A;

/// Indices of refraction nearer to each other than this, relatively, are the same.
const SAME_INDEX: f32 = 1e-3;

/// A unit direction along no axis or diagonal of anything, in which point queries look.
const ODD_DIRECTION: Vec3A = Vec3A::new(0.387_684_1, 0.847_139_7, 0.363_394_14);

/// Stands for no medium.
pub const VACUUM: u32 = u32::MAX;

/// What a solid is bounded by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// Nothing that light notices.
    Matched,
    /// A dielectric, with the index inside and the one outside where no other solid says it.
    Refracting {
        /// Index inside.
        inside: f32,
        /// Index outside.
        outside: f32,
    },
    /// Something that light does not pass.
    Opaque,
}

/// A solid.
#[derive(Clone, Debug)]
pub struct Solid {
    /// Its shape.
    pub shape: u32,
    /// What bounds it.
    pub surface: Surface,
    /// Index of the medium in it; [`VACUUM`] for none.
    pub medium: u32,
    /// Higher comes first.
    pub priority: i32,
    /// Whether its boundary leaves no gap, and its inside is in it. A mesh that runs through itself is not seen here.
    pub closed: bool,
    /// The box about it.
    pub bounds: Aabb,
}

/// What is known of the points whose foremost refracting solid is this one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Room {
    /// There are none: it does not refract.
    Nowhere,
    /// A straight way may lead out.
    Open,
    /// None does without meeting a surface.
    Closed,
    /// None does, and no light is in it.
    Dark,
}

impl Solid {
    fn index(&self) -> Option<f32> {
        match self.surface {
            Surface::Refracting { inside, .. } => Some(inside),
            Surface::Matched | Surface::Opaque => None,
        }
    }
}

/// All solids of a scene, numbered from the foremost on.
#[derive(Clone, Debug)]
pub struct Solids {
    solids: Vec<Solid>,
    /// By shape; [`Inside::NONE`] for a shape that is none.
    of_shape: Vec<u16>,
    /// The medium where no solid is.
    world: u32,
    /// Whether some solids refract and may touch one another.
    nested: bool,
    /// By solid.
    rooms: Vec<Room>,
    /// What is known of any of them at most.
    most: Room,
    /// By solid, its shape if that is hollow.
    shells: Vec<Option<u32>>,
}

impl Solids {
    /// From the solids of a scene with so many shapes, and the medium about them all ([`VACUUM`] for none).
    ///
    /// # Errors
    /// More solids than can be told apart.
    pub fn new(mut solids: Vec<Solid>, shapes: usize, world: u32) -> Result<Self, String> {
        if solids.len() >= usize::from(Inside::NONE) {
            return Err(format!(
                "there are {} solids, and at most {} can be",
                solids.len(),
                Inside::NONE - 1
            ));
        }
        solids.sort_by(|a, b| {
            let size = a.bounds.surface().total_cmp(&b.bounds.surface());
            b.priority.cmp(&a.priority).then(size).then(b.shape.cmp(&a.shape))
        });
        let mut of_shape = vec![Inside::NONE; shapes];
        for (i, solid) in solids.iter().enumerate() {
            of_shape[solid.shape as usize] = i as u16;
        }
        let mut all = Self {
            solids,
            of_shape,
            world,
            nested: false,
            rooms: Vec::new(),
            most: Room::Nowhere,
            shells: Vec::new(),
        };
        all.nested = !all.touching().is_empty();
        all.rooms = all.rooms();
        all.most = most(&all.rooms);
        Ok(all)
    }

    /// Pairs of refracting solids whose boxes overlap, the foremost of a pair first.
    fn touching(&self) -> Vec<(&Solid, &Solid)> {
        let refracting: Vec<&Solid> = self.solids.iter().filter(|s| s.index().is_some()).collect();
        let mut pairs = Vec::new();
        for (i, front) in refracting.iter().enumerate() {
            let behind = refracting[i + 1..].iter().filter(|b| b.bounds.overlaps(&front.bounds));
            pairs.extend(behind.map(|b| (*front, *b)));
        }
        pairs
    }

    /// On a straight way out of the points whose foremost refracting solid is a certain one, something refracting ends or begins in
    /// front of what was foremost: a surface that light does not pass straight (see [`Self::is_passed`]), unless both have the
    /// same index. That hangs on the account of solids, which only closed ones keep, and no more of them than it can hold.
    fn rooms(&self) -> Vec<Room> {
        let sound = self.solids.iter().all(|s| s.closed || s.index().is_none());
        let near = |solid: &Solid| self.solids.iter().filter(|s| s.bounds.overlaps(&solid.bounds)).count();
        let room = |solid: &Solid| match solid.index() {
            None => Room::Nowhere,
            Some(_) if sound && near(solid) <= Inside::DEPTH => Room::Closed,
            Some(_) => Room::Open,
        };
        let mut rooms: Vec<Room> = self.solids.iter().map(room).collect();
        for (front, behind) in self.touching() {
            let index = |solid: &Solid| solid.index().unwrap_or(1.0);
            if same_index(index(front), index(behind)) || same_index(index(behind), index(front)) {
                for solid in [front, behind] {
                    rooms[usize::from(self.of_shape(solid.shape))] = Room::Open;
                }
            }
        }
        rooms
    }

    /// Says of the boxes about solids in which a light may be.
    pub fn light_up(&mut self, is_lit: impl Fn(&Aabb) -> bool) {
        for (room, solid) in self.rooms.iter_mut().zip(&self.solids) {
            if *room == Room::Closed && !is_lit(&solid.bounds) {
                *room = Room::Dark;
            }
        }
        self.most = most(&self.rooms);
    }

    /// Takes all rooms for open: where somebody's account of solids may be wrong, as a camera's that is partly in one.
    pub fn open_up(&mut self) {
        self.rooms.iter_mut().filter(|room| **room != Room::Nowhere).for_each(|room| *room = Room::Open);
        self.most = most(&self.rooms);
    }

    /// Says of the solids' shapes which are hollow, see [`Geometry::is_hollow`].
    pub fn hollow_out(&mut self, is_hollow: impl Fn(u32) -> bool) {
        self.shells = self.solids.iter().map(|s| is_hollow(s.shape).then_some(s.shape)).collect();
    }

    /// The hollow shape that the foremost solid at a point inside of these is.
    #[inline]
    pub fn shell(&self, inside: &Inside) -> Option<u32> {
        self.shells.get(usize::from(inside.foremost())).copied().flatten()
    }

    /// The foremost refracting solid at a point inside of these, and what is known of it.
    #[inline]
    fn room_of(&self, inside: &Inside) -> (u16, Room) {
        let mut rooms = inside.iter().map(|s| (s, self.rooms[usize::from(s)]));
        rooms.find(|(_, room)| *room != Room::Nowhere).unwrap_or((Inside::NONE, Room::Open))
    }

    /// Whether a surface is on every straight way between a point inside of `a` and one inside of `b`. False where that is not known
    /// without a look.
    #[inline]
    pub fn are_apart(&self, a: &Inside, b: &Inside) -> bool {
        if self.most < Room::Closed {
            return false;
        }
        let ((one, room), (other, there)) = (self.room_of(a), self.room_of(b));
        one != other && room.max(there) >= Room::Closed
    }

    /// Whether a surface is on every straight way between a point inside of these and any light. False where that is not known
    /// without a look.
    #[inline]
    pub fn is_dark(&self, inside: &Inside) -> bool {
        self.most == Room::Dark && self.room_of(inside).1 == Room::Dark
    }

    /// By shape, whether a ray may pass it: what is index-matched, and what another solid may hide or match.
    pub fn boundaries(&self) -> Vec<bool> {
        let mut passable = vec![false; self.of_shape.len()];
        for solid in &self.solids {
            passable[solid.shape as usize] |= solid.surface == Surface::Matched;
        }
        for (front, behind) in self.touching() {
            passable[behind.shape as usize] = true;
            if same_index(front.index().unwrap_or(1.0), behind.index().unwrap_or(1.0)) {
                passable[front.shape as usize] = true;
            }
        }
        passable
    }

    /// The solids, from the foremost on.
    pub fn all(&self) -> &[Solid] {
        &self.solids
    }

    /// The solid of a shape; [`Inside::NONE`] for a shape that is none.
    #[inline]
    pub fn of_shape(&self, shape: u32) -> u16 {
        self.of_shape[shape as usize]
    }

    /// The medium about all solids; [`VACUUM`] for none.
    pub fn world(&self) -> u32 {
        self.world
    }

    /// The medium at a point inside of these solids; [`VACUUM`] for none.
    #[inline]
    pub fn medium(&self, inside: &Inside) -> u32 {
        match inside.foremost() {
            Inside::NONE => self.world,
            foremost => self.solids[usize::from(foremost)].medium,
        }
    }

    /// What `inside` becomes for a ray along `dir` that crosses the surface at `point`.
    #[inline]
    pub fn cross(&self, inside: Inside, point: &SurfacePoint, dir: Vec3A) -> Inside {
        match self.of_shape(point.shape) {
            Inside::NONE => inside,
            solid if dir.dot(point.ng) < 0.0 => inside.with(solid),
            solid => inside.without(solid),
        }
    }

    /// Whether light passes the boundary of `shape`, which it may (see [`Self::boundaries`]), as if it were not there;
    /// `inside` on either side.
    #[inline]
    pub fn is_passed(&self, shape: u32, inside: &Inside) -> bool {
        let solid = self.of_shape(shape);
        if solid == Inside::NONE {
            return true;
        }
        let own = &self.solids[usize::from(solid)];
        let Some(index) = own.index() else { return own.surface == Surface::Matched };
        match self.around(solid, inside) {
            Some(other) => {
                other < solid || same_index(self.solids[usize::from(other)].index().unwrap_or(index), index)
            }
            None => false,
        }
    }

    /// Index of refraction outside of the boundary of `shape`, `inside` on either side; 0 where no other solid says it.
    #[inline]
    pub fn outside_index(&self, shape: u32, inside: &Inside) -> f32 {
        if !self.nested {
            return 0.0;
        }
        let solid = self.of_shape(shape);
        let around = self.around(solid, inside).and_then(|s| self.solids[usize::from(s)].index());
        around.unwrap_or(0.0)
    }

    /// The foremost refracting solid among `inside`, another than `solid`.
    #[inline]
    fn around(&self, solid: u16, inside: &Inside) -> Option<u16> {
        inside.iter().find(|s| *s != solid && self.solids[usize::from(*s)].index().is_some())
    }

    /// The solids at a point, found by a ray that comes from outside of all. For a point on the surface of a solid that
    /// one may be in or not.
    pub fn at(&self, geometry: &Geometry, point: Vec3A) -> Inside {
        let mut inside = Inside::NOTHING;
        if self.solids.is_empty() {
            return inside;
        }
        let (centre, radius) = geometry.bounding_sphere();
        let distance = 2.0 * radius + (point - centre).length();
        let mut ray = Ray { t_max: distance, ..Ray::new(point + ODD_DIRECTION * distance, -ODD_DIRECTION) };
        loop {
            let wall = geometry.intersect(&ray);
            let nearer = Ray { t_max: wall.map_or(ray.t_max, |h| h.t), ..ray };
            let Some(hit) = geometry.boundary(&nearer).or(wall) else { return inside };
            inside = self.cross(inside, &hit.point, ray.dir);
            let next = hit.point.spawn(ray.dir);
            ray = Ray { t_max: (point - next.origin).dot(ray.dir), ..next };
            if ray.t_max <= 0.0 {
                return inside;
            }
        }
    }

    /// The solids at every point of a box, with those of `shape` apart; `None` where that differs or cannot be told
    /// without looking at each point.
    pub fn within(&self, geometry: &Geometry, bounds: &Aabb, shape: Option<u32>) -> Option<Inside> {
        let crosses = |s: &&Solid| Some(s.shape) != shape && may_cross(geometry.shape(s.shape), bounds);
        if self.solids.iter().find(crosses).is_some() {
            return None;
        }
        let inside = self.at(geometry, bounds.centre());
        Some(shape.map_or(inside, |s| inside.without(self.of_shape(s))))
    }
}

/// What is known of any room at most.
fn most(rooms: &[Room]) -> Room {
    rooms.iter().copied().max().unwrap_or(Room::Nowhere)
}

fn same_index(a: f32, b: f32) -> bool {
    (a - b).abs() < SAME_INDEX * b
}

/// Whether the surface of a shape may pass through a box.
fn may_cross(shape: &ShapeDesc, bounds: &Aabb) -> bool {
    match shape {
        ShapeDesc::Sphere { centre, radius } => {
            let nearest = centre.clamp(bounds.min, bounds.max);
            let farthest = (*centre - bounds.min).abs().max((*centre - bounds.max).abs());
            nearest.distance(*centre) <= *radius && farthest.length() >= *radius
        }
        ShapeDesc::Disc { .. } => shape.bounds().overlaps(bounds),
        ShapeDesc::Mesh(mesh) => {
            shape.bounds().overlaps(bounds)
                && (0..mesh.indices().len())
                    .any(|i| Aabb::of(mesh.corners(i).map(Vec3A::from)).overlaps(bounds))
        }
    }
}

#[cfg(test)]
mod tests;
