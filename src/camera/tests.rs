use super::*;
use crate::math::testing::{Cap, stream};
use glam::Affine3A;

fn settings(lens: Option<Lens>) -> CameraSettings {
    CameraSettings {
        size: UVec2::new(64, 40),
        crop: None,
        fov_axis: FovAxis::Horizontal,
        fov: 70.0,
        to_world: look_at(Vec3A::new(3.0, 1.0, -2.0), Vec3A::new(-0.5, 0.3, 0.4), Vec3A::Y).unwrap(),
        lens,
        near: 0.0,
    }
}

fn cameras() -> [(&'static str, Camera); 2] {
    let lens = Lens { radius: 0.4, focus_distance: 2.5 };
    [
        ("pinhole", Camera::new(&settings(None)).unwrap()),
        ("lens", Camera::new(&settings(Some(lens))).unwrap()),
    ]
}

/// A pixel of the whole frame, uniform.
fn random_pixel(s: &mut crate::math::Stream, size: UVec2) -> UVec2 {
    (s.next_2d() * size.as_vec2()).as_uvec2().min(size - UVec2::ONE)
}

#[test]
fn directions_follow_their_density() {
    for (name, camera) in cameras() {
        // One lens point: u_lens is held while the film is sampled.
        let u_lens = Vec2::new(0.9, 0.3);
        let lens_p = camera.sample_lens(u_lens);
        let cap = Cap { axis: camera.forward(), cos_min: 0.6 };
        let sample = |s: &mut crate::math::Stream| {
            let ray = camera.sample_ray(random_pixel(s, camera.size()), s.next_2d(), u_lens);
            assert_eq!(ray.origin, lens_p);
            let pdf = camera.pdf_direction(lens_p, ray.dir);
            assert!((ray.pdf / pdf - 1.0).abs() < 1e-4, "{name}: {} and {pdf}", ray.pdf);
            Some(ray.dir)
        };
        cap.assert_sampler(name, 400_000, sample, |d| camera.pdf_direction(lens_p, d));
    }
}

#[test]
fn pixel_of_inverts_sample_ray() {
    for (name, camera) in cameras() {
        let mut s = stream(2);
        let mut missed = 0;
        for _ in 0..200_000 {
            let pixel = random_pixel(&mut s, camera.size());
            let u = s.next_2d();
            let ray = camera.sample_ray(pixel, u, s.next_2d());
            let found = camera.pixel_of(ray.origin, ray.dir);
            // Only where the film point lies on a pixel's edge within f32's rounding may the neighbour be found.
            if found != Some(pixel) {
                assert!(u.min(1.0 - u).min_element() < 2e-4, "{name}: {pixel} at {u} found as {found:?}");
                missed += 1;
            }
            assert!(found.is_some(), "{name}: the frame's own rays stay in the frame");
        }
        assert!(missed < 60, "{name}: {missed} rays of 200000");
    }
}

#[test]
fn frame_corners_are_inside() {
    for (name, camera) in cameras() {
        let last = 1.0 - f32::EPSILON / 2.0;
        let far = camera.size() - UVec2::ONE;
        for (pixel, u) in [(UVec2::ZERO, Vec2::ZERO), (far, Vec2::splat(last))] {
            for u_lens in [Vec2::ZERO, Vec2::new(last, 0.5), Vec2::new(0.25, last)] {
                let ray = camera.sample_ray(pixel, u, u_lens);
                assert_eq!(camera.pixel_of(ray.origin, ray.dir), Some(pixel), "{name}");
                assert!(camera.pdf_direction(ray.origin, ray.dir) > 0.0, "{name}");
            }
        }
        assert_eq!(camera.pixel_of(camera.position(), -camera.forward()), None);
        assert_eq!(camera.pdf_direction(camera.position(), -camera.forward()), 0.0);
    }
}

#[test]
fn the_lens_focuses_one_film_point_in_one_point() {
    let [(_, pinhole), (_, lens)] = cameras();
    assert_eq!(pinhole.lens_area(), None);
    assert!((lens.lens_area().unwrap() - PI * 0.16).abs() < 1e-6);
    let mut s = stream(3);
    for _ in 0..1000 {
        let (pixel, u) = (random_pixel(&mut s, lens.size()), s.next_2d());
        let chief = pinhole.sample_ray(pixel, u, Vec2::ZERO);
        let focus = chief.origin + chief.dir * (2.5 / chief.dir.dot(lens.forward()));
        let ray = lens.sample_ray(pixel, u, s.next_2d());
        let hit = ray.origin + ray.dir * (2.5 / ray.dir.dot(lens.forward()));
        assert!(hit.distance(focus) < 1e-5, "{hit} and {focus}");
        let offset = ray.origin - lens.position();
        assert!(offset.length() < 0.4001 && offset.dot(lens.forward()).abs() < 1e-6);
    }
}

#[test]
fn row_zero_is_on_top_and_right_is_right() {
    let mut set = settings(None);
    set.to_world = Affine3A::IDENTITY;
    let camera = Camera::new(&set).unwrap();
    assert_eq!(camera.forward(), -Vec3A::Z);
    let top_right = camera.sample_ray(UVec2::new(63, 0), Vec2::splat(0.5), Vec2::ZERO).dir;
    assert!(top_right.x > 0.0 && top_right.y > 0.0 && top_right.z < 0.0);
    let half = 35f32.to_radians().tan();
    let corner = camera.sample_ray(UVec2::ZERO, Vec2::ZERO, Vec2::ZERO).dir;
    assert!(
        (corner.x / corner.z - half).abs() < 1e-4 && (corner.y / -corner.z - half * 40.0 / 64.0).abs() < 1e-4
    );
    set.fov_axis = FovAxis::Vertical;
    let corner = Camera::new(&set).unwrap().sample_ray(UVec2::ZERO, Vec2::ZERO, Vec2::ZERO).dir;
    assert!(
        (corner.y / -corner.z - half).abs() < 1e-4 && (corner.x / corner.z - half * 64.0 / 40.0).abs() < 1e-4
    );
}

#[test]
fn a_crop_window_changes_no_ray() {
    let lens = Some(Lens { radius: 0.1, focus_distance: 2.0 });
    let full = Camera::new(&settings(lens)).unwrap();
    let window = CropWindow { x0: 10, y0: 5, x1: 30, y1: 40 };
    let crop = Camera::new(&CameraSettings { crop: Some(window), ..settings(lens) }).unwrap();
    assert_eq!((crop.crop(), window.width(), window.height()), (window, 20, 35));
    assert!(window.contains(UVec2::new(10, 5)) && !window.contains(UVec2::new(30, 5)));
    let mut s = stream(4);
    for _ in 0..100 {
        let (pixel, u, v) = (random_pixel(&mut s, full.size()), s.next_2d(), s.next_2d());
        let (a, b) = (full.sample_ray(pixel, u, v), crop.sample_ray(pixel, u, v));
        assert_eq!((a.origin, a.dir, a.pdf), (b.origin, b.dir, b.pdf));
        assert_eq!(full.pdf_direction(a.origin, a.dir), crop.pdf_direction(a.origin, a.dir));
        assert_eq!(full.pixel_of(a.origin, a.dir), crop.pixel_of(a.origin, a.dir));
    }
}

#[test]
fn a_scaled_matrix_is_the_same_camera() {
    let mut scaled = settings(None);
    scaled.to_world.matrix3 *= 3.0;
    let (a, b) = (Camera::new(&settings(None)).unwrap(), Camera::new(&scaled).unwrap());
    let pixel = UVec2::new(5, 6);
    let (ra, rb) = (a.sample_ray(pixel, Vec2::ZERO, Vec2::ZERO), b.sample_ray(pixel, Vec2::ZERO, Vec2::ZERO));
    assert!((ra.dir - rb.dir).length() < 1e-6);
}

#[test]
fn bad_settings_are_refused() {
    let lens = |radius, focus_distance| Some(Lens { radius, focus_distance });
    let window = |x0, y0, x1, y1| Some(CropWindow { x0, y0, x1, y1 });
    let scale = |x, y, z| Affine3A::from_scale(glam::Vec3::new(x, y, z));
    let good = settings(None);
    let bad = [
        CameraSettings { size: UVec2::new(0, 4), ..good.clone() },
        CameraSettings { size: UVec2::new(4, 70_000), ..good.clone() },
        CameraSettings { crop: window(4, 0, 4, 10), ..good.clone() },
        CameraSettings { crop: window(0, 0, 65, 10), ..good.clone() },
        CameraSettings { fov: 0.0, ..good.clone() },
        CameraSettings { fov: 180.0, ..good.clone() },
        CameraSettings { fov: f32::NAN, ..good.clone() },
        CameraSettings { lens: lens(-1.0, 1.0), ..good.clone() },
        CameraSettings { lens: lens(0.1, 0.0), ..good.clone() },
        CameraSettings { lens: lens(0.1, f32::INFINITY), ..good.clone() },
        CameraSettings { to_world: scale(0.0, 1.0, 1.0), ..good.clone() },
        CameraSettings { to_world: scale(1.0, 2.0, 1.0), ..good.clone() },
        CameraSettings { to_world: scale(-1.0, 1.0, 1.0), ..good.clone() },
        CameraSettings { to_world: scale(f32::NAN, 1.0, 1.0), ..good.clone() },
    ];
    for b in bad {
        let message = Camera::new(&b).unwrap_err();
        assert!(message.starts_with("camera: "), "{message}");
    }
    assert!(look_at(Vec3A::ONE, Vec3A::ONE, Vec3A::Y).is_err());
    assert!(look_at(Vec3A::ZERO, Vec3A::Y, Vec3A::Y).is_err());
    assert!(look_at(Vec3A::ZERO, Vec3A::Z, Vec3A::ZERO).is_err());
    assert!(look_at(Vec3A::ZERO, Vec3A::Z, Vec3A::NAN).is_err());
}
