//! What every method borrows: the scene, its triangles, the ray backend and the lights, built once.

use std::sync::Arc;

use glam::DVec3;

use super::surroundings::{Surroundings, surroundings};
use super::{LightTable, Surface};
use crate::accel::{Backend, RayQuery, build};
use crate::error::Result;
use crate::math::Ray;
use crate::memory;
use crate::run::Run;
use crate::scene::{Camera, Scene};
use crate::tessellate::Geometry;

/// Scene, triangles, rays and lights.
#[derive(Debug)]
pub struct World {
    /// Zero of world space in the user's.
    pub origin: DVec3,
    /// The view.
    pub camera: Camera,
    /// World-space triangles.
    pub geometry: Arc<Geometry>,
    /// Who answers ray queries.
    pub backend: Backend,
    /// Ray queries against them.
    pub rays: Box<dyn RayQuery>,
    /// All light sources.
    pub lights: LightTable,
    /// The scene's diagonal: the scale of how far rays leave their surface.
    pub diagonal: f32,
    /// What surrounds what the camera sees: the scale of every relative length.
    pub around: Surroundings,
}

impl World {
    /// Flattens the scene and builds the ray backend (phase `build`).
    ///
    /// # Errors
    /// When the backend cannot be made.
    pub fn new(scene: &Scene, backend: Backend, run: &Run) -> Result<Self> {
        let _phase = run.phase("build", 1);
        let geometry = Arc::new(Geometry::new(scene));
        if geometry.dropped_degenerate + geometry.dropped_duplicate > 0 {
            run.warn(format!(
                "{} zero-area and {} duplicate triangles were left out",
                geometry.dropped_degenerate, geometry.dropped_duplicate
            ));
        }
        let count = geometry.len() as u64;
        let what = format!("a scene of {count} triangles");
        memory::claim(memory::of_triangles(count), &what, "leave out what is not seen")?;
        let rays = run.install(|| build(backend, &geometry, run.threads()))?;
        let lights = LightTable::new(scene, &geometry);
        let diagonal = geometry.bounds.diagonal();
        let camera = scene.camera.clone();
        let views = std::slice::from_ref(&camera);
        let around = run.install(|| surroundings(&*rays, &geometry, views));
        Ok(Self { origin: scene.origin, camera, geometry, backend, rays, lights, diagonal, around })
    }

    /// Lengths follow all of `views` from now on, instead of the camera.
    pub fn follow(&mut self, views: &[Camera], run: &Run) {
        self.around = run.install(|| surroundings(&*self.rays, &self.geometry, views));
    }

    /// The surface a ray meets, facing back along it.
    pub fn closest(&self, ray: &Ray) -> Option<Surface> {
        self.rays.closest(ray).map(|hit| Surface::new(&self.geometry, &hit, -ray.dir))
    }
}
