//! Every ray against every triangle, in double precision: what the other backends are tested
//! against.

use std::sync::Arc;

use super::RayQuery;
use crate::math::{Aabb, Hit, Ray};
use crate::tessellate::Geometry;

/// All triangles, no structure. O(triangles) per ray.
#[derive(Debug)]
pub struct BruteScene {
    geometry: Arc<Geometry>,
    masked: bool,
}

impl BruteScene {
    /// Nothing is built.
    pub fn build(geometry: &Arc<Geometry>) -> Self {
        Self { geometry: Arc::clone(geometry), masked: geometry.masks().is_some() }
    }

    fn hit(&self, ray: &Ray, triangle: u32) -> Option<Hit> {
        let [a, b, c] = self.geometry.corners(triangle).map(|p| p.as_dvec3());
        let (o, d) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        let (e1, e2) = (b - a, c - a);
        let p = d.cross(e2);
        let det = e1.dot(p);
        if det == 0.0 {
            return None;
        }
        let s = o - a;
        let q = s.cross(e1);
        let (u, v, t) = (s.dot(p) / det, d.dot(q) / det, e2.dot(q) / det);
        let inside = u >= 0.0
            && v >= 0.0
            && u + v <= 1.0
            && t > f64::from(ray.t_min)
            && t < f64::from(ray.t_max);
        let hit = Hit { t: t as f32, u: u as f32, v: v as f32, triangle };
        (inside && (!self.masked || self.geometry.exists(triangle, hit.u, hit.v))).then_some(hit)
    }
}

impl RayQuery for BruteScene {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        (0..self.geometry.len() as u32)
            .filter_map(|i| self.hit(ray, i))
            .min_by(|a, b| a.t.total_cmp(&b.t))
    }
    fn occluded(&self, ray: &Ray) -> bool {
        (0..self.geometry.len() as u32).any(|i| self.hit(ray, i).is_some())
    }
    fn bounds(&self) -> Aabb {
        self.geometry.bounds
    }
}
