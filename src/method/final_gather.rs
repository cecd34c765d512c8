//! `--method gather`: final gathering through the proxy at every shading point, the image that
//! caching and decomposition can at best reach.
//!
//! ```text
//! E(x) = π / rays · Σ_r L(x, wi_r)
//! wi_r cosine-distributed around the shading normal, Owen–Sobol; L from Proxy::incident
//! ```
//!
//! Directions below the geometric horizon bring nothing. Unbiased for the light of the proxy; noise
//! falls with `gather.rays`. Cost `rays` rays per shading point.

use rayon::prelude::*;

use super::locations::Locations;
use super::stage::{Inputs, Stage, StageStatistics};
use super::{MethodStatistics, Rendered};
use crate::error::Result;
use crate::math::{Frame, Ray};
use crate::proxy::Proxy;
use crate::radiometry::Rgb;
use crate::record::ShadingPoints;
use crate::run::{RayKind, Run};
use crate::sampling::{Sobol, Stream, sample_cosine_hemisphere};
use crate::settings::section;
use crate::shading::World;

section! {
    /// Final gathering.
    pub struct GatherSettings in "gather" {
        /// Cosine rays per shading point.
        rays: u32 = 64, in from(1.0).to(1_048_576.0), unit "rays";
    }
}

/// What final gathering tells of its picture.
#[derive(Clone, Debug, serde::Serialize)]
pub struct GatherStatistics {
    /// Proxy and points.
    #[serde(flatten)]
    pub stage: StageStatistics,
    /// Rays of every point.
    pub rays_per_point: u32,
}

/// Irradiance at every point (phase `sample`).
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
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
    Ok(Rendered {
        film: stage.samples.compose(&irradiance),
        statistics: MethodStatistics::Gather(GatherStatistics {
            stage: stage.statistics(),
            rays_per_point: settings.rays,
        }),
        locations: Locations::default(),
    })
}
