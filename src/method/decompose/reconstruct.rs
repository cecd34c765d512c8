//! Pass 3: irradiance at every shading point: far by interpolation, near by the analytic sum.
//!
//! E = max(0, E_far + k · (Σ m B G/π − Σ m S)). With `overlap = "scale"` k = min(1, 1/Σ form
//! factors, E_far/Σ m S in the channel where that is least), so that cells hiding one another can
//! take away no more than there is, in any colour; else k = 1. Only the sum is clamped: single
//! terms may be negative and must stay so, or a closed surround would no longer cancel the far
//! field exactly.

use rayon::prelude::*;

use super::far::sample_cluster;
use super::filter::{NearPart, filter};
use super::interpolate::FarField;
use super::near::{NearQuery, NearTree};
use super::near_rays::near_by_rays;
use super::near_sets::{NearSets, SetEntry};
use super::{DecomposeSettings, NearIntegral, NearVisibility, Overlap};
use crate::error::Result;
use crate::proxy::Proxy;
use crate::radiometry::Rgb;
use crate::record::ShadingPoints;
use crate::run::{RayKind, Run};
use crate::sampling::{Rng, Stream};
use crate::sh::{Quadratic, ShRgb};
use crate::shading::World;

/// Irradiance at one point and where it comes from.
#[derive(Clone, Copy, Debug, Default)]
pub struct PointIrradiance {
    /// Irradiance, W/m².
    pub total: Rgb,
    /// Far part alone, as interpolated.
    pub far: Rgb,
    /// Cluster of the largest weight; none where the point sampled its own hemisphere.
    pub cluster: Option<u32>,
    /// Near cells that took part.
    pub near_cells: u32,
    /// Closeness of what is near, 1/length (short rays only).
    pub closeness: f32,
}

/// Irradiance at `p` with unit normal `n` for a given far field and the near sum over `tree`, or
/// over `set` of its blocks; the far field alone without one.
pub fn point(
    world: &World,
    tree: Option<&NearTree>,
    set: Option<&[SetEntry]>,
    sh: &ShRgb,
    p: glam::Vec3,
    n: glam::Vec3,
    settings: &DecomposeSettings,
    alpha: f32,
    rng: &mut Rng,
) -> (PointIrradiance, u64) {
    let far = sh.irradiance(n);
    let Some(tree) = tree.filter(|_| settings.near_visibility != NearVisibility::Off) else {
        return (
            PointIrradiance { total: far.max(Rgb::ZERO), far, ..PointIrradiance::default() },
            0,
        );
    };
    let query = NearQuery {
        alpha,
        trace: matches!(
            settings.near_visibility,
            NearVisibility::Traced | NearVisibility::TrianglesRays
        )
        .then_some(world),
        flagged: set.is_some().then(|| (sh, settings.near_tolerance * far.element_sum() / 3.0)),
        monte_carlo: (settings.near_integral == NearIntegral::MonteCarlo)
            .then_some((sh, settings.near_samples)),
    };
    let near = match set {
        Some(set) => tree.sum_set(p, n, set, &query, rng),
        None => tree.sum(p, n, &query, rng),
    };
    let covered = match settings.near_integral {
        NearIntegral::Exact => Quadratic::new(sh, n).integral(&near.moments),
        NearIntegral::MonteCarlo => near.covered,
    };
    let scale = if settings.overlap == Overlap::Scale {
        overlap_scale(far, covered, near.form_factor)
    } else {
        1.0
    };
    let total = (far + (near.sent - covered) * scale).max(Rgb::ZERO);
    (
        PointIrradiance { total, far, cluster: None, near_cells: near.cells, closeness: 0.0 },
        u64::from(near.rays),
    )
}

/// The largest k ≤ 1 for which the near cells cover neither more than the hemisphere nor, in any
/// channel, more than the far field holds.
fn overlap_scale(far: Rgb, covered: Rgb, form_factor: f32) -> f32 {
    let mut k = 1.0 / form_factor.max(1.0);
    for c in 0..3 {
        if covered[c] * k > far[c].max(0.0) {
            k = far[c].max(0.0) / covered[c];
        }
    }
    k
}

/// Settings of points that no cluster may serve. They are few: a quarter of a cluster's rays.
pub(super) fn alone(settings: &DecomposeSettings) -> DecomposeSettings {
    DecomposeSettings { rays: settings.rays.div_ceil(4), ..settings.clone() }
}

/// The far field at point `i`, the cluster of the largest weight and alpha there; sampled as
/// [`alone`] says where no cluster may serve.
pub(super) fn far_at(
    world: &World,
    proxy: &Proxy,
    points: &ShadingPoints,
    i: usize,
    field: &FarField<'_>,
    alone: &DecomposeSettings,
    alpha: f32,
    seed: u64,
) -> (ShRgb, Option<u32>, f32) {
    /// Keys their random numbers apart from those of clusters.
    const OWN: u64 = 1 << 40;
    match field.at(points.p[i], points.ns[i]) {
        Some(far) => (far.sh, Some(far.cluster), alpha * far.scale),
        None => (
            sample_cluster(world, proxy, points, &[i as u32], alone, alpha, seed, OWN | i as u64),
            None,
            alpha,
        ),
    }
}

/// Irradiance at every point (phase `reconstruct`).
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn reconstruct(
    world: &World,
    proxy: &Proxy,
    points: &ShadingPoints,
    field: &FarField<'_>,
    tree: Option<&NearTree>,
    sets: Option<&NearSets>,
    settings: &DecomposeSettings,
    seed: u64,
    run: &Run,
) -> Result<Vec<PointIrradiance>> {
    reconstruct_with(world, proxy, points, field, tree, sets, None, settings, seed, run)
}

/// As [`reconstruct`]; with `near`, the near part by short rays is given for every point.
///
/// # Errors
/// As [`reconstruct`].
pub fn reconstruct_with(
    world: &World,
    proxy: &Proxy,
    points: &ShadingPoints,
    field: &FarField<'_>,
    tree: Option<&NearTree>,
    sets: Option<&NearSets>,
    near: Option<&[NearPart]>,
    settings: &DecomposeSettings,
    seed: u64,
    run: &Run,
) -> Result<Vec<PointIrradiance>> {
    const BLOCK: usize = 256;
    let alpha = settings.lengths(world.diagonal).alpha;
    let alone = alone(settings);
    let phase = run.phase("reconstruct", points.len() as u64);
    let blocks: Vec<Vec<PointIrradiance>> = run.install(|| {
        (0..points.len().div_ceil(BLOCK))
            .into_par_iter()
            .map(|block| {
                let range = block * BLOCK..((block + 1) * BLOCK).min(points.len());
                if run.cancelled() {
                    return Vec::new();
                }
                phase.advance(range.len() as u64);
                let (mut rays, mut own) = (0, 0);
                let out = range
                    .map(|i| {
                        let (p, n) = (points.p[i], points.ns[i]);
                        let (sh, cluster, alpha) =
                            far_at(world, proxy, points, i, field, &alone, alpha, seed);
                        own += if cluster.is_none() { u64::from(alone.rays) } else { 0 };
                        if settings.near_visibility == NearVisibility::Rays {
                            if let Some(near) = near {
                                let far = sh.irradiance(n);
                                return PointIrradiance {
                                    total: far + near[i].irradiance,
                                    far,
                                    cluster,
                                    near_cells: 0,
                                    closeness: near[i].closeness,
                                };
                            }
                            rays += u64::from(settings.near_rays);
                            let far = sh.irradiance(n);
                            let key = settings.near_noise.element(points, i);
                            let (near, near_cells) = near_by_rays(
                                world,
                                proxy,
                                &sh,
                                p,
                                points.ng[i],
                                n,
                                points.footprint[i],
                                settings,
                                alpha,
                                seed,
                                key,
                            );
                            return PointIrradiance {
                                total: far + near.irradiance,
                                far,
                                cluster,
                                near_cells,
                                closeness: near.closeness,
                            };
                        }
                        let mut rng = Rng::new(seed, Stream::Near, i as u64, 0);
                        let (found, shot) = point(
                            world,
                            tree,
                            sets.zip(cluster).map(|(s, c)| s.of(c)),
                            &sh,
                            p,
                            n,
                            settings,
                            alpha,
                            &mut rng,
                        );
                        rays += shot;
                        PointIrradiance { cluster, ..found }
                    })
                    .collect();
                run.rays.add(RayKind::Visibility, rays);
                run.rays.add(RayKind::Sample, own);
                out
            })
            .collect()
    });
    run.check()?;
    let mut found = blocks.concat();
    if settings.near_visibility == NearVisibility::Rays {
        if settings.near_filter > 0 {
            let near: Vec<NearPart> = found
                .iter()
                .map(|f| NearPart { irradiance: f.total - f.far, closeness: f.closeness })
                .collect();
            let hidden = run.install(|| field.hidden_pairs());
            let apart = |i: usize, j: usize| match (found[i].cluster, found[j].cluster) {
                (Some(a), Some(b)) => hidden.get(a as usize).is_some_and(|h| h.contains(&b)),
                _ => !hidden.is_empty(),
            };
            let near = run.install(|| {
                filter(
                    points,
                    &near,
                    world.camera.width,
                    settings.near_filter,
                    settings.near_filter_reach,
                    apart,
                )
            });
            found.iter_mut().zip(near).for_each(|(f, near)| f.total = f.far + near);
        }
        found.iter_mut().for_each(|f| f.total = f.total.max(Rgb::ZERO));
    }
    Ok(found)
}
