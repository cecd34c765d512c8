//! The door: one call renders whatever the command line renders, and what it tells is typed.

use glam::Vec3;
use nearfar::accel::Backend;
use nearfar::film::layer_of;
use nearfar::math::{Frame, Ray, offset_origin};
use nearfar::radiometry::Rgb;
use nearfar::render::{Kept, SurfacePoints};
use nearfar::sampling::{Rng, Stream, sample_cosine_hemisphere};
use nearfar::scene::{Light, Mesh, Sides};
use nearfar::shading::direct_irradiance;
use nearfar::{Error, Method, RenderConfig, Renderer, Run, Scene, render};

use crate::support::{Folder, grey, program, quad, small_room};

fn room() -> Scene {
    let mut scene = small_room();
    (scene.camera.width, scene.camera.height) = (24, 16);
    scene
}

fn config() -> RenderConfig {
    let text = "backend = \"bvh\"\n[record]\nspp = 2\n[path]\nspp = 4\n[converge]\nspp = 4";
    RenderConfig::from_table(text.parse().unwrap()).unwrap()
}

#[test]
fn every_method_makes_the_layers_that_it_declares() {
    for method in Method::ALL {
        let done = render(&room(), &config(), method, &Run::new(2).unwrap()).unwrap();
        let mut declared: Vec<String> =
            method.layers().iter().flat_map(|l| l.channel_names()).collect();
        declared.sort();
        let made: Vec<&String> =
            done.film.channels.keys().filter(|c| !layer_of(c).is_empty()).collect();
        assert_eq!(made, declared.iter().collect::<Vec<_>>(), "{}", method.name());
        assert_eq!(done.film.header["nearfar.method"], method.name());
    }
}

#[test]
fn statistics_are_flat_and_complete() {
    let scene = room();
    for method in Method::ALL {
        let done = render(&scene, &config(), method, &Run::new(2).unwrap()).unwrap();
        let json = serde_json::to_value(&done.statistics).unwrap();
        for key in ["method", "backend", "width", "height", "seed", "triangles", "threads"] {
            assert!(!json[key].is_null(), "{}: {key}", method.name());
        }
        for key in ["rays", "seconds"] {
            assert!(json[key].is_object(), "{}: {key}", method.name());
        }
        assert_eq!(json["method"], method.name());
        assert!(json["rays"]["primary"].as_u64().unwrap() >= 24 * 16, "{}", method.name());
    }
    let done = render(&scene, &config(), Method::Decomposition, &Run::new(2).unwrap()).unwrap();
    let json = serde_json::to_value(&done.statistics).unwrap();
    for key in ["alpha", "cells", "photons", "clusters", "rays_per_cluster", "near_triangles_mean"]
    {
        assert!(json[key].as_f64().unwrap() >= 0.0, "{key}");
    }
}

#[test]
fn converging_keeps_the_models_figures() {
    let mut config = config();
    config.converge.enabled = true;
    let run = Run::new(2).unwrap();
    let done = render(&room(), &config, Method::Gather, &run).unwrap();
    let json = serde_json::to_value(&done.statistics).unwrap();
    assert_eq!(json["converge_spp"], 4.0);
    assert!(json["rays_per_point"].is_u64() && json["converge_relmse"].is_f64(), "{json}");
    for method in [Method::Path, Method::PhotonMap] {
        let error = render(&room(), &config, method, &run).unwrap_err().to_string();
        assert!(error.contains("converge.enabled") && !error.contains("--"), "{error}");
    }
}

#[test]
fn only_some_methods_keep_their_work() {
    let (scene, config, run) = (room(), config(), Run::new(2).unwrap());
    let mut renderer = Renderer::new(&scene, &config, &run).unwrap();
    let folder = Folder::new("door-kept");
    for method in Method::ALL {
        let file = folder.join(format!("{}.ply", method.name()));
        let kept = Kept { save: Some(file.clone()), ..Kept::default() };
        match renderer.render_keeping(method, &kept) {
            Ok(first) => {
                let kept = Kept { load: Some(file), ..Kept::default() };
                let again = renderer.render_keeping(method, &kept).unwrap();
                assert_eq!(first.film.rgb(""), again.film.rgb(""), "{}", method.name());
            }
            Err(Error::Usage(message)) => {
                assert!(!method.keeps() && message.contains("irradiance-cache"), "{message}");
                assert!(!file.exists());
            }
            Err(other) => panic!("{other}"),
        }
    }
}

/// Where lengths follow the view, kept work brings its own: another view goes on from it.
#[test]
fn kept_work_fits_another_view_outdoors() {
    let mut scene = room();
    let mut ground = nearfar::scene::Mesh::default();
    let corner = |x: f32, z: f32| glam::Vec3::new(x, -0.01, z) * 1e3;
    let corners = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
    crate::support::quad(&mut ground, corners, 0);
    scene.meshes.push(ground);
    let (config, run, folder) = (config(), Run::new(2).unwrap(), Folder::new("door-outdoors"));
    for method in [Method::Decomposition, Method::IrradianceCache] {
        let file = folder.join(format!("{}.ply", method.name()));
        let mut first = Renderer::new(&scene, &config, &run).unwrap();
        assert!(first.world().around.extent < 0.5 * first.world().diagonal);
        first
            .render_keeping(method, &Kept { save: Some(file.clone()), ..Kept::default() })
            .unwrap();
        let mut moved = scene.clone();
        moved.camera.eye += glam::Vec3::new(0.1, 0.05, 0.0);
        let mut second = Renderer::new(&moved, &config, &run).unwrap();
        assert!(second.world().around.extent != first.world().around.extent, "the views are alike");
        second.render_keeping(method, &Kept { load: Some(file), ..Kept::default() }).unwrap();
        assert_eq!(second.world().around.extent, first.world().around.extent);
    }
}

#[test]
fn the_command_line_renders_the_same_bits() {
    let folder = Folder::new("door-cli");
    let out = folder.join("a.exr");
    let file = "scenes/lit-sheet/lit-sheet.toml";
    let done = program(&[
        "render",
        file,
        "--size",
        "24x16",
        "--backend",
        "bvh",
        "-o",
        out.to_str().unwrap(),
    ]);
    assert!(done.status.success());
    let loaded = nearfar::load::load(file.as_ref(), &[]).unwrap();
    let mut scene = loaded.scene;
    (scene.camera.width, scene.camera.height) = (24, 16);
    let mut config = RenderConfig::from_table(loaded.settings).unwrap();
    config.backend = Backend::Bvh;
    let ours = render(&scene, &config, Method::default(), &Run::new(3).unwrap()).unwrap();
    let theirs = nearfar::film::read_exr(&out).unwrap();
    assert_eq!(ours.film.channels, theirs.channels);
    assert_eq!(ours.film.header["nearfar.settings"], theirs.header["nearfar.settings"]);
}

/// A floor under a constant sky with a lamp: both parts have closed forms.
#[test]
fn irradiance_at_points_in_closed_form() {
    let mut floor = Mesh { sides: Sides::Two, ..Mesh::default() };
    let far = 50.0;
    let corners = [[-far, -far], [-far, far], [far, far], [far, -far]];
    quad(&mut floor, corners.map(|[x, z]| Vec3::new(x, 0.0, z)), 0);
    let lamp = Light::Point { position: Vec3::new(0.0, 2.0, 0.0), intensity: Rgb::splat(8.0) };
    let sky = Light::Sky { radiance: Rgb::new(1.0, 2.0, 3.0) };
    let scene = Scene {
        meshes: vec![floor],
        materials: vec![grey(0.5)],
        lights: vec![lamp, sky],
        ..Scene::default()
    };
    let run = Run::new(2).unwrap();
    let config = config();
    let renderer = Renderer::new(&scene, &config, &run).unwrap();
    let points = SurfacePoints {
        p: vec![Vec3::ZERO, Vec3::new(1.5, 0.0, 0.0), Vec3::Y],
        n: vec![Vec3::Y, Vec3::Y * 7.0, -Vec3::Y],
    };
    let found = renderer.irradiance(&points).unwrap();
    let sky = std::f32::consts::PI * Vec3::new(1.0, 2.0, 3.0);
    // Straight below: I / d²; aside: I cos / d², cos = 2 / 2.5.
    for (e, direct) in found.iter().zip([8.0 / 4.0, 8.0 * 0.8 / 6.25]) {
        assert!((e.direct - direct).length() < 1e-4, "{e:?}");
        assert!((e.indirect / sky - 1.0).length() < 1e-4, "{e:?}");
        assert_eq!(e.total(), e.direct + e.indirect);
    }
    // Facing the floor: it reflects half of the sky's light, and of the lamp's what its solid
    // angle under the point gathers.
    let below = found[2];
    assert_eq!(below.direct, Rgb::ZERO);
    assert!(below.indirect.cmpgt(0.5 * sky).all(), "{below:?}");
    let again = Renderer::new(&scene, &config, &run).unwrap().irradiance(&points).unwrap();
    assert_eq!(found, again);
    for (p, n) in [(vec![Vec3::ZERO], vec![]), (vec![Vec3::NAN], vec![Vec3::Y])] {
        assert!(renderer.irradiance(&SurfacePoints { p, n }).is_err());
    }
    let flat = SurfacePoints { p: vec![Vec3::ZERO], n: vec![Vec3::ZERO] };
    assert!(renderer.irradiance(&flat).unwrap_err().to_string().contains("point 0"));
}

/// In a room, irradiance at the points that a camera saw is what final gathering gave them.
#[test]
fn irradiance_at_points_agrees_with_path_tracing() {
    let scene = room();
    let run = Run::new(2).unwrap();
    let text = "backend = \"bvh\"\n[gather]\nrays = 4096\n[direct]\nlight_samples = 4096";
    let config = RenderConfig::from_table(text.parse().unwrap()).unwrap();
    let p: Vec<Vec3> = [0.15, 0.5, 0.85].map(|x| Vec3::new(x, 0.0, 0.8)).to_vec();
    let points = SurfacePoints { n: vec![Vec3::Y; p.len()], p };
    let renderer = Renderer::new(&scene, &config, &run).unwrap();
    let found = renderer.irradiance(&points).unwrap();
    let world = renderer.world();
    for (e, &p) in found.iter().zip(&points.p) {
        let mut rng = Rng::new(3, Stream::Test, 0, 0);
        let mut sum = Rgb::ZERO;
        const PATHS: u32 = 40_000;
        for _ in 0..PATHS {
            let mut beta = Rgb::ONE;
            let (mut at, mut ng, mut n) = (p, Vec3::Y, Vec3::Y);
            for _ in 0..12 {
                let local = sample_cosine_hemisphere(rng.next_2d());
                let wi = Frame::from_normal(n).world_from_local(local);
                let origin = offset_origin(at, ng, world.diagonal);
                let Some(s) = world.closest(&Ray::new(origin, wi)) else { break };
                beta *= s.albedo;
                let mut sample = |_: u32| (rng.next_f32(), rng.next_2d());
                sum += beta * direct_irradiance(world, [s.p, s.ng, s.ns], None, 1, &mut sample).0;
                (at, ng, n) = (s.p, s.ng, s.ns);
            }
        }
        let truth = sum / PATHS as f32;
        // The proxy's own noise and the noise of 40 000 paths, about 1 % each.
        assert!((e.indirect / truth - 1.0).abs().max_element() < 0.05, "{e:?} {truth}");
    }
}
