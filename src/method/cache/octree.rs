//! Spheres in an octree: which hold a point, and whose centres lie in a sphere.
//!
//! A sphere of radius R is referenced by every node of side in \[2R, 4R) that its box overlaps:
//! eight at most. So the spheres around a point are all found on one path from the root, and there
//! are no lists longer than the true overlap by more than a constant factor.
//!
//! Input   centres and radii, within or around the root's box. Guarantees  answers contain every
//!         sphere in question (and others: callers test exactly), in an order that depends on
//!         insertions alone. Cost  O(depth) an operation, depth at most 24.

use glam::Vec3;

use crate::math::Aabb;

/// Smaller spheres go to the nodes of this depth.
const DEEPEST: u32 = 24;
const NONE: u32 = u32::MAX;

#[derive(Clone, Debug)]
struct Node {
    children: [u32; 8],
    items: Vec<u32>,
}

impl Node {
    fn new() -> Self {
        Self { children: [NONE; 8], items: Vec::new() }
    }
}

/// The tree; items are indices into the caller's list.
#[derive(Clone, Debug)]
pub struct Octree {
    corner: Vec3,
    side: f32,
    nodes: Vec<Node>,
}

impl Octree {
    /// An empty tree around a box (a little larger than it).
    pub fn new(bounds: &Aabb) -> Self {
        let side = (bounds.max - bounds.min).max_element().max(f32::MIN_POSITIVE) * 1.02;
        Self { corner: bounds.center() - Vec3::splat(0.5 * side), side, nodes: vec![Node::new()] }
    }

    /// Adds item `index` with its sphere. What lies outside the root's box is found by points
    /// outside as well: they share its border nodes.
    pub fn insert(&mut self, index: u32, center: Vec3, radius: f32) {
        let mut depth = 0;
        let mut side = self.side;
        while depth < DEEPEST && side >= 4.0 * radius {
            side *= 0.5;
            depth += 1;
        }
        let cells = (1u32 << depth) as f32;
        let cell = |v: Vec3| {
            ((v - self.corner) / side)
                .floor()
                .clamp(Vec3::ZERO, Vec3::splat(cells - 1.0))
                .as_uvec3()
        };
        let (low, high) = (cell(center - Vec3::splat(radius)), cell(center + Vec3::splat(radius)));
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    let node = self.node(depth, [x, y, z]);
                    self.nodes[node].items.push(index);
                }
            }
        }
    }

    /// The node of integer coordinates at a depth, made where missing.
    fn node(&mut self, depth: u32, cell: [u32; 3]) -> usize {
        let mut at = 0;
        for level in (0..depth).rev() {
            let child = (0..3).fold(0, |c, axis| c | ((cell[axis] >> level & 1) as usize) << axis);
            if self.nodes[at].children[child] == NONE {
                self.nodes[at].children[child] = self.nodes.len() as u32;
                self.nodes.push(Node::new());
            }
            at = self.nodes[at].children[child] as usize;
        }
        at
    }

    /// Calls `visit` with candidates for the spheres that hold `p`, until it returns true; each
    /// once. Returns whether it did.
    pub fn around(&self, p: Vec3, mut visit: impl FnMut(u32) -> bool) -> bool {
        let finest = (1u32 << DEEPEST) as f32;
        let cell = ((p - self.corner) / self.side * finest)
            .floor()
            .clamp(Vec3::ZERO, Vec3::splat(finest - 1.0))
            .as_uvec3();
        let mut at = 0;
        for level in (0..=DEEPEST).rev() {
            let node = &self.nodes[at];
            if node.items.iter().any(|&item| visit(item)) {
                return true;
            }
            if level == 0 {
                break;
            }
            let bit = |v: u32| (v >> (level - 1) & 1) as usize;
            let child = node.children[bit(cell.x) | bit(cell.y) << 1 | bit(cell.z) << 2];
            if child == NONE {
                break;
            }
            at = child as usize;
        }
        false
    }

    /// Candidates for the items whose centres lie within `radius` of `p`, ascending.
    pub fn within(&self, p: Vec3, radius: f32) -> Vec<u32> {
        // What lies outside the box is kept at its border; clamping brings no two points further
        // apart.
        let p = p.clamp(self.corner, self.corner + Vec3::splat(self.side));
        let mut found = Vec::new();
        let mut open = vec![(0u32, self.corner, self.side)];
        while let Some((at, corner, side)) = open.pop() {
            let node = &self.nodes[at as usize];
            found.extend_from_slice(&node.items);
            let half = 0.5 * side;
            for (i, &child) in node.children.iter().enumerate().filter(|(_, c)| **c != NONE) {
                let low =
                    corner + Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * half;
                if p.distance_squared(p.clamp(low, low + Vec3::splat(half)))
                    <= radius * radius * 1.0001 + self.side * self.side * 1e-13
                {
                    open.push((child, low, half));
                }
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Never: there is a root.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn agrees_with_brute_force(seed in 0u64..10_000, scale in -7.0f32..3.0) {
            let mut rng = Rng::new(seed, Stream::Test, 0, 0);
            // Some centres and queries lie outside the box.
            let mut point = || {
                let place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
                place * 1.2 - Vec3::splat(0.1)
            };
            let centers: Vec<Vec3> = (0..120).map(|_| point()).collect();
            let elsewhere = (0..60).map(|_| point());
            let queries: Vec<Vec3> = elsewhere.chain(centers.iter().copied().take(20)).collect();
            let radii: Vec<f32> = (0..120).map(|_| 10f32.powf(scale * rng.next_f32())).collect();
            let mut tree = Octree::new(&Aabb { min: Vec3::ZERO, max: Vec3::ONE });
            for i in 0..centers.len() {
                tree.insert(i as u32, centers[i], radii[i]);
            }
            for &q in &queries {
                let mut seen = Vec::new();
                tree.around(q, |i| { seen.push(i); false });
                let count = seen.len();
                seen.sort_unstable();
                seen.dedup();
                prop_assert_eq!(count, seen.len(), "each once");
                for i in 0..centers.len() {
                    if centers[i].distance(q) < radii[i] {
                        prop_assert!(seen.contains(&(i as u32)));
                    }
                }
                let radius = radii[0];
                let near = tree.within(q, radius);
                for (i, c) in centers.iter().enumerate() {
                    if c.distance(q) < radius {
                        prop_assert!(near.contains(&(i as u32)), "{q} {c} {radius}");
                    }
                }
            }
        }
    }

    #[test]
    fn tiny_huge_and_infinite_radii() {
        let mut tree = Octree::new(&Aabb { min: Vec3::ZERO, max: Vec3::ONE });
        for (i, r) in [0.0, 1e-30, 1e30, f32::INFINITY].into_iter().enumerate() {
            tree.insert(i as u32, Vec3::splat(0.3), r);
        }
        let mut seen = Vec::new();
        tree.around(Vec3::splat(0.3), |i| {
            seen.push(i);
            false
        });
        seen.sort_unstable();
        assert_eq!(seen, [0, 1, 2, 3]);
        assert!(tree.len() < 100);
        assert!(tree.around(Vec3::splat(0.9), |i| i == 3));
    }
}
