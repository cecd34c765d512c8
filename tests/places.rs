//! Light by need: integrating sphere, energy, threads, leaks, what a second need adds, cost.

use glam::Vec3;
use nearfar::accel::Backend;
use nearfar::length::Length;
use nearfar::math::Ray;
use nearfar::proxy::{Estimate, Landing, Need, Proxy, ProxyInputs, ProxySettings, SavedProxy};
use nearfar::radiometry::Rgb;
use nearfar::run::{RayKind, Run};
use nearfar::sampling::{Rng, Stream, sample_cosine_hemisphere, sample_uniform_hemisphere};
use nearfar::scene::{Light, Material, Mesh, Scene, Sides};
use nearfar::shading::World;
use rayon::prelude::*;

use crate::proxy::{gray, hollow_sphere, quads, room};
use crate::support::{Folder, program};

const LAMP: Light = Light::Point { position: Vec3::new(0.5, 0.5, 1.8), intensity: Rgb::ONE };

fn places() -> ProxySettings {
    ProxySettings { estimate: Some(Estimate::Places), ..ProxySettings::default() }
}

fn world(meshes: Vec<Mesh>, materials: Vec<Material>, lights: Vec<Light>) -> World {
    let scene = Scene { meshes, materials, lights, ..Scene::default() };
    World::new(&scene, Backend::Bvh, &Run::new(2).unwrap()).unwrap()
}

/// A proxy for what a few landings need, made on some threads.
fn made(world: &World, settings: &ProxySettings, need: &[Landing], threads: usize) -> Proxy {
    let inputs = ProxyInputs { near_cell: 0.1, settings, seed: 7 };
    Proxy::new(world, inputs, Need::Landings(need), &Run::new(threads).unwrap()).unwrap()
}

fn sized(size: f32) -> ProxySettings {
    ProxySettings { place_size: Some(Length::Units(size)), ..places() }
}

/// Where rays of all directions from a point land.
fn landings(world: &World, from: Vec3, count: u32) -> Vec<Landing> {
    let mut rng = Rng::new(3, Stream::Test, u64::from(from.x.to_bits()), 0);
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

fn mean_of(proxy: &Proxy, world: &World, at: &[Landing]) -> f32 {
    mean(at.iter().map(|l| proxy.read(world, l).radiosity.x))
}

/// A lamp in the middle of a white sphere: E_direct = I/r², of which 0.6/(1 − 0.6) is the rest. Its
/// triangles have places of their own in the first case and share them in the second. What was
/// asked for is known; what was not is found by paths, and comes out the same.
#[test]
fn integrating_sphere() {
    let lamp = Light::Point { position: Vec3::ZERO, intensity: Rgb::ONE };
    let w = world(vec![hollow_sphere(24, 1.0)], vec![gray(0.6)], vec![lamp]);
    let expected = 0.6 / (1.0 - 0.6);
    let all = landings(&w, Vec3::new(0.3, 0.2, 0.1), 4000);
    let (asked, others) = all.split_at(2000);
    for size in [0.05, 0.5] {
        let p = made(&w, &sized(size), asked, 2);
        for at in [asked, others] {
            let indirect = mean(at.iter().map(|l| p.read(&w, l).indirect.x));
            assert!((indirect / expected - 1.0).abs() < 0.02, "{size}: {indirect}, not {expected}");
        }
        let found = p.place_stats().unwrap();
        assert!(found.places > 100 && found.rays.gather > 1000, "{found:?}");
    }
}

/// A lamp behind a wall lights a room by a slit: most rays miss the bright patch. More rays go
/// where light is noisy, and the mean over seeds stays what many rays find.
#[test]
fn rays_by_noise_lose_no_energy() {
    let shell = quads(&room(Vec3::ZERO, Vec3::new(2.0, 1.0, 1.0)), 0, Sides::One);
    let wall = quads(&[(Vec3::new(1.0, 0.15, 0.0), Vec3::Y, Vec3::Z)], 0, Sides::Two);
    let lamp = Light::Point { position: Vec3::new(1.5, 0.1, 0.5), intensity: Rgb::splat(3.0) };
    let w = world(vec![shell, wall], vec![gray(0.5)], vec![lamp]);
    let at = landings(&w, Vec3::new(0.5, 0.6, 0.4), 1500);
    let with = |gather_rays: u32, seed: u64| {
        let settings = ProxySettings { gather_rays, direct_samples: 8, ..sized(0.05) };
        let inputs = ProxyInputs { near_cell: 0.1, settings: &settings, seed };
        let p = Proxy::new(&w, inputs, Need::Landings(&at), &Run::new(2).unwrap()).unwrap();
        mean_of(&p, &w, &at)
    };
    let expected = mean((0..8).map(|seed| with(1024, 99 + seed)));
    let found = mean((0..64).map(|seed| with(16, seed)));
    // The mean of 64 seeds has a standard error of 0.7 %.
    assert!((found / expected - 1.0).abs() < 0.02, "{found}, not {expected}");
}

/// A spot lights less of a ceiling than a place holds: what leaves the ceiling there, and what the
/// floor receives of it, is that of the closed form whatever the seed. The spot's disc lies on the
/// border of two triangles.
#[test]
fn patches_smaller_than_a_place() {
    let (half_angle, height) = (2.0f32, 2.0);
    let square = |z: f32, normal: f32| {
        let corner = Vec3::new(-1.0, -normal, z);
        quads(&[(corner, 2.0 * Vec3::X, 2.0 * normal * Vec3::Y)], (normal < 0.0).into(), Sides::One)
    };
    let lamp = Light::Spot {
        position: Vec3::Z,
        direction: Vec3::Z,
        intensity: Rgb::splat(1000.0),
        inner_deg: half_angle,
        outer_deg: half_angle * 1.001,
    };
    let (black, white) = (gray(0.02), gray(0.8));
    let w = world(vec![square(0.0, 1.0), square(height, -1.0)], vec![black, white], vec![lamp]);
    let leaving = 0.8 * 1000.0 * std::f32::consts::TAU * (1.0 - half_angle.to_radians().cos());
    let asked = landings(&w, Vec3::new(0.1, 0.2, 0.3), 120_000);
    let mut rng = Rng::new(5, Stream::Test, 0, 0);
    let mut at = |half: f32, wi: Vec3| -> Vec<Landing> {
        let mut one = || {
            let p = ((2.0 * rng.next_2d() - 1.0) * half).extend(1.0);
            let ray = Ray::new(p, wi);
            let landing = Landing::new(&w, &ray, &w.rays.closest(&ray).unwrap());
            Landing { reach: height, ..landing }
        };
        (0..20_000).map(|_| one()).collect()
    };
    let (ceiling, floor) = (at(0.05, Vec3::Z), at(0.9, Vec3::NEG_Z));
    let sent = |l: &Landing| {
        let d2 = l.p.length_squared() + height * height;
        leaving * height * height / (std::f32::consts::PI * d2 * d2)
    };
    let expected = mean(floor.iter().map(sent));
    let mut floors = Vec::new();
    for seed in 0..12 {
        let settings = sized(0.1);
        let inputs = ProxyInputs { near_cell: 0.1, settings: &settings, seed };
        let p = Proxy::new(&w, inputs, Need::Landings(&asked), &Run::new(2).unwrap()).unwrap();
        let up = |l: &Landing| Ray::new(l.p - Vec3::Z, Vec3::Z);
        let found = mean(ceiling.iter().map(|l| p.radiance(&w, &up(l)).x));
        let found = found * std::f32::consts::PI * 0.1 * 0.1;
        assert!((found / leaving - 1.0).abs() < 0.03, "{seed}: {found} leaves, not {leaving}");
        let found = mean(floor.iter().map(|l| p.read(&w, l).indirect.x));
        floors.push(found / expected - 1.0);
    }
    // Rays that are aimed leave 11 %; cosine rays alone 40 %.
    let scatter = mean(floors.iter().map(|x| x * x)).sqrt();
    assert!(scatter < 0.2 && mean(floors.iter().copied()).abs() < 0.12, "{floors:?}");
}

/// The same bits on any number of threads and in any order of reading, from the file too.
#[test]
fn who_asks_first_decides_nothing() {
    let shell = quads(&room(Vec3::ZERO, Vec3::new(1.0, 1.0, 2.0)), 0, Sides::One);
    let block = quads(&room(Vec3::new(0.4, 0.4, 0.6), Vec3::new(0.43, 0.9, 0.0)), 0, Sides::Two);
    let w = world(vec![shell, block], vec![gray(0.7)], vec![LAMP]);
    let all = landings(&w, Vec3::new(0.5, 0.3, 1.0), 3000);
    let (need, settings) = (&all[..2000], sized(0.1));
    let bits = |p: &Proxy, l: &Landing| p.read(&w, l).radiosity.to_array().map(f32::to_bits);
    let first = made(&w, &settings, need, 1);
    let expected: Vec<_> = all.iter().map(|l| bits(&first, l)).collect();
    for threads in [2, 3, 8] {
        let (p, run) = (made(&w, &settings, need, threads), Run::new(threads).unwrap());
        let mut found: Vec<_> = run.install(|| all.par_iter().rev().map(|l| bits(&p, l)).collect());
        found.reverse();
        assert!(found == expected && p.saved() == first.saved(), "{threads} threads");
    }
    let saved = first.saved();
    let rows: Vec<_> = saved.rows().collect();
    let rows = rows.iter().map(|(floats, bytes)| (floats.clone(), &bytes[..]));
    let read = SavedProxy::from_rows(rows, &settings).unwrap();
    assert!(read == saved && read.len() > 300);
    let inputs = ProxyInputs { near_cell: 0.1, settings: &settings, seed: 7 };
    let again = Proxy::restore(&w, inputs, read, &Run::new(1).unwrap()).unwrap();
    assert!(all.iter().map(|l| bits(&again, l)).eq(expected));
}

/// A second need adds what it lacks and changes nothing of the first, bit for bit.
#[test]
fn what_is_known_stays() {
    let w = world(
        vec![quads(&room(Vec3::ZERO, Vec3::new(1.0, 1.0, 2.0)), 0, Sides::One)],
        vec![gray(0.7)],
        vec![LAMP],
    );
    let (near, far) = (Vec3::new(0.5, 0.5, 0.2), Vec3::new(0.2, 0.7, 1.9));
    let (first, second) = (landings(&w, near, 1500), landings(&w, far, 1500));
    let mut p = made(&w, &sized(0.05), &first, 2);
    let (before, run) = (p.saved(), Run::new(2).unwrap());
    let known: Vec<_> = first.iter().map(|l| p.read(&w, l)).collect();
    let added = p.need(&w, Need::Landings(&second), &run).unwrap();
    assert!(added.sides > 50 && p.saved().len() == before.len() + added.sides, "{added:?}");
    assert!(before.rows().zip(p.saved().rows()).all(|(old, new)| old == new));
    assert!(first.iter().zip(known).all(|(l, known)| p.read(&w, l) == known));
    assert_eq!(p.need(&w, Need::Landings(&second), &run).unwrap().sides, 0);
}

/// The light that leaks into the dark, as a share of what is lit: landings around `dark` and `lit`
/// are asked for together.
fn leak(world: &World, size: f32, dark: Vec3, lit: Vec3) -> f32 {
    let [dark, lit] = [dark, lit].map(|from| landings(world, from, 3000));
    let p = made(world, &sized(size), &[&dark[..], &lit[..]].concat(), 2);
    let found = mean_of(&p, world, &lit);
    assert!(found > 0.05, "{found}");
    mean_of(&p, world, &dark) / found
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
        for size in [0.05, 0.25] {
            let found = leak(&w, size, Vec3::new(0.0, 0.0, -1.8), Vec3::new(1.0, 1.0, 0.5));
            assert!(found < 1e-3, "wall {wall}, places of {size}: {found}");
        }
    }
}

/// Two halves of a room, one lit, with a wall between them on one floor and under one ceiling; the
/// wall is a sheet, or a slab thinner than a place.
#[test]
fn a_wall_between_two_halves_holds() {
    for thickness in [0.0, 0.02] {
        let shell = quads(&room(Vec3::ZERO, Vec3::new(2.0, 1.0, 1.0)), 0, Sides::One);
        let side = |x: f32| (Vec3::new(x, 0.0, 0.0), Vec3::Y, Vec3::Z);
        let faces = [side(1.0), side(1.0 + thickness)];
        let wall = quads(&faces[..if thickness > 0.0 { 2 } else { 1 }], 0, Sides::Two);
        let lamp = Light::Point { position: Vec3::new(1.6, 0.5, 0.6), intensity: Rgb::ONE };
        let w = world(vec![shell, wall], vec![gray(0.6)], vec![lamp]);
        for size in [0.05, 0.25] {
            let found = leak(&w, size, Vec3::new(0.5, 0.5, 0.5), Vec3::new(1.5, 0.5, 0.5));
            assert!(found < 1e-3, "{thickness} thick, places of {size}: {found}");
        }
    }
}

/// Sheets of small triangles, one above the other and both facing the lamp: the lower is dark.
#[test]
fn layers_of_small_triangles_are_apart() {
    let sheet = |z: f32| {
        let cell = |i: usize| Vec3::new((i % 40) as f32, (i / 40) as f32, 0.0) * 0.025;
        let at = Vec3::Z * z;
        (0..1600).map(move |i| (cell(i) + at, Vec3::X * 0.025, Vec3::Y * 0.025))
    };
    let faces: Vec<_> = sheet(0.0).chain(sheet(0.02)).collect();
    let lamp = Light::Point { position: Vec3::new(0.5, 0.5, 1.0), intensity: Rgb::ONE };
    let w = world(vec![quads(&faces, 0, Sides::Two)], vec![gray(0.5)], vec![lamp]);
    let between = Vec3::new(0.5, 0.5, 0.01);
    let mut down = landings(&w, between, 3000);
    down.retain(|l| l.p.z < 0.005 && (l.p - between).length() < 0.3);
    let up = landings(&w, Vec3::new(0.5, 0.5, 0.5), 3000);
    let p = made(&w, &sized(0.1), &[&down[..], &up[..]].concat(), 2);
    let (dark, lit) = (mean_of(&p, &w, &down), mean_of(&p, &w, &up));
    assert!(down.len() > 500 && lit > 0.1 && dark < 1e-3 * lit, "{dark} of {lit}");
}

#[test]
fn a_sheet_lit_on_one_side_is_dark_on_the_other() {
    let sheet = quads(&[(Vec3::ZERO, Vec3::X, Vec3::Y)], 0, Sides::Two);
    let w = world(vec![sheet], vec![gray(0.5)], vec![LAMP]);
    let both = [1.0, -1.0].map(|z: f32| {
        let ray = Ray::new(Vec3::new(0.4, 0.3, z), -Vec3::Z * z);
        Landing::new(&w, &ray, &w.rays.closest(&ray).unwrap())
    });
    for need in [&both[..], &both[..1], &[]] {
        let p = made(&w, &sized(0.1), need, 1);
        let [lit, dark] = both.map(|l| p.read(&w, &l).radiosity.x);
        assert!(lit > 0.01 && dark == 0.0, "{lit} {dark}");
    }
}

/// How finely a surface is cut does not decide the work.
#[test]
fn the_cost_does_not_follow_the_triangles() {
    let rays = |cuts: usize| {
        let step = 1.0 / cuts as f32;
        let wall = |(corner, a, b): (Vec3, Vec3, Vec3)| {
            (0..cuts * cuts).map(move |i| {
                let (x, y) = ((i % cuts) as f32 * step, (i / cuts) as f32 * step);
                (corner + a * x + b * y, a * step, b * step)
            })
        };
        let faces: Vec<_> =
            room(Vec3::ZERO, Vec3::new(1.0, 1.0, 2.0)).into_iter().flat_map(wall).collect();
        let w = world(vec![quads(&faces, 0, Sides::One)], vec![gray(0.7)], vec![LAMP]);
        let run = Run::new(2).unwrap();
        let all = landings(&w, Vec3::new(0.5, 0.5, 0.2), 5000);
        let inputs = ProxyInputs { near_cell: 0.1, settings: &sized(0.05), seed: 7 };
        Proxy::new(&w, inputs, Need::Landings(&all), &run).unwrap();
        run.rays.get(RayKind::Sample) + run.rays.get(RayKind::Shadow)
    };
    let (coarse, fine) = (rays(1), rays(80));
    // Near the lamp only places of large triangles ask for more of their direct light.
    assert!((fine as f64 / coarse as f64 - 1.0).abs() < 0.2, "{coarse} and {fine} rays");
}

#[test]
fn the_program_renders_with_places() {
    let folder = Folder::new("places");
    let at = |name: &str| folder.join(name).display().to_string();
    let scene = "scenes/cornell-box/cornell-box.toml";
    let render = |extra: &[&str]| {
        let common = ["render", scene, "--size", "48x48", "-q"];
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
    let number = |key: &str| told[key].as_u64().unwrap();
    assert!(number("places") > 1000 && number("place_gather_rays") > 4 * number("place_parts"));
    assert!(number("place_points") >= number("place_parts"));
    let shown = ["--method", "photon-map", "--set", "proxy.estimate=places", "-o", &one];
    assert!(render(&shown).status.success());
    let film = nearfar::film::read_exr(std::path::Path::new(&one)).unwrap();
    let sum = |channel: &str| film.channels[channel].iter().sum::<f32>();
    assert!(sum("place_size") > 0.0 && sum("place_age") <= 0.0);
    assert!(sum("place_direct.R") > 0.0 && sum("place_indirect.R") > 0.0);
    // Where cells are summed there are cells.
    let cells =
        render(&["-o", &one, "--set", "decompose.near_visibility=assumed", "--stats", &json]);
    assert!(cells.status.success(), "{}", String::from_utf8_lossy(&cells.stderr));
    let refused = ["proxy.estimate=places", "decompose.near_visibility=assumed"];
    let refused = render(&["-o", &one, "--set", refused[0], "--set", refused[1]]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(2) && said.contains("leaves no cells"), "{said}");
}

/// Of leaves that are smaller than a place, the sides away from the lamp stay dark, and so do those
/// that others shade, but for what reflects.
#[test]
fn leaves_are_told_apart() {
    let mut rng = Rng::new(5, Stream::Test, 0, 0);
    let leaf = |_| {
        let normal = sample_uniform_hemisphere(rng.next_2d());
        let (across, along) = normal.any_orthonormal_pair();
        let [x, y] = rng.next_2d().to_array();
        (Vec3::new(x, y, rng.next_f32()), across * 0.05, along * 0.05)
    };
    let leaves: Vec<_> = (0..800).map(leaf).collect();
    let lamp = Light::Point { position: Vec3::new(0.5, 0.5, 9.0), intensity: Rgb::splat(50.0) };
    let w = world(vec![quads(&leaves, 0, Sides::Two)], vec![gray(1e-4)], vec![lamp]);
    let at = landings(&w, Vec3::splat(0.5), 6000);
    let p = made(&w, &sized(0.1), &at, 2);
    let faces = |l: &Landing| {
        let normal = w.geometry.face_normals[l.triangle as usize] * l.side.sign();
        normal.dot((Vec3::new(0.5, 0.5, 9.0) - l.p).normalize())
    };
    let (lit, dark): (Vec<Landing>, Vec<Landing>) = at.iter().partition(|l| faces(l) > 0.0);
    let leak = mean_of(&p, &w, &dark) / mean_of(&p, &w, &lit);
    assert!(lit.len() > 500 && dark.len() > 500 && leak < 1e-3, "{leak}");
}

/// Neighbours share their light: from seed to seed it differs by less than half of what the gather
/// rays of each place alone would leave.
#[test]
fn neighbours_share_what_they_know() {
    let shell = quads(&room(Vec3::ZERO, Vec3::new(2.0, 1.0, 1.0)), 0, Sides::One);
    let wall = quads(&[(Vec3::new(1.0, 0.3, 0.0), Vec3::Y, Vec3::Z)], 0, Sides::Two);
    let lamp = Light::Point { position: Vec3::new(1.5, 0.2, 0.5), intensity: Rgb::splat(3.0) };
    let w = world(vec![shell, wall], vec![gray(0.5)], vec![lamp]);
    let at: Vec<Landing> = landings(&w, Vec3::new(0.5, 0.6, 0.4), 6000)
        .into_iter()
        .filter(|l| l.p.y < 1e-4 && l.p.x < 0.9)
        .collect();
    let with = |gather_rays: u32, seed: u64| {
        let settings = ProxySettings { gather_rays, direct_samples: 64, ..sized(0.04) };
        let inputs = ProxyInputs { near_cell: 0.1, settings: &settings, seed };
        Proxy::new(&w, inputs, Need::Landings(&at), &Run::new(2).unwrap()).unwrap()
    };
    let fine = with(256, 9);
    let mut rng = Rng::new(4, Stream::Test, 1, 0);
    let samples: Vec<f32> = at
        .iter()
        .map(|l| {
            let local = sample_cosine_hemisphere(rng.next_2d());
            let wi = Vec3::new(local.x, local.z, local.y);
            fine.incident(&w, &Ray::new(l.p + Vec3::Y * 1e-5, wi)).radiance.x * std::f32::consts::PI
        })
        .collect();
    let average = mean(samples.iter().copied());
    let variance = mean(samples.iter().map(|x| (x - average) * (x - average)));
    let pair = [1, 2].map(|seed| with(16, seed));
    let found = pair[0].place_stats().unwrap();
    let rays = found.rays.gather as f32 / found.parts as f32;
    let [a, b] = pair.map(|p| at.iter().map(|l| p.read(&w, l).indirect.x).collect::<Vec<f32>>());
    let scatter = mean(a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b))) / 2.0;
    let alone = variance / rays;
    assert!(scatter < 0.25 * alone, "{scatter}, alone {alone}: {rays} rays a place");
}
