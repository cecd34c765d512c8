//! `proxy.estimate = "places"`: integrating sphere, threads, leaks, and the program with it.

use glam::Vec3;
use nearfar::accel::Backend;
use nearfar::math::Ray;
use nearfar::proxy::{Estimate, Landing, Need, Proxy, ProxyInputs, ProxySettings};
use nearfar::radiometry::Rgb;
use nearfar::run::Run;
use nearfar::sampling::{Rng, Stream, sample_uniform_hemisphere};
use nearfar::scene::{Light, Material, Mesh, Scene, Sides};
use nearfar::shading::World;
use rayon::prelude::*;

use crate::proxy::{gray, hollow_sphere, quads, room};
use crate::support::{program, temporary};

const LAMP: Light = Light::Point { position: Vec3::new(0.5, 0.5, 1.8), intensity: Rgb::ONE };

fn places() -> ProxySettings {
    ProxySettings { estimate: Estimate::Places, ..ProxySettings::default() }
}

fn world(meshes: Vec<Mesh>, materials: Vec<Material>, lights: Vec<Light>) -> World {
    let scene = Scene { meshes, materials, lights, ..Scene::default() };
    World::new(&scene, Backend::Bvh, &Run::new(2).unwrap()).unwrap()
}

fn proxy(world: &World, size: f32, settings: &ProxySettings) -> Proxy {
    let inputs = ProxyInputs { near_cell: size, settings, seed: 7 };
    Proxy::new(world, inputs, Need::Landings(&[]), &Run::new(1).unwrap()).unwrap()
}

/// Where rays of all directions from a point land.
fn landings(world: &World, from: Vec3, count: u32) -> Vec<Landing> {
    let mut rng = Rng::new(3, Stream::Test, 0, 0);
    (0..count)
        .filter_map(|i| {
            let wi = sample_uniform_hemisphere(rng.next_2d()) * if i % 2 == 0 { 1.0 } else { -1.0 };
            let ray = Ray::new(from, wi);
            world.rays.closest(&ray).map(|hit| Landing::new(world, &ray, &hit))
        })
        .collect()
}

fn mean(all: impl Iterator<Item = f32>) -> f32 {
    let (sum, count) = all.fold((0.0f64, 0u32), |(s, n), x| (s + f64::from(x), n + 1));
    (sum / f64::from(count.max(1))) as f32
}

/// A lamp in the middle of a white sphere: E_direct = I/r², of which 0.6/(1 − 0.6) is the rest. The
/// sphere's triangles are larger than places in the first case, and smaller in the second.
#[test]
fn integrating_sphere() {
    let lamp = Light::Point { position: Vec3::ZERO, intensity: Rgb::ONE };
    let w = world(vec![hollow_sphere(24, 1.0)], vec![gray(0.6)], vec![lamp]);
    for size in [0.05, 0.5] {
        let p = proxy(&w, size, &ProxySettings { gather_rays: 64, ..places() });
        let all = landings(&w, Vec3::new(0.3, 0.2, 0.1), 2000);
        let indirect = mean(all.iter().map(|l| p.read(&w, l).indirect.x));
        let expected = 0.6 / (1.0 - 0.6);
        assert!((indirect / expected - 1.0).abs() < 0.02, "{size}: {indirect}, not {expected}");
    }
}

/// The same bits whoever asks, in any order, on any number of threads; and again from nothing.
#[test]
fn who_asks_first_decides_nothing() {
    let shell = quads(&room(Vec3::ZERO, Vec3::new(1.0, 1.0, 2.0)), 0, Sides::One);
    let block = quads(&room(Vec3::new(0.4, 0.4, 0.6), Vec3::new(0.43, 0.9, 0.0)), 0, Sides::Two);
    let w = world(vec![shell, block], vec![gray(0.7)], vec![LAMP]);
    let all = landings(&w, Vec3::new(0.5, 0.3, 1.0), 3000);
    let settings = places();
    let bits = |p: &Proxy, l: &Landing| p.read(&w, l).radiosity.to_array().map(f32::to_bits);
    let first = proxy(&w, 0.1, &settings);
    let expected: Vec<_> = all.iter().map(|l| bits(&first, l)).collect();
    for threads in [2, 3, 8] {
        let (p, run) = (proxy(&w, 0.1, &settings), Run::new(threads).unwrap());
        let mut found: Vec<_> = run.install(|| all.par_iter().rev().map(|l| bits(&p, l)).collect());
        found.reverse();
        assert!(found == expected, "{threads} threads");
        assert_eq!(p.place_stats().unwrap().places, first.place_stats().unwrap().places);
    }
}

/// A box without a floor of its own on the floor of a lit room: no light gets in below its walls.
#[test]
fn dark_boxes_stay_dark() {
    for wall in [0.001, 0.01, 0.2] {
        let shell = quads(&room(Vec3::splat(-2.0), Vec3::splat(2.0)), 0, Sides::One);
        let (inner, outer) = (Vec3::splat(0.3), Vec3::splat(0.3 + wall));
        let stand = |half: Vec3| {
            let (low, high) = (-half.with_z(2.0), half.with_z(-2.0 + 2.0 * half.z));
            room(low, high)[1..].to_vec()
        };
        let faces = [stand(inner), stand(outer)].concat();
        let dark = quads(&faces, 0, Sides::Two);
        let lamp = Light::Point { position: Vec3::new(1.5, 1.2, 1.5), intensity: Rgb::splat(30.0) };
        let w = world(vec![shell, dark], vec![gray(0.6)], vec![lamp]);
        let p = proxy(&w, 0.25, &places());
        let mean_from = |at: Vec3| {
            let all = landings(&w, at, 3000);
            mean(all.iter().map(|l| p.read(&w, l).radiosity.x))
        };
        let lit = mean_from(Vec3::new(1.0, 1.0, 0.5));
        let inside = mean_from(Vec3::new(0.0, 0.0, -1.8));
        assert!(lit > 0.1 && inside < 1e-3 * lit, "wall {wall}: {inside} of {lit}");
    }
}

#[test]
fn a_sheet_lit_on_one_side_is_dark_on_the_other() {
    let sheet = quads(&[(Vec3::ZERO, Vec3::X, Vec3::Y)], 0, Sides::Two);
    let w = world(vec![sheet], vec![gray(0.5)], vec![LAMP]);
    let p = proxy(&w, 0.1, &places());
    let read = |z: f32| {
        let ray = Ray::new(Vec3::new(0.4, 0.3, z), -Vec3::Z * z.signum());
        let hit = w.rays.closest(&ray).unwrap();
        p.read(&w, &Landing::new(&w, &ray, &hit)).radiosity.x
    };
    assert!(read(1.0) > 0.01 && read(-1.0) == 0.0);
}

#[test]
fn the_program_renders_with_places() {
    let folder = temporary("places");
    let at = |name: &str| folder.join(name).display().to_string();
    let scene = "scenes/cornell-box/cornell-box.toml";
    let render = |extra: &[&str]| {
        let common = ["render", scene, "--size", "48x48", "-q", "--set", "proxy.estimate=places"];
        program(&[&common, extra].concat())
    };
    let (one, three, json) = (at("one.exr"), at("three.exr"), at("one.json"));
    let made = render(&["-o", &one, "--threads", "1", "--stats", &json]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    assert!(render(&["-o", &three, "--threads", "3"]).status.success());
    let pixels =
        |path: &str| nearfar::film::read_exr(std::path::Path::new(path)).unwrap().rgb("").unwrap();
    assert!(pixels(&one) == pixels(&three));
    let told: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    assert!(told["places"].as_u64().unwrap() > 1000 && told["gather_rays"].as_u64() > Some(1000));
    let refused = render(&["-o", &one, "--set", "decompose.near_visibility=assumed"]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(2) && said.contains("leaves no cells"), "{said}");
    std::fs::remove_dir_all(&folder).unwrap();
}
