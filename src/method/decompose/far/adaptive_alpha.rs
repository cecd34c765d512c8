//! `alpha_mode = "adaptive"`: alpha, size and reach of a cluster follow the distance of what
//! surrounds it.
//!
//! ```text
//! α_c = 2^k α, k ∈ {1, 0, −1}:   the largest with α_c ≤ κ R_c
//! 1 / R_c = mean of 1 / t over cosine rays from the members
//! ```
//! How fast the far field changes from place to place goes with the inverse of the distance to what
//! is seen, so an open wall is served by few wide clusters and a corner by many narrow ones. Top
//! down: clusters of twice the radius first; those with R_c too small are cut again at half the
//! radius. Cluster radius and blend radius keep their ratio to α_c. A point's near part takes the
//! blend of its clusters' α_c with the weights of the SH; the near part is a difference against
//! that same SH, so any alpha keeps the sum whole.
//!
//! It pays where rooms are large and their detail is small, and loses in a box, so `single` is the
//! default (figures in `docs/records/2026-11-decompose.md`).
//!
//! [`adaptive`] turns a choice of points into [`Clusters`] with `scale` = α_c / α. The harmonic
//! mean distance is `[Ward88]`'s. The bounds of size and normal hold at each cluster's own scale,
//! and the result does not depend on threads. It costs [`PROBES`] rays a cluster and level; the
//! knob is κ = `alpha_closeness`.

use rayon::prelude::*;

use super::cluster::{Bounds, Clusters, cluster, summarize};
use crate::math::{Frame, Ray};
use crate::method::decompose::Context;
use crate::record::ShadingPoints;
use crate::run::RayKind;
use crate::sampling::{Sobol, Stream, sample_cosine_hemisphere};
use crate::shading::World;

/// Rays that measure what surrounds a cluster.
pub const PROBES: u32 = 32;
const SCALES: [f32; 3] = [2.0, 1.0, 0.5];

/// Clusters of the chosen points, each at its own scale.
pub fn adaptive(context: &Context<'_>, points: &ShadingPoints, chosen: Vec<u32>) -> Clusters {
    let Context { world, settings, lengths, seed, run, .. } = *context;
    let (mut groups, mut scales) = (Vec::new(), Vec::new());
    let mut open = vec![chosen];
    for (level, scale) in SCALES.into_iter().enumerate() {
        let cut = |(i, members): (usize, Vec<u32>)| {
            let key = seed ^ ((level as u64) << 48) ^ ((i as u64) << 20);
            let bounds = Bounds {
                radius: lengths.cluster_radius * scale,
                normal_cos: settings.cluster_normal_cos,
            };
            let clusters = cluster(points, members, bounds, key);
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
