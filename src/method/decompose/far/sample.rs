//! Pass 2b: the distant incident radiance of each cluster, as spherical harmonics.
//!
//! Rays start at random members of the cluster, uniformly over the hemisphere of the member, both
//! stratified (Owen–Sobol). A hit has the radiance that the proxy tells, a miss sees the sky.
//! Emission counts zero: it is direct light. A hit near its origin (membership m) keeps its own
//! radiance with weight 1 − 0.9 m: the near part subtracts whatever the fit says there, so any
//! smooth value will do, while dropping such rays altogether leaves cluttered clusters without
//! data. With `near_hits = "ignore"` rays pass through everything closer than alpha, as in
//! `[Course07]`, pass 2. The fit takes the hits of the clusters around as well ([`super::pool`]).
//!
//! [`sample`] turns clusters into one [`ShRgb`] each; [`Bundle::fit`] does it for any points on
//! their own. It costs clusters · (rays · one ray + pooled hits · O(bands⁴) flops), and 44 B a ray.

use std::sync::atomic::{AtomicU64, Ordering};

use cpu_time::ThreadTime;
use glam::Vec3;
use rayon::prelude::*;

use super::Sight;
use super::cluster::Clusters;
use super::pool::{FarHit, Pool};
use crate::error::Result;
use crate::math::{Frame, Ray};
use crate::method::decompose::{Context, NearHits};
use crate::record::ShadingPoints;
use crate::run::RayKind;
use crate::sampling::{Sobol, Stream, sample_uniform_hemisphere};
use crate::sh::{Fit, ShRgb};

/// SH of every cluster of `points`, and the CPU seconds it took, summed over threads (phase
/// `sample`).
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn sample(
    context: &Context<'_>,
    points: &ShadingPoints,
    clusters: &Clusters,
) -> Result<(Vec<ShRgb>, f64)> {
    let mut seconds = 0.0;
    let (sh, _) = context.run.once("sample", || {
        let (sh, spent) = shoot_and_fit(context, points, clusters)?;
        seconds = spent;
        Ok(sh)
    })?;
    Ok((sh, seconds))
}

/// What [`sample`] keeps as a whole: single rays would be ten times as much.
fn shoot_and_fit(
    context: &Context<'_>,
    points: &ShadingPoints,
    clusters: &Clusters,
) -> Result<(Vec<ShRgb>, f64)> {
    let Context { world, settings, lengths, run, .. } = *context;
    let phase = run.phase("sample", 2 * clusters.len() as u64);
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
            let bundle = Bundle {
                members: clusters.members_of(c),
                rays: settings.rays,
                alpha: lengths.alpha * clusters.scale_of(c),
                stream: Stream::Far,
                element: c as u64,
            };
            timed(&mut || hits = bundle.shoot(context, points));
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

/// Far rays from some points.
#[derive(Clone, Copy, Debug)]
pub struct Bundle<'a> {
    /// The points they start from, by index.
    pub members: &'a [u32],
    /// How many.
    pub rays: u32,
    /// Near/far distance, scene units.
    pub alpha: f32,
    /// Who draws their random numbers.
    pub stream: Stream,
    /// Keys these.
    pub element: u64,
}

impl Bundle<'_> {
    /// SH from these rays alone.
    pub fn fit(&self, context: &Context<'_>, points: &ShadingPoints) -> ShRgb {
        let mut fit = Fit::new(context.settings.sh_bands as usize);
        for hit in self.shoot(context, points) {
            fit.add(hit.wi, hit.radiance, hit.own_weight());
        }
        fit.solve(context.settings.ridge)
    }

    /// What the rays find.
    fn shoot(&self, context: &Context<'_>, points: &ShadingPoints) -> Vec<FarHit> {
        let Context { world, proxy, settings, .. } = *context;
        let sobol = Sobol::new(context.seed, self.stream, self.element);
        let last = self.members.len() - 1;
        let mut hits = Vec::with_capacity(self.rays as usize);
        for r in 0..self.rays {
            let pick = (sobol.sample_1d(r, 0) * self.members.len() as f32) as usize;
            let member = self.members[pick.min(last)] as usize;
            let (p, ng, ns) = (points.p[member], points.ng[member], points.ns[member]);
            let wi = Frame::from_normal(ns)
                .world_from_local(sample_uniform_hemisphere(sobol.sample_2d(r, 1)));
            if wi.dot(ng) <= 0.0 {
                continue;
            }
            let mut ray = Ray::new(p, wi);
            if settings.near_hits == NearHits::Ignore {
                ray.t_min = self.alpha;
            }
            if ray.t_min == f32::INFINITY {
                hits.push(FarHit::sky(wi, world.lights.sky.radiance(wi)));
                continue;
            }
            let incident = proxy.incident(world, &ray);
            let near = match settings.near_hits {
                NearHits::Damp => context.membership_of(&incident, p, self.alpha),
                NearHits::Ignore => None,
            };
            hits.push(FarHit {
                wi,
                t: incident.t,
                position: p + wi * if incident.t.is_finite() { incident.t } else { 0.0 },
                normal: incident.normal,
                radiance: incident.radiance,
                membership: near.unwrap_or(0.0),
            });
        }
        hits
    }
}

impl FarHit {
    fn sky(wi: Vec3, radiance: crate::radiometry::Rgb) -> Self {
        Self { wi, t: f32::INFINITY, position: Vec3::ZERO, normal: -wi, radiance, membership: 0.0 }
    }
}
