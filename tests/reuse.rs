//! What is kept between renders: files of the decomposition, other cameras, camera paths.

use std::process::Command;

use glam::Vec3;
use nearfar::accel::Backend;
use nearfar::compare::{Truth, errors};
use nearfar::film::{Film, read_exr};
use nearfar::length::Length;
use nearfar::method::decompose::near::boxes::NearBoxes;
use nearfar::method::decompose::store::{Known, key, load, save};
use nearfar::method::decompose::{
    DecomposeSettings, NearNoise, picture, picture_with, plan, prepare, render, resume,
};
use nearfar::method::key::Key;
use nearfar::method::stage::Inputs;
use nearfar::proxy::ProxySettings;
use nearfar::radiometry::Rgb;
use nearfar::record::RecordSettings;
use nearfar::run::Run;
use nearfar::scene::{Camera, Fingerprint, Light, Mesh, Scene, Sides};
use nearfar::shading::{DirectSettings, World};

use crate::support::{Folder, backends, cuboid, small_room, world};

struct Settings {
    decompose: DecomposeSettings,
    photon: ProxySettings,
    record: RecordSettings,
    direct: DirectSettings,
}

impl Settings {
    fn new() -> Self {
        let decompose = DecomposeSettings {
            alpha: Length::Percent(8.0),
            rays: 128,
            ..DecomposeSettings::default()
        };
        let photon = ProxySettings { photons: 20_000, ..ProxySettings::default() };
        Self {
            decompose,
            photon,
            record: RecordSettings { spp: 4, ..RecordSettings::default() },
            direct: DirectSettings::default(),
        }
    }
    fn inputs(&self, w: &World) -> Inputs<'_> {
        let near_cell = self.decompose.lengths(w.around.extent).near_cell;
        Inputs {
            near_cell,
            photon: &self.photon,
            record: &self.record,
            direct: &self.direct,
            seed: 5,
        }
    }
    fn key(&self, scene: &Scene, w: &World) -> Key {
        key(Fingerprint::new(scene), &self.inputs(w), &self.decompose, w)
    }
}

/// Bits of every layer but `location`, which marks only what was made for this camera.
fn bits(film: &Film) -> Vec<(String, Vec<u32>)> {
    let layers = film.channels.iter().filter(|(k, _)| *k != "location");
    layers.map(|(k, v)| (k.clone(), v.iter().map(|x| x.to_bits()).collect())).collect()
}

fn aside(camera: &Camera) -> Camera {
    Camera {
        eye: camera.eye + Vec3::new(0.25, 0.1, 0.1),
        target: camera.target + Vec3::new(-0.3, 0.0, 0.0),
        ..camera.clone()
    }
}

#[test]
fn what_is_loaded_is_what_was_saved_and_gives_the_same_picture() {
    let (folder, s, run) = (Folder::new("reuse-reload"), Settings::new(), Run::new(2).unwrap());
    for backend in backends() {
        let scene = small_room();
        let w = world(&scene, backend);
        let inputs = s.inputs(&w);
        let first = prepare(&w, &s.decompose, inputs, &run).unwrap();
        let (file, key) = (folder.join("room.ply"), s.key(&scene, &w));
        save(&file, &key, &Known::new(&first), &inputs, &s.decompose).unwrap();
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "nothing beside the file");
        let known = load(&file, &key, &inputs, &s.decompose).unwrap();
        assert!(known == Known::new(&first));
        let again = resume(&w, &s.decompose, inputs, known, &run).unwrap();
        assert_eq!(
            (again.sampled.clusters.len(), again.earlier, again.sides_added),
            (first.sampled.clusters.len(), first.sampled.clusters.len(), 0)
        );
        let fresh = picture(&w, &s.decompose, &first, 5, &run).unwrap().film;
        assert!(
            bits(&picture(&w, &s.decompose, &again, 5, &run).unwrap().film) == bits(&fresh),
            "{backend:?}"
        );
        assert!(
            bits(&render(&w, &s.decompose, inputs, &run).unwrap().film) == bits(&fresh),
            "{backend:?}"
        );
    }
}

/// Relative mean squared difference and relative difference of the means of the irradiance.
fn difference(a: &Film, b: &Film) -> (f64, f64) {
    let grey = |film: &Film| -> Vec<Rgb> {
        let layer = film.rgb("irradiance").unwrap();
        layer.iter().map(|c| Rgb::splat(c.element_sum() / 3.0)).collect()
    };
    let e = errors(&grey(a), &Truth::exact(b.width, b.height, &grey(b)));
    (e.relmse, e.bias)
}

#[test]
fn another_camera_adds_what_it_sees_first_and_looks_as_if_fresh() {
    let s = Settings::new();
    let mut w = world(&small_room(), Backend::Bvh);
    let picture_of = |threads: usize, w: &mut World| {
        let run = Run::new(threads).unwrap();
        w.camera = small_room().camera;
        let first = prepare(w, &s.decompose, s.inputs(w), &run).unwrap();
        w.camera = aside(&w.camera);
        let extended = resume(w, &s.decompose, s.inputs(w), Known::new(&first), &run).unwrap();
        let film = picture(w, &s.decompose, &extended, 5, &run).unwrap().film;
        (first, extended, film)
    };
    let (first, extended, film) = picture_of(2, &mut w);
    let run = Run::new(2).unwrap();
    let fresh = prepare(&w, &s.decompose, s.inputs(&w), &run).unwrap();
    let added = extended.sampled.clusters.len() - extended.earlier;
    assert!(added > 5, "{added} clusters");
    assert!(
        added < fresh.sampled.clusters.len(),
        "{added} added, {} fresh",
        fresh.sampled.clusters.len()
    );
    // What was there stays, bit for bit.
    assert!(
        extended.sampled.sh[..first.sampled.sh.len()] == first.sampled.sh
            && extended.sampled.clusters.center[..first.sampled.sh.len()]
                == first.sampled.clusters.center
    );
    let (old, new) = (first.stage.proxy.saved(), extended.stage.proxy.saved());
    assert!(old.rows().zip(new.rows()).all(|(old, new)| old == new));
    assert!(new.len() > old.len());
    let fresh = picture(&w, &s.decompose, &fresh, 5, &run).unwrap().film;
    let mut noise = s.inputs(&w);
    noise.seed = 6;
    let other = render(&w, &s.decompose, noise, &run).unwrap().film;
    let (found, between_seeds) = (difference(&film, &fresh), difference(&other, &fresh));
    eprintln!("extended against fresh: {found:?}; two seeds: {between_seeds:?}");
    // Both are renders of the same settings with other clusters: they differ as two seeds do.
    assert!(found.0 < 2.0 * between_seeds.0 && found.1.abs() < 0.01, "{found:?} {between_seeds:?}");
    for threads in [1, 8] {
        assert!(bits(&picture_of(threads, &mut w).2) == bits(&film), "{threads} threads");
    }
}

/// A second room, closed: rays from the first never reach it, so all of it is gathered for the
/// camera that stands in it.
#[test]
fn a_room_never_seen_is_gathered_then() {
    let (s, run, aside) = (Settings::new(), Run::new(2).unwrap(), Vec3::X * 3.0);
    let mut scene = small_room();
    let mut room = Mesh { sides: Sides::Auto, ..Mesh::default() };
    cuboid(&mut room, aside, aside + 1.0, 0, true);
    scene.meshes.push(room);
    scene.lights.push(Light::Quad {
        corner: aside + Vec3::new(0.4, 0.999, 0.4),
        edge1: Vec3::X * 0.2,
        edge2: Vec3::Z * 0.2,
        radiance: Vec3::splat(9.0),
    });
    let mut w = world(&scene, Backend::Bvh);
    let first = Known::new(&prepare(&w, &s.decompose, s.inputs(&w), &run).unwrap());
    w.camera = Camera { eye: w.camera.eye + aside, target: w.camera.target + aside, ..w.camera };
    let extended = resume(&w, &s.decompose, s.inputs(&w), first, &run).unwrap();
    assert!(extended.sides_added > 200, "{}", extended.sides_added);
    let film = picture(&w, &s.decompose, &extended, 5, &run).unwrap().film;
    let fresh = render(&w, &s.decompose, s.inputs(&w), &run).unwrap().film;
    let mut noise = s.inputs(&w);
    noise.seed = 6;
    let between_seeds = difference(&render(&w, &s.decompose, noise, &run).unwrap().film, &fresh);
    let found = difference(&film, &fresh);
    eprintln!("second room against fresh: {found:?}; two seeds: {between_seeds:?}");
    assert!(found.0 < 2.0 * between_seeds.0 && found.1.abs() < 0.01, "{found:?} {between_seeds:?}");
}

#[test]
fn stale_and_broken_files_are_refused_with_the_reason() {
    let (folder, s, run) = (Folder::new("reuse-refuse"), Settings::new(), Run::new(2).unwrap());
    let scene = small_room();
    let w = world(&scene, Backend::Bvh);
    let file = folder.join("room.ply");
    let own = s.key(&scene, &w);
    let prepared = prepare(&w, &s.decompose, s.inputs(&w), &run).unwrap();
    let known = Known::new(&prepared);
    save(&file, &own, &known, &s.inputs(&w), &s.decompose).unwrap();
    let good = std::fs::read(&file).unwrap();
    let refused = |key: &Key, expected: &str| {
        let error = load(&file, key, &s.inputs(&w), &s.decompose).unwrap_err().to_string();
        assert!(error.contains("room.ply") && error.contains(expected), "{error}");
    };
    type Change = fn(&mut Scene);
    let changes: [(Change, &str); 3] = [
        (|s| s.materials[0].albedo.x += 0.1, "another scene: its materials differ"),
        (|s| s.meshes[1].positions[0].x += 1e-4, "another scene: its meshes differ"),
        (|s| s.lights.clear(), "another scene: its lights differ"),
    ];
    for (change, expected) in changes {
        let mut other = scene.clone();
        change(&mut other);
        refused(&s.key(&other, &w), expected);
    }
    let with = |change: &dyn Fn(&mut Settings)| {
        let mut other = Settings::new();
        change(&mut other);
        other.key(&scene, &w)
    };
    refused(
        &with(&|s| s.decompose.rays = 64),
        "decompose.rays is 128 there and 64 here; set them alike",
    );
    refused(&with(&|s| s.decompose.alpha = Length::Percent(9.0)), "decompose.alpha is");
    refused(&with(&|s| s.decompose.near_cell = Some(Length::Units(0.3))), "decompose.near_cell is");
    refused(&with(&|s| s.photon.gather_rays = 8), "proxy.gather_rays is 16 there and 8 here");
    // The last pass and the camera's samples may be others.
    let last = with(&|s| {
        s.decompose.near_rays = 4;
        s.decompose.near_noise = Some(NearNoise::World);
        s.decompose.alpha = Length::Units(s.decompose.lengths(w.around.extent).alpha);
        s.record.spp = 9;
    });
    assert!(load(&file, &last, &s.inputs(&w), &s.decompose).is_ok());

    let text = |from: &str, to: &str| {
        let at = good.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        let bytes = [&good[..at], to.as_bytes(), &good[at + from.len()..]].concat();
        std::fs::write(&file, bytes).unwrap();
    };
    text("decomposition 6", "decomposition 7");
    refused(&own, "is of version 7; this program reads \"nearfar decomposition 6\"");
    text("nearfar decomposition 6", "nearfar irradiance cache 5");
    refused(&own, "is no decomposition");
    text("property float radius", "property float width");
    refused(&own, "other columns");
    std::fs::write(&file, &good[..good.len() - 5]).unwrap();
    refused(&own, "cut short");
    std::fs::write(&file, &good[..60]).unwrap();
    refused(&own, "PLY");
    let mut damaged = known.clone();
    damaged.sampled.sh[3].0[0].x = f32::NAN;
    save(&file, &own, &damaged, &s.inputs(&w), &s.decompose).unwrap();
    refused(&own, "cluster 3 is damaged");
    // The parts of places come before the checksum: 18 floats and 13 bytes each.
    let end = good.len() - 4;
    let at = end - (known.proxy.len() - 2) * 85 + 9 * 4;
    let bytes = [&good[..at], &(-1.0f32).to_le_bytes(), &good[at + 4..end]].concat();
    std::fs::write(&file, [&bytes[..], &good[end..]].concat()).unwrap();
    refused(&own, "not what its checksum says");
    let checksum = crc32fast::hash(&bytes).to_le_bytes();
    std::fs::write(&file, [&bytes[..], &checksum].concat()).unwrap();
    refused(&own, "place_part 2 is damaged");
}

#[test]
fn a_planned_path_needs_nothing_more_and_threads_do_not_matter() {
    let mut s = Settings::new();
    s.decompose.near_noise = Some(NearNoise::World);
    let mut w = world(&small_room(), Backend::Bvh);
    let (start, end) = (small_room().camera, aside(&small_room().camera));
    let views = [start.clone(), start.clone(), end.clone()];
    let mut fly = |threads: usize| {
        let run = Run::new(threads).unwrap();
        w.camera = start.clone();
        let mut prepared = plan(&w, &s.decompose, s.inputs(&w), &views, None, &run).unwrap();
        let clusters = prepared.sampled.clusters.len();
        let mut boxes = NearBoxes::default();
        let frames: Vec<_> = views
            .iter()
            .map(|view| {
                w.camera = view.clone();
                prepared.look(&w, &s.decompose, s.inputs(&w), false, &run).unwrap();
                bits(
                    &picture_with(&w, &s.decompose, &prepared, Some(&mut boxes), 5, &run)
                        .unwrap()
                        .film,
                )
            })
            .collect();
        assert_eq!(prepared.sampled.clusters.len(), clusters);
        prepared.look(&w, &s.decompose, s.inputs(&w), true, &run).unwrap();
        let missing = prepared.sampled.clusters.len() - clusters;
        assert!(missing * 20 < clusters, "{missing} of {clusters} clusters were not planned");
        frames
    };
    let frames = fly(2);
    assert!(
        frames[0] == frames[1] && frames[1] != frames[2],
        "a camera that rests gives the same frame"
    );
    assert!(fly(1) == frames && fly(8) == frames);
}

fn nearfar(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_nearfar")).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box/cornell-box.toml");

#[test]
fn fly_as_a_user_types_it() {
    let folder = Folder::new("reuse-fly");
    let at = |name: &str| folder.at(name);
    let (path, film, stats) = (at("path.toml"), at("film"), at("fly.json"));
    let camera = nearfar::load::load(SCENE.as_ref(), &[]).unwrap().scene.camera;
    let key = |shift: f32| {
        format!(
            "[[key]]\neye = {:?}\ntarget = {:?}\n",
            (camera.eye + Vec3::X * shift).to_array(),
            camera.target.to_array()
        )
    };
    std::fs::write(&path, key(0.0) + &key(60.0)).unwrap();
    let common = [
        "--size",
        "24x24",
        "--spp",
        "2",
        "--set",
        "proxy.photons=5000",
        "--set",
        "decompose.rays=64",
    ];
    let fly = |arguments: &[&str]| {
        nearfar(&[&["fly", SCENE, "-o", &film, "--replace"], &common[..], arguments].concat())
    };
    let (code, out, err) = fly(&["--path", &path, "--frames", "3", "--png", "--stats", &stats]);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("temporal variance"), "{out}");
    for i in 1..=3 {
        let frame = read_exr(&folder.join(format!("film/frame_{i:04}.exr"))).unwrap();
        assert!(
            (frame.width, frame.height) == (24, 24)
                && frame.header["nearfar.settings"].contains("near_noise = \"world\"")
        );
        assert!(folder.join(format!("film/frame_{i:04}.png")).is_file());
    }
    let stats: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&stats).unwrap()).unwrap();
    assert!(
        stats["flicker"]["temporal_variance"].as_f64().unwrap() > 0.0
            && stats["flicker"]["points"].as_u64().unwrap() > 200,
        "{stats}"
    );
    assert!(
        stats["frames"].as_array().unwrap().len() == 3 && stats["frames"][1]["clusters_added"] == 0
    );

    // Kept and loaded: the same film, without photons.
    let kept = at("fly.ply");
    let film_of = |arguments: &[&str]| {
        let (code, _, err) = fly(&[&["--path", &path, "--frames", "3", "-q"], arguments].concat());
        assert_eq!((code, err.as_str()), (0, ""));
        [1, 2, 3].map(|i| bits(&read_exr(&folder.join(format!("film/frame_{i:04}.exr"))).unwrap()))
    };
    let first = film_of(&["--save-cache", &kept]);
    assert!(first == film_of(&["--load-cache", &kept]));

    // Without --path, in a straight line; a camera that rests gives the same frames.
    let eye = camera.eye.to_array().map(|v| v.to_string()).join(",");
    let (code, _, err) = fly(&["--to-eye", &eye, "--frames", "2", "-q"]);
    assert_eq!((code, err.as_str()), (0, ""));
    let frames =
        [1, 2].map(|i| bits(&read_exr(&folder.join(format!("film/frame_{i:04}.exr"))).unwrap()));
    assert!(frames[0] == frames[1]);
    for (arguments, expected) in [
        (&["--frames", "2"][..], "give --path FILE.toml, or --to-eye"),
        (&["--path", "none.toml"], "none.toml"),
        (&["--path", &path, "--to-eye", "1,2,3"], "cannot be used with"),
        (&["--to-eye", "1,2"], "write three numbers"),
        (&["--to-eye", &eye, "--reuse", "some"], "possible values"),
        (
            &["--to-eye", &eye, "--reuse", "none", "--save-cache", &kept],
            "frames that share nothing",
        ),
    ] {
        let (code, _, err) = fly(arguments);
        assert!(code == 2 && err.contains(expected), "{arguments:?}: {err}");
    }
}

#[test]
fn caches_as_a_user_types_them() {
    let folder = Folder::new("reuse-cli");
    let at = |name: &str| folder.at(name);
    let (cache, a, b, stats) = (at("c.ply"), at("a.exr"), at("b.exr"), at("s.json"));
    let common = ["--size", "24x24", "--spp", "2", "--set", "proxy.photons=5000", "-q"];
    let run = |arguments: &[&str]| nearfar(&[&["render", SCENE], &common[..], arguments].concat());
    assert_eq!(run(&["-o", &a, "--save-cache", &cache]).0, 0);
    let (code, _, err) = run(&["-o", &b, "--load-cache", &cache, "--stats", &stats]);
    assert_eq!(code, 0, "{err}");
    assert!(bits(&read_exr(a.as_ref()).unwrap()) == bits(&read_exr(b.as_ref()).unwrap()));
    let stats: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&stats).unwrap()).unwrap();
    assert!(
        stats["clusters_loaded"] == stats["clusters"]
            && stats["rays"]["photon"] == 0
            && stats["rays"]["sample"].as_u64().unwrap() < 200_000,
        "{stats}"
    );
    let (code, _, err) = run(&["-o", &b, "--load-cache", &cache, "--set", "decompose.rays=100"]);
    assert!(
        code == 2
            && err.contains(
                "c.ply: was made with other settings: decompose.rays is 384 there and 100 here"
            ),
        "{err}"
    );
    let (code, _, err) = run(&["-o", &b, "--load-cache", &cache, "--method", "irradiance-cache"]);
    assert!(code == 2 && err.contains("is no irradiance cache"), "{err}");
    let (code, _, err) = run(&["-o", &b, "--load-cache", &cache, "--method", "path"]);
    assert!(code == 2 && err.contains("--method decomposition or irradiance-cache"), "{err}");
}
