//! The scene as data: camera, meshes, materials, lights, textures. No files, no rays, no rendering.
//!
//! Lengths are in the file's units; positions are relative to [`Scene::origin`], so that scenes in
//! the coordinates of a map keep their precision. Directions and normals are unit unless said.
//! Surfaces are two-sided diffuse; radiosity is stored per side.

mod cage;
mod camera;
mod camera_path;
mod curves;
mod environment;
mod fingerprint;
mod light;
mod material;
mod mesh;
mod texture;

use glam::DVec3;

pub use cage::{Boundary, Cage, INFINITE_SHARPNESS, UvRule};
pub use camera::Camera;
pub use camera_path::CameraPath;
pub use curves::{Basis, Curves};
pub use environment::Environment;
pub use fingerprint::Fingerprint;
pub use light::Light;
pub use material::{Material, TextureId};
pub use mesh::{Mesh, Sides};
pub use texture::{Placement, Texture};

/// Everything that is rendered.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name for reports.
    pub name: String,
    /// Zero of world space in the user's: what files and the command line say is world plus this.
    pub origin: DVec3,
    /// The view.
    pub camera: Camera,
    /// World-space meshes (transforms are applied at load).
    pub meshes: Vec<Mesh>,
    /// Materials, referred to by index.
    pub materials: Vec<Material>,
    /// Textures, referred to by index.
    pub textures: Vec<Texture>,
    /// Lights beside the emissive materials.
    pub lights: Vec<Light>,
}
