//! Small scenes made in code.

pub mod browser;
pub mod folder;
#[cfg(unix)]
pub mod hostile;
pub mod mutation;
pub mod readers;
pub mod source;

use glam::Vec3;
use nearfar::accel::Backend;
use nearfar::radiometry::Rgb;
use nearfar::run::Run;
use nearfar::scene::{Camera, Light, Material, Mesh, Scene, Sides};
use nearfar::shading::World;

pub use folder::Folder;

/// The backends that this build has.
pub fn backends() -> Vec<Backend> {
    if cfg!(feature = "embree") { vec![Backend::Bvh, Backend::Embree] } else { vec![Backend::Bvh] }
}

/// A quad as two triangles, wound as given.
pub fn quad(mesh: &mut Mesh, corners: [Vec3; 4], material: u32) {
    let base = mesh.positions.len() as u32;
    mesh.positions.extend(corners);
    mesh.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
    mesh.materials.extend([material; 2]);
}

/// An axis-aligned box; faces wound outwards, or inwards for a room.
pub fn cuboid(mesh: &mut Mesh, min: Vec3, max: Vec3, material: u32, inwards: bool) {
    let c = |i: usize| {
        Vec3::new([min.x, max.x][i & 1], [min.y, max.y][i >> 1 & 1], [min.z, max.z][i >> 2 & 1])
    };
    for f in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
        let mut corners = f.map(c);
        if inwards {
            corners.reverse();
        }
        quad(mesh, corners, material);
    }
}

/// A grey diffuse material.
pub fn grey(albedo: f32) -> Material {
    Material { albedo: Rgb::splat(albedo), ..Material::default() }
}

/// A unit room with a block on the floor and a quad light under the ceiling, seen from inside.
pub fn small_room() -> Scene {
    let mut room = Mesh { name: "room".into(), sides: Sides::Auto, ..Mesh::default() };
    cuboid(&mut room, Vec3::ZERO, Vec3::ONE, 0, true);
    let mut block = Mesh { name: "block".into(), sides: Sides::Auto, ..Mesh::default() };
    cuboid(&mut block, Vec3::new(0.3, 0.0, 0.3), Vec3::new(0.6, 0.35, 0.6), 1, false);
    let light = Light::Quad {
        corner: Vec3::new(0.4, 0.999, 0.4),
        edge1: Vec3::X * 0.2,
        edge2: Vec3::Z * 0.2,
        radiance: Rgb::new(10.0, 9.0, 8.0),
    };
    Scene {
        name: "small room".into(),
        origin: glam::DVec3::ZERO,
        camera: Camera {
            eye: Vec3::new(0.5, 0.5, 0.02),
            target: Vec3::new(0.5, 0.4, 1.0),
            up: Vec3::Y,
            vfov_deg: 80.0,
            width: 32,
            height: 24,
        },
        meshes: vec![room, block],
        materials: vec![
            grey(0.7),
            Material { albedo: Rgb::new(0.6, 0.3, 0.2), ..Material::default() },
        ],
        textures: Vec::new(),
        lights: vec![light],
    }
}

/// The world of a scene.
pub fn world(scene: &Scene, backend: Backend) -> World {
    World::new(scene, backend, &Run::new(2).unwrap()).unwrap()
}

/// The folder of reference models and images; says so when it is not there.
pub fn shared() -> Option<std::path::PathBuf> {
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared");
    let path = std::path::PathBuf::from(
        std::env::var("NEARFAR_SHARED").unwrap_or_else(|_| default.into()),
    );
    if !path.join("references").is_dir() {
        eprintln!("skipped: no reference images at {}", path.display());
        return None;
    }
    Some(path)
}

/// Runs the program with its output captured, from the top of the checkout.
pub fn program(arguments: &[&str]) -> std::process::Output {
    std::process::Command::new(env!("CARGO_BIN_EXE_nearfar"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments)
        .output()
        .unwrap()
}

/// Settings for small pictures: so many samples of a path, few of all else.
pub fn quick(path_spp: u32) -> nearfar::RenderConfig {
    let mut config = nearfar::RenderConfig::default();
    (config.path.spp, config.record.spp, config.gather.rays) = (path_spp, 2, Some(32));
    config
}
