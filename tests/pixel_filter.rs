//! Pixel filters: an edge in the picture is as wide as the filter's density says, for path tracing
//! and camera samples alike.

use glam::{Vec2, Vec3};
use nearfar::accel::Backend;
use nearfar::method::path::{PathSettings, render};
use nearfar::radiometry::Rgb;
use nearfar::record::{RecordSettings, camera_samples};
use nearfar::run::Run;
use nearfar::sampling::FilterShape;
use nearfar::scene::{Camera, Light, Material, Mesh, Scene, Sides};

use crate::support::{grey, quad, world};

/// A glowing card that fills the left of the picture and ends between two pixels, before nothing;
/// the camera looks straight at it.
fn edge() -> Scene {
    let mut card = Mesh { name: "card".into(), sides: Sides::Auto, ..Mesh::default() };
    let x = 0.017;
    quad(
        &mut card,
        [
            Vec3::new(-9.0, -9.0, 0.0),
            Vec3::new(x, -9.0, 0.0),
            Vec3::new(x, 9.0, 0.0),
            Vec3::new(-9.0, 9.0, 0.0),
        ],
        0,
    );
    Scene {
        name: "edge".into(),
        camera: Camera {
            eye: Vec3::Z,
            target: Vec3::ZERO,
            width: 16,
            height: 8,
            ..Camera::default()
        },
        meshes: vec![card],
        materials: vec![Material { emission: Rgb::ONE, ..grey(0.5) }],
        lights: vec![Light::Point { position: Vec3::new(0.0, 0.0, 2.0), intensity: Rgb::ONE }],
        ..Scene::default()
    }
}

fn density(shape: FilterShape, radius: f32, p: Vec2) -> f64 {
    let p = (p / radius).abs();
    let inside = match shape {
        FilterShape::Gaussian => p.length() <= 1.0,
        _ => p.max_element() <= 1.0,
    };
    match shape {
        _ if !inside => 0.0,
        FilterShape::Box => 1.0,
        FilterShape::Tent => f64::from((1.0 - p.x) * (1.0 - p.y)),
        FilterShape::Gaussian => f64::from((-4.5 * p.length_squared()).exp()),
    }
}

/// Share of the filter left of a vertical line `at` pixels right of the pixel's centre.
fn share_left_of(shape: FilterShape, radius: f32, at: f32) -> f64 {
    let n = 400;
    let (mut left, mut all) = (0.0, 0.0);
    for i in 0..n * n {
        let p =
            (Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32 * 2.0 - 1.0) * radius;
        let f = density(shape, radius, p);
        all += f;
        left += if p.x < at { f } else { 0.0 };
    }
    left / all
}

const FILTERS: [(FilterShape, Option<f32>, f32); 4] = [
    (FilterShape::Box, None, 0.5),
    (FilterShape::Box, Some(1.5), 1.5),
    (FilterShape::Tent, None, 1.0),
    (FilterShape::Gaussian, Some(2.0), 2.0),
];

#[test]
fn an_edge_is_as_wide_as_the_filter() {
    let scene = edge();
    let (w, run) = (world(&scene, Backend::Bvh), Run::new(2).unwrap());
    let (line, _) = scene.camera.project(Vec3::new(0.017, 0.0, 0.0)).unwrap();
    assert!(
        (line.x.fract() - 0.5).abs() > 0.05,
        "the edge lies on a centre and tests little: {line}"
    );
    for (filter, filter_radius, radius) in FILTERS {
        let record =
            RecordSettings { spp: 1024, filter, filter_radius, ..RecordSettings::default() };
        let path = PathSettings {
            spp: 1024,
            max_depth: 1,
            filter: record.pixel_filter(),
            ..PathSettings::default()
        };
        let seen = camera_samples(&w, &record, &Default::default(), 1, &run).unwrap();
        let traced = render(&w, &path, 1, &run).unwrap().film.rgb("emission").unwrap();
        for x in 0..16 {
            let expected = share_left_of(filter, radius, line.x - (x as f32 + 0.5));
            let i = 3 * 16 + x;
            for (name, value) in [("path", traced[i].x), ("record", seen.emission[i].x)] {
                assert!(
                    (f64::from(value) - expected).abs() < 0.01,
                    "{name}, {filter:?} {radius}, pixel {x}: {value} for {expected}"
                );
            }
        }
    }
}

#[test]
fn shading_points_carry_all_samples_wherever_they_lie() {
    let scene = edge();
    let (w, run) = (world(&scene, Backend::Bvh), Run::new(2).unwrap());
    for (filter, filter_radius, _) in FILTERS {
        let record = RecordSettings { spp: 16, filter, filter_radius, ..RecordSettings::default() };
        let seen = camera_samples(&w, &record, &Default::default(), 1, &run).unwrap();
        let reflected = seen.reflect(&vec![Rgb::splat(std::f32::consts::PI); seen.points.len()]);
        for (a, b) in reflected.iter().zip(&seen.albedo) {
            assert!((*a - *b).abs().max_element() < 1e-5, "{a} {b}");
        }
        let on_the_card = seen.points.p.iter().all(|p| p.x <= 0.0171);
        assert!(
            on_the_card && seen.points.len() >= 8 * 8,
            "a flat card needs one point a pixel: {}",
            seen.points.len()
        );
        assert!(seen.points.len() <= 8 * 11, "{}", seen.points.len());
    }
}

#[test]
fn the_box_of_half_a_pixel_is_the_default() {
    let scene = edge();
    let (w, run) = (world(&scene, Backend::Bvh), Run::new(2).unwrap());
    let of =
        |record: RecordSettings| camera_samples(&w, &record, &Default::default(), 1, &run).unwrap();
    let (a, b) = (
        of(RecordSettings::default()),
        of(RecordSettings { filter_radius: Some(0.5), ..RecordSettings::default() }),
    );
    assert!(a.direct == b.direct && a.points.p == b.points.p);
    let c = of(RecordSettings { filter: FilterShape::Tent, ..RecordSettings::default() });
    assert!(a.direct != c.direct);
}
