//! Solids against what spheres say of their own inside.

use super::*;
use crate::math::testing::stream;

const GLASS: Surface = Surface::Refracting { inside: 1.5, outside: 1.0 };
const WATER: Surface = Surface::Refracting { inside: 1.33, outside: 1.0 };

/// Spheres on the x axis: their middle, radius, surface, medium and priority. By shape: glass, water that reaches into it, ice
/// of water's index, half out of the water, fog that nothing bounds, a lamp.
const BALLS: [(f32, f32, Surface, u32, i32); 5] = [
    (0.0, 1.0, GLASS, VACUUM, 3),
    (1.2, 0.8, WATER, 0, 1),
    (2.0, 0.2, WATER, 1, 2),
    (-0.9, 0.5, Surface::Matched, 2, 5),
    (4.0, 0.3, Surface::Opaque, 3, 0),
];

fn sphere(x: f32, radius: f32) -> ShapeDesc {
    ShapeDesc::Sphere { centre: Vec3A::new(x, 0.0, 0.0), radius }
}

/// Solids of the balls, and the geometry with those that may be passed as boundaries, or all as walls.
fn scene(all_walls: bool) -> (Solids, Geometry) {
    let shapes: Vec<ShapeDesc> = BALLS.iter().map(|(x, radius, ..)| sphere(*x, *radius)).collect();
    let solid = |(i, (_, _, surface, medium, priority)): (usize, &(f32, f32, Surface, u32, i32))| Solid {
        shape: i as u32,
        surface: *surface,
        medium: *medium,
        priority: *priority,
        closed: true,
        bounds: shapes[i].bounds(),
    };
    let solids = Solids::new(BALLS.iter().enumerate().map(solid).collect(), BALLS.len(), 9).expect("solids");
    let passable = solids.boundaries();
    assert_eq!(passable, [false, true, true, true, false]);
    let geometry =
        Geometry::build_with(shapes.iter().cloned().zip(passable.iter().map(|p| *p && !all_walls)).collect());
    (solids, geometry)
}

/// The shapes that a point lies in, by distances to their middles; `None` near one's surface.
fn truth(p: Vec3A) -> Option<Vec<u32>> {
    let distance = |i: usize| (p - Vec3A::new(BALLS[i].0, 0.0, 0.0)).length() / BALLS[i].1;
    let all = || (0..BALLS.len()).map(|i| (i as u32, distance(i)));
    all()
        .all(|(_, d)| (d - 1.0).abs() > 1e-3)
        .then(|| all().filter(|(_, d)| *d < 1.0).map(|(i, _)| i).collect())
}

fn shapes(solids: &Solids, inside: &Inside) -> Vec<u32> {
    let mut shapes: Vec<u32> = inside.iter().map(|s| solids.all()[usize::from(s)].shape).collect();
    shapes.sort_unstable();
    shapes
}

fn among(solids: &Solids, shapes: &[u32]) -> Inside {
    shapes.iter().fold(Inside::NOTHING, |inside, s| inside.with(solids.of_shape(*s)))
}

fn point(random: &mut crate::math::Stream) -> Vec3A {
    let u = random.next_2d();
    Vec3A::new(7.0 * u.x - 2.0, 2.4 * u.y - 1.2, 2.4 * random.next_1d() - 1.2)
}

#[test]
fn points_lie_in_the_spheres_that_hold_them() {
    let (mut random, mut many) = (stream(1), 0);
    for all_walls in [false, true] {
        let (solids, geometry) = scene(all_walls);
        for _ in 0..4000 {
            let p = point(&mut random);
            let Some(truth) = truth(p) else { continue };
            assert_eq!(shapes(&solids, &solids.at(&geometry, p)), truth, "{p}");
            many += usize::from(truth.len() > 1);
        }
    }
    assert!(many > 100, "points in more than one: {many}");
}

/// Walks through all surfaces and looks between them.
#[test]
fn crossings_keep_the_account() {
    let (solids, geometry) = scene(true);
    let (mut random, mut crossed) = (stream(2), 0);
    for _ in 0..2000 {
        let (from, to) = (point(&mut random), point(&mut random));
        let mut inside = solids.at(&geometry, from);
        let mut ray = Ray::new(from, (to - from).normalize());
        let (mut last, mut clear) = (from, truth(from).is_some());
        while let Some(hit) = geometry.intersect(&ray) {
            let middle = 0.5 * (last + hit.point.p);
            if let (Some(truth), true) = (truth(middle), clear) {
                assert_eq!(shapes(&solids, &inside), truth, "{middle}");
            }
            // Of a ray that grazes two surfaces at once the order is nobody's to say.
            clear &= (hit.point.p - last).length() > 1e-3 && hit.point.ng.dot(ray.dir).abs() > 0.01;
            inside = solids.cross(inside, &hit.point, ray.dir);
            assert_eq!(solids.cross(inside, &hit.point, ray.dir), inside, "twice is once");
            last = hit.point.p;
            ray = hit.point.spawn(ray.dir);
            crossed += 1;
        }
        assert!(!clear || inside == Inside::NOTHING, "out of all: {inside:?}");
    }
    assert!(crossed > 3000, "{crossed}");
}

#[test]
fn the_foremost_says_what_medium_is_there() {
    let (solids, _) = scene(false);
    let medium = |shapes: &[u32]| solids.medium(&among(&solids, shapes));
    assert_eq!(medium(&[]), 9, "the world's");
    assert_eq!((medium(&[1]), medium(&[2, 1])), (0, 1));
    assert_eq!(medium(&[0, 1]), VACUUM, "the glass is in front of the water and has nothing in it");
    assert_eq!(medium(&[0, 3]), 2, "the fog is in front of all");
    assert_eq!(solids.world(), 9);
}

/// What is inside of a foremost refracting solid, or of the same index, is not there for light; what is index-matched
/// never is, and hides nothing.
#[test]
fn hidden_and_matched_boundaries_are_passed() {
    let (solids, _) = scene(false);
    let passed = |shape: u32, inside: &[u32]| {
        let (off, on) = (among(&solids, inside), among(&solids, inside).with(solids.of_shape(shape)));
        let verdict = solids.is_passed(shape, &off);
        assert_eq!(solids.is_passed(shape, &on), verdict, "on either side");
        verdict
    };
    assert!(!passed(1, &[]), "water in air");
    assert!(passed(1, &[0]), "water in glass is hidden");
    assert!(!passed(0, &[1]), "glass in water");
    assert!(passed(2, &[1]), "ice in water, of the same index");
    assert!(passed(1, &[2]), "water in ice");
    assert!(!passed(2, &[]), "ice in air");
    assert!(passed(2, &[0, 1]), "ice in glass, whatever else is there");
    assert!(passed(3, &[]) && passed(3, &[0, 1]), "fog");
    assert!(!passed(1, &[3]) && !passed(0, &[3]), "fog hides nothing");
    assert!(!passed(4, &[]) && !passed(4, &[3]), "a lamp is there");
}

#[test]
fn the_index_outside_is_that_of_the_foremost_refracting_solid_about() {
    let (solids, _) = scene(false);
    let outside = |shape, inside: &[u32]| solids.outside_index(shape, &among(&solids, inside));
    assert_eq!((outside(0, &[]), outside(0, &[0])), (0.0, 0.0), "nothing says it");
    assert_eq!((outside(0, &[1]), outside(0, &[0, 1, 3])), (1.33, 1.33));
    assert_eq!(outside(1, &[0, 2]), 1.5, "glass is in front of ice");
    assert_eq!(outside(1, &[3]), 0.0, "fog has no index");
    // Solids that touch no other need not ask.
    let bounds = sphere(0.0, 1.0).bounds();
    let alone = Solid { shape: 0, surface: GLASS, medium: 0, priority: 0, closed: true, bounds };
    let solids = Solids::new(vec![alone], 1, VACUUM).expect("a solid");
    assert_eq!(solids.outside_index(0, &among(&solids, &[0])), 0.0);
}

/// Water and the ice in it have one index, so that a straight way leads from one to the other; none leads out of glass.
#[test]
fn rooms_are_apart_where_no_straight_way_can_lead() {
    let (mut solids, _) = scene(false);
    let apart = |a: &[u32], b: &[u32]| solids.are_apart(&among(&solids, a), &among(&solids, b));
    assert!(apart(&[0], &[]) && apart(&[], &[0]), "glass and air");
    assert!(apart(&[0, 1], &[1]) && apart(&[0, 3], &[3]), "glass is in front of water; fog is no room");
    assert!(!apart(&[0, 1], &[0]) && !apart(&[0], &[0, 3]), "within the glass");
    assert!(!apart(&[1], &[2]) && !apart(&[1], &[]) && !apart(&[2], &[]), "water and ice are left to a look");
    assert!(!apart(&[4], &[]) && !apart(&[3], &[]), "a lamp and fog refract nothing");
    let dark = |solids: &Solids, at: &[u32]| solids.is_dark(&among(solids, at));
    assert!(!dark(&solids, &[0]), "nothing was said of lights");
    solids.light_up(|bounds| bounds.max.x > 3.0);
    assert!(dark(&solids, &[0]) && dark(&solids, &[0, 1, 3]) && !dark(&solids, &[1]) && !dark(&solids, &[]));
    let (mut solids, _) = scene(false);
    solids.light_up(|_| true);
    assert!(!dark(&solids, &[0]));
    solids.open_up();
    assert!(!solids.are_apart(&among(&solids, &[0]), &Inside::NOTHING));
    // What is open has no inside that one could be sure of, and who passes it has a wrong account elsewhere, too.
    let ball = |shape: u32, closed| Solid {
        shape,
        surface: GLASS,
        medium: 0,
        priority: 0,
        closed,
        bounds: sphere(3.0 * shape as f32, 1.0).bounds(),
    };
    for (closed, apart) in [([true, true], true), ([true, false], false), ([false, true], false)] {
        let both = vec![ball(0, closed[0]), ball(1, closed[1])];
        let mut solids = Solids::new(both, 2, VACUUM).expect("solids");
        solids.light_up(|_| false);
        for inside in [0, 1].map(|shape| among(&solids, &[shape])) {
            assert_eq!(solids.are_apart(&inside, &Inside::NOTHING), apart, "{closed:?}");
            assert_eq!(solids.is_dark(&inside), apart, "{closed:?}");
        }
    }
    // More than an account can hold.
    let many = |count: u32| {
        let fog = |shape: u32| Solid { shape, surface: Surface::Matched, priority: 9, ..ball(0, true) };
        let solids: Vec<Solid> = std::iter::once(ball(0, true)).chain((1..count).map(fog)).collect();
        Solids::new(solids, count as usize, VACUUM).expect("solids")
    };
    for (count, apart) in [(Inside::DEPTH as u32, true), (Inside::DEPTH as u32 + 1, false)] {
        let solids = many(count);
        assert_eq!(solids.are_apart(&among(&solids, &[0]), &Inside::NOTHING), apart, "{count}");
    }
}

#[test]
fn a_box_is_within_what_no_surface_of_it_crosses() {
    let (solids, geometry) = scene(false);
    let cube = |x: f32, half: f32| {
        let middle = Vec3A::new(x, 0.0, 0.0);
        Aabb::of([middle - half, middle + half])
    };
    let within = |x: f32, half: f32, shape| {
        solids.within(&geometry, &cube(x, half), shape).map(|i| shapes(&solids, &i))
    };
    assert_eq!(within(0.0, 0.1, None), Some(vec![0]));
    assert_eq!(within(1.5, 0.05, None), Some(vec![1]));
    assert_eq!(within(3.0, 0.2, None), Some(vec![]));
    assert_eq!(within(1.0, 0.1, None), None, "across the glass");
    // The lamp's own surface is no obstacle, and it is not in itself.
    assert_eq!(within(4.0, 0.3, Some(4)), Some(vec![]));
    assert_eq!(within(4.0, 0.3, None), None);
}

#[test]
fn equals_are_ordered_by_size_and_then_by_place() {
    let solid = |shape, radius, priority| Solid {
        shape,
        surface: Surface::Matched,
        medium: shape,
        priority,
        closed: true,
        bounds: sphere(0.0, radius).bounds(),
    };
    let order = |list: Vec<Solid>| {
        let n = list.len();
        Solids::new(list, n, VACUUM).expect("solids").all().iter().map(|s| s.shape).collect::<Vec<_>>()
    };
    assert_eq!(order(vec![solid(0, 2.0, 0), solid(1, 1.0, 0)]), [1, 0], "the smaller");
    assert_eq!(order(vec![solid(0, 1.0, 0), solid(1, 1.0, 0)]), [1, 0], "the later");
    assert_eq!(order(vec![solid(0, 2.0, 1), solid(1, 1.0, 0), solid(2, 0.5, -1)]), [0, 1, 2], "the priority");
}
