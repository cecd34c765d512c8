//! A triangle mesh in world space.

use glam::{Vec2, Vec3};

/// Which sides of a mesh exist for light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sides {
    /// `One` for connected parts that are closed and consistently wound, else `Two`.
    #[default]
    Auto,
    /// The back (by winding) is never seen: culled in the near sum.
    One,
    /// Both sides count.
    Two,
}

/// Triangles with per-vertex attributes. `normals` and `uvs` are empty or as long as `positions`.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name for messages.
    pub name: String,
    /// Vertex positions, world space.
    pub positions: Vec<Vec3>,
    /// Unit shading normals; empty: face normals.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, v upward; empty: (0, 0).
    pub uvs: Vec<Vec2>,
    /// Vertex indices; counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Material of every triangle: indices into [`super::Scene::materials`], as long as
    /// `triangles`.
    pub materials: Vec<u32>,
    /// Which sides count.
    pub sides: Sides,
}
