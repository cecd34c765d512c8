//! Gathered occlusion beside traced occlusion, at the same points: what `--traced` says.
//!
//! Rays with cosine-distributed directions give the share of the hemisphere that is occluded, with
//! the distances and the fall-off of the settings. The difference of the two is told as mean
//! absolute error, root mean square and bias (positive: gathered too dark). Then rays alone are
//! traced with 4, 8, 16 … rays a point until their error falls below that of the gather; between
//! powers of two the error is taken as a power of the number of rays. The cost is that of the rays.

use serde_json::{Map, Value, json};

use crate::cli::options::Job;
use crate::error::Result;
use crate::method::point_based::{PointLayers, traced_occlusion};
use crate::radiometry::Rgb;
use crate::shading::World;

/// What the comparison adds to a picture.
pub(super) struct AgainstRays {
    /// `traced` and `rays_of_equal_error`.
    pub(super) stats: Map<String, Value>,
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
    let settings = &job.config.points;
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
    let equal = equal_rays(world, layers, &traced, mae, job)?
        .map_or(Value::Null, |(r, s)| json!({ "rays": r, "seconds": s }));
    let stats = [
        ("traced", json!({ "rays": rays, "mean_absolute_error": mae, "rms": rmse, "bias": bias })),
        ("rays_of_equal_error", equal),
    ];
    let values: Vec<Rgb> = traced.into_iter().map(Rgb::splat).collect();
    Ok(AgainstRays {
        stats: stats.into_iter().map(|(k, v)| (k.to_owned(), v)).collect(),
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
) -> Result<Option<(f64, f64)>> {
    let mut before: Option<(f64, f64, f64)> = None;
    for rays in (2..10).map(|i| 1u32 << i) {
        let start = std::time::Instant::now();
        let few = traced_occlusion(
            world,
            &layers.samples.points,
            &job.config.points,
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
            return Ok(Some((equal, time)));
        }
        before = Some((f64::from(rays), error, seconds));
    }
    Ok(None)
}
