//! `alpha_mode = "adaptive"`: alpha, size and reach of a cluster follow the distance of what
//! surrounds it.
//!
//! ```text
//! α_c = 2^k α, k ∈ {1, 0, −1}: the largest with α_c ≤ κ R_c,   1 / R_c = mean over cosine rays from the members of 1 / t
//! ```
//! How fast the far field changes from place to place goes with the inverse of the distance to what
//! is seen, so an open wall is served by few wide clusters and a corner by many narrow ones. Top
//! down: clusters of twice the radius first; those with R_c too small are cut again at half the
//! radius. Cluster radius and blend radius keep their ratio to α_c. A point's near part takes the
//! blend of its clusters' α_c with the weights of the SH; the near part is a difference against
//! that same SH, so any alpha keeps the sum whole.
//!
//! Measured, trimmed relMSE and CPU seconds, single → adaptive (κ 0.12; 0.25): Cornell 0.00038 in
//! 2.6 s → 0.00045 in 2.6; 0.00047 in 2.2. nested-slats 0.00416 in 3.5 → 0.00414 in 3.7; 0.00418 in
//! 3.5. veach_ajar 0.00451 in 1.95 → 0.00345 in 2.2; 0.00408 in 2.0. foliage 0.00256 in 3.0 →
//! 0.00252 in 3.3; 0.00252 in 3.2. It pays where rooms are large and their detail is small, and
//! loses in a box: `single` is the default. Alpha alone, with clusters as they are, changes little:
//! 1, 2, 4 and 8 % of the diagonal agree within 9 % on four scenes.
//!
//! Input   points and a choice of them. Output  [`Clusters`] with `scale` = α_c / α. Source
//!         `[Ward88]` (harmonic mean distance).
//! Guarantees  bounds of size and normal hold at each cluster's own scale; deterministic. Cost
//!             [`PROBES`] rays a cluster and level.
//! Knob    κ = `alpha_closeness` 0.25.

use rayon::prelude::*;

use super::DecomposeSettings;
use super::cluster::{Clusters, cluster, summarize};
use crate::math::{Frame, Ray};
use crate::record::ShadingPoints;
use crate::run::{RayKind, Run};
use crate::sampling::{Sobol, Stream, sample_cosine_hemisphere};
use crate::shading::World;

/// Rays that measure what surrounds a cluster.
pub const PROBES: u32 = 32;
const SCALES: [f32; 3] = [2.0, 1.0, 0.5];

/// Clusters of the chosen points, each at its own scale.
pub fn adaptive(
    world: &World,
    points: &ShadingPoints,
    chosen: Vec<u32>,
    settings: &DecomposeSettings,
    seed: u64,
    run: &Run,
) -> Clusters {
    let lengths = settings.lengths(world.diagonal);
    let (mut groups, mut scales) = (Vec::new(), Vec::new());
    let mut open = vec![chosen];
    for (level, scale) in SCALES.into_iter().enumerate() {
        let cut = |(i, members): (usize, Vec<u32>)| {
            let key = seed ^ ((level as u64) << 48) ^ ((i as u64) << 20);
            let clusters = cluster(
                points,
                members,
                lengths.cluster_radius * scale,
                settings.cluster_normal_cos,
                key,
            );
            let list = |c: usize| {
                let wide = level + 1 < SCALES.len()
                    && distance(world, points, clusters.members_of(c), key ^ c as u64)
                        * settings.alpha_closeness
                        < lengths.alpha * scale;
                (clusters.members_of(c).to_vec(), wide)
            };
            (0..clusters.len()).into_par_iter().map(list).collect::<Vec<_>>()
        };
        let found: Vec<Vec<(Vec<u32>, bool)>> = open.into_par_iter().enumerate().map(cut).collect();
        open = Vec::new();
        for (members, too_wide) in found.into_iter().flatten() {
            if level + 1 < SCALES.len() {
                run.rays.add(RayKind::Sample, u64::from(PROBES));
            }
            if too_wide {
                open.push(members);
            } else {
                groups.push(members);
                scales.push(scale);
            }
        }
    }
    Clusters { scale: scales, ..summarize(points, groups) }
}

/// Harmonic mean distance seen from the members; infinite under an open sky.
fn distance(world: &World, points: &ShadingPoints, members: &[u32], key: u64) -> f32 {
    let sobol = Sobol::new(key, Stream::Cluster, 1);
    let inverse: f32 = (0..PROBES)
        .map(|r| {
            let m = members
                [((sobol.sample_1d(r, 0) * members.len() as f32) as usize).min(members.len() - 1)]
                as usize;
            let wi = Frame::from_normal(points.ns[m])
                .world_from_local(sample_cosine_hemisphere(sobol.sample_2d(r, 1)));
            let hit = if wi.dot(points.ng[m]) > 0.0 {
                world.rays.closest(&Ray::new(points.p[m], wi))
            } else {
                None
            };
            hit.map_or(0.0, |h| 1.0 / h.t.max(points.footprint[m]))
        })
        .sum();
    PROBES as f32 / inverse
}
