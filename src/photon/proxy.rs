//! What a ray is told about the surface it meets: the radiance that leaves a cell's side.
//!
//! ```text
//! L(ray) = B(cell, side) / π,  the sky where nothing is met;  emission counts zero: it is direct light
//! ```

use glam::Vec3;

use super::CellRadiosity;
use crate::math::Ray;
use crate::radiometry::Rgb;
use crate::shading::World;
use crate::tessellate::{CellId, Cells, Side};

/// Cells and the radiosity of their sides, borrowed.
#[derive(Clone, Copy, Debug)]
pub struct Proxy<'a> {
    /// Pieces of the surfaces.
    pub cells: &'a Cells,
    /// Radiosity of their sides.
    pub radiosity: &'a CellRadiosity,
}

/// Light that arrives along a ray.
#[derive(Clone, Copy, Debug)]
pub struct Incident {
    /// Radiance, W·sr⁻¹·m⁻².
    pub radiance: Rgb,
    /// Distance in lengths of the ray's direction; infinite for the sky.
    pub t: f32,
    /// The cell it comes from; none for the sky.
    pub cell: Option<CellId>,
    /// Unit geometric normal there, towards the ray's origin; zero for the sky.
    pub normal: Vec3,
}

impl Proxy<'_> {
    /// One ray.
    pub fn incident(&self, world: &World, ray: &Ray) -> Incident {
        match world.rays.closest(ray) {
            None => Incident {
                radiance: world.lights.sky.radiance(ray.dir.normalize_or_zero()),
                t: f32::INFINITY,
                cell: None,
                normal: Vec3::ZERO,
            },
            Some(hit) => {
                let cell = self.cells.find(hit.triangle, hit.u, hit.v);
                let n = world.geometry.face_normals[hit.triangle as usize];
                let (side, normal) =
                    if n.dot(ray.dir) > 0.0 { (Side::Back, -n) } else { (Side::Front, n) };
                Incident {
                    radiance: self.radiosity.get(cell, side) * std::f32::consts::FRAC_1_PI,
                    t: hit.t,
                    cell: Some(cell),
                    normal,
                }
            }
        }
    }
}
