//! An own ray backend timed against the built-in ones:
//! `cargo run --release --example backend -- SCENE.toml`.
//!
//! The backend here is a flat list of triangles in boxes of 64, the simplest thing that is not
//! hopeless. Replace it with your own: two functions and a box make a [`RayQuery`].
#![allow(clippy::print_stdout, reason = "an example shows what it found")]

use std::sync::Arc;
use std::time::Instant;

use nearfar::accel::RayQuery;
use nearfar::bench::streams::record;
use nearfar::math::{Aabb, Hit, Ray};
use nearfar::tessellate::Geometry;
use nearfar::{RenderConfig, Renderer, Result, Run, load};

const BLOCK: u32 = 64;

/// Triangles in the scene's order, a box around every 64.
#[derive(Debug)]
struct Boxes {
    geometry: Arc<Geometry>,
    boxes: Vec<Aabb>,
}

impl Boxes {
    fn new(geometry: &Arc<Geometry>) -> Self {
        let corners = |b: u32| {
            (b * BLOCK..((b + 1) * BLOCK).min(geometry.len() as u32))
                .flat_map(|t| geometry.corners(t))
        };
        let count = (geometry.len() as u32).div_ceil(BLOCK);
        let boxes = (0..count).map(|b| Aabb::around(corners(b))).collect();
        Self { geometry: Arc::clone(geometry), boxes }
    }

    /// The closest triangle by the determinant test of Möller and Trumbore.
    fn nearest(&self, ray: &Ray) -> Option<Hit> {
        let mut found: Option<Hit> = None;
        for (b, bounds) in (0..).zip(&self.boxes) {
            let reach = found.map_or(ray.t_max, |h| h.t);
            if !meets(bounds, ray, reach) {
                continue;
            }
            for triangle in b * BLOCK..((b + 1) * BLOCK).min(self.geometry.len() as u32) {
                let [a, c1, c2] = self.geometry.corners(triangle);
                let (e1, e2) = (c1 - a, c2 - a);
                let p = ray.dir.cross(e2);
                let inverse = 1.0 / e1.dot(p);
                let s = ray.origin - a;
                let (u, q) = (s.dot(p) * inverse, s.cross(e1));
                let (v, t) = (ray.dir.dot(q) * inverse, e2.dot(q) * inverse);
                let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
                if inside && t > ray.t_min && t < found.map_or(ray.t_max, |h| h.t) {
                    found = Some(Hit { t, u, v, triangle });
                }
            }
        }
        found
    }
}

fn meets(bounds: &Aabb, ray: &Ray, t_max: f32) -> bool {
    let (a, b) = ((bounds.min - ray.origin) / ray.dir, (bounds.max - ray.origin) / ray.dir);
    a.min(b).max_element().max(ray.t_min) <= a.max(b).min_element().min(t_max)
}

impl RayQuery for Boxes {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.nearest(ray)
    }
    fn occluded(&self, ray: &Ray) -> bool {
        self.nearest(ray).is_some()
    }
    fn bounds(&self) -> Aabb {
        self.geometry.bounds
    }
}

fn main() -> Result<()> {
    let scene = std::env::args().nth(1).unwrap_or("scenes/cornell-box/cornell-box.toml".into());
    let loaded = load(scene.as_ref(), &[])?;
    let config = RenderConfig::from_table(loaded.settings)?;
    let run = Run::new(1)?;
    let renderer = Renderer::new(&loaded.scene, &config, &run)?;
    let world = renderer.world();
    let own = Boxes::new(&world.geometry);
    for stream in record(world, 20_000, 1) {
        let rate = |rays: &dyn RayQuery| {
            let start = Instant::now();
            let hits = stream.rays.iter().filter(|r| rays.closest(r).is_some()).count();
            (hits, stream.rays.len() as f64 * 1e-6 / start.elapsed().as_secs_f64())
        };
        let ((hits, built_in), (own_hits, own)) = (rate(&*world.rays), rate(&own));
        println!(
            "{:>8}: built-in {built_in:.2} Mrays/s, own {own:.2}; hits {hits} and {own_hits}",
            stream.name
        );
    }
    Ok(())
}
