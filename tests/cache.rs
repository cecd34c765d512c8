//! The irradiance cache: furnaces, threads, convergence to the gather, leaks, curved surfaces,
//! files.

use glam::Vec3;
use nearfar::accel::Backend;
use nearfar::compare::{Truth, errors};
use nearfar::method::cache::{
    Cache, CacheRecord, CacheSettings, Mode, fill_and_interpolate, render, store,
};
use nearfar::method::final_gather::{Rays, gather};
use nearfar::method::key::Key;
use nearfar::method::stage::{Inputs, Stage};
use nearfar::proxy::{Proxy, ProxySettings};
use nearfar::radiometry::Rgb;
use nearfar::record::{RecordSettings, camera_samples};
use nearfar::run::Run;
use nearfar::scene::{Camera, Fingerprint, Mesh, Scene, Sides};
use nearfar::shading::{DirectSettings, World};

use crate::proxy::hollow_sphere;
use crate::support::{Folder, backends, cuboid, grey, quad, small_room, world};

const MODES: [Mode; 3] = [Mode::Hessian, Mode::Production2006, Mode::SplitSphere];

fn settings(mode: Mode) -> CacheSettings {
    CacheSettings { mode, rays: 128, ..CacheSettings::default() }
}

/// A stage whose surfaces have the radiosity that `glow` gives their place and normal.
fn stage(w: &World, near_cell: f32, glow: impl Fn(Vec3, Vec3) -> Rgb) -> Stage {
    let proxy = Proxy::given(&w.geometry, near_cell, glow).unwrap();
    let record = RecordSettings { spp: 1, ..RecordSettings::default() };
    let samples =
        camera_samples(w, &record, &DirectSettings::default(), 0, &Run::new(2).unwrap()).unwrap();
    Stage { proxy, samples }
}

fn empty(w: &World, settings: &CacheSettings, stage: &Stage) -> Cache {
    Cache::new(settings, stage.samples.width * stage.samples.height, w)
}

fn cached(w: &World, settings: &CacheSettings, stage: &Stage) -> (Vec<Rgb>, Cache) {
    let mut cache = empty(w, settings, stage);
    let e = fill_and_interpolate(w, settings, stage, &mut cache, 0, &Run::new(2).unwrap()).unwrap();
    (e, cache)
}

fn gathered(w: &World, stage: &Stage, rays: u32) -> Vec<Rgb> {
    gather(w, &stage.proxy, &stage.samples.points, Rays::cosine(rays), 0, &Run::new(2).unwrap())
        .unwrap()
}

fn relative_mse(e: &[Rgb], truth: &[Rgb]) -> f64 {
    errors(e, &Truth::exact(truth.len() as u32, 1, truth)).relmse
}

#[test]
fn furnace() {
    let w = world(&small_room(), Backend::Bvh);
    let stage = stage(&w, 0.2, |_, _| Rgb::new(1.0, 2.0, 0.5));
    for mode in MODES {
        let (e, cache) = cached(&w, &settings(mode), &stage);
        assert!(cache.records.len() > 4 && cache.records.len() < e.len());
        for (e, &ng) in e.iter().zip(&stage.samples.points.ng) {
            // Rounding of the derivatives' sums.
            assert!(
                (*e / Rgb::new(1.0, 2.0, 0.5) - Rgb::ONE).abs().max_element() < 1e-4,
                "{mode:?} {e} {ng}"
            );
        }
    }
}

fn inputs<'a>(
    photon: &'a ProxySettings,
    record: &'a RecordSettings,
    direct: &'a DirectSettings,
) -> Inputs<'a> {
    Inputs { near_cell: 0.15, photon, record, direct, seed: 3 }
}

#[test]
fn same_bits_for_any_thread_count() {
    let (photon, record, direct) = (
        ProxySettings { photons: 5000, ..ProxySettings::default() },
        RecordSettings::default(),
        DirectSettings::default(),
    );
    for backend in backends() {
        let w = world(&small_room(), backend);
        for mode in MODES {
            let picture = |threads| {
                let (rendered, cache) = render(
                    &w,
                    &settings(mode),
                    inputs(&photon, &record, &direct),
                    None,
                    &Run::new(threads).unwrap(),
                )
                .unwrap();
                assert_eq!(rendered.locations.len(), cache.records.len());
                (rendered.film.channels, cache.records)
            };
            let one = picture(1);
            assert!(one.1.len() > 20);
            for threads in [2, 8] {
                assert!(one == picture(threads), "{mode:?} {threads} threads");
            }
        }
    }
}

#[test]
fn error_to_the_gather_falls_with_the_knob() {
    let mut room = small_room();
    (room.camera.width, room.camera.height) = (48, 36);
    falls_to_the_gather(&room, 0.15);
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box/cornell-box.toml");
    let size = [("camera.width", "48"), ("camera.height", "48")]
        .map(|(key, value)| (key.to_owned(), value.to_owned()));
    let cornell = nearfar::load::load(file.as_ref(), &size).unwrap().scene;
    falls_to_the_gather(&cornell, 14.0);
}

/// relMSE of the irradiance to a gather through the same proxy: falls, and ends below 1e-4.
fn falls_to_the_gather(scene: &Scene, near_cell: f32) {
    let w = world(scene, *backends().last().unwrap());
    let photon = ProxySettings { photons: 20_000, ..ProxySettings::default() };
    let stage = Stage::new(
        &w,
        Inputs {
            near_cell,
            ..inputs(
                &photon,
                &RecordSettings { spp: 1, ..RecordSettings::default() },
                &DirectSettings::default(),
            )
        },
        &Run::new(2).unwrap(),
    )
    .unwrap();
    let truth = gathered(&w, &stage, 8192);
    for mode in [Mode::Hessian, Mode::Production2006] {
        let mut found = Vec::new();
        for error in [1.0, 0.2, 0.01] {
            let (e, cache) =
                cached(&w, &CacheSettings { error, rays: 4096, ..settings(mode) }, &stage);
            found.push((relative_mse(&e, &truth), cache.records.len()));
        }
        eprintln!("{mode:?} {found:?}");
        assert!(found.windows(2).all(|f| f[1].0 < f[0].0 && f[1].1 > f[0].1), "{mode:?} {found:?}");
        assert!(found[2].0 < 1e-4, "{mode:?} {found:?}");
    }
}

/// Two rooms of their own walls, between them a sheet without thickness; the first glows.
fn two_rooms(eye: f32) -> Scene {
    let mut mesh = Mesh { sides: Sides::Two, ..Mesh::default() };
    cuboid(&mut mesh, Vec3::ZERO, Vec3::new(2.0, 1.0, 1.0), 0, true);
    quad(
        &mut mesh,
        [Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::new(1.0, 1.0, 1.0), Vec3::new(1.0, 0.0, 1.0)],
        0,
    );
    let camera = Camera {
        eye: Vec3::new(eye, 0.9, 0.5),
        target: Vec3::new(1.0 + 0.2 * (eye - 1.0), 0.0, 0.5),
        up: Vec3::Z,
        vfov_deg: 90.0,
        width: 40,
        height: 40,
    };
    Scene { camera, meshes: vec![mesh], materials: vec![grey(0.7)], ..Scene::default() }
}

#[test]
fn records_do_not_leak_through_a_sheet() {
    for mode in MODES {
        let s = CacheSettings { rays: 512, ..settings(mode) };
        let bright = |p: Vec3, n: Vec3| {
            if p.x < 0.999 || (p.x < 1.001 && n.x < 0.0) { Rgb::ONE } else { Rgb::ZERO }
        };
        let w = world(&two_rooms(0.3), Backend::Bvh);
        let lit = stage(&w, 0.25, bright);
        let (e, first) = cached(&w, &s, &lit);
        assert!(e.iter().all(|e| (e.x - 1.0).abs() < 1e-3), "the first room is a furnace");
        let dark_world = world(&two_rooms(1.7), Backend::Bvh);
        let dark = stage(&dark_world, 0.25, bright);
        let mut cache = empty(&dark_world, &s, &dark);
        first.records.iter().for_each(|&record| cache.insert(record, None));
        let e = fill_and_interpolate(&dark_world, &s, &dark, &mut cache, 0, &Run::new(2).unwrap())
            .unwrap();
        let worst = e.iter().map(|e| e.x).fold(0.0, f32::max);
        let leaking = e.iter().filter(|e| e.x > 1e-3).count();
        eprintln!("{mode:?}: worst {worst}, {leaking} of {}", e.len());
        // A record within a radius of the sheet leaks in the modes without the guard; the guard
        // stops it.
        if mode == Mode::Hessian {
            assert_eq!(leaking, 0, "worst {worst}");
        }
        assert!(leaking * 20 < e.len(), "{mode:?} {leaking}");
    }
}

#[test]
fn curved_surfaces() {
    let mut ball = hollow_sphere(48, 1.0);
    // Smooth normals: positions of a sphere about the origin, seen from within.
    ball.normals = Vec::new();
    let scene = Scene {
        camera: Camera {
            eye: Vec3::new(0.0, -0.6, 0.0),
            target: Vec3::Y,
            up: Vec3::Z,
            vfov_deg: 80.0,
            width: 40,
            height: 40,
        },
        meshes: vec![ball],
        materials: vec![grey(0.5)],
        ..Scene::default()
    };
    let w = world(&scene, Backend::Bvh);
    let stage = stage(&w, 0.3, |p, _| Rgb::splat(if p.z > 0.0 { 1.0 } else { 0.2 }));
    // Inside a sphere the irradiance is the same everywhere.
    for mode in [Mode::Hessian, Mode::Production2006] {
        let (e, cache) = cached(&w, &CacheSettings { rays: 1024, ..settings(mode) }, &stage);
        assert!(
            cache.records.len() < e.len(),
            "{mode:?}: {} records for {} points",
            cache.records.len(),
            e.len()
        );
        let error = relative_mse(&e, &gathered(&w, &stage, 1024));
        // Noise of 1024 rays to either side.
        assert!(error < 1e-3, "{mode:?} {error}");
    }
}

#[test]
fn saved_records_are_reused() {
    let folder = Folder::new("cache-reuse");
    let file = folder.join("room.ply");
    let (photon, record, direct) = (
        ProxySettings { photons: 5000, ..ProxySettings::default() },
        RecordSettings::default(),
        DirectSettings::default(),
    );
    for mode in MODES {
        // A value that a careless way through text would not bring back bit for bit.
        let (scene, s) = (small_room(), CacheSettings { error: 0.051, ..settings(mode) });
        let w = world(&scene, Backend::Bvh);
        let input = inputs(&photon, &record, &direct);
        let run = Run::new(2).unwrap();
        let key = store::key(Fingerprint::new(&scene), &input, &s, &w);
        let (first, cache) = render(&w, &s, input, None, &run).unwrap();
        store::save(&file, &key, &cache.records).unwrap();
        let loaded = store::load(&file, &key).unwrap();
        assert_eq!(loaded, cache.records);
        let (again, cache_again) = render(&w, &s, input, Some(loaded.clone()), &run).unwrap();
        assert_eq!(cache_again.records.len(), cache.records.len(), "{mode:?}: no new record");
        assert!(again.film.rgb("") == first.film.rgb(""), "{mode:?}");

        let mut aside = scene.clone();
        aside.camera.eye.x += 0.05;
        let w = world(&aside, Backend::Bvh);
        let of_aside = store::key(Fingerprint::new(&aside), &input, &s, &w);
        assert_eq!(of_aside.difference(&key.comments()), None, "another camera, the same scene");
        let (_, extended) = render(&w, &s, input, Some(loaded), &run).unwrap();
        let (new, alone) = (extended.records.len() - cache.records.len(), cache.records.len());
        assert!(new * 2 < alone, "{mode:?}: {new} new, {alone} loaded");
    }
}

#[test]
fn broken_and_foreign_files_are_refused() {
    let folder = Folder::new("cache-broken");
    let file = folder.join("c.ply");
    let (photon, record, direct) =
        (ProxySettings::default(), RecordSettings::default(), DirectSettings::default());
    let scene = small_room();
    let w = world(&scene, Backend::Bvh);
    let s = settings(Mode::Hessian);
    let key = |scene: &Scene, s: &CacheSettings| {
        store::key(Fingerprint::new(scene), &inputs(&photon, &record, &direct), s, &w)
    };
    let (_, cache) = cached(&w, &s, &stage(&w, 0.3, |_, _| Rgb::ONE));
    let records: Vec<CacheRecord> = cache.records.iter().copied().take(50).collect();
    let refused = |key: &Key, expected: &str| {
        let error = store::load(&file, key).unwrap_err().to_string();
        assert!(error.contains("c.ply") && error.contains(expected), "{error}");
    };
    let own = key(&scene, &s);
    store::save(&file, &own, &records).unwrap();
    let good = std::fs::read(&file).unwrap();

    let mut other = scene.clone();
    other.materials[0].albedo.x += 0.1;
    refused(&key(&other, &s), "another scene: its materials differ");
    refused(
        &key(&scene, &CacheSettings { rays: 256, ..s.clone() }),
        "cache.rays is 128 there and 256 here",
    );
    refused(&key(&scene, &settings(Mode::SplitSphere)), "cache.mode");
    assert!(
        store::load(&file, &key(&scene, &CacheSettings { reach: 1.0, ..s.clone() })).is_ok(),
        "the final pass may change"
    );

    std::fs::write(&file, &good[..good.len() - 7]).unwrap();
    refused(&own, "cut short");
    std::fs::write(&file, &good[..40]).unwrap();
    refused(&own, "PLY");
    std::fs::write(
        &file,
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
    )
    .unwrap();
    refused(&own, "\"ascii\" cannot be read");
    std::fs::write(
        &file,
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nend_header\n\
         0000",
    )
    .unwrap();
    refused(&own, "is no irradiance cache");
    std::fs::write(&file, b"\x89PNG\r\n").unwrap();
    refused(&own, "PLY");
    std::fs::write(
        &file,
        String::from_utf8_lossy(&good).replacen("cache 3", "cache 9", 1).as_bytes(),
    )
    .unwrap();
    refused(&own, "version 9");
    let mut broken = records.clone();
    broken[7].irradiance.y = f32::NAN;
    store::save(&file, &own, &broken).unwrap();
    refused(&own, "record 7 is damaged");
    std::fs::remove_file(&file).unwrap();
    assert!(store::load(&file, &own).is_err());
}
