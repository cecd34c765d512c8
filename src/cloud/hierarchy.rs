//! The tree of elements: what a group of discs looks like from afar.
//!
//! From direction w a group shows its projected area a and its radiant intensity I,
//!
//! ```text
//! a(w) = Σ_e A_e [ max(0, n_e·w) + max(0, −n_e·w) ]
//! I(w) = Σ_e A_e [ B_e max(0, n_e·w) + B'_e max(0, −n_e·w) ] / π
//! ```
//!
//! without the second terms for one-sided elements, which are all of them when only fronts or only
//! backs are there. Both are kept as nine SH coefficients (l ≤ 2, with the clamped cosine's band
//! factors `[RH01]`), beside the sum of areas, the centre of area, the mean normal (whose length is
//! the spread), a sphere around the discs and the mean radiosities of the two sides. Groups of one
//! plane use the mean normal instead: three bands give a plane that is seen from its edge an area,
//! which it does not have `[Christensen08]`.
//!
//! Input is a [`Cloud`] with the channels `_radiosity` and `_radiosity_back`, or without them when
//! only occlusion is wanted. Elements are sorted in Morton order (21 bits an axis) and groups are
//! split at the highest bit that differs, down to leaves of at most eight (`tree_build`). The
//! result is the same for any number of threads, and parents hold their children's sums. An element
//! takes 32 bytes and a node 124, of which there are about a third as many; building takes O(n log
//! n).
use glam::Vec3;
use rayon::prelude::*;

use super::pack::{PackedNormal, PackedRgb, PackedSh};
use super::tree_build::{build, morton_code};
use super::{Cloud, HitSides};
use crate::error::{Error, Result};
use crate::math::Aabb;
use crate::radiometry::Rgb;

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

impl Hierarchy {
    /// Sorts and sums. Call inside the thread pool.
    ///
    /// # Errors
    /// [`Error::Usage`] for clouds without elements or with more than 2³⁰.
    pub fn new(cloud: &Cloud, sides: HitSides) -> Result<Self> {
        if cloud.is_empty() || cloud.len() > MAX_ELEMENTS {
            return Err(Error::Usage(format!(
                "a cloud of {} elements cannot be gathered from; \
                 between 1 and {MAX_ELEMENTS} are possible",
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
                (morton_code(g), i)
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
    /// Position in the cloud of every element, in the tree's order.
    pub fn order(&self) -> &[u32] {
        &self.order
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
    use crate::sh::basis;

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
