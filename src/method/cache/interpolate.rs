//! The final pass: every point blends the records around it; nothing is added.
//!
//! ```text
//! E(p, n) = Σ_i w_i · clamp( E_i + (n_i × n) · g_r,i + (p − p_i) · g_t,i ) / Σ_i w_i
//! ```
//! Records reach `cache.reach` times as far as in the fill, so several overlap at every point. A
//! point out of everybody's reach (the fill gave up, or was skipped) is told apart. The order of
//! the sum is that of the octree: independent of threads.

use std::ops::Range;

use super::fill::Cache;
use super::settings::CacheSettings;
use crate::error::Result;
use crate::radiometry::Rgb;
use crate::record::ShadingPoints;
use crate::run::{RayKind, Run};
use crate::shading::World;

/// Irradiance at every point, none where no record has weight (phase `interpolate`).
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn interpolate(
    world: &World,
    cache: &Cache,
    points: &ShadingPoints,
    settings: &CacheSettings,
    run: &Run,
) -> Result<Vec<Option<Rgb>>> {
    const BLOCK: usize = 256;
    let phase = run.phase("interpolate", points.len() as u64);
    let block = |(): &mut (), range: Range<usize>| {
        let mut rays = 0;
        let mut one = |i: usize| {
            let (p, n, reach) = (points.p[i], points.ns[i], settings.reach);
            let (mut sum, mut weights) = (Rgb::ZERO, 0.0f32);
            cache.lookup(world, p, n, reach, &mut rays, |record, weight| {
                sum += record.extrapolate(p, n, settings.extrapolation) * weight;
                weights += weight;
                false
            });
            (weights > 0.0).then(|| sum / weights)
        };
        let out = range.map(&mut one).collect();
        run.rays.add(RayKind::Visibility, rays);
        out
    };
    phase.blocks((points.len(), BLOCK), (), block)
}
