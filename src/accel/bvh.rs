//! Pure-Rust BVH (skeleton).
use super::RayQuery;
use crate::error::Result;
use crate::math::{Aabb, Hit, Ray};
use crate::tessellate::Geometry;
use std::sync::Arc;

/// BVH of the crate `obvhs`.
#[derive(Debug)]
pub struct BvhScene(super::brute::BruteScene);
impl BvhScene {
    /// Builds.
    ///
    /// # Errors
    /// None yet.
    pub fn build(geometry: &Arc<Geometry>, _threads: usize) -> Result<Self> {
        Ok(Self(super::brute::BruteScene::build(geometry)))
    }
}
impl RayQuery for BvhScene {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.0.closest(ray)
    }
    fn occluded(&self, ray: &Ray) -> bool {
        self.0.occluded(ray)
    }
    fn bounds(&self) -> Aabb {
        self.0.bounds()
    }
}
