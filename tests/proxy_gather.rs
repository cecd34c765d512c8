//! `photon.estimate = "gather"`: furnace, integrating sphere, dark rooms, buried area, threads.

use std::f32::consts::PI;

use glam::Vec3;
use nearfar::accel::Backend;
use nearfar::length::Length;
use nearfar::math::Frame;
use nearfar::proxy::{Estimate, ProxySettings};
use nearfar::radiometry::Rgb;
use nearfar::run::Run;
use nearfar::sampling::{Rng, Stream, sample_cosine_hemisphere, sample_triangle};
use nearfar::scene::{Camera, Light, Material, Mesh, Scene, Sides};
use nearfar::shading::{Surface, World, direct_irradiance};
use nearfar::tessellate::Side;

use crate::proxy::{gray, hollow_sphere, mean_indirect, quads, room, solved};

/// A world seen by a wide camera at `eye`.
fn world(
    meshes: Vec<Mesh>,
    materials: Vec<Material>,
    lights: Vec<Light>,
    eye: Vec3,
    target: Vec3,
) -> World {
    let camera =
        Camera { eye, target, vfov_deg: 100.0, width: 128, height: 128, ..Camera::default() };
    World::new(
        &Scene { meshes, materials, lights, camera, ..Scene::default() },
        Backend::Bvh,
        &Run::new(2).unwrap(),
    )
    .unwrap()
}

fn gather() -> ProxySettings {
    ProxySettings {
        estimate: Some(Estimate::Gather),
        photons: 2000,
        direct_samples: 16,
        gather_rays: 32,
        ..ProxySettings::default()
    }
}

#[test]
fn furnace() {
    let (le, albedo) = (2.0, 0.6);
    let walls = quads(&room(Vec3::ZERO, Vec3::ONE), 0, Sides::One);
    let w = world(
        vec![walls],
        vec![Material { emission: Rgb::splat(le), ..gray(albedo) }],
        Vec::new(),
        Vec3::splat(0.5),
        Vec3::X,
    );
    let proxy = solved(&w, 0.2, &ProxySettings { direct_samples: 2048, ..gather() }, 2);
    assert_eq!(proxy.stats().gathered, proxy.facet_count(), "everything is seen, backs are not");
    let stats = proxy.stats();
    assert!(stats.residual < 1e-3 && stats.sweeps < gather().gather_sweeps);
    let expected = albedo * PI * le / (1.0 - albedo);
    // Direct light of emitters that touch the lit wall has a heavy tail (1/d² at the edge): it is
    // the noise here, most in the corners.
    let mean = mean_indirect(&proxy, Side::Front).x;
    assert!((mean / expected - 1.0).abs() < 0.02, "{mean} {expected}");
    let mut squares = 0.0;
    for f in proxy.facets() {
        squares +=
            (f.indirect_of(Side::Front).x / expected - 1.0).powi(2) / proxy.facet_count() as f32;
        assert_eq!(f.radiosity_of(Side::Back), Rgb::ZERO);
    }
    assert!(squares.sqrt() < 0.08, "{}", squares.sqrt());
}

#[test]
fn integrating_sphere() {
    let (albedo, radius, intensity) = (0.75, 2.0, 3.0);
    let lamp =
        Light::Point { position: Vec3::new(0.7, -0.4, 0.9), intensity: Rgb::splat(intensity) };
    let w =
        world(vec![hollow_sphere(24, radius)], vec![gray(albedo)], vec![lamp], Vec3::ZERO, Vec3::X);
    let expected = albedo * intensity / (radius * radius * (1.0 - albedo));
    let proxy = solved(&w, 0.5, &gather(), 2);
    assert_eq!(proxy.stats().gathered, proxy.facet_count());
    // The polyhedron's area is 0.6 % below the sphere's.
    let mean = mean_indirect(&proxy, Side::Front).x;
    assert!((mean / expected - 1.0).abs() < 0.012, "{mean} {expected}");
    for f in proxy.facets() {
        assert!(
            (f.indirect_of(Side::Front).x / expected - 1.0).abs() < 0.25,
            "{}",
            f.indirect_of(Side::Front).x / expected
        );
    }
}

#[test]
fn a_dark_room_stays_dark() {
    // Two rooms of their own triangles, between them one sheet without thickness; the lamp is in
    // the first, the camera in the second.
    let mut walls = room(Vec3::ZERO, Vec3::ONE);
    walls.remove(4);
    walls.extend(room(Vec3::X, Vec3::new(2.0, 1.0, 1.0)));
    let lamp = Light::Point { position: Vec3::new(0.5, 0.6, 0.4), intensity: Rgb::ONE };
    for eye in [0.5, 1.5] {
        let w = world(
            vec![quads(&walls, 0, Sides::Two)],
            vec![gray(0.7)],
            vec![lamp.clone()],
            Vec3::new(eye, 0.5, 0.5),
            Vec3::new(eye, 1.0, 0.6),
        );
        let proxy =
            solved(&w, 0.1, &ProxySettings { max_radius: Length::Percent(2.0), ..gather() }, 2);
        let (gathered, all) = (proxy.stats().gathered, proxy.facet_count());
        assert!(gathered * 3 > all, "{gathered} of {all}");
        let mut sums = [0.0; 2];
        for f in proxy.facets() {
            let n = f.normal();
            for (side, sign) in [(Side::Front, 1.0), (Side::Back, -1.0)] {
                let p = f.centroid + n * (sign * 0.01);
                let inside = p.cmpgt(Vec3::ZERO).all() && p.cmplt(Vec3::new(2.0, 1.0, 1.0)).all();
                // Sides that nothing reached are blurred photons: within their radius of the sheet
                // they may borrow from the first room.
                if eye < 1.0 && (1.0..1.2).contains(&p.x) {
                    continue;
                }
                if !inside || p.x > 1.0 {
                    // A start within rounding of the sheet may lie on its wrong side: a ray in 100
                    // 000. Lit sides have about 1.
                    assert!(
                        f.radiosity_of(side).x < 1e-3,
                        "side {side:?} at {p}: {}",
                        f.radiosity_of(side)
                    );
                } else {
                    sums[0] += f.indirect_of(side).x * f.area();
                    sums[1] += f.area();
                }
            }
        }
        assert!(sums[0] > 0.0 && sums[1] > 5.9, "the first room is lit, whether seen or not");
    }
}

/// Indirect irradiance of one path.
fn path(w: &World, start: &Surface, rng: &mut Rng) -> f32 {
    let (mut s, mut beta, mut sum) = (*start, 1.0, 0.0);
    for _ in 0..16 {
        let wi = Frame::from_normal(s.ns).world_from_local(sample_cosine_hemisphere(rng.next_2d()));
        let Some(hit) = w.closest(&s.ray(wi, w.diagonal)) else { break };
        beta *= hit.albedo.x;
        sum += beta
            * direct_irradiance(w, [hit.p, hit.ng, hit.ns], None, 1, &mut |_| {
                (rng.next_f32(), rng.next_2d())
            })
            .0
            .x;
        s = hit;
    }
    sum
}

#[test]
fn buried_area_does_not_dilute() {
    // A box of one cell per triangle stands with its lower half in the floor. The walls are cut
    // small: one radiosity for a wall cell of 0.9 alone makes 5 % here.
    let small = |(corner, a, b): (Vec3, Vec3, Vec3)| {
        let (a, b) = (a / 10.0, b / 10.0);
        (0..100).map(move |i| (corner + a * (i % 10) as f32 + b * (i / 10) as f32, a, b))
    };
    let walls: Vec<_> =
        room(Vec3::ZERO, Vec3::new(2.0, 2.0, 1.5)).into_iter().flat_map(small).collect();
    let (low, high) = (Vec3::new(0.7, 0.8, -0.3), Vec3::new(1.3, 1.4, 0.3));
    let outwards: Vec<_> = room(low, high).into_iter().map(|(c, a, b)| (c, b, a)).collect();
    let meshes = vec![quads(&walls, 0, Sides::One), quads(&outwards, 0, Sides::Two)];
    let lamp = Light::Point { position: Vec3::new(0.4, 0.5, 1.2), intensity: Rgb::ONE };
    let w = world(
        meshes,
        vec![gray(0.6)],
        vec![lamp],
        Vec3::new(0.1, 0.1, 1.0),
        Vec3::new(1.0, 1.0, 0.3),
    );
    let found = [Estimate::Gather, Estimate::Cells].map(|estimate| {
        let (gather_rays, photons, neighbours) = (512, 200_000, 100);
        let settings = ProxySettings {
            estimate: Some(estimate),
            gather_rays,
            photons,
            neighbours,
            ..gather()
        };
        solved(&w, 0.9, &settings, 2)
    });
    let mut rng = Rng::new(4, Stream::Test, 0, 0);
    let (mut sums, mut truth) = ([0.0; 2], 0.0);
    for (i, f) in found[0].facets().enumerate() {
        let triangle = f.triangle;
        if w.geometry.mesh_of[triangle as usize] != 1 || f.normal().z.abs() > 0.5 {
            continue;
        }
        let mut area = 0.0;
        for _ in 0..20_000 {
            let b = sample_triangle(rng.next_2d());
            let a = w.geometry.surface(triangle, b.x, b.y);
            if a.p.z > 0.0 {
                let s = Surface {
                    p: a.p,
                    ng: a.ng,
                    ns: a.ns,
                    albedo: a.albedo,
                    le: Rgb::ZERO,
                    triangle,
                    u: b.x,
                    v: b.y,
                    side: Side::Front,
                };
                truth += f64::from(path(&w, &s, &mut rng));
                area += 1.0;
            }
        }
        for (sum, proxy) in sums.iter_mut().zip(&found) {
            *sum += area * f64::from(proxy.facet(i as u32).indirect_of(Side::Front).x);
        }
    }
    let [gathered, counted] = sums.map(|sum| sum / truth);
    // The gather weighs the visible part by how it is seen, not by area, and the upper part of a
    // side, which is seen more, is brighter: 2.8 % more, with a deviation of 1.0 % between seeds.
    // The truth has 0.9 % for 80 000 paths. 4 deviations of both (docs/records/2026-11-proxy.md).
    assert!((gathered - 1.028).abs() < 0.052, "{gathered}");
    assert!(counted < 0.7, "photons alone see all of it: {counted}");
}

#[test]
fn same_bits_for_any_thread_count() {
    let lights = vec![Light::Point { position: Vec3::new(0.5, 0.6, 0.4), intensity: Rgb::ONE }];
    let w = world(
        vec![quads(&room(Vec3::ZERO, Vec3::ONE), 0, Sides::One)],
        vec![gray(0.6)],
        lights,
        Vec3::splat(0.5),
        Vec3::X,
    );
    let one = solved(&w, 0.05, &gather(), 1);
    assert!(one.stats().gathered > 1000);
    for threads in [2, 8] {
        let other = solved(&w, 0.05, &gather(), threads);
        assert!(one.saved() == other.saved() && one.stats() == other.stats(), "{threads} threads");
    }
}
