//! The tree of elements: what a group of discs looks like from afar.
//!
//! ```text
//! a(w) = Σ_e A_e [ max(0, n_e·w) + max(0, −n_e·w) ]                       projected area towards w
//! I(w) = Σ_e A_e [ B_e max(0, n_e·w) + B'_e max(0, −n_e·w) ] / π          radiant intensity
//! of the sides that are there: without the second terms for one-sided elements, which are all of them for `hitsides` other than `both`
//! ```
//! both as nine SH coefficients (l ≤ 2; the clamped cosine's band factors `[RH01]`), beside Σ A,
//! the centre of area, the mean normal (its length is the spread), a sphere around the discs and
//! the mean radiosities of the two sides. Groups of one plane use the mean normal: three bands give
//! a plane seen from its edge an area, which it does not have `[Christensen08]`.
//!
//! Input   [`Cloud`] with `_radiosity`, `_radiosity_back` or without (occlusion only). Output
//!         [`Hierarchy`].
//! Method  elements in Morton order (21 bits an axis); groups split at the highest bit that
//!         differs, to leaves of at most 8.
//! Guarantees  the same for any number of threads; parents hold their children's sums.
//! Cost    32 B an element and 124 B a node, of which there are about a third as many; O(n log n).

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::pack::{PackedNormal, PackedRgb, PackedSh};
use super::{Cloud, HitSides};
use crate::error::{Error, Result};
use crate::math::Aabb;
use crate::radiometry::Rgb;
use crate::sh::{basis, cosine_band};

/// Most elements of a leaf.
const LEAF: usize = 8;
/// Groups of fewer elements are built by one thread.
const SERIAL: usize = 1 << 14;
/// Most elements: indices of elements and nodes leave two bits for the traversal.
const MAX_ELEMENTS: usize = 1 << 30;

/// A disc.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    pub p: Vec3,
    /// Area; negative for discs that have no back.
    pub signed_area: f32,
    pub n: PackedNormal,
    /// Radiosity times the tree's scale: front, back.
    pub radiosity: [PackedRgb; 2],
}

/// What the traversal always reads: 32 B.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// Centre of area.
    pub center: Vec3,
    /// Of a sphere around `center` that holds the discs.
    pub radius: f32,
    /// Of a slab across the mean normal, around `center`, that holds the discs: half its width.
    pub thickness: f32,
    /// Second child (the first follows its parent), or a leaf's first element.
    pub next: u32,
    /// Mean normal times 32767.
    pub mean_normal: [i16; 3],
    /// Elements of a leaf; 0 for inner nodes.
    pub count: u8,
    /// No element has a back.
    pub one_sided: bool,
}

/// What it reads of the nodes it uses: 92 B.
#[derive(Clone, Copy, Debug)]
pub(super) struct Appearance {
    /// Σ A.
    pub total: f32,
    /// a(w).
    pub area: PackedSh<9>,
    /// π · scale · I(w): red, green, blue.
    pub power: PackedSh<27>,
    /// Mean radiosity times the scale, front and back.
    pub radiosity: [PackedRgb; 2],
}

/// The elements in order and the nodes above them.
#[derive(Debug)]
pub struct Hierarchy {
    pub(super) discs: Vec<Disc>,
    pub(super) nodes: Vec<Node>,
    pub(super) appearances: Vec<Appearance>,
    /// Position of every element in the cloud.
    pub(super) order: Vec<u32>,
    /// Colours are stored times this.
    pub(super) scale: f32,
    /// Elements hold radiosity.
    lit: bool,
}

/// A node, for looking at: one disc for all elements below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Group {
    /// First element below, in the tree's order.
    pub first: u32,
    /// Elements below.
    pub count: u32,
    /// Steps from the root.
    pub depth: u32,
    /// Nothing below but elements.
    pub leaf: bool,
    /// Centre of area, world space.
    pub center: Vec3,
    /// Mean normal; its length, at most 1, is the spread.
    pub normal: Vec3,
    /// Sum of areas, scene units squared.
    pub area: f32,
}

impl Disc {
    pub fn area(&self) -> f32 {
        self.signed_area.abs()
    }
    pub fn has_back(&self) -> bool {
        self.signed_area > 0.0
    }
}

impl Node {
    pub fn mean_normal(&self) -> Vec3 {
        Vec3::from_array(self.mean_normal.map(|v| f32::from(v) * (1.0 / 32767.0)))
    }
}

/// Sums of a group.
#[derive(Clone, Copy)]
struct Sums {
    area: f32,
    /// Area times position relative to the group's first element.
    moment: DVec3,
    origin: Vec3,
    normal: Vec3,
    front: Rgb,
    back: Rgb,
    area_sh: [f32; 9],
    power_sh: [f32; 27],
    bounds: Aabb,
    center: Vec3,
    radius: f32,
    thickness: f32,
    one_sided: bool,
}

impl Sums {
    fn of_element(disc: &Disc) -> Self {
        let (n, area, has_back) = (disc.n.get(), disc.area(), disc.has_back());
        let y = basis(n);
        let [front, back] = disc.radiosity.map(|c| c.get() * area);
        let (mut area_sh, mut power_sh) = ([0.0; 9], [0.0; 27]);
        for l in 0..3usize {
            for i in l * l..(l + 1) * (l + 1) {
                let lobe = cosine_band(l) * y[i];
                let turned = if !has_back {
                    0.0
                } else if l % 2 == 0 {
                    1.0
                } else {
                    -1.0
                };
                area_sh[i] = area * lobe * (1.0 + turned);
                let both = front + back * turned;
                for k in 0..3 {
                    power_sh[9 * k + i] = both[k] * lobe;
                }
            }
        }
        let radius = (area * std::f32::consts::FRAC_1_PI).sqrt();
        let extent = (Vec3::ONE - n * n).max(Vec3::ZERO).map(f32::sqrt) * radius;
        let bounds = Aabb { min: disc.p - extent, max: disc.p + extent };
        Self {
            area,
            moment: DVec3::ZERO,
            origin: disc.p,
            normal: n * area,
            front,
            back,
            area_sh,
            power_sh,
            bounds,
            center: disc.p,
            radius,
            thickness: 0.0,
            one_sided: !has_back,
        }
    }

    /// Both together; centre and radius of the sum.
    fn join(&self, other: &Self) -> Self {
        let mut sum = *self;
        sum.area += other.area;
        sum.one_sided &= other.one_sided;
        sum.moment +=
            other.moment + (other.origin - self.origin).as_dvec3() * f64::from(other.area);
        sum.normal += other.normal;
        sum.front += other.front;
        sum.back += other.back;
        sum.area_sh.iter_mut().zip(&other.area_sh).for_each(|(a, b)| *a += b);
        sum.power_sh.iter_mut().zip(&other.power_sh).for_each(|(a, b)| *a += b);
        sum.bounds = Aabb {
            min: self.bounds.min.min(other.bounds.min),
            max: self.bounds.max.max(other.bounds.max),
        };
        sum.center = self.origin + (sum.moment / f64::from(sum.area)).as_vec3();
        let by_parts = (sum.center.distance(self.center) + self.radius)
            .max(sum.center.distance(other.center) + other.radius);
        let corner = (sum.bounds.max - sum.center).max(sum.center - sum.bounds.min);
        sum.radius = by_parts.min(corner.length());
        // A part's discs lie in its own slab and its own sphere, both turned by the angle between
        // the normals.
        let axis = sum.normal.normalize_or(Vec3::Z);
        let reach = |part: &Self| {
            let normal = part.normal.normalize_or(Vec3::Z);
            let own = (part.thickness * normal.dot(axis).abs()
                + part.radius * normal.cross(axis).length())
            .min(part.radius);
            (part.center - sum.center).dot(axis).abs() + own
        };
        sum.thickness = reach(self).max(reach(other)).min(sum.radius);
        sum
    }

    fn node(&self, next: u32, count: u8) -> Node {
        let mean = (self.normal / self.area * 32767.0)
            .round()
            .clamp(Vec3::splat(-32767.0), Vec3::splat(32767.0));
        Node {
            center: self.center,
            radius: self.radius,
            thickness: self.thickness,
            next,
            mean_normal: mean.to_array().map(|v| v as i16),
            count,
            one_sided: self.one_sided,
        }
    }

    fn appearance(&self) -> Appearance {
        Appearance {
            total: self.area,
            area: PackedSh::new(&self.area_sh),
            power: PackedSh::new(&self.power_sh),
            radiosity: [
                PackedRgb::new(self.front / self.area, 1.0),
                PackedRgb::new(self.back / self.area, 1.0),
            ],
        }
    }
}

#[derive(Default)]
struct Part {
    nodes: Vec<Node>,
    appearances: Vec<Appearance>,
}

/// Builds the group of elements `from .. from + codes.len()`. `next` of inner nodes is relative to
/// the part.
fn build(codes: &[(u64, u32)], discs: &[Disc], from: usize) -> (Part, Sums) {
    let mut part = Part::default();
    let sums = if codes.len() > SERIAL {
        let middle = split(codes);
        let ((left, a), (right, b)) = rayon::join(
            || build(&codes[..middle], &discs[..middle], from),
            || build(&codes[middle..], &discs[middle..], from + middle),
        );
        let sums = a.join(&b);
        let first = 1 + left.nodes.len() as u32;
        part.nodes.reserve(1 + left.nodes.len() + right.nodes.len());
        part.appearances.reserve(1 + left.nodes.len() + right.nodes.len());
        part.nodes.push(sums.node(first, 0));
        part.appearances.push(sums.appearance());
        for (child, base) in [(left, 1), (right, first)] {
            part.nodes.extend(
                child
                    .nodes
                    .into_iter()
                    .map(|n| if n.count == 0 { Node { next: n.next + base, ..n } } else { n }),
            );
            part.appearances.extend(child.appearances);
        }
        sums
    } else {
        serial(codes, discs, from, &mut part)
    };
    (part, sums)
}

fn serial(codes: &[(u64, u32)], discs: &[Disc], from: usize, part: &mut Part) -> Sums {
    if codes.len() <= LEAF {
        let mut sums = Sums::of_element(&discs[0]);
        for disc in &discs[1..] {
            sums = sums.join(&Sums::of_element(disc));
        }
        part.nodes.push(sums.node(from as u32, codes.len() as u8));
        part.appearances.push(sums.appearance());
        return sums;
    }
    let at = part.nodes.len();
    let empty = Sums::of_element(&discs[0]);
    part.nodes.push(empty.node(0, 0));
    part.appearances.push(empty.appearance());
    let middle = split(codes);
    let a = serial(&codes[..middle], &discs[..middle], from, part);
    let second = part.nodes.len() as u32;
    let b = serial(&codes[middle..], &discs[middle..], from + middle, part);
    let sums = a.join(&b);
    part.nodes[at] = sums.node(second, 0);
    part.appearances[at] = sums.appearance();
    sums
}

/// Where the highest differing bit turns; the middle when all codes are equal.
fn split(codes: &[(u64, u32)]) -> usize {
    let (first, last) = (codes[0].0, codes[codes.len() - 1].0);
    if first == last {
        return codes.len() / 2;
    }
    let bit = 1u64 << (63 - (first ^ last).leading_zeros());
    codes.partition_point(|c| c.0 & bit == 0)
}

/// Every third bit, 21 of them.
fn spread(x: u32) -> u64 {
    let mut x = u64::from(x) & 0x1f_ffff;
    for (shift, mask) in [
        (32, 0x1f_0000_0000_ffff),
        (16, 0x1f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

impl Hierarchy {
    /// Sorts and sums. Call inside the thread pool.
    ///
    /// # Errors
    /// [`Error::Render`] for clouds without elements or with more than 2³⁰.
    pub fn new(cloud: &Cloud, sides: HitSides) -> Result<Self> {
        if cloud.is_empty() || cloud.len() > MAX_ELEMENTS {
            return Err(Error::Render(format!(
                "a cloud of {} elements cannot be gathered from; between 1 and {MAX_ELEMENTS} are possible",
                cloud.len()
            )));
        }
        let bounds = Aabb::around(cloud.p.iter().copied());
        let size = (bounds.max - bounds.min).max_element();
        let to_grid = if size > 0.0 { 2_097_151.0 / size } else { 0.0 };
        let mut codes: Vec<(u64, u32)> = cloud
            .p
            .par_iter()
            .zip(0..cloud.len() as u32)
            .map(|(p, i)| {
                let g = ((*p - bounds.min) * to_grid).as_uvec3();
                (spread(g.x) << 2 | spread(g.y) << 1 | spread(g.z), i)
            })
            .collect();
        codes.par_sort_unstable();
        let (front, back) = (cloud.channel(Cloud::RADIOSITY), cloud.channel(Cloud::RADIOSITY_BACK));
        let brightest = front
            .into_iter()
            .chain(back)
            .map(|c| c.par_iter().map(|v| v.max_element()).reduce(|| 0.0, f32::max))
            .fold(0.0, f32::max);
        let scale = if brightest > 0.0 { 1024.0 / brightest } else { 1.0 };
        let light = |channel: Option<&[Rgb]>, i: usize| {
            channel.map_or(PackedRgb::default(), |c| PackedRgb::new(c[i], scale))
        };
        let discs: Vec<Disc> = codes
            .par_iter()
            .map(|&(_, i)| {
                let i = i as usize;
                let (n, sign) = match sides {
                    HitSides::Both if !cloud.one_sided[i] => (cloud.n[i], 1.0),
                    HitSides::Both | HitSides::Front => (cloud.n[i], -1.0),
                    HitSides::Back => (-cloud.n[i], -1.0),
                };
                let mut radiosity = [light(front, i), light(back, i)];
                if sides == HitSides::Back {
                    radiosity.reverse();
                }
                Disc {
                    p: cloud.p[i],
                    signed_area: sign * cloud.area[i],
                    n: PackedNormal::new(n),
                    radiosity,
                }
            })
            .collect();
        let (part, _) = build(&codes, &discs, 0);
        let order = codes.into_iter().map(|c| c.1).collect();
        Ok(Self {
            discs,
            nodes: part.nodes,
            appearances: part.appearances,
            order,
            scale,
            lit: front.is_some(),
        })
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.discs.len()
    }
    /// Never: there is at least one element.
    pub fn is_empty(&self) -> bool {
        self.discs.is_empty()
    }
    /// Ranges of elements in the tree's order: the largest groups of at most `most`.
    pub(super) fn groups(&self, most: usize) -> Vec<std::ops::Range<usize>> {
        let span = self.spans();
        let (mut groups, mut stack) = (Vec::new(), vec![0usize]);
        while let Some(i) = stack.pop() {
            let (from, to) = (span[i].0 as usize, span[i].1 as usize);
            if to - from <= most.max(LEAF) {
                groups.push(from..to);
            } else {
                stack.extend([self.nodes[i].next as usize, i + 1]);
            }
        }
        groups
    }
    /// Position in the cloud of every element, in the tree's order.
    pub fn order(&self) -> &[u32] {
        &self.order
    }
    /// Every node, parents before their children: those of one depth are what the cloud looks like
    /// at that level, beside leaves above it.
    pub fn all_groups(&self) -> Vec<Group> {
        let (span, mut groups) = (self.spans(), Vec::with_capacity(self.nodes.len()));
        let mut open = vec![(0usize, 0u32)];
        while let Some((i, depth)) = open.pop() {
            let (node, (first, end)) = (&self.nodes[i], span[i]);
            let (center, normal, area) =
                (node.center, node.mean_normal(), self.appearances[i].total);
            groups.push(Group {
                first,
                count: end - first,
                depth,
                leaf: node.count > 0,
                center,
                normal,
                area,
            });
            if node.count == 0 {
                open.extend([(node.next as usize, depth + 1), (i + 1, depth + 1)]);
            }
        }
        groups
    }
    /// Range of elements below every node.
    fn spans(&self) -> Vec<(u32, u32)> {
        // From the back: children follow their parent.
        let mut span = vec![(0u32, 0u32); self.nodes.len()];
        for (i, node) in self.nodes.iter().enumerate().rev() {
            span[i] = if node.count > 0 {
                (node.next, node.next + u32::from(node.count))
            } else {
                (span[i + 1].0, span[node.next as usize].1)
            };
        }
        span
    }
    /// True when the elements hold radiosity: light can be gathered, not only occlusion.
    pub fn is_lit(&self) -> bool {
        self.lit
    }
    /// Memory that elements and nodes occupy.
    pub fn bytes(&self) -> usize {
        size_of_val(self.discs.as_slice())
            + size_of_val(self.nodes.as_slice())
            + size_of_val(self.appearances.as_slice())
            + size_of_val(self.order.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream, sample_uniform_sphere};

    fn cloud(count: usize) -> Cloud {
        let mut rng = Rng::new(5, Stream::Test, 1, 0);
        let mut cloud = Cloud::default();
        let mut light = [Vec::new(), Vec::new()];
        for _ in 0..count {
            cloud.p.push(Vec3::new(rng.next_f32() * 3.0, rng.next_f32(), rng.next_f32()));
            cloud.n.push(sample_uniform_sphere(rng.next_2d()));
            cloud.area.push(1e-4 + 1e-3 * rng.next_f32());
            cloud.one_sided.push(rng.next_f32() < 0.5);
            light
                .iter_mut()
                .for_each(|l| l.push(Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32())));
        }
        let [front, back] = light;
        cloud.set(Cloud::RADIOSITY, front);
        cloud.set(Cloud::RADIOSITY_BACK, back);
        cloud
    }

    #[test]
    fn sums_and_spheres_hold_what_is_below() {
        let cloud = cloud(40_000);
        let tree = Hierarchy::new(&cloud, HitSides::Both).unwrap();
        assert!((f64::from(tree.appearances[0].total) / cloud.total_area() - 1.0).abs() < 1e-3);
        let mut seen = vec![false; cloud.len()];
        tree.order.iter().for_each(|&i| seen[i as usize] = true);
        assert!(seen.iter().all(|&s| s));
        // Elements below every node, by walking.
        let mut covered = 0;
        let mut stack = vec![(0usize, Vec::<usize>::new())];
        while let Some((i, mut above)) = stack.pop() {
            let node = &tree.nodes[i];
            above.push(i);
            if node.count == 0 {
                stack.push((i + 1, above.clone()));
                stack.push((node.next as usize, above));
                continue;
            }
            for e in node.next as usize..node.next as usize + node.count as usize {
                covered += 1;
                let disc = &tree.discs[e];
                let reach = (disc.area() / std::f32::consts::PI).sqrt();
                for &a in &above {
                    let a = &tree.nodes[a];
                    let (d, n) = (disc.p - a.center, disc.n.get());
                    let (up, aside) = (d.dot(n), (d - n * d.dot(n)).length() + reach);
                    assert!((up * up + aside * aside).sqrt() <= a.radius * 1.0001 + 1e-6);
                    let axis = a.mean_normal().normalize_or(Vec3::Z);
                    let out = reach * (1.0 - disc.n.get().dot(axis).powi(2)).max(0.0).sqrt();
                    assert!(
                        (disc.p - a.center).dot(axis).abs() + out <= a.thickness + 1e-3 * a.radius
                    );
                }
            }
        }
        assert_eq!(covered, cloud.len());
        assert!(tree.bytes() <= 100 * cloud.len(), "{} B an element", tree.bytes() / cloud.len());
    }

    #[test]
    fn the_root_looks_like_its_elements() {
        let cloud = cloud(3000);
        let tree = Hierarchy::new(&cloud, HitSides::Both).unwrap();
        let root = &tree.appearances[0];
        for w in [Vec3::X, Vec3::new(0.3, -0.8, 0.5).normalize(), -Vec3::Z] {
            let y: [f32; 9] = basis(w)[..9].try_into().unwrap();
            let area: f32 = (0..cloud.len())
                .map(|i| {
                    cloud.area[i]
                        * if cloud.one_sided[i] {
                            cloud.n[i].dot(w).max(0.0)
                        } else {
                            cloud.n[i].dot(w).abs()
                        }
                })
                .sum();
            let red: f32 = (0..cloud.len())
                .map(|i| {
                    let cos = cloud.n[i].dot(w);
                    let back = if cloud.one_sided[i] {
                        0.0
                    } else {
                        cloud.channels[1].values[i].x * (-cos).max(0.0)
                    };
                    cloud.area[i] * (cloud.channels[0].values[i].x * cos.max(0.0) + back)
                })
                .sum();
            assert!((root.area.dot(0, &y) / area - 1.0).abs() < 0.02);
            assert!((root.power.dot(0, &y) / tree.scale / red - 1.0).abs() < 0.02);
        }
    }

    #[test]
    fn threads_do_not_matter_and_equal_points_do_not_hang() {
        let cloud = cloud(60_000);
        let build = |threads: usize| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap()
                .install(|| Hierarchy::new(&cloud, HitSides::Both).unwrap())
        };
        let (one, three) = (build(1), build(3));
        assert_eq!(one.order, three.order);
        assert!(
            one.nodes
                .iter()
                .zip(&three.nodes)
                .all(|(a, b)| a.center == b.center && a.radius == b.radius && a.next == b.next)
        );
        let same = Cloud {
            p: vec![Vec3::ONE; 100],
            n: vec![Vec3::Z; 100],
            area: vec![1.0; 100],
            one_sided: vec![false; 100],
            channels: Vec::new(),
        };
        assert_eq!(Hierarchy::new(&same, HitSides::Both).unwrap().len(), 100);
        assert!(Hierarchy::new(&Cloud::default(), HitSides::Both).is_err());
    }
}
