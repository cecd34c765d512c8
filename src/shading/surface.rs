//! The surface at a hit, turned to the side it was seen from.

use glam::Vec3;

use crate::math::{Hit, Ray, offset_origin};
use crate::radiometry::Rgb;
use crate::tessellate::{Geometry, Side};

/// A surface point seen from one side.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Position.
    pub p: Vec3,
    /// Unit geometric normal of the seen side.
    pub ng: Vec3,
    /// Unit shading normal of the seen side; same hemisphere as `ng`.
    pub ns: Vec3,
    /// Diffuse reflectance.
    pub albedo: Rgb,
    /// Emitted radiance of the seen side.
    pub le: Rgb,
    /// Triangle.
    pub triangle: u32,
    /// Barycentric weight of vertex 1.
    pub u: f32,
    /// Barycentric weight of vertex 2.
    pub v: f32,
    /// Side that is seen.
    pub side: Side,
}

impl Surface {
    /// The surface at `hit`, seen from direction `wo`.
    pub fn new(geometry: &Geometry, hit: &Hit, wo: Vec3) -> Self {
        let a = geometry.surface(hit.triangle, hit.u, hit.v);
        let front = a.ng.dot(wo) >= 0.0;
        let (sign, side) = if front { (1.0, Side::Front) } else { (-1.0, Side::Back) };
        let material = geometry.material(hit.triangle);
        Self {
            p: a.p,
            ng: a.ng * sign,
            ns: a.ns * sign,
            albedo: a.albedo,
            le: if front { material.emission } else { Rgb::ZERO },
            triangle: hit.triangle,
            u: hit.u,
            v: hit.v,
            side,
        }
    }

    /// A ray leaving the seen side; `diagonal` is the scene's.
    pub fn ray(&self, wi: Vec3, diagonal: f32) -> Ray {
        Ray::new(offset_origin(self.p, self.ng, diagonal), wi)
    }
}
