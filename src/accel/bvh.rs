//! Ray queries by a compressed eight-wide BVH in pure Rust: the crate `obvhs` builds and walks it,
//! boxes and triangles are tested here.
//!
//! Input      [`Geometry`]. Output  [`BvhScene`]: nodes of 80 B, corners in leaf order, 40 B per
//!            triangle.
//! Method     PLOC with reinsertion (`obvhs`), converted to eight children a node with boxes in 8
//!            bits; triangles by Woop, Benthin and Wald, "Watertight ray/triangle intersection",
//!            JCGT 2013, with their fallback to double precision on an edge. Guarantees watertight:
//!            boxes are padded by the rounding error of both tests, so that no triangle that is hit
//!            lies in a box that is not. Deterministic: the build is serial, and a query depends on
//!            its ray only; equal distances go to the first found.
//! Expects    `0 ≤ t_min`; a direction of zero length or a NaN hits nothing.
//! Cost       build O(n log n) on one thread; packets have no faster path: batches are loops.

use std::sync::Arc;
use std::time::Duration;

use glam::{UVec2, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::cwbvh::node::CwBvhNode;
use obvhs::cwbvh::{BRANCHING, CwBvh};
use obvhs::triangle::Triangle;

use super::RayQuery;
use super::watertight::{Sheared, Touch};
use crate::error::{Error, Result};
use crate::ffi::lanes::{self, Kernel, Lanes};
use crate::math::{Aabb, Hit, Ray};
use crate::tessellate::Geometry;

/// Levels that a walk can hold: fixed by `obvhs`.
const MAX_DEPTH: usize = 32;
/// Padding of boxes in units of rounding (2⁻²³) of the largest coordinate difference: 2 for the
/// corners of a box, 4 for the sheared corners of a triangle and the scale of the ray, doubled.
/// Derived, not measured.
const PADDING: f32 = 12.0 * f32::EPSILON;

/// A BVH over triangles.
#[derive(Debug)]
pub struct BvhScene {
    bvh: CwBvh,
    /// Corners, in the order of the leaves.
    corners: Vec<[Vec3; 3]>,
    geometry: Arc<Geometry>,
    masked: bool,
}

impl BvhScene {
    /// Builds; `threads` is not used, since the build is serial.
    ///
    /// # Errors
    /// [`Error::Accel`] when there are more triangles than can be numbered, or the tree is too deep
    /// to be walked.
    pub fn build(geometry: &Arc<Geometry>, _threads: usize) -> Result<Self> {
        let geometry = Arc::clone(geometry);
        if geometry.len() >= (u32::MAX / 8) as usize {
            return Err(Error::Accel(format!(
                "{} triangles are more than the BVH can number",
                geometry.len()
            )));
        }
        let triangles: Vec<Triangle> = (0..geometry.len() as u32)
            .map(|i| {
                let [v0, v1, v2] = geometry.corners(i).map(Vec3A::from);
                Triangle { v0, v1, v2 }
            })
            .collect();
        let mut bvh = CwBvh::default();
        if !triangles.is_empty() {
            bvh = build_cwbvh(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
        }
        if depth(&bvh) >= MAX_DEPTH {
            return Err(Error::Accel(format!(
                "the BVH is {} levels deep, over the limit of {MAX_DEPTH}; use the backend embree",
                depth(&bvh)
            )));
        }
        let corners = bvh.primitive_indices.iter().map(|&i| geometry.corners(i)).collect();
        let masked = geometry.masks().is_some();
        Ok(Self { bvh, corners, geometry, masked })
    }

    /// Calls `visit` with every hit in the interval that is open at the time; `visit` returns the
    /// new end of the interval.
    #[inline(always)]
    fn walk<L: Lanes>(&self, ray: &Ray, mut visit: impl FnMut(Hit) -> f32) {
        let Some(sheared) = Sheared::new(ray) else { return };
        if self.bvh.nodes.is_empty() {
            return;
        }
        let slabs = Slabs::new(ray);
        let mut t_max = ray.t_max;
        let mut state = self.bvh.new_traversal(ray.dir.into());
        let mut node;
        obvhs::traverse!(
            self.bvh,
            node,
            state,
            slabs.children::<L>(node, t_max, state.oct_inv4),
            {
                let slot = state.primitive_id as usize;
                if let Some(Touch { t, u, v }) = sheared.touch(&self.corners[slot], t_max) {
                    let triangle = self.bvh.primitive_indices[slot];
                    if !self.masked || self.geometry.exists(triangle, u, v) {
                        t_max = visit(Hit { t, u, v, triangle });
                        if t_max <= ray.t_min {
                            return;
                        }
                    }
                }
            }
        );
    }
}

/// The closest hit of a ray.
struct Closest<'a>(&'a BvhScene, &'a Ray);
impl Kernel for Closest<'_> {
    type Output = Option<Hit>;
    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<Hit> {
        let mut closest = None;
        self.0.walk::<L>(self.1, |hit| {
            closest = Some(hit);
            hit.t
        });
        closest
    }
}

/// Whether a ray hits anything.
struct Occluded<'a>(&'a BvhScene, &'a Ray);
impl Kernel for Occluded<'_> {
    type Output = bool;
    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let mut any = false;
        self.0.walk::<L>(self.1, |_| {
            any = true;
            f32::NEG_INFINITY
        });
        any
    }
}

impl RayQuery for BvhScene {
    fn closest(&self, ray: &Ray) -> Option<Hit> {
        lanes::run(Closest(self, ray))
    }
    fn occluded(&self, ray: &Ray) -> bool {
        lanes::run(Occluded(self, ray))
    }
    fn bounds(&self) -> Aabb {
        self.geometry.bounds
    }
}

/// Levels of inner nodes.
fn depth(bvh: &CwBvh) -> usize {
    let mut deepest = 0;
    let mut open = if bvh.nodes.is_empty() { Vec::new() } else { vec![(0usize, 1usize)] };
    while let Some((index, level)) = open.pop() {
        deepest = deepest.max(level);
        let node = &bvh.nodes[index];
        for child in 0..BRANCHING {
            if !node.is_child_empty(child) && !node.is_leaf(child) {
                open.push((node.child_node_index(child) as usize, level + 1));
            }
        }
    }
    deepest
}

/// A ray prepared for boxes.
struct Slabs {
    origin: Vec3A,
    inv_dir: Vec3A,
    negative: [bool; 3],
    t_min: f32,
}

impl Slabs {
    fn new(ray: &Ray) -> Self {
        // A component this small moves the ray by nothing; its reciprocal must stay finite, so that
        // 0 · ∞ never arises.
        let tiny = 1e-20;
        let inverse = |x: f32| if x.abs() < tiny { (1.0 / tiny).copysign(x) } else { 1.0 / x };
        let d = ray.dir;
        Self {
            origin: ray.origin.into(),
            inv_dir: Vec3A::new(inverse(d.x), inverse(d.y), inverse(d.z)),
            negative: [d.x.is_sign_negative(), d.y.is_sign_negative(), d.z.is_sign_negative()],
            t_min: ray.t_min,
        }
    }

    /// The children of a node whose padded boxes the ray meets, as the bits that `traverse!` wants.
    #[inline(always)]
    fn children<L: Lanes>(&self, node: &CwBvhNode, t_max: f32, oct_inv4: u32) -> u32 {
        let extent = node.compute_extent();
        let from_origin = Vec3A::from(node.p) - self.origin;
        let pad = (from_origin.abs() + extent * 255.0).max_element() * PADDING;
        let scale = extent * self.inv_dir;
        let start = from_origin * self.inv_dir;
        let slack = self.inv_dir.abs() * pad;
        let (enter, leave) = (start - slack, start + slack);
        let mut t_in = L::splat(self.t_min);
        let mut t_out = L::splat(t_max);
        let planes = [
            (&node.child_min_x, &node.child_max_x),
            (&node.child_min_y, &node.child_max_y),
            (&node.child_min_z, &node.child_max_z),
        ];
        for (axis, (low, high)) in planes.into_iter().enumerate() {
            let (first, last) = if self.negative[axis] { (high, low) } else { (low, high) };
            let scale = L::splat(scale[axis]);
            t_in = t_in.max(L::from_bytes(first).mul_add(scale, L::splat(enter[axis])));
            t_out = t_out.min(L::from_bytes(last).mul_add(scale, L::splat(leave[axis])));
        }
        let mut met = t_in.le(t_out).to_bitmask();
        let (child_bits, bit_index) = node.get_child_and_index_bits(oct_inv4);
        let mut mask = 0;
        while met != 0 {
            let child = met.trailing_zeros() as usize * 8;
            met &= met - 1;
            mask |= ((child_bits >> child) as u32 & 0xff) << ((bit_index >> child) as u32 & 0xff);
        }
        mask
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream, sample_uniform_sphere};
    use crate::scene::{Material, Mesh, Scene};

    #[test]
    fn both_forms_of_the_walk_find_the_same_bits() {
        let mut rng = Rng::new(11, Stream::Test, 0, 0);
        let mut random = || Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
        let positions: Vec<Vec3> = (0..3000)
            .flat_map(|_| {
                let at = random();
                [at, at + random() * 0.1, at + random() * 0.1]
            })
            .collect();
        let triangles: Vec<[u32; 3]> = (0..3000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = Mesh { materials: vec![0; 3000], positions, triangles, ..Mesh::default() };
        let materials = vec![Material::default()];
        let scene = Scene { meshes: vec![mesh], materials, ..Scene::default() };
        let bvh = BvhScene::build(&Arc::new(Geometry::new(&scene)), 1).unwrap();
        let mut found = 0;
        for _ in 0..5000 {
            let origin = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
            let ray = Ray::new(origin, sample_uniform_sphere(rng.next_2d()));
            let (vector, plain) = (bvh.closest(&ray), lanes::run_plain(Closest(&bvh, &ray)));
            assert_eq!(
                vector.map(|h| (h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.triangle)),
                plain.map(|h| (h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.triangle))
            );
            assert_eq!(bvh.occluded(&ray), lanes::run_plain(Occluded(&bvh, &ray)));
            found += usize::from(plain.is_some());
        }
        assert!((1000..4900).contains(&found), "{found} of 5000 rays hit");
    }
}
