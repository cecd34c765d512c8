//! Pass 2b: the distant incident radiance of each cluster, as spherical harmonics.
//!
//! Rays start at random members of the cluster, uniformly over the hemisphere of the member, both stratified (Owen–Sobol). A hit's radiance
//! is the radiosity of its cell's side over π; a miss sees the sky. Emission counts zero: it is direct light.
//! A hit whose cell is near its origin (membership m) keeps its own radiance with weight 1 − 0.9 m: the near sum subtracts whatever the
//! fit says there, so any smooth value will do, while dropping such rays altogether leaves cluttered clusters without data.
//! With `near_hits = "ignore"` rays pass through everything closer than alpha (the course's form).
//!
//! Input   clusters, points, cells and their radiosity. Output  one [`ShRgb`] a cluster. Source  `[Course07]` pass 2; ridge: [`crate::sh::Fit`].
//! Cost    clusters · rays · (one ray + O(bands⁴) flops).

use std::sync::atomic::{AtomicU64, Ordering};

use cpu_time::ThreadTime;
use rayon::prelude::*;

use super::cluster::Clusters;
use super::{DecomposeSettings, NearHits, membership};
use crate::error::Result;
use crate::math::Frame;
use crate::photon::Proxy;
use crate::record::ShadingPoints;
use crate::run::{RayKind, Run};
use crate::sampling::{Sobol, Stream, sample_uniform_hemisphere};
use crate::sh::{Fit, ShRgb};
use crate::shading::World;

/// SH of every cluster, and the CPU seconds it took, summed over threads (phase `sample`).
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn sample(
    world: &World,
    proxy: Proxy<'_>,
    points: &ShadingPoints,
    clusters: &Clusters,
    settings: &DecomposeSettings,
    seed: u64,
    run: &Run,
) -> Result<(Vec<ShRgb>, f64)> {
    let phase = run.phase("sample", clusters.len() as u64);
    let alpha = settings.lengths(world.diagonal).alpha;
    let nanoseconds = AtomicU64::new(0);
    let out = run.install(|| {
        (0..clusters.len())
            .into_par_iter()
            .with_min_len(8)
            .map(|c| {
                if run.cancelled() {
                    return ShRgb::default();
                }
                run.rays.add(RayKind::Sample, u64::from(settings.rays));
                phase.advance(1);
                let start = ThreadTime::now();
                let sh = sample_cluster(world, proxy, points, clusters.members_of(c), settings, alpha * clusters.scale_of(c), seed, c as u64);
                nanoseconds.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
                sh
            })
            .collect()
    });
    run.check()?;
    Ok((out, nanoseconds.into_inner() as f64 * 1e-9))
}

/// SH from the given members' hemispheres; `element` keys the random numbers.
pub fn sample_cluster(
    world: &World,
    proxy: Proxy<'_>,
    points: &ShadingPoints,
    members: &[u32],
    settings: &DecomposeSettings,
    alpha: f32,
    seed: u64,
    element: u64,
) -> ShRgb {
    let sobol = Sobol::new(seed, Stream::Far, element);
    let mut fit = Fit::new(settings.sh_bands as usize);
    for r in 0..settings.rays {
        let member = members[((sobol.sample_1d(r, 0) * members.len() as f32) as usize).min(members.len() - 1)] as usize;
        let (p, ng, ns) = (points.p[member], points.ng[member], points.ns[member]);
        let wi = Frame::from_normal(ns).world_from_local(sample_uniform_hemisphere(sobol.sample_2d(r, 1)));
        if wi.dot(ng) <= 0.0 {
            continue;
        }
        let mut ray = crate::math::Ray::new(p, wi);
        if settings.near_hits == NearHits::Ignore {
            ray.t_min = alpha;
        }
        if ray.t_min == f32::INFINITY {
            fit.add(wi, world.lights.sky, 1.0);
            continue;
        }
        let incident = proxy.incident(world, &ray);
        let weight = match (incident.cell, settings.near_hits) {
            (Some(cell), NearHits::Damp) => 1.0 - 0.9 * membership(proxy.cells.centroids[cell as usize].distance(p), alpha),
            _ => 1.0,
        };
        fit.add(wi, incident.radiance, weight);
    }
    fit.solve(settings.ridge)
}
