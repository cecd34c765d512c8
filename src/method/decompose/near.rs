//! Pass 3b: the near cells of a point, found by range search and summed analytically, eight at a
//! time.
//!
//! ```text
//! Σ_T m_T B_T G_T / π   and   Σ_T m_T · moments_T        (the SH is applied to the summed moments: crate::sh::Quadratic)
//! ```
//! The cells lie in blocks of eight, leaves of a median-split tree of boxes. A query walks the
//! boxes that touch the ball of radius alpha and reach above the tangent plane; a block whose lanes
//! are all too far, all below the horizon, or all in the point's own plane is left early.
//!
//! A cell counts with the side that faces the point; the back of a one-sided cell does not exist.
//! Cells whose plane passes closer to the point than a thousandth of `near_cell` are its own plane
//! or touch it: they cover no solid angle that matters and are left out.
//!
//! A masked cell counts by the fraction of it that exists.
//!
//! Input   [`crate::proxy::Facet`]s. Output  [`NearSum`] at (x, N). Source
//!         `[Course07]` "nearby geometry", `[Lambert60]`, `[Arvo95]`.
//! Guarantees  the sum runs in tree order, whatever the thread. Cost  72 B a cell; tens of ns a
//!             near cell.

use glam::Vec3;
use rayon::prelude::*;
use wide::f32x8;

use super::near_sets::{SetEntry, TESTS};
use crate::math::{Aabb, Ray};
use crate::proxy::Proxy;
use crate::radiometry::Rgb;
use crate::sampling::{Rng, sample_triangle};
use crate::sh::{MOMENTS, ShRgb, moments8};
use crate::shading::World;

type F = f32x8;

/// Eight cells.
#[derive(Clone, Debug)]
struct Block {
    corners: [[F; 3]; 3],
    centroid: [F; 3],
    /// Radiosity over π of the front and the back.
    front: [F; 3],
    back: [F; 3],
    /// Cell of each lane; lanes past the last cell repeat it.
    ids: [u32; 8],
    /// Lane mask: the back does not exist.
    one_sided: F,
    /// Fraction of the cell that exists (masks); 0 in lanes without a cell (the last block may be
    /// short).
    coverage: F,
}

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

/// What the near cells of one point add up to.
#[derive(Clone, Copy, Debug, Default)]
pub struct NearSum {
    /// Σ m B G / π: irradiance that the near cells send.
    pub sent: Rgb,
    /// Σ m · moments: what they cover.
    pub moments: [f32; MOMENTS],
    /// Σ m S by Monte Carlo, where that was asked for.
    pub covered: Rgb,
    /// Σ m G / π: summed form factors.
    pub form_factor: f32,
    /// Cells with a contribution.
    pub cells: u32,
    /// Visibility rays shot.
    pub rays: u32,
}

impl NearSum {
    fn close(&mut self, moments: &[F; MOMENTS], sent: [F; 3]) {
        for (total, lanes) in self.moments.iter_mut().zip(moments) {
            *total = lanes.reduce_add();
        }
        self.sent = Rgb::from_array(sent.map(f32x8::reduce_add));
        self.form_factor = self.moments[0] * std::f32::consts::FRAC_1_PI;
    }
}

/// How near cells are summed at one point.
#[derive(Debug)]
pub struct NearQuery<'a> {
    /// Near/far distance.
    pub alpha: f32,
    /// Tests the visibility of every cell's centroid when set.
    pub trace: Option<&'a World>,
    /// With sets: a cell seen in part is tested where it changes this field's irradiance by more
    /// than the tolerance (W/m², mean of channels).
    pub flagged: Option<(&'a ShRgb, f32)>,
    /// Monte Carlo integral of this field instead of the moments, with points per cell.
    pub monte_carlo: Option<(&'a ShRgb, u32)>,
}

impl NearQuery<'_> {
    /// The plain query: visible, closed form.
    pub fn assumed(alpha: f32) -> Self {
        Self { alpha, trace: None, flagged: None, monte_carlo: None }
    }
}

/// Where a node of `count` ids is cut: whole blocks on the left.
fn middle(count: usize) -> usize {
    (count / 2).next_multiple_of(8).min(count - 1)
}

/// Sorts ids into the tree's order: each node at the median of its widest axis.
fn order(proxy: &Proxy, ids: &mut [u32]) {
    if ids.len() <= 8 {
        return;
    }
    let c = |i: u32| proxy.facet(i).centroid;
    let spread = Aabb::around(ids.iter().map(|&i| c(i)));
    let axis = (spread.max - spread.min).max_position();
    let cut = middle(ids.len());
    ids.select_nth_unstable_by(cut, |&a, &b| c(a)[axis].total_cmp(&c(b)[axis]).then(a.cmp(&b)));
    let (left, right) = ids.split_at_mut(cut);
    if right.len() > 2048 {
        rayon::join(|| order(proxy, left), || order(proxy, right));
    } else {
        order(proxy, left);
        order(proxy, right);
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
        let mut ids: Vec<u32> = (0..proxy.facet_count() as u32).collect();
        if ids.is_empty() {
            return Self { nodes: Vec::new(), blocks: Vec::new(), plane_tolerance: 0.0 };
        }
        order(proxy, &mut ids);
        let mut groups = Vec::with_capacity(ids.len() / 8 + 1);
        leaves(&ids, &mut groups);
        let blocks: Vec<Block> = groups.par_iter().map(|ids| block(proxy, ids)).collect();
        let bounds: Vec<Aabb> = groups
            .par_iter()
            .map(|ids| Aabb::around(ids.iter().flat_map(|&c| proxy.facet(c).corners)))
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

    /// Visits the blocks that come within `radius` of `x` and reach higher than `slack` below its
    /// plane, with the cells of their lanes.
    pub fn blocks_near(
        &self,
        x: Vec3,
        radius: f32,
        n: Vec3,
        slack: f32,
        visit: &mut dyn FnMut(u32, &[u32]),
    ) {
        let mut stack = if self.nodes.is_empty() { vec![] } else { vec![0u32] };
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            let outside = (node.bounds.min - x).max(x - node.bounds.max).max(Vec3::ZERO);
            let highest = Vec3::select(n.cmpge(Vec3::ZERO), node.bounds.max, node.bounds.min) - x;
            if outside.length_squared() >= radius * radius || highest.dot(n) <= -slack {
                continue;
            }
            if node.link & LEAF == 0 {
                stack.extend([node.link, index + 1]);
            } else {
                let block = &self.blocks[(node.link & !LEAF) as usize];
                let lanes = block.coverage.simd_gt(F::ZERO).to_bitmask().trailing_ones() as usize;
                visit(node.link & !LEAF, &block.ids[..lanes]);
            }
        }
    }

    /// Sum over the given blocks alone, each lane by its share.
    pub fn sum_set(
        &self,
        x: Vec3,
        n: Vec3,
        entries: &[SetEntry],
        query: &NearQuery<'_>,
        rng: &mut Rng,
    ) -> NearSum {
        let mut out = NearSum::default();
        let mut moments = [F::ZERO; MOMENTS];
        let mut sent = [F::ZERO; 3];
        for entry in entries {
            self.add_block(
                &self.blocks[entry.block as usize],
                x,
                n,
                query,
                Some(entry),
                rng,
                &mut moments,
                &mut sent,
                &mut out,
            );
        }
        out.close(&moments, sent);
        out
    }

    /// Sum over the near cells of `x` with unit normal `n`; `rng` feeds the Monte Carlo integral.
    pub fn sum(&self, x: Vec3, n: Vec3, query: &NearQuery<'_>, rng: &mut Rng) -> NearSum {
        let mut out = NearSum::default();
        if self.nodes.is_empty() || query.alpha <= 0.0 {
            return out;
        }
        let mut moments = [F::ZERO; MOMENTS];
        let mut sent = [F::ZERO; 3];
        let alpha2 = query.alpha * query.alpha;
        let mut stack = [0u32; 64];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let node = &self.nodes[index as usize];
            let outside = (node.bounds.min - x).max(x - node.bounds.max).max(Vec3::ZERO);
            let highest = Vec3::select(n.cmpge(Vec3::ZERO), node.bounds.max, node.bounds.min) - x;
            if outside.length_squared() >= alpha2 || highest.dot(n) <= self.plane_tolerance {
                continue;
            }
            if node.link & LEAF == 0 {
                stack[depth] = node.link;
                stack[depth + 1] = index + 1;
                depth += 2;
            } else {
                self.add_block(
                    &self.blocks[(node.link & !LEAF) as usize],
                    x,
                    n,
                    query,
                    None,
                    rng,
                    &mut moments,
                    &mut sent,
                    &mut out,
                );
            }
        }
        out.close(&moments, sent);
        out
    }

    fn add_block(
        &self,
        block: &Block,
        x: Vec3,
        n: Vec3,
        query: &NearQuery<'_>,
        set: Option<&SetEntry>,
        rng: &mut Rng,
        moments: &mut [F; MOMENTS],
        sent: &mut [F; 3],
        out: &mut NearSum,
    ) {
        let x8 = x.to_array().map(F::splat);
        let n8 = n.to_array().map(F::splat);
        let to_centroid: [F; 3] = std::array::from_fn(|k| block.centroid[k] - x8[k]);
        let distance = dot(to_centroid, to_centroid).sqrt();
        let m = if query.alpha == f32::INFINITY {
            F::ONE
        } else {
            let t = ((F::splat(query.alpha) - distance) * F::splat(4.0 / query.alpha))
                .fast_max(F::ZERO)
                .fast_min(F::ONE);
            t * t * (F::splat(3.0) - t - t)
        };
        let mut v: [[F; 3]; 3] =
            std::array::from_fn(|c| std::array::from_fn(|k| block.corners[c][k] - x8[k]));
        let height = v.map(|c| dot(c, n8));
        let tolerance = F::splat(self.plane_tolerance);
        let reaches = height[0].fast_max(height[1]).fast_max(height[2]).simd_gt(tolerance);
        let normal = cross(
            std::array::from_fn(|k| v[1][k] - v[0][k]),
            std::array::from_fn(|k| v[2][k] - v[0][k]),
        );
        let det = dot(normal, v[0]);
        let back = det.simd_gt(F::ZERO);
        let apart = det.abs().simd_gt(tolerance * dot(normal, normal).sqrt());
        let mut m = m * block.coverage;
        if let Some(set) = set {
            m *= F::from(set.share.map(|s| f32::from(s) / f32::from(TESTS)));
        }
        let mut active = m.simd_gt(F::ZERO) & reaches & apart & !(back & block.one_sided);
        if !active.any() {
            return;
        }
        if let Some(world) = query.trace.filter(|_| set.is_none()) {
            active &= self.visible(world, block, active, x, out);
            if !active.any() {
                return;
            }
        }
        // Wind every triangle clockwise as seen from x, so that the moments come out positive.
        let [_, second, third] = &mut v;
        for (a, b) in second.iter_mut().zip(third) {
            (*a, *b) = (back.bitselect(*a, *b), back.bitselect(*b, *a));
        }
        let mut weight = active & m;
        let found = moments8(&v, n);
        if let (Some(world), Some(set), Some((field, tolerance))) =
            (query.trace, set, query.flagged)
        {
            weight *=
                settle(world, block, set, weight * found[0], back, x, field, tolerance, rng, out);
        }
        for (sum, moment) in moments.iter_mut().zip(found) {
            *sum = weight.mul_add(moment, *sum);
        }
        let weighted_g = weight * found[0];
        for (sum, (from_back, from_front)) in
            sent.iter_mut().zip(block.back.iter().zip(&block.front))
        {
            *sum = weighted_g.mul_add(back.bitselect(*from_back, *from_front), *sum);
        }
        out.cells += active.to_bitmask().count_ones();
        if let Some((field, samples)) = query.monte_carlo {
            out.covered += monte_carlo(block, active, weighted_g, x, n, field, samples, rng);
        }
    }

    fn visible(&self, world: &World, block: &Block, active: F, x: Vec3, out: &mut NearSum) -> F {
        let centroid = block.centroid.map(|c| c.to_array());
        let lanes = active.to_bitmask();
        let mask = std::array::from_fn(|i| {
            if lanes >> i & 1 == 0 {
                return 0.0;
            }
            out.rays += 1;
            let target = Vec3::new(centroid[0][i], centroid[1][i], centroid[2][i]);
            let ray = Ray { t_max: 1.0 - 1e-3, ..Ray::new(x, target - x) };
            f32::from_bits(if world.rays.occluded(&ray) { 0 } else { u32::MAX })
        });
        F::from(mask)
    }

    /// Memory held, bytes.
    pub fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>() + self.blocks.len() * size_of::<Block>()
    }
}

/// Factor of each lane: 1, or where a cell seen in part matters, 0 or the inverse of its share by a
/// ray to a random place on it.
fn settle(
    world: &World,
    block: &Block,
    set: &SetEntry,
    weighted_g: F,
    back: F,
    x: Vec3,
    field: &ShRgb,
    tolerance: f32,
    rng: &mut Rng,
    out: &mut NearSum,
) -> F {
    let g = weighted_g.to_array();
    let back = back.to_bitmask();
    let lane = |k: [F; 3], i: usize| Vec3::from_array(k.map(|c| c.to_array()[i]));
    F::from(std::array::from_fn::<f32, 8, _>(|i| {
        let share = set.share[i];
        if share == 0 || share == TESTS || g[i] <= 0.0 {
            return 1.0;
        }
        let w = (lane(block.centroid, i) - x).normalize_or(Vec3::Y);
        let sent = Rgb::from(
            lane(if back >> i & 1 == 1 { block.back } else { block.front }, i).to_array(),
        );
        if ((sent - field.radiance(w)) * g[i]).abs().element_sum() <= 3.0 * tolerance {
            return 1.0;
        }
        out.rays += 1;
        let [a, b, c] = block.corners.map(|k| lane(k, i));
        let uv = sample_triangle(rng.next_2d());
        let to = a + (b - a) * uv.x + (c - a) * uv.y - x;
        if world.rays.occluded(&Ray { t_max: 1.0 - 1e-3, ..Ray::new(x, to) }) {
            0.0
        } else {
            f32::from(TESTS) / f32::from(share)
        }
    }))
}

/// Σ over lanes of (m G) · mean of the field over random points of the cell, weighted by their
/// share of G.
fn monte_carlo(
    block: &Block,
    active: F,
    weighted_g: F,
    x: Vec3,
    n: Vec3,
    field: &ShRgb,
    samples: u32,
    rng: &mut Rng,
) -> Rgb {
    let corners = block.corners.map(|c| c.map(|k| k.to_array()));
    let g = weighted_g.to_array();
    let lanes = active.to_bitmask();
    let mut sum = Rgb::ZERO;
    for i in (0..8).filter(|i| lanes >> i & 1 == 1) {
        let [a, b, c] = corners.map(|k| Vec3::new(k[0][i], k[1][i], k[2][i]));
        let normal = (b - a).cross(c - a);
        let (mut mean, mut total) = (Rgb::ZERO, 0.0);
        for _ in 0..samples {
            let uv = sample_triangle(rng.next_2d());
            let d = a + (b - a) * uv.x + (c - a) * uv.y - x;
            let r2 = d.length_squared().max(1e-20);
            let w = d / r2.sqrt();
            let share = n.dot(w).max(0.0) * normal.dot(w).abs() / r2;
            mean += field.radiance(w) * share;
            total += share;
        }
        if total > 0.0 {
            sum += mean * (g[i] / total);
        }
    }
    sum
}

fn dot(a: [F; 3], b: [F; 3]) -> F {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}
fn cross(a: [F; 3], b: [F; 3]) -> [F; 3] {
    [
        a[1].mul_sub(b[2], a[2] * b[1]),
        a[2].mul_sub(b[0], a[0] * b[2]),
        a[0].mul_sub(b[1], a[1] * b[0]),
    ]
}

fn block(proxy: &Proxy, ids: &[u32]) -> Block {
    let id = |lane: usize| ids[lane.min(ids.len() - 1)];
    let lanes =
        |f: &dyn Fn(u32) -> f32| F::from(std::array::from_fn::<f32, 8, _>(|lane| f(id(lane))));
    let mask = |f: &dyn Fn(usize) -> bool| {
        F::from(std::array::from_fn::<f32, 8, _>(|lane| {
            f32::from_bits(if f(lane) { u32::MAX } else { 0 })
        }))
    };
    let side = |s| {
        std::array::from_fn(|k| {
            lanes(&|c| proxy.facet(c).radiosity_of(s)[k] * std::f32::consts::FRAC_1_PI)
        })
    };
    Block {
        ids: std::array::from_fn(id),
        corners: std::array::from_fn(|v| {
            std::array::from_fn(|k| lanes(&|c| proxy.facet(c).corners[v][k]))
        }),
        centroid: std::array::from_fn(|k| lanes(&|c| proxy.facet(c).centroid[k])),
        front: side(crate::tessellate::Side::Front),
        back: side(crate::tessellate::Side::Back),
        one_sided: mask(&|lane| proxy.facet(id(lane)).one_sided),
        coverage: F::from(std::array::from_fn::<f32, 8, _>(|lane| {
            if lane < ids.len() { proxy.facet(id(lane)).coverage } else { 0.0 }
        })),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::decompose::membership;
    use crate::sampling::{Stream, sample_uniform_sphere};
    use crate::scene::{Material, Mesh, Scene, Sides};
    use crate::sh::{Quadratic, moments};
    use crate::tessellate::{Geometry, Side};

    fn proxy_of(
        positions: Vec<Vec3>,
        sides: Sides,
        near_cell: f32,
        glow: impl FnMut(Vec3, Vec3) -> Rgb,
    ) -> Proxy {
        let n = positions.len() as u32 / 3;
        let mesh = Mesh {
            positions,
            triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            materials: vec![0; n as usize],
            sides,
            ..Mesh::default()
        };
        Proxy::given(
            &Geometry::new(&Scene {
                meshes: vec![mesh],
                materials: vec![Material::default()],
                ..Scene::default()
            }),
            near_cell,
            glow,
        )
        .unwrap()
    }

    fn random_glow(rng: &mut Rng) -> impl FnMut(Vec3, Vec3) -> Rgb + '_ {
        |_, _| Rgb::new(rng.next_f32(), rng.next_f32(), rng.next_f32())
    }

    /// The definition, cell by cell in double precision.
    fn brute(proxy: &Proxy, x: Vec3, n: Vec3, alpha: f32) -> (Rgb, [f64; MOMENTS], u32) {
        let (mut sent, mut sum, mut count) = (Rgb::ZERO, [0.0; MOMENTS], 0);
        let tolerance = 1e-3 * proxy.piece_size();
        for f in proxy.facets() {
            let mut v = f.corners.map(|p| p - x);
            let normal = (v[1] - v[0]).cross(v[2] - v[0]).normalize();
            let m = membership(f.centroid.distance(x), alpha);
            let det = v[0].dot(normal);
            if m <= 0.0 || det.abs() <= tolerance || v.iter().all(|p| p.dot(n) <= tolerance) {
                continue;
            }
            let side = if det > 0.0 { Side::Back } else { Side::Front };
            if side == Side::Back && f.one_sided {
                continue;
            }
            if side == Side::Front {
                v.swap(1, 2);
            }
            let found = moments(&v, n);
            count += 1;
            sent += f.radiosity_of(side) * (f64::from(m) * found[0] / std::f64::consts::PI) as f32;
            for (s, f) in sum.iter_mut().zip(found) {
                *s += f64::from(m) * f;
            }
        }
        (sent, sum, count)
    }

    #[test]
    fn equals_the_definition_for_every_alpha_and_side_rule() {
        let mut rng = Rng::new(9, Stream::Test, 0, 0);
        let mut random = || Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
        let positions: Vec<Vec3> = (0..60)
            .flat_map(|_| {
                let c = random() * 2.0;
                [c, c + random() * 0.5, c + random() * 0.5]
            })
            .collect();
        for sides in [Sides::One, Sides::Two] {
            let proxy = proxy_of(positions.clone(), sides, 0.15, random_glow(&mut rng));
            assert!(proxy.facet_count() > 300);
            let tree = NearTree::new(&proxy);
            for alpha in [0.3, 1.0, f32::INFINITY] {
                for _ in 0..50 {
                    let x = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0;
                    let n = sample_uniform_sphere(rng.next_2d());
                    let fast = tree.sum(x, n, &NearQuery::assumed(alpha), &mut rng);
                    let (sent, sum, count) = brute(&proxy, x, n, alpha);
                    assert_eq!(fast.cells, count);
                    assert!((fast.sent - sent).abs().max_element() < 1e-4, "{} {sent}", fast.sent);
                    for (f, s) in fast.moments.iter().zip(sum) {
                        assert!((f64::from(*f) - s).abs() < 1e-3, "{f} {s}");
                    }
                }
            }
        }
    }

    #[test]
    fn alpha_zero_finds_nothing_and_no_cells_are_no_trouble() {
        let mut rng = Rng::new(9, Stream::Test, 1, 0);
        let triangle = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let proxy = proxy_of(triangle, Sides::Two, 0.1, random_glow(&mut rng));
        let tree = NearTree::new(&proxy);
        assert_eq!(tree.sum(Vec3::Z * 0.1, -Vec3::Z, &NearQuery::assumed(0.0), &mut rng).cells, 0);
        let tree = NearTree::new(&Proxy::default());
        assert_eq!(tree.sum(Vec3::ZERO, Vec3::Z, &NearQuery::assumed(1.0), &mut rng).cells, 0);
    }

    /// Moving a point through the shell of one bright cell must not pop: no step may exceed what
    /// the membership's slope allows.
    #[test]
    fn continuous_across_the_shell() {
        let mut rng = Rng::new(9, Stream::Test, 2, 0);
        let triangle = vec![Vec3::ZERO, Vec3::new(0.3, 0.0, 0.0), Vec3::new(0.0, 0.3, 0.0)];
        let tree = NearTree::new(&proxy_of(triangle, Sides::Two, 1.0, |_, _| Rgb::ONE));
        let at = |z: f32, rng: &mut Rng| {
            tree.sum(Vec3::new(0.1, 0.1, z), -Vec3::Z, &NearQuery::assumed(1.0), rng).sent.x
        };
        let (mut last, mut largest) = (at(0.5, &mut rng), 0.0f32);
        assert!(last > 0.01 && at(1.01, &mut rng) == 0.0);
        for step in 1..=600 {
            let now = at(0.5 + step as f32 * 1e-3, &mut rng);
            largest = largest.max((now - last).abs());
            last = now;
        }
        // Steepest: F(0.875) · |m'| = 0.045/(π 0.77) · 1.5 · 4 per unit length.
        assert!(largest < 2e-4, "{largest}");
    }

    #[test]
    fn monte_carlo_agrees_with_the_closed_form() {
        let mut rng = Rng::new(9, Stream::Test, 3, 0);
        let proxy = proxy_of(
            vec![Vec3::new(-1.0, -1.0, 0.4), Vec3::new(1.0, -1.0, 0.6), Vec3::new(0.0, 1.0, 0.8)],
            Sides::Two,
            0.2,
            random_glow(&mut rng),
        );
        let tree = NearTree::new(&proxy);
        let mut field = ShRgb::default();
        for c in field.0.iter_mut().take(9) {
            *c = Rgb::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
        }
        let query =
            NearQuery { alpha: 1.2, trace: None, flagged: None, monte_carlo: Some((&field, 400)) };
        let sum = tree.sum(Vec3::ZERO, Vec3::Z, &query, &mut rng);
        let exact = Quadratic::new(&field, Vec3::Z).integral(&sum.moments);
        assert!(
            (sum.covered - exact).abs().max_element() < 2e-3 * exact.max_element(),
            "{} {exact}",
            sum.covered
        );
    }
}
