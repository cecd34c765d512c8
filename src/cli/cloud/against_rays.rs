//! Gathered occlusion beside traced occlusion, at the same points: what `--traced` says.
//!
//! Rays with cosine-distributed directions give the share of the hemisphere that is occluded, with
//! the distances and the fall-off of the settings. The difference of the two is told as mean
//! absolute error, root mean square and bias (positive: gathered too dark). Then rays alone are
//! traced with 4, 8, 16 … rays a point until their error falls below that of the gather; between
//! powers of two the error is taken as a power of the number of rays. The cost is that of the rays.

use serde::Serialize;

use crate::cli::options::Job;
use crate::error::Result;
use crate::film::Layer;
use crate::method::point_based::{PointLayers, traced_occlusion};
use crate::radiometry::Rgb;
use crate::shading::World;

/// The layer of traced occlusion.
pub(in crate::cli) const TRACED: Layer = Layer::alone("traced", "occlusion by rays, 0 to 1");

/// How far gathered occlusion is from traced.
#[derive(Debug, Serialize)]
pub(super) struct TracedFigures {
    rays: u32,
    mean_absolute_error: f64,
    rms: f64,
    bias: f64,
}

/// What as good an occlusion costs by rays.
#[derive(Debug, Serialize)]
pub(super) struct EqualRays {
    rays: f64,
    seconds: f64,
}

/// What the comparison adds to a picture.
pub(super) struct AgainstRays {
    pub(super) figures: TracedFigures,
    /// None when rays are never as good.
    pub(super) equal: Option<EqualRays>,
    /// Traced occlusion per pixel.
    pub(super) layer: Vec<f32>,
}

/// Traces occlusion with `rays` rays a point, prints how far the gathered one is from it and how
/// many rays would do as well.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub(super) fn against_rays(
    world: &World,
    layers: &PointLayers,
    job: &Job,
    rays: u32,
) -> Result<AgainstRays> {
    let settings = &job.config.point_based;
    let points = &layers.samples.points;
    let traced = traced_occlusion(world, points, settings, rays, job.config.seed, &job.run)?;
    let difference = |f: &dyn Fn(f64) -> f64| {
        let sum: f64 = layers
            .gathered
            .iter()
            .zip(&traced)
            .map(|(g, &t)| f(f64::from(g.occlusion) - f64::from(t)))
            .sum();
        sum / traced.len().max(1) as f64
    };
    let (mae, rmse, bias) =
        (difference(&f64::abs), difference(&|d| d * d).sqrt(), difference(&|d| d));
    println!(
        "occlusion against {rays} rays: mean absolute error {mae:.4}, \
         root mean square {rmse:.4}, bias {bias:+.4}"
    );
    let values: Vec<Rgb> = traced.iter().copied().map(Rgb::splat).collect();
    Ok(AgainstRays {
        figures: TracedFigures { rays, mean_absolute_error: mae, rms: rmse, bias },
        equal: equal_rays(world, layers, &traced, mae, job)?,
        layer: layers.samples.mean(&values).iter().map(|c| c.x).collect(),
    })
}

/// Rays a point whose mean absolute error is `mae`, and the seconds that they take at all points;
/// none when `truth` is no better than that. Prints both.
fn equal_rays(
    world: &World,
    layers: &PointLayers,
    truth: &[f32],
    mae: f64,
    job: &Job,
) -> Result<Option<EqualRays>> {
    let mut before: Option<(f64, f64, f64)> = None;
    for rays in (2..10).map(|i| 1u32 << i) {
        let start = std::time::Instant::now();
        let few = traced_occlusion(
            world,
            &layers.samples.points,
            &job.config.point_based,
            rays,
            job.config.seed.wrapping_add(1),
            &job.run,
        )?;
        let seconds = start.elapsed().as_secs_f64();
        let error = few.iter().zip(truth).map(|(&a, &b)| f64::from((a - b).abs())).sum::<f64>()
            / few.len().max(1) as f64;
        if error <= mae {
            let (from, to) = (
                before.unwrap_or((f64::from(rays), error, seconds)),
                (f64::from(rays), error, seconds),
            );
            let t = if from.1 > to.1 { (from.1 / mae).ln() / (from.1 / to.1).ln() } else { 1.0 };
            let (equal, time) =
                (from.0 * (to.0 / from.0).powf(t), from.2 * (to.2 / from.2).powf(t));
            println!("as good as {equal:.1} rays a point, which take {time:.2} s");
            return Ok(Some(EqualRays { rays: equal, seconds: time }));
        }
        before = Some((f64::from(rays), error, seconds));
    }
    Ok(None)
}
