//! `--method gather`: final gathering through the proxy at every shading point, the image that
//! caching and decomposition can at best reach.
//!
//! ```text
//! E(x) = π / rays · Σ_r L(x, wi_r)          wi_r cosine-distributed around the shading normal, Owen–Sobol; L from [`Proxy::incident`]
//! ```
//!
//! Directions below the geometric horizon bring nothing. Unbiased for the light of the proxy; noise
//! falls with `gather.rays`. Cost `rays` rays per shading point.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Rendered;
use super::stage::{Inputs, Stage};
use crate::error::{Error, Result};
use crate::math::{Frame, Ray};
use crate::proxy::Proxy;
use crate::radiometry::Rgb;
use crate::record::ShadingPoints;
use crate::run::{RayKind, Run};
use crate::sampling::{Sobol, Stream, sample_cosine_hemisphere};
use crate::shading::World;

/// Settings of final gathering.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GatherSettings {
    /// Cosine rays per shading point, 1..=1048576.
    pub rays: u32,
}

impl Default for GatherSettings {
    fn default() -> Self {
        Self { rays: 64 }
    }
}

impl GatherSettings {
    /// # Errors
    /// [`Error::Setting`] for values out of range.
    pub fn validate(&self) -> Result<()> {
        if !(1..=1 << 20).contains(&self.rays) {
            return Err(Error::setting(
                "gather.rays",
                format!("{} is not in 1..=1048576", self.rays),
            ));
        }
        Ok(())
    }
}

/// Irradiance at every point (phase `sample`).
///
/// # Errors
/// [`Error::Interrupted`].
pub fn gather(
    world: &World,
    proxy: &Proxy,
    points: &ShadingPoints,
    rays: u32,
    seed: u64,
    run: &Run,
) -> Result<Vec<Rgb>> {
    let phase = run.phase("sample", points.len() as u64);
    let out = run.install(|| {
        (0..points.len())
            .into_par_iter()
            .with_min_len(16)
            .map(|i| {
                if run.cancelled() {
                    return Rgb::ZERO;
                }
                let sobol = Sobol::new(seed, Stream::Gather, i as u64);
                let frame = Frame::from_normal(points.ns[i]);
                let mut sum = glam::DVec3::ZERO;
                for r in 0..rays {
                    let wi =
                        frame.world_from_local(sample_cosine_hemisphere(sobol.sample_2d(r, 0)));
                    if wi.dot(points.ng[i]) > 0.0 {
                        sum +=
                            proxy.incident(world, &Ray::new(points.p[i], wi)).radiance.as_dvec3();
                    }
                }
                run.rays.add(RayKind::Sample, u64::from(rays));
                phase.advance(1);
                (sum * (std::f64::consts::PI / f64::from(rays))).as_vec3()
            })
            .collect()
    });
    run.check()?;
    Ok(out)
}

/// The picture by final gathering.
///
/// # Errors
/// As [`Stage::new`].
pub fn render(
    world: &World,
    settings: &GatherSettings,
    inputs: Inputs<'_>,
    run: &Run,
) -> Result<Rendered> {
    settings.validate()?;
    let stage = Stage::new(world, inputs, run)?;
    let irradiance =
        gather(world, &stage.proxy, &stage.samples.points, settings.rays, inputs.seed, run)?;
    let mut stats = stage.stats();
    stats.insert("rays_per_point".into(), settings.rays.into());
    Ok(Rendered { film: stage.samples.compose(&irradiance), stats, ..Rendered::default() })
}
