//! Pass 2b: the distant incident radiance of each cluster, as spherical harmonics.
//!
//! Rays start at random members of the cluster, uniformly over the hemisphere of the member, both
//! stratified (Owen–Sobol). A hit's radiance is the radiosity of its cell's side over π; a miss
//! sees the sky. Emission counts zero: it is direct light. A hit whose cell is near its origin
//! (membership m) keeps its own radiance with weight 1 − 0.9 m: the near sum subtracts whatever the
//! fit says there, so any smooth value will do, while dropping such rays altogether leaves
//! cluttered clusters without data. With `near_hits = "ignore"` rays pass through everything closer
//! than alpha (the course's form). The fit takes the hits of the clusters around as well
//! ([`super::pool`]).
//!
//! Input   clusters, points, cells and their radiosity. Output  one [`ShRgb`] a cluster. Source
//!         `[Course07]` pass 2; ridge: [`crate::sh::Fit`].
//! Cost    clusters · (rays · one ray + pooled hits · O(bands⁴) flops); 44 B a ray.

use std::sync::atomic::{AtomicU64, Ordering};

use cpu_time::ThreadTime;
use glam::Vec3;
use rayon::prelude::*;

use super::cluster::Clusters;
use super::pool::{FarHit, Pool};
use super::validity::Sight;
use super::{DecomposeSettings, NearHits, membership};
use crate::error::Result;
use crate::math::{Frame, Ray};
use crate::proxy::Proxy;
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
    proxy: &Proxy,
    points: &ShadingPoints,
    clusters: &Clusters,
    settings: &DecomposeSettings,
    seed: u64,
    run: &Run,
) -> Result<(Vec<ShRgb>, f64)> {
    let phase = run.phase("sample", 2 * clusters.len() as u64);
    let lengths = settings.lengths(world.diagonal);
    let nanoseconds = AtomicU64::new(0);
    let timed = |work: &mut dyn FnMut()| {
        let start = ThreadTime::now();
        work();
        nanoseconds.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
        phase.advance(1);
    };
    let each = |c: usize| {
        let mut hits = Vec::new();
        if !run.cancelled() {
            run.rays.add(RayKind::Sample, u64::from(settings.rays));
            timed(&mut || {
                hits = shoot(
                    world,
                    proxy,
                    points,
                    clusters.members_of(c),
                    settings,
                    lengths.alpha * clusters.scale_of(c),
                    seed,
                    c as u64,
                )
            });
        }
        hits
    };
    let hits: Vec<Vec<FarHit>> =
        run.install(|| (0..clusters.len()).into_par_iter().with_min_len(8).map(each).collect());
    run.check()?;
    let sight = settings.sight.then(|| Sight::new(world, clusters));
    let pool = Pool::new(clusters, &hits, sight.as_ref(), settings, lengths);
    let each = |c: usize| {
        let mut sh = ShRgb::default();
        if !run.cancelled() {
            timed(&mut || sh = pool.fit(c));
        }
        sh
    };
    let out =
        run.install(|| (0..clusters.len()).into_par_iter().with_min_len(8).map(each).collect());
    run.check()?;
    Ok((out, nanoseconds.into_inner() as f64 * 1e-9))
}

/// SH from the given members' hemispheres alone; `element` keys the random numbers.
pub fn sample_cluster(
    world: &World,
    proxy: &Proxy,
    points: &ShadingPoints,
    members: &[u32],
    settings: &DecomposeSettings,
    alpha: f32,
    seed: u64,
    element: u64,
) -> ShRgb {
    let mut fit = Fit::new(settings.sh_bands as usize);
    for hit in shoot(world, proxy, points, members, settings, alpha, seed, element) {
        fit.add(hit.wi, hit.radiance, 1.0 - 0.9 * hit.membership);
    }
    fit.solve(settings.ridge)
}

/// What `settings.rays` rays from the given members find.
fn shoot(
    world: &World,
    proxy: &Proxy,
    points: &ShadingPoints,
    members: &[u32],
    settings: &DecomposeSettings,
    alpha: f32,
    seed: u64,
    element: u64,
) -> Vec<FarHit> {
    let sobol = Sobol::new(seed, Stream::Far, element);
    let mut hits = Vec::with_capacity(settings.rays as usize);
    for r in 0..settings.rays {
        let member = members
            [((sobol.sample_1d(r, 0) * members.len() as f32) as usize).min(members.len() - 1)]
            as usize;
        let (p, ng, ns) = (points.p[member], points.ng[member], points.ns[member]);
        let wi = Frame::from_normal(ns)
            .world_from_local(sample_uniform_hemisphere(sobol.sample_2d(r, 1)));
        if wi.dot(ng) <= 0.0 {
            continue;
        }
        let mut ray = Ray::new(p, wi);
        if settings.near_hits == NearHits::Ignore {
            ray.t_min = alpha;
        }
        if ray.t_min == f32::INFINITY {
            hits.push(FarHit {
                wi,
                t: f32::INFINITY,
                position: Vec3::ZERO,
                normal: -wi,
                radiance: world.lights.sky.radiance(wi),
                membership: 0.0,
            });
            continue;
        }
        let incident = proxy.incident(world, &ray);
        let near = match (incident.piece, settings.near_hits) {
            (Some(piece), NearHits::Damp) => membership(proxy.center(piece).distance(p), alpha),
            _ => 0.0,
        };
        hits.push(FarHit {
            wi,
            t: incident.t,
            position: p + wi * if incident.t.is_finite() { incident.t } else { 0.0 },
            normal: incident.normal,
            radiance: incident.radiance,
            membership: near,
        });
    }
    hits
}
