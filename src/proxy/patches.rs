//! Cell sides summed into patches of doubling size: regions of any radius at bounded cost.
//!
//! A patch is what lies in one box of a grid and faces one of 24 sectors (cube face, quadrant).
//! Level l has boxes of edge `edge · 2^l` and is made of the patches of level l − 1. A region of
//! radius r sums the patches of the level whose boxes are r/3 that agree in normal and lie in the
//! squashed ball, with weight 1 − d²/r² on flux and area alike. So a query visits tens of patches
//! whether the surface is one large cell or thousands of small ones.
//!
//! Flux is divided by the area it was counted on. Sorting fixes the order, so bits do not depend on
//! threads. A patch costs about 60 B, all levels twice the first; they take O(n log n) to build.

use glam::Vec3;
use rayon::prelude::*;

use super::surface_index::{Region, squashed};
use crate::math::KdTree;

/// Box edges in a radius.
const BOXES_PER_RADIUS: f32 = 3.0;

/// What lies together and faces alike.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    pub center: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    pub sums: Region,
}

#[derive(Debug)]
struct Level {
    tree: KdTree,
    patches: Vec<Patch>,
}

/// All levels.
#[derive(Debug)]
pub(super) struct Patches {
    levels: Vec<Level>,
    /// Radius that the first level serves.
    first_radius: f32,
    /// Patch of the first level that each side went to.
    pub patch_of_side: Vec<u32>,
}

/// Cube face and quadrant of a direction, 0..24.
fn sector(n: Vec3) -> u64 {
    let a = n.abs();
    let (axis, u, v) = if a.x >= a.y && a.x >= a.z {
        (0, n.y, n.z)
    } else if a.y >= a.z {
        (1, n.x, n.z)
    } else {
        (2, n.x, n.y)
    };
    (axis * 2 + u64::from(n[axis as usize] < 0.0)) * 4 + u64::from(u < 0.0) * 2 + u64::from(v < 0.0)
}

/// The patches of a grid, and the patch that each of `fine` went to.
fn merge(fine: &[Patch], origin: Vec3, edge: f32) -> (Vec<Patch>, Vec<u32>) {
    let mut order: Vec<((u64, u64), u32)> = fine
        .par_iter()
        .zip(0..fine.len() as u32)
        .map(|(p, i)| {
            let c = ((p.center - origin) / edge).max(Vec3::ZERO).as_uvec3();
            (((u64::from(c.x) << 32) | u64::from(c.y), (u64::from(c.z) << 8) | sector(p.normal)), i)
        })
        .collect();
    order.par_sort_unstable();
    let mut patch_of = vec![0; fine.len()];
    for (group, at) in order.chunk_by(|a, b| a.0 == b.0).zip(0..) {
        for &(_, i) in group {
            patch_of[i as usize] = at;
        }
    }
    let patches = order
        .chunk_by(|a, b| a.0 == b.0)
        .map(|group| {
            let first = fine[group[0].1 as usize];
            let (mut center, mut normal, mut sums) = (Vec3::ZERO, Vec3::ZERO, Region::default());
            for &(_, i) in group {
                let p = &fine[i as usize];
                center += (p.center - first.center) * p.sums.area;
                normal += p.normal * p.sums.area;
                sums.flux += p.sums.flux;
                sums.area += p.sums.area;
                sums.photons += p.sums.photons;
            }
            Patch {
                center: first.center + center / sums.area,
                normal: normal.normalize_or(first.normal),
                sums,
            }
        })
        .collect();
    (patches, patch_of)
}

impl Patches {
    /// Levels for radii from `first_radius` to `cap`, from cell sides of positive area. Call inside
    /// the thread pool.
    pub fn new(sides: &[Patch], first_radius: f32, cap: f32) -> Self {
        let origin = sides.iter().fold(Vec3::splat(f32::INFINITY), |o, p| o.min(p.center));
        let (mut levels, mut patch_of_side): (Vec<Level>, Vec<u32>) = Default::default();
        let mut radius = first_radius;
        loop {
            let fine = levels.last().map_or(sides, |l| &l.patches);
            let (patches, patch_of) = merge(fine, origin, radius / BOXES_PER_RADIUS);
            if levels.is_empty() {
                patch_of_side = patch_of;
            }
            levels.push(Level { tree: KdTree::new(patches.iter().map(|p| p.center)), patches });
            radius *= 2.0;
            if radius > cap {
                return Self { levels, first_radius, patch_of_side };
            }
        }
    }

    /// Patches of the first level.
    pub fn finest(&self) -> &[Patch] {
        &self.levels[0].patches
    }

    /// Irradiance over the smallest region around a patch with at least `k` photons, else over the
    /// largest; and whether it had enough.
    pub fn irradiance(&self, patch: &Patch, k: u32, agreement: f32) -> (Vec3, bool) {
        let at = |level: usize| self.region(patch.center, patch.normal, level, agreement);
        let e = |r: Region| if r.area > 0.0 { r.flux / r.area } else { Vec3::ZERO };
        let last = self.levels.len() - 1;
        // Dark and starved sides are common (outsides, roofs): the largest region first settles
        // them at once.
        let widest = at(last);
        if widest.photons < k {
            return (e(widest), false);
        }
        (e((0..last).map(at).find(|r| r.photons >= k).unwrap_or(widest)), true)
    }

    /// Weighted sums around `center` over patches of a level whose normal has at least cosine
    /// `agreement` with `n`.
    fn region(&self, center: Vec3, n: Vec3, level: usize, agreement: f32) -> Region {
        let radius = self.first_radius * (1u64 << level) as f32;
        let level = &self.levels[level];
        let mut sum = Region::default();
        let inverse = 1.0 / (radius * radius);
        level.tree.within(center, radius, |i, offset| {
            let patch = &level.patches[i as usize];
            let weight = 1.0 - squashed(offset, n) * inverse;
            if weight > 0.0 && patch.normal.dot(n) >= agreement {
                sum.flux += patch.sums.flux * weight;
                sum.area += patch.sums.area * weight;
                sum.photons += patch.sums.photons;
            }
        });
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sectors_are_distinct_and_levels_keep_the_sums() {
        let mut seen = std::collections::BTreeSet::new();
        for face in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z] {
            for (s, t) in [(0.3, 0.3), (-0.3, 0.3), (0.3, -0.3), (-0.3, -0.3)] {
                let (a, b) = face.any_orthonormal_pair();
                seen.insert(sector(face + a * s + b * t));
            }
        }
        assert_eq!(seen.len(), 24);
        let sides: Vec<Patch> = (0..10_000)
            .map(|i| Patch {
                center: Vec3::new((i % 100) as f32, (i / 100) as f32, 0.0) * 0.01,
                normal: if i % 3 == 0 { -Vec3::Z } else { Vec3::Z },
                sums: Region { flux: Vec3::splat(2e-4), area: 1e-4, photons: 2 },
            })
            .collect();
        let patches = Patches::new(&sides, 0.05, 0.9);
        assert_eq!(patches.levels.len(), 5);
        for level in &patches.levels {
            assert_eq!(level.patches.iter().map(|p| p.sums.photons).sum::<u32>(), 20_000);
            assert!((level.patches.iter().map(|p| p.sums.area).sum::<f32>() - 1.0).abs() < 1e-3);
        }
        for level in 0..5 {
            let r = patches.region(Vec3::new(0.2, 0.5, 0.0), Vec3::Z, level, 0.7);
            assert!((r.flux.x / r.area - 2.0).abs() < 1e-4);
        }
    }
}
