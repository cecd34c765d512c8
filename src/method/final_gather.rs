//! `--method gather`: final gathering through the proxy at every shading point.
//!
//! ```text
//! E(x) = Σ_r L(x, wi_r) cos θ_r / (n_cosine p_cosine(wi_r) + n_guided p_guide(wi_r))
//! wi_r cosine-distributed around the shading normal, or by the guide; L from Proxy::radiance
//! ```
//!
//! Of the rays of a point the share `gather.guided` is sent where rays of the neighbourhood have
//! found light ([`crate::guide`]); all are weighed by the balance heuristic `[Veach97]` §9.2.
//! Directions below the geometric horizon bring nothing. Unbiased for the light of the proxy; noise
//! falls with `gather.rays`, and is independent from point to point, as denoisers expect it. Cost
//! `rays` rays per shading point, and the guide's.

use super::locations::Locations;
use super::stage::{Inputs, Stage, StageStatistics};
use super::{MethodStatistics, Rendered};
use crate::error::Result;
use crate::guide::Guide;
use crate::length::Length;
use crate::math::{Frame, Ray};
use crate::proxy::Proxy;
use crate::radiometry::Rgb;
use crate::record::ShadingPoints;
use crate::run::{RayKind, Run};
use crate::sampling::{Sobol, Stream, pdf_cosine_hemisphere, sample_cosine_hemisphere};
use crate::settings::section;
use crate::shading::World;

section! {
    /// Final gathering.
    pub struct GatherSettings in "gather" {
        /// Rays per shading point.
        rays: Option<u32> = None, follows "denoise: 16 with a denoiser, else 64",
            in from(1.0).to(1_048_576.0), unit "rays";
        /// Share of the rays that go where rays of the neighbourhood found light.
        guided: f32 = 0.5, in from(0.0).to(1.0);
        /// Size of the cells that learn where light comes from.
        guide_cell: Option<Length> = None, follows "decompose.near_cell", in above(0.0);
    }
}

impl GatherSettings {
    /// Rays per shading point, where no denoiser follows.
    pub fn rays(&self) -> u32 {
        self.rays.unwrap_or(64)
    }
}

/// Points that are gathered at, and kept, at a time.
const BLOCK: usize = 64;

/// What final gathering tells of its picture.
#[derive(Clone, Debug, serde::Serialize)]
pub struct GatherStatistics {
    /// Proxy and points.
    #[serde(flatten)]
    pub stage: StageStatistics,
    /// Rays of every point.
    pub rays_per_point: u32,
}

/// The rays of a point.
#[derive(Clone, Copy, Debug)]
pub struct Rays<'a> {
    /// How many.
    pub count: u32,
    /// What sends a share of them where light is.
    pub guide: Option<(&'a Guide, f32)>,
}

impl Rays<'_> {
    /// All of them cosine-distributed.
    pub fn cosine(count: u32) -> Self {
        Self { count, guide: None }
    }
}

/// Irradiance at every point (phase `sample`).
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn gather(
    world: &World,
    proxy: &Proxy,
    points: &ShadingPoints,
    rays: Rays<'_>,
    seed: u64,
    run: &Run,
) -> Result<Vec<Rgb>> {
    let phase = run.phase("sample", points.len() as u64);
    let irradiance = |i: usize| {
        if run.cancelled() {
            return Rgb::ZERO;
        }
        let (p, ng, ns) = (points.p[i], points.ng[i], points.ns[i]);
        let guided = rays.guide.and_then(|(guide, share)| Some((guide.at(p, ns)?, share)));
        let count_guided =
            guided.map_or(0, |(_, share)| (share * rays.count as f32).round() as u32);
        let count_cosine = rays.count - count_guided;
        let sobol = Sobol::new(seed, Stream::Gather, i as u64);
        let frame = Frame::from_normal(ns);
        let mut sum = glam::DVec3::ZERO;
        for r in 0..rays.count {
            let wi = match guided {
                Some((directions, _)) if r >= count_cosine => {
                    directions.sample(sobol.sample_2d(r - count_cosine, 1))
                }
                _ => frame.world_from_local(sample_cosine_hemisphere(sobol.sample_2d(r, 0))),
            };
            let cos = wi.dot(ns);
            if cos <= 0.0 || wi.dot(ng) <= 0.0 {
                continue;
            }
            let by_guide = guided.map_or(0.0, |(d, _)| d.pdf_solid_angle(wi));
            let density =
                count_cosine as f32 * pdf_cosine_hemisphere(cos) + count_guided as f32 * by_guide;
            let radiance = proxy.radiance(world, &Ray::new(p, wi));
            sum += (radiance * (cos / density)).as_dvec3();
        }
        run.rays.add(RayKind::Sample, u64::from(rays.count));
        sum.as_vec3()
    };
    phase.blocks((points.len(), BLOCK), (), |(), range| range.map(irradiance).collect())
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
    let guide = match settings.guided > 0.0 {
        true => {
            let size = settings
                .guide_cell
                .map_or(inputs.near_cell, |length| length.resolve(world.around.extent));
            Some(Guide::new(world, &stage.proxy, size, inputs.seed, run)?)
        }
        false => None,
    };
    let rays = Rays { count: settings.rays(), guide: guide.as_ref().map(|g| (g, settings.guided)) };
    let irradiance = gather(world, &stage.proxy, &stage.samples.points, rays, inputs.seed, run)?;
    Ok(Rendered {
        film: stage.samples.compose(&irradiance),
        statistics: MethodStatistics::Gather(GatherStatistics {
            stage: stage.statistics(),
            rays_per_point: settings.rays(),
        }),
        locations: Locations::default(),
    })
}
