//! Eyes: whence surfaces are seen or lit, and which closed parts they are inside of.
//!
//! An eye is inside of a part where the part's triangles have a solid angle of ±4π from there, and
//! outside where they have none: `Ω = Σ 2 atan(a · (b × c) / (1 + a·b + b·c + c·a))`, a, b, c the
//! unit directions of a triangle's corners `[VanOosterom83]`. Only parts whose box holds the eye
//! are asked. Cost: one such term for each triangle of them and each eye.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::Geometry;
use crate::math::Aabb;
use crate::scene::{Light, Scene};

/// Most eyes; of more lamps every second, third, … counts.
const MOST: usize = 32;
/// An emitting surface is an eye a little in front of it, by this share of its size.
const IN_FRONT: f32 = 1e-3;

/// Whence a scene is seen or lit.
#[derive(Clone, Debug, Default)]
pub struct Eyes {
    /// The camera, and lamps without a surface.
    points: Vec<Vec3>,
    /// A sky, a sun or an environment: an eye that no part holds.
    everywhere: bool,
}

impl Eyes {
    /// Those of a scene, but for surfaces that emit.
    pub fn new(scene: &Scene) -> Self {
        let mut out = Self { points: vec![scene.camera.eye], everywhere: false };
        for light in &scene.lights {
            match *light {
                Light::Point { position, .. } | Light::Spot { position, .. } => {
                    out.points.push(position);
                }
                Light::Sun { .. } | Light::Sky { .. } | Light::Environment { .. } => {
                    out.everywhere = true;
                }
                Light::Quad { .. } | Light::Sphere { .. } => {}
            }
        }
        out
    }

    /// Whether any eye is inside of a part, and whether any is outside. Parts are boxes of closed
    /// surfaces; `None` is not asked about.
    pub fn sides(
        &self,
        geometry: &Geometry,
        part_of: &[u32],
        parts: &[Option<Aabb>],
    ) -> Vec<[bool; 2]> {
        let eyes = self.with_emitters(geometry, part_of);
        let mut asked: Vec<Vec<u32>> = vec![Vec::new(); parts.len()];
        let mut out = vec![[false, self.everywhere]; parts.len()];
        for (part, bounds) in parts.iter().enumerate() {
            let Some(bounds) = bounds else { continue };
            for (i, eye) in eyes.iter().enumerate() {
                let within = eye.cmpge(bounds.min).all() && eye.cmple(bounds.max).all();
                if within {
                    asked[part].push(i as u32);
                } else {
                    out[part][1] = true;
                }
            }
        }
        if asked.iter().all(Vec::is_empty) {
            return out;
        }
        let of_block = |block: usize| {
            let mut sums: Vec<(u32, u32, f64)> = Vec::new();
            let triangles = block * BLOCK..((block + 1) * BLOCK).min(part_of.len());
            for t in triangles {
                for &i in &asked[part_of[t] as usize] {
                    let angle = solid_angle(geometry.corners(t as u32), eyes[i as usize]);
                    match sums.iter_mut().find(|(part, eye, _)| (*part, *eye) == (part_of[t], i)) {
                        Some((.., sum)) => *sum += angle,
                        None => sums.push((part_of[t], i, angle)),
                    }
                }
            }
            sums
        };
        let blocks: Vec<_> =
            (0..part_of.len().div_ceil(BLOCK)).into_par_iter().map(of_block).collect();
        let mut sums: HashMap<(u32, u32), f64> = HashMap::new();
        for (part, eye, angle) in blocks.into_iter().flatten() {
            *sums.entry((part, eye)).or_default() += angle;
        }
        for (part, eyes_of) in asked.iter().enumerate() {
            for &eye in eyes_of {
                let angle = sums.get(&(part as u32, eye)).copied().unwrap_or(0.0);
                let inside = angle.abs() > 2.0 * std::f64::consts::PI;
                out[part][usize::from(!inside)] = true;
            }
        }
        out
    }

    /// The points, and one in front of each emitting part.
    fn with_emitters(&self, geometry: &Geometry, part_of: &[u32]) -> Vec<Vec3> {
        let mut lit: HashMap<u32, Vec3> = HashMap::new();
        for t in 0..geometry.len() as u32 {
            if !geometry.material(t).emits() {
                continue;
            }
            lit.entry(part_of[t as usize]).or_insert_with(|| {
                let [a, b, c] = geometry.corners(t);
                let lift = IN_FRONT * geometry.area(t).sqrt();
                (a + b + c) / 3.0 + geometry.face_normals[t as usize] * lift
            });
        }
        let mut lit: Vec<(u32, Vec3)> = lit.into_iter().collect();
        lit.sort_unstable_by_key(|(part, _)| *part);
        let all: Vec<Vec3> =
            self.points.iter().copied().chain(lit.into_iter().map(|(_, p)| p)).collect();
        all.iter().step_by(all.len().div_ceil(MOST)).copied().collect()
    }
}

/// Triangles of a block.
const BLOCK: usize = 4096;

/// Signed solid angle of a triangle, sr.
fn solid_angle(corners: [Vec3; 3], from: Vec3) -> f64 {
    let [a, b, c]: [DVec3; 3] = corners.map(|p| (p - from).as_dvec3().normalize_or_zero());
    let volume = a.dot(b.cross(c));
    2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}
