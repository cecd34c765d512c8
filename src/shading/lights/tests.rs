use glam::{Vec2, Vec3};

use super::*;
use crate::accel::Backend;
use crate::run::Run;
use crate::sampling::{Rng, Stream};
use crate::shading::World;

fn world(lights: Vec<Light>) -> World {
    // A small distant triangle, so that the scene has bounds.
    let mesh = crate::scene::Mesh {
        positions: vec![
            Vec3::new(0.0, -90.0, 0.0),
            Vec3::new(1.0, -90.0, 0.0),
            Vec3::new(0.0, -90.0, 1.0),
        ],
        triangles: vec![[0, 1, 2]],
        materials: vec![0],
        ..Default::default()
    };
    let scene = Scene {
        meshes: vec![mesh],
        materials: vec![Material::default()],
        lights,
        ..Scene::default()
    };
    World::new(&scene, Backend::Brute, &Run::new(1).unwrap()).unwrap()
}

fn irradiance(world: &World, p: Vec3, n: Vec3, count: u32) -> Rgb {
    let mut rng = Rng::new(1, Stream::Test, 0, 0);
    direct_irradiance(world, [p, n, n], None, count, &mut |_| (rng.next_f32(), rng.next_2d())).0
}

#[test]
fn quad_has_lamberts_form_factor() {
    // method.md I.1: corner above the point, parallel.
    let (a, b, h) = (1.3, 0.7, 0.9);
    let quad = Light::Quad {
        corner: Vec3::new(0.0, 0.0, h),
        edge1: Vec3::new(0.0, b, 0.0),
        edge2: Vec3::new(a, 0.0, 0.0),
        radiance: Rgb::new(1.0, 2.0, 3.0),
    };
    let w = world(vec![quad]);
    let e = irradiance(&w, Vec3::ZERO, Vec3::Z, 100_000);
    assert!(
        (e / std::f32::consts::PI - Rgb::new(1.0, 2.0, 3.0) * 0.137_671_75).length() < 1e-3,
        "{e}"
    );
    assert_eq!(
        irradiance(&w, Vec3::new(0.3, 0.3, 1.5), -Vec3::Z, 100),
        Rgb::ZERO,
        "its back is black"
    );
}

#[test]
fn sphere_is_inverse_square() {
    let w = world(vec![Light::Sphere {
        center: Vec3::new(0.0, 0.0, 3.0),
        radius: 0.5,
        radiance: Rgb::ONE,
    }]);
    for tilt in [0.0f32, 0.7] {
        let n = Vec3::new(tilt.sin(), 0.0, tilt.cos());
        let e = irradiance(&w, Vec3::ZERO, n, 4000).x / std::f32::consts::PI;
        let expected = (0.5f32 / 3.0).powi(2) * tilt.cos();
        // The tessellated sphere of equal area appears about 0.2 % off from a given side.
        assert!((e / expected - 1.0).abs() < 0.01, "{e} {expected}");
    }
}

#[test]
fn sun_point_and_spot() {
    let n = Vec3::Z;
    let to_sun = Vec3::new(0.6, 0.0, 0.8);
    for angular_radius_deg in [0.0, 0.27, 5.0] {
        let w = world(vec![Light::Sun {
            direction_to_sun: to_sun,
            irradiance: Rgb::splat(10.0),
            angular_radius_deg,
        }]);
        assert!((irradiance(&w, Vec3::ZERO, n, 20_000).x - 8.0).abs() < 0.02);
        assert_eq!(w.lights.background(to_sun) == Rgb::ZERO, angular_radius_deg == 0.0);
    }
    let position = Vec3::new(0.0, 0.0, 2.0);
    let w = world(vec![Light::Point { position, intensity: Rgb::splat(8.0) }]);
    assert!((irradiance(&w, Vec3::ZERO, n, 1).x - 2.0).abs() < 1e-5);
    let w = world(vec![Light::Spot {
        position,
        direction: -Vec3::Z,
        intensity: Rgb::splat(8.0),
        inner_deg: 20.0,
        outer_deg: 40.0,
    }]);
    let at = |deg: f32| {
        let p = Vec3::new(2.0 * deg.to_radians().tan(), 0.0, 0.0);
        irradiance(&w, p, (position - p).normalize(), 1).x * position.distance_squared(p) / 8.0
    };
    assert!((at(15.0) - 1.0).abs() < 1e-4 && at(41.0) == 0.0);
    let half =
        ((20.0f32.to_radians().cos() + 40.0f32.to_radians().cos()) * 0.5).acos().to_degrees();
    assert!((at(half) - 0.5).abs() < 1e-3);
}

fn many() -> Vec<Light> {
    let mut rng = Rng::new(3, Stream::Test, 1, 0);
    let mut out: Vec<Light> = (0..100)
        .map(|_| Light::Point {
            position: Vec3::new(
                rng.next_f32() * 8.0 - 4.0,
                rng.next_f32() * 8.0 - 4.0,
                1.0 + rng.next_f32(),
            ),
            intensity: Rgb::splat(rng.next_f32()),
        })
        .collect();
    out.push(Light::Quad {
        corner: Vec3::new(-1.0, -1.0, 2.5),
        edge1: Vec3::Y * 2.0,
        edge2: Vec3::X * 2.0,
        radiance: Rgb::ONE,
    });
    out.push(Light::Sun {
        direction_to_sun: Vec3::new(0.0, 0.6, 0.8),
        irradiance: Rgb::ONE,
        angular_radius_deg: 3.0,
    });
    out
}

#[test]
fn many_lamps_add_up() {
    let lights = many();
    let alone: f32 = lights
        .iter()
        .map(|l| irradiance(&world(vec![l.clone()]), Vec3::ZERO, Vec3::Z, 4000).x)
        .sum();
    let together = irradiance(&world(lights), Vec3::ZERO, Vec3::Z, 200_000).x;
    assert!((together / alone - 1.0).abs() < 0.01, "{together} {alone}");
}

#[test]
fn density_is_that_of_the_samples() {
    let mut lights = many();
    lights.drain(..70);
    lights.push(Light::Sphere {
        center: Vec3::new(1.5, 0.0, 1.2),
        radius: 0.4,
        radiance: Rgb::splat(2.0),
    });
    for lights in [lights, many()] {
        let w = world(lights);
        let mut rng = Rng::new(5, Stream::Test, 0, 0);
        let n = Vec3::new(0.1, -0.2, 1.0).normalize();
        let mut seen = 0;
        for _ in 0..3000 {
            let Some(s) = w.lights.sample(Vec3::ZERO, n, rng.next_f32(), rng.next_2d()) else {
                continue;
            };
            if s.pdf_solid_angle.is_infinite() {
                continue;
            }
            let (pdf, pdf_sun) = (
                w.rays
                    .closest(&Ray::new(Vec3::ZERO, s.wi))
                    .map(|h| w.lights.pdf_solid_angle(Vec3::ZERO, n, s.wi, h.triangle, s.wi * h.t)),
                w.lights.pdf_sun_disc(Vec3::ZERO, n, s.wi),
            );
            let Some(pdf) = pdf.or((pdf_sun > 0.0).then_some(pdf_sun)) else { continue };
            // No light stands before another one here; a cone sample beside the tessellated sphere
            // meets nothing.
            assert!((pdf / s.pdf_solid_angle - 1.0).abs() < 2e-3, "{pdf} {}", s.pdf_solid_angle);
            seen += 1;
        }
        assert!(seen > 200, "{seen}");
    }
}

#[test]
fn density_integrates_to_the_share_of_area_lights() {
    // Uniform directions: ∫ pdf dω over a quad and a sun disc alone in the sky is 1.
    let quad = Light::Quad {
        corner: Vec3::new(-1.0, -1.0, 1.0),
        edge1: Vec3::Y * 2.0,
        edge2: Vec3::X * 2.0,
        radiance: Rgb::ONE,
    };
    let sun = Light::Sun {
        direction_to_sun: Vec3::new(0.8, 0.0, 0.6),
        irradiance: Rgb::ONE,
        angular_radius_deg: 8.0,
    };
    let w = world(vec![quad, sun]);
    let mut rng = Rng::new(6, Stream::Test, 0, 0);
    let (count, mut sum) = (400_000, 0.0f64);
    for _ in 0..count {
        let wi = crate::sampling::sample_uniform_sphere(rng.next_2d());
        let hit = w.rays.closest(&Ray::new(Vec3::ZERO, wi));
        sum += f64::from(
            hit.map_or(0.0, |h| {
                w.lights.pdf_solid_angle(Vec3::ZERO, Vec3::Z, wi, h.triangle, wi * h.t)
            }) + w.lights.pdf_sun_disc(Vec3::ZERO, Vec3::Z, wi),
        );
    }
    let integral = sum / f64::from(count) * 4.0 * std::f64::consts::PI;
    assert!((integral - 1.0).abs() < 0.03, "{integral}");
}

#[test]
fn photons_carry_the_power() {
    let mut lights = many();
    lights.drain(..97);
    lights.push(Light::Sky { radiance: Rgb::splat(0.01) });
    lights.push(Light::Sphere { center: Vec3::X * 6.0, radius: 0.4, radiance: Rgb::splat(50.0) });
    lights.push(Light::Spot {
        position: Vec3::Y,
        direction: Vec3::X,
        intensity: Rgb::splat(80.0),
        inner_deg: 10.0,
        outer_deg: 60.0,
    });
    let w = world(lights);
    let mut rng = Rng::new(7, Stream::Test, 0, 0);
    let n = 100_000;
    let mut sum = 0.0f64;
    for _ in 0..n {
        let photon = w.lights.emit_photon(rng.next_f32(), rng.next_2d(), rng.next_2d()).unwrap();
        assert!((photon.ray.dir.length() - 1.0).abs() < 1e-4 && photon.ray.t_min == 0.0);
        sum += f64::from(photon.flux.x);
    }
    assert!((sum / f64::from(n) / f64::from(w.lights.power().x) - 1.0).abs() < 0.01);
    assert!(world(Vec::new()).lights.emit_photon(0.5, Vec2::ZERO, Vec2::ZERO).is_none());
}

#[test]
fn sky_photons_light_a_plane_evenly() {
    // Flux density of sky photons through a small horizontal window at the centre, from above: π L.
    let w = world(vec![Light::Sky { radiance: Rgb::splat(2.0) }]);
    let c = w.geometry.bounds.center();
    let r = w.geometry.bounds.diagonal() * 0.25;
    let mut rng = Rng::new(8, Stream::Test, 0, 0);
    let n = 200_000;
    let mut sum = 0.0f64;
    for _ in 0..n {
        let photon = w.lights.emit_photon(rng.next_f32(), rng.next_2d(), rng.next_2d()).unwrap();
        let t = (c.y - photon.ray.origin.y) / photon.ray.dir.y;
        if photon.ray.dir.y < 0.0 && t > 0.0 && photon.ray.at(t).distance(c) < r {
            sum += f64::from(photon.flux.x);
        }
    }
    let e = sum / f64::from(n) / (std::f64::consts::PI * f64::from(r * r));
    assert!((e / (2.0 * std::f64::consts::PI) - 1.0).abs() < 0.02, "{e}");
}
