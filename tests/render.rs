//! The door: one call renders whatever the command line renders, and what it tells is typed.

use nearfar::accel::Backend;
use nearfar::film::layer_of;
use nearfar::render::Kept;
use nearfar::{Error, Method, RenderConfig, Renderer, Run, Scene, render};

use crate::support::{program, small_room, temporary};

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
    let renderer = Renderer::new(&scene, &config, &run).unwrap();
    let folder = temporary("door-kept");
    for method in Method::ALL {
        let file = folder.join(format!("{}.ply", method.name()));
        let kept = Kept { load: None, save: Some(file.clone()) };
        match renderer.render_keeping(method, &kept) {
            Ok(first) => {
                let kept = Kept { load: Some(file), save: None };
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
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn the_command_line_renders_the_same_bits() {
    let folder = temporary("door-cli");
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
    std::fs::remove_dir_all(folder).unwrap();
}
