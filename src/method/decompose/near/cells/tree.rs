//! A tree of boxes over blocks of eight facets: the range search of the near sum.
//!
//! Each node is cut at the median of its widest axis, whole blocks on the left. A query walks the
//! boxes that come within alpha of the point and reach above its tangent plane, depth first.

use glam::Vec3;
use rayon::prelude::*;

use super::block::{Block, Summation};
use super::{NearQuery, NearSum};
use crate::ffi::lanes::{self, Kernel, Lanes};
use crate::math::Aabb;
use crate::proxy::{Facet, Proxy};
use crate::sampling::Rng;

#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Aabb,
    /// Inner: index of the second child (the first follows the node). Leaf: block, marked by the
    /// high bit.
    link: u32,
}
const LEAF: u32 = 1 << 31;

/// Range search over cells.
#[derive(Debug)]
pub struct NearTree {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    plane_tolerance: f32,
}

/// Where a node of `count` ids is cut: whole blocks on the left.
fn middle(count: usize) -> usize {
    (count / 2).next_multiple_of(8).min(count - 1)
}

/// Sorts ids into the tree's order: each node at the median of its widest axis.
fn order(facets: &[Facet], ids: &mut [u32]) {
    if ids.len() <= 8 {
        return;
    }
    let spread = Aabb::around(ids.iter().map(|&i| facets[i as usize].centroid));
    let axis = (spread.max - spread.min).max_position();
    let cut = middle(ids.len());
    let at = |i: u32| facets[i as usize].centroid[axis];
    ids.select_nth_unstable_by(cut, |&a, &b| at(a).total_cmp(&at(b)).then(a.cmp(&b)));
    let (left, right) = ids.split_at_mut(cut);
    if right.len() > 2048 {
        rayon::join(|| order(facets, left), || order(facets, right));
    } else {
        order(facets, left);
        order(facets, right);
    }
}

/// The leaves' ids, depth first.
fn leaves<'a>(ids: &'a [u32], out: &mut Vec<&'a [u32]>) {
    if ids.len() <= 8 {
        out.push(ids);
        return;
    }
    let (left, right) = ids.split_at(middle(ids.len()));
    leaves(left, out);
    leaves(right, out);
}

impl NearTree {
    /// Builds over all cells, with their present radiosity.
    pub fn new(proxy: &Proxy) -> Self {
        let facets: Vec<Facet> = proxy.facets().collect();
        let mut ids: Vec<u32> = (0..facets.len() as u32).collect();
        if ids.is_empty() {
            return Self { nodes: Vec::new(), blocks: Vec::new(), plane_tolerance: 0.0 };
        }
        order(&facets, &mut ids);
        let mut groups = Vec::with_capacity(ids.len() / 8 + 1);
        leaves(&ids, &mut groups);
        let blocks: Vec<Block> = groups.par_iter().map(|ids| Block::new(&facets, ids)).collect();
        let bounds: Vec<Aabb> = groups
            .par_iter()
            .map(|ids| Aabb::around(ids.iter().flat_map(|&i| facets[i as usize].corners)))
            .collect();
        let mut tree = Self {
            nodes: Vec::with_capacity(2 * blocks.len()),
            blocks,
            plane_tolerance: 1e-3 * proxy.piece_size(),
        };
        tree.link(&mut bounds.iter(), ids.len());
        tree
    }

    /// Adds the nodes over `count` ids whose leaves are the next of `leaves`, depth first, and
    /// returns their box.
    fn link(&mut self, leaves: &mut std::slice::Iter<'_, Aabb>, count: usize) -> Aabb {
        let at = self.nodes.len();
        self.nodes.push(Node { bounds: Aabb::EMPTY, link: 0 });
        if count <= 8 {
            self.nodes[at].link = LEAF | (self.blocks.len() - leaves.len()) as u32;
            self.nodes[at].bounds = leaves.next().copied().unwrap_or(Aabb::EMPTY);
        } else {
            let left = self.link(leaves, middle(count));
            self.nodes[at].link = self.nodes.len() as u32;
            let right = self.link(leaves, count - middle(count));
            self.nodes[at].bounds =
                Aabb { min: left.min.min(right.min), max: left.max.max(right.max) };
        }
        self.nodes[at].bounds
    }

    /// Sum over the near cells of `x` with unit normal `n`; `rng` feeds the Monte Carlo integral.
    pub fn sum(&self, x: Vec3, n: Vec3, query: &NearQuery<'_>, rng: &mut Rng) -> NearSum {
        if self.nodes.is_empty() || query.alpha <= 0.0 {
            return NearSum::default();
        }
        lanes::run(Walk { tree: self, x, n, query, rng })
    }

    /// Memory held, bytes.
    pub fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>() + self.blocks.len() * size_of::<Block>()
    }
}

/// A query's way through the tree.
struct Walk<'a> {
    tree: &'a NearTree,
    x: Vec3,
    n: Vec3,
    query: &'a NearQuery<'a>,
    rng: &'a mut Rng,
}

impl Kernel for Walk<'_> {
    type Output = NearSum;
    #[inline(always)]
    fn run<L: Lanes>(self) -> NearSum {
        let Self { tree, x, n, query, rng } = self;
        let mut sum = Summation::<L>::new(x, n, query, tree.plane_tolerance);
        let alpha2 = query.alpha * query.alpha;
        let mut stack = [0u32; 64];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let node = &tree.nodes[index as usize];
            let outside = (node.bounds.min - x).max(x - node.bounds.max).max(Vec3::ZERO);
            let highest = Vec3::select(n.cmpge(Vec3::ZERO), node.bounds.max, node.bounds.min) - x;
            if outside.length_squared() >= alpha2 || highest.dot(n) <= tree.plane_tolerance {
                continue;
            }
            if node.link & LEAF == 0 {
                stack[depth] = node.link;
                stack[depth + 1] = index + 1;
                depth += 2;
            } else {
                sum.add(&tree.blocks[(node.link & !LEAF) as usize], rng);
            }
        }
        sum.finish()
    }
}
