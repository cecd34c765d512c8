//! The proxy against closed forms: stored power, furnace, integrating sphere, sheets and walls; and
//! need by need.

use std::f32::consts::PI;

use glam::Vec3;
use nearfar::accel::Backend;
use nearfar::length::Length;
use nearfar::math::Ray;
use nearfar::proxy::{
    Estimate, Facet, Landing, Need, Photon, Proxy, ProxyInputs, ProxySettings, photons,
};
use nearfar::radiometry::Rgb;
use nearfar::run::Run;
use nearfar::scene::{Light, Material, Mesh, Scene, Sides};
use nearfar::shading::World;
use nearfar::tessellate::Side;

/// Parallelograms (corner, edge1, edge2), front along edge1 × edge2, all of material `material`.
pub(crate) fn quads(list: &[(Vec3, Vec3, Vec3)], material: u32, sides: Sides) -> Mesh {
    let positions = list.iter().flat_map(|&(c, a, b)| [c, c + a, c + a + b, c + b]).collect();
    let triangles: Vec<[u32; 3]> = (0..list.len() as u32)
        .flat_map(|i| [[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]])
        .collect();
    Mesh {
        positions,
        materials: vec![material; triangles.len()],
        triangles,
        sides,
        ..Mesh::default()
    }
}

/// The six walls of a box with corners `low` and `high`, fronts inwards.
pub(crate) fn room(low: Vec3, high: Vec3) -> Vec<(Vec3, Vec3, Vec3)> {
    let d = high - low;
    let (x, y, z) = (Vec3::X * d.x, Vec3::Y * d.y, Vec3::Z * d.z);
    vec![(low, x, y), (low, y, z), (low, z, x), (high, -y, -x), (high, -z, -y), (high, -x, -z)]
}

pub(crate) fn gray(albedo: f32) -> Material {
    Material { albedo: Rgb::splat(albedo), ..Material::default() }
}

fn world(meshes: Vec<Mesh>, materials: Vec<Material>, lights: Vec<Light>) -> World {
    World::new(
        &Scene { meshes, materials, lights, ..Scene::default() },
        Backend::Bvh,
        &Run::new(2).unwrap(),
    )
    .unwrap()
}

pub(crate) fn solved(
    world: &World,
    near_cell: f32,
    settings: &ProxySettings,
    threads: usize,
) -> Proxy {
    let inputs = ProxyInputs { near_cell, settings, seed: 7 };
    let views = std::slice::from_ref(&world.camera);
    Proxy::new(world, inputs, Need::Views(views), &Run::new(threads).unwrap()).unwrap()
}

/// Area-weighted mean over the facets of the indirect irradiance on `side`.
pub(crate) fn mean_indirect(proxy: &Proxy, side: Side) -> Rgb {
    let (mut sum, mut area) = (Rgb::ZERO, 0.0);
    for f in proxy.facets() {
        sum += f.indirect_of(side) * f.area();
        area += f.area();
    }
    sum / area
}

fn few(count: u32) -> ProxySettings {
    ProxySettings {
        photons: count,
        direct_samples: 4,
        estimate: Some(Estimate::Cells),
        ..ProxySettings::default()
    }
}

const BOTH: [Estimate; 2] = [Estimate::Cells, Estimate::Density];

#[test]
fn stored_power_is_the_albedo_series() {
    let albedo = Rgb::new(0.7, 0.5, 0.2);
    let walls = quads(&room(Vec3::ZERO, Vec3::new(1.0, 2.0, 1.5)), 0, Sides::One);
    let lamp =
        Light::Point { position: Vec3::new(0.3, 1.2, 0.8), intensity: Rgb::new(1.0, 2.0, 3.0) };
    let w = world(vec![walls], vec![Material { albedo, ..Material::default() }], vec![lamp]);
    let count = 1 << 16;
    let settings = few(count);
    let inputs = ProxyInputs { near_cell: 0.3, settings: &settings, seed: 3 };
    let traced = photons(&w, inputs, &Run::new(2).unwrap()).unwrap();
    let emitted = Rgb::new(1.0, 2.0, 3.0) * (4.0 * PI);
    assert!(((traced.emitted_flux / emitted) - Rgb::ONE).abs().max_element() < 1e-3);
    let stored: Rgb = traced.photons.iter().map(|p| p.flux).sum();
    // Direct light is not stored: ρ + ρ² + … Roulette by the brightest channel leaves per path a
    // deviation of a few times its mean.
    let expected = emitted * albedo / (Rgb::ONE - albedo);
    assert!(
        (stored / expected - Rgb::ONE).abs().max_element() < 4.0 * 2.0 / (count as f32).sqrt(),
        "{stored} {expected}"
    );
    assert!(traced.photons.iter().all(|p| p.side() == Side::Front));
    let facets: Vec<Facet> = solved(&w, 0.3, &settings, 2).facets().collect();
    let normal = |p: &Photon| facets[p.piece().number() as usize].normal();
    assert!(traced.photons.iter().all(|p| p.incident.dot(normal(p)) < 0.0));
    let energy: f64 = traced.photons.iter().map(|p| f64::from(p.flux.x)).sum();
    for estimate in BOTH {
        let proxy = solved(&w, 0.3, &ProxySettings { estimate: Some(estimate), ..few(count) }, 2);
        let area: f32 = proxy.facets().map(|f| f.area()).sum();
        let found = mean_indirect(&proxy, Side::Front).x * area;
        assert!(
            (f64::from(found) / energy - 1.0).abs() < 0.02,
            "{estimate:?}: {found} W of {energy} W"
        );
        let sides = proxy.stats().sides;
        assert_eq!(sides, proxy.facet_count(), "backs of a closed room are skipped");
    }
}

#[test]
fn furnace() {
    let (le, albedo) = (2.0, 0.6);
    let walls = quads(&room(Vec3::ZERO, Vec3::ONE), 0, Sides::One);
    let w =
        world(vec![walls], vec![Material { emission: Rgb::splat(le), ..gray(albedo) }], Vec::new());
    for estimate in BOTH {
        let proxy = solved(
            &w,
            0.2,
            &ProxySettings {
                estimate: Some(estimate),
                neighbours: 200,
                direct_samples: 64,
                ..few(1 << 17)
            },
            2,
        );
        // E = πLe/(1 − ρ), of which πLe is direct; emission itself is left out.
        let expected = PI * le / (1.0 - albedo);
        let mean = proxy.facets().map(|f| f.radiosity_of(Side::Front).x).sum::<f32>()
            / proxy.facet_count() as f32;
        let indirect = mean_indirect(&proxy, Side::Front).x;
        assert!(
            (indirect / (albedo * expected) - 1.0).abs() < 0.01,
            "{estimate:?}: indirect {indirect}"
        );
        // Direct light of emitters that touch the lit wall has a heavy tail (1/d² at the corner):
        // its mean over 57 000 rays is good to 3 %.
        assert!((mean / (albedo * expected) - 1.0).abs() < 0.03, "{estimate:?}: {mean}");
        for f in proxy.facets() {
            // 5 deviations of about 1/√200 on the indirect part.
            assert!(
                (f.indirect_of(Side::Front).x / (expected * albedo) - 1.0).abs()
                    < 5.0 / 200f32.sqrt(),
                "{estimate:?}"
            );
            assert_eq!(f.radiosity_of(Side::Back), Rgb::ZERO);
        }
    }
}

/// A sphere of `n` × 2n quads seen from inside.
pub(crate) fn hollow_sphere(n: u32, radius: f32) -> Mesh {
    let point = |i: u32, j: u32| {
        let (t, p) = (PI * i as f32 / n as f32, PI * j as f32 / n as f32);
        Vec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos()) * radius
    };
    let mut positions = Vec::new();
    for i in 0..n {
        for j in 0..2 * n {
            let [a, b, c, d] = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
            positions.extend(if i > 0 { vec![a, d, c] } else { vec![] });
            positions.extend(if i + 1 < n { vec![a, c, b] } else { vec![] });
        }
    }
    let count = positions.len() as u32 / 3;
    Mesh {
        positions,
        triangles: (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        materials: vec![0; count as usize],
        sides: Sides::One,
        ..Mesh::default()
    }
}

#[test]
fn integrating_sphere() {
    // method.md I.10: the indirect irradiance is the same everywhere. The lamp is off centre.
    let (albedo, radius, intensity) = (0.75, 2.0, 3.0);
    let lamp =
        Light::Point { position: Vec3::new(0.7, -0.4, 0.9), intensity: Rgb::splat(intensity) };
    let w = world(vec![hollow_sphere(24, radius)], vec![gray(albedo)], vec![lamp]);
    let expected = albedo * intensity / (radius * radius * (1.0 - albedo));
    for estimate in BOTH {
        let proxy = solved(
            &w,
            0.5,
            &ProxySettings { estimate: Some(estimate), neighbours: 100, ..few(40_000) },
            2,
        );
        let mean = mean_indirect(&proxy, Side::Front).x;
        // The polyhedron's area is 0.6 % below the sphere's; noise of 40 000 paths about 0.5 %.
        assert!((mean / expected - 1.0).abs() < 0.02, "{estimate:?}: {mean} {expected}");
        for f in proxy.facets() {
            assert!(
                (f.indirect_of(Side::Front).x / expected - 1.0).abs() < 0.5,
                "{estimate:?}: {}",
                f.indirect_of(Side::Front)
            );
        }
    }
}

#[test]
fn thin_wall_and_sheet_do_not_leak() {
    // Two rooms and between them one sheet without thickness; the lamp is in the first.
    let mut walls = room(Vec3::ZERO, Vec3::new(2.0, 1.0, 1.0));
    walls.push((Vec3::X, Vec3::Y, Vec3::Z));
    let lamp = Light::Point { position: Vec3::new(0.5, 0.6, 0.4), intensity: Rgb::ONE };
    let w = world(vec![quads(&walls, 0, Sides::Two)], vec![gray(0.7)], vec![lamp]);
    for estimate in BOTH {
        let proxy = solved(
            &w,
            0.1,
            &ProxySettings {
                estimate: Some(estimate),
                neighbours: 200,
                max_radius: Length::Percent(20.0),
                ..few(20_000)
            },
            2,
        );
        let mut lit = 0;
        for f in proxy.facets() {
            let n = f.normal();
            for (side, sign) in [(Side::Front, 1.0), (Side::Back, -1.0)] {
                // The room that this side faces.
                let p = f.centroid + n * (sign * 0.01);
                let inside = p.cmpgt(Vec3::ZERO).all() && p.cmplt(Vec3::new(2.0, 1.0, 1.0)).all();
                if !inside {
                    assert_eq!(f.radiosity_of(side), Rgb::ZERO, "outside is dark");
                } else if n.x.abs() > 0.5 || !(0.9..1.5).contains(&p.x) {
                    assert_eq!(
                        f.radiosity_of(side).x > 0.0,
                        p.x < 1.0,
                        "{estimate:?}: side {side:?} at {p}"
                    );
                    lit += i32::from(p.x < 1.0);
                }
            }
        }
        assert!(lit > 100);
    }
}

#[test]
fn sky_is_indirect_and_lights_both_sides() {
    let sheet = quads(&[(Vec3::ZERO, Vec3::X, Vec3::Y)], 0, Sides::Two);
    let w =
        world(vec![sheet], vec![gray(0.5)], vec![Light::Sky { radiance: Rgb::new(1.0, 2.0, 4.0) }]);
    for estimate in BOTH {
        let proxy = solved(
            &w,
            0.1,
            &ProxySettings {
                estimate: Some(estimate),
                max_radius: Length::Percent(50.0),
                ..few(1 << 16)
            },
            2,
        );
        for side in [Side::Front, Side::Back] {
            let e = mean_indirect(&proxy, side) / Rgb::new(1.0, 2.0, 4.0) / PI;
            assert!((e - Rgb::ONE).abs().max_element() < 0.03, "{estimate:?} {side:?}: {e}");
        }
        let f = proxy.facet(proxy.facet_count() as u32 / 2);
        assert!(
            (f.radiosity_of(Side::Front) - f.indirect_of(Side::Front) * 0.5).length() < 1e-5,
            "no direct light from the sky"
        );
    }
}

#[test]
fn direct_light_is_exact() {
    // method.md I.1 at a small cell below the lamp's corner.
    let (a, b, h, size) = (1.3, 0.7, 0.9, 0.01);
    let floor = quads(
        &[(Vec3::new(-size, -size, 0.0), Vec3::X * 2.0 * size, Vec3::Y * 2.0 * size)],
        0,
        Sides::Two,
    );
    let lamp = Light::Quad {
        corner: Vec3::new(0.0, 0.0, h),
        edge1: Vec3::Y * b,
        edge2: Vec3::X * a,
        radiance: Rgb::new(1.0, 2.0, 3.0),
    };
    let w = world(vec![floor], vec![gray(0.5)], vec![lamp]);
    let proxy = solved(&w, 1.0, &ProxySettings { direct_samples: 4096, ..few(1000) }, 1);
    let f = proxy.facet(0);
    let mean = (f.radiosity_of(Side::Front) + proxy.facet(1).radiosity_of(Side::Front)) / 2.0;
    let expected = Rgb::new(1.0, 2.0, 3.0) * (0.5 * PI * 0.137_671_753);
    assert!((mean / expected - Rgb::ONE).abs().max_element() < 2e-3, "{mean} {expected}");
    assert_eq!(f.radiosity_of(Side::Back), Rgb::ZERO);
}

#[test]
fn same_bits_for_any_thread_count() {
    let lights = vec![
        Light::Point { position: Vec3::new(0.5, 0.6, 0.4), intensity: Rgb::ONE },
        Light::Quad {
            corner: Vec3::splat(0.9),
            edge1: -Vec3::X * 0.3,
            edge2: -Vec3::Z * 0.3,
            radiance: Rgb::ONE,
        },
    ];
    let w =
        world(vec![quads(&room(Vec3::ZERO, Vec3::ONE), 0, Sides::One)], vec![gray(0.6)], lights);
    for estimate in BOTH {
        let settings = ProxySettings { estimate: Some(estimate), ..few(20_000) };
        let one = solved(&w, 0.05, &settings, 1);
        for threads in [2, 8] {
            let other = solved(&w, 0.05, &settings, threads);
            assert!(
                one.saved() == other.saved() && one.stats() == other.stats(),
                "{estimate:?} on {threads} threads"
            );
        }
    }
}

#[test]
fn interruption_is_an_error() {
    let w = world(
        vec![quads(&room(Vec3::ZERO, Vec3::ONE), 0, Sides::One)],
        vec![gray(0.6)],
        Vec::new(),
    );
    #[derive(Debug)]
    struct Quiet;
    impl nearfar::run::Reporter for Quiet {
        fn begin(&self, _: &str, _: u64) {}
        fn advance(&self, _: u64) {}
        fn end(&self) {}
        fn warn(&self, _: &str) {}
    }
    let run = Run::new(1).unwrap().with_reporter(Box::new(Quiet), std::sync::Arc::new(true.into()));
    let settings = ProxySettings { estimate: Some(Estimate::Gather), ..ProxySettings::default() };
    let inputs = ProxyInputs { near_cell: 0.5, settings: &settings, seed: 1 };
    let made = Proxy::new(&w, inputs, Need::Views(&[]), &run);
    assert!(matches!(made, Err(nearfar::error::Error::Interrupted)));
}

#[test]
fn need_by_landings_makes_light_where_rays_landed_and_keeps_what_was() {
    // Two closed rooms without a way between them, a lamp in each.
    let mut walls = room(Vec3::ZERO, Vec3::ONE);
    walls.extend(room(Vec3::X * 2.0, Vec3::new(3.0, 1.0, 1.0)));
    let lamp = |x| Light::Point { position: Vec3::new(x, 0.6, 0.4), intensity: Rgb::ONE };
    let lamps = vec![lamp(0.5), lamp(2.5)];
    let mut w = world(vec![quads(&walls, 0, Sides::One)], vec![gray(0.5)], lamps);
    // Wherever the camera is, both rooms get cells of the same size.
    w.around.extent = w.diagonal;
    let run = Run::new(2).unwrap();
    let landings = |x: f32| -> Vec<Landing> {
        [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z]
            .map(|d| Ray::new(Vec3::new(x, 0.45, 0.55), d + Vec3::new(0.1, 0.2, 0.3)))
            .iter()
            .map(|ray| Landing::new(&w, ray, &w.rays.closest(ray).unwrap()))
            .collect()
    };
    let (first, second) = (landings(0.5), landings(2.5));
    let estimate = Some(Estimate::Gather);
    let settings =
        ProxySettings { photons: 1000, gather_rays: 256, estimate, ..ProxySettings::default() };
    let inputs = ProxyInputs { near_cell: 0.2, settings: &settings, seed: 7 };
    let mut proxy = Proxy::new(&w, inputs, Need::Landings(&first), &run).unwrap();
    let gathered = |proxy: &Proxy| {
        let half = proxy.facet_count() / 2;
        let flags: Vec<bool> = proxy.saved().rows().map(|(_, flags)| flags[0] & 1 != 0).collect();
        [&flags[..half], &flags[half..]].map(|f| f.iter().filter(|&&f| f).count())
    };
    let before = gathered(&proxy);
    assert!(before[0] > 100 && before[1] == 0, "{before:?}");
    let read = |proxy: &Proxy, all: &[Landing]| -> Vec<Rgb> {
        all.iter().map(|l| proxy.read(&w, l).radiosity).collect()
    };
    let kept = read(&proxy, &first);
    let added = proxy.need(&w, Need::Landings(&second), &run).unwrap();
    let after = gathered(&proxy);
    assert_eq!((after[0], after[1]), (before[0], added.sides), "only the second room is added");
    assert!(read(&proxy, &first) == kept, "what was known stays");
    // The rooms are alike, and so is their light: 256 rays, 8 shadow rays, about 3 % each.
    for (a, b) in kept.iter().zip(read(&proxy, &second)) {
        assert!((a.x / b.x - 1.0).abs() < 0.25, "{a} {b}");
    }
    let again = proxy.need(&w, Need::Landings(&second), &run).unwrap();
    assert_eq!(again.sides, 0, "the same need adds nothing");
}
