//! What `nearfar info` says of scenes whose numbers are known, and where the camera stands.

use std::f64::consts::PI;
use std::path::Path;
use std::process::Command;

use glam::Vec3;
use nearfar::accel::Backend;
use nearfar::info::{SceneInfo, scene_info};
use nearfar::load::load;
use nearfar::method::decompose::DecomposeSettings;
use nearfar::render::camera_inside_wall;
use nearfar::scene::{Camera, Light, Mesh, Scene};
use serde_json::Value;

use crate::support::{backends, cuboid, grey, small_room, world};

fn info(name: &str) -> SceneInfo {
    let loaded = load(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}/{name}.toml")),
        &[],
    )
    .unwrap();
    let world = world(&loaded.scene, Backend::default());
    scene_info(&loaded, &world)
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-4 * b
}

#[test]
fn cornell_box() {
    let info = info("cornell-box");
    // Three walls of one colour, a red and a green one, the lamp, and two blocks of five faces:
    // sixteen quads, none closed.
    assert_eq!(
        (info.triangles, info.parts, info.closed_parts, info.one_sided_share),
        (32, 4, 0, 0.0)
    );
    let triangles: Vec<_> = info.materials.iter().map(|m| (m.name.as_str(), m.triangles)).collect();
    assert_eq!(triangles, [("white", 26), ("red", 2), ("green", 2), ("lamp", 2)]);
    let [lamp] = &info.lights[..] else { panic!("{:?}", info.lights) };
    let luminance = 0.2126 * 17.0 + 0.7152 * 12.0 + 0.0722 * 4.0;
    assert!(
        lamp.kind == "material \"lamp\"" && close(lamp.power, PI * 130.0 * 105.0 * luminance),
        "{lamp:?}"
    );
    assert!(
        info.notes.is_empty() && info.warnings.is_empty(),
        "{:?} {:?}",
        info.notes,
        info.warnings
    );
}

#[test]
fn nested_slats() {
    let info = info("nested-slats");
    // 137 cuboids and the lamp; some cuboids touch and are one part, and only the lamp is open.
    assert_eq!(
        (info.triangles, info.parts - info.closed_parts, info.boundary_edges),
        (137 * 12 + 2, 1, 4)
    );
    assert!(close(info.one_sided_share.into(), 1644.0 / 1646.0), "{}", info.one_sided_share);
    let area = 1.2 * (0.3f64 * 0.3 + 1.1 * 1.1).sqrt();
    let lamp = PI * area * (0.2126 * 9.0 + 0.7152 * 8.4 + 0.0722 * 7.0);
    let sky = 4.0 * PI * PI * f64::from(info.diagonal).powi(2) / 4.0 * 0.05;
    let [a, b] = &info.lights[..] else { panic!("{:?}", info.lights) };
    assert!(
        a.kind == "quad" && close(a.power, lamp) && b.kind == "sky" && close(b.power, sky),
        "{a:?} {b:?}"
    );
    assert!(info.warnings.is_empty(), "{:?}", info.warnings);
}

/// Triangles, parts and closed parts are those that the scenes' READMEs name.
#[test]
fn hairball_and_foliage() {
    let figures = |name: &str| {
        let info = info(name);
        (info.triangles, info.parts, info.closed_parts)
    };
    // 500 hairs of 3 · 2 · 39 sides and two fans of 3; the box; the lamp.
    assert_eq!(figures("hairball"), (500 * (6 * 39 + 6) + 92 + 2, 502, 501));
    assert_eq!(figures("foliage"), (12_300, 6009, 9));
}

#[test]
fn alpha_is_the_default_of_the_decomposition() {
    for name in ["cornell-box", "nested-slats"] {
        let info = info(name);
        assert_eq!(info.alpha, DecomposeSettings::default().lengths(info.diagonal).alpha, "{name}");
    }
}

#[test]
fn json_holds_the_same_figures() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box/cornell-box.toml");
    let output = Command::new(env!("CARGO_BIN_EXE_nearfar"))
        .arg("info")
        .arg(path)
        .arg("--json")
        .output()
        .unwrap();
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    // By way of text, so that both went from f32 to decimals and back.
    let known = serde_json::to_string(&info("cornell-box")).unwrap();
    assert_eq!(told, serde_json::from_str::<Value>(&known).unwrap());
}

/// A solid block of one metre on a floor, seen from `eye`.
fn block_seen_from(eye: Vec3) -> Scene {
    let mut mesh = Mesh::default();
    cuboid(&mut mesh, Vec3::ZERO, Vec3::ONE, 0, false);
    cuboid(&mut mesh, Vec3::new(-4.0, -1.2, -4.0), Vec3::new(4.0, -0.2, 4.0), 0, false);
    Scene {
        camera: Camera { eye, target: eye + Vec3::X, ..Camera::default() },
        meshes: vec![mesh],
        materials: vec![grey(0.5)],
        lights: vec![Light::Sky { radiance: nearfar::radiometry::Rgb::ONE }],
        ..Scene::default()
    }
}

#[test]
fn cameras_in_walls_are_found() {
    for backend in backends() {
        let inside = |scene: &Scene| camera_inside_wall(&world(scene, backend));
        assert!(
            inside(&block_seen_from(Vec3::splat(0.5)))
                && inside(&block_seen_from(Vec3::new(2.0, -0.7, 2.0)))
        );
        assert!(!inside(&block_seen_from(Vec3::new(-1.0, 0.5, 0.5))), "beside the block");
        assert!(!inside(&small_room()), "a closed room, seen from inside");
        // Without its top the block is a tray: its backs are surfaces like others.
        let mut open = block_seen_from(Vec3::splat(0.5));
        let mesh = &mut open.meshes[0];
        mesh.triangles.drain(0..1);
        mesh.materials.drain(0..1);
        assert!(!inside(&open), "an open shell");
    }
}
