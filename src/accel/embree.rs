//! Ray queries by Embree 4.3 or later, through [`crate::ffi::embree`].
//!
//! Input      [`Geometry`]: positions are copied into Embree's padded buffer, indices are shared.
//!            Output  [`EmbreeScene`].
//! Method     one triangle mesh, build quality medium, `ROBUST`: watertight along shared edges (a
//!            ray through a vertex, exact to the last place, is lost in some 0.6 % of cases:
//!            Embree's edge signs are rounded one by one; [`super::bvh`] loses none). Masks are
//!            asked in a filter callback that is set only when the geometry has any. Guarantees At
//!            creation the device is checked against the headers of the build (see
//!            `ffi/README.md`); later errors cannot happen. Hits are the same for any number of
//!            threads: they are queried one by one, and the tests compare builds of 1, 2 and 8
//!            threads.
//! Not        bit-equal between packet widths, between the library's versions or between CPUs:
//!            widths use different arithmetic in the last places, and among surfaces at equal
//!            distance (a shared edge) may name another triangle. Use one width for one purpose.
//! Expects    `0 ≤ t_min`; a direction of zero length or a NaN hits nothing.
//! Cost       a slice of rays crosses the border in one call; about 100 B per triangle.

use std::sync::Arc;

use glam::Vec3;

use super::RayQuery;
use crate::error::Result;
use crate::ffi::embree::{Device, Scene, Triangles};
use crate::math::{Aabb, Hit, Ray};
use crate::tessellate::Geometry;

/// A committed Embree scene.
#[derive(Debug)]
pub struct EmbreeScene {
    scene: Scene,
    bounds: Aabb,
    version: u32,
}

impl Triangles for Geometry {
    fn positions(&self) -> &[Vec3] {
        &self.positions
    }
    fn indices(&self) -> &[[u32; 3]] {
        &self.triangles
    }
    fn masked(&self) -> bool {
        self.masks().is_some()
    }
    fn exists(&self, triangle: u32, u: f32, v: f32) -> bool {
        Self::exists(self, triangle, u, v)
    }
}

impl EmbreeScene {
    /// Builds with `threads` threads (0 = all).
    ///
    /// # Errors
    /// [`crate::error::Error::Accel`] when the library does not fit the headers of the build, has
    /// no filter functions, or has no memory left.
    pub fn build(geometry: &Arc<Geometry>, threads: usize) -> Result<Self> {
        let device = Device::new(threads)?;
        Ok(Self {
            scene: Scene::build(&device, geometry)?,
            bounds: geometry.bounds,
            version: device.version(),
        })
    }

    /// Version of the library in use: major, minor, patch.
    pub fn version(&self) -> [u32; 3] {
        [self.version / 10_000, self.version / 100 % 100, self.version % 100]
    }
}

impl RayQuery for EmbreeScene {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut hit = [None];
        self.scene.closest(std::slice::from_ref(ray), &mut hit, 1);
        hit[0]
    }
    fn occluded(&self, ray: &Ray) -> bool {
        let mut hit = [false];
        self.scene.occluded(std::slice::from_ref(ray), &mut hit, 1);
        hit[0]
    }
    fn bounds(&self) -> Aabb {
        self.bounds
    }
    fn closest_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], width: usize) {
        self.scene.closest(rays, hits, width);
    }
    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool], width: usize) {
        self.scene.occluded(rays, occluded, width);
    }
}
