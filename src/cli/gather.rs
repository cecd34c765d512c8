//! `nearfar gather`: pictures from a baked point cloud.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::{Args, ValueEnum};
use serde::Serialize;

use super::options::{Job, SceneOptions};
use super::picture::OutputOptions;
use crate::accel::Backend;
use crate::error::{Error, Result};
use crate::film::{Film, Layer};
use crate::method::points::{PointLayers, gather_picture, traced_occlusion};
use crate::points::{Hierarchy, read_cloud};
use crate::radiometry::Rgb;
use crate::render::{RunStatistics, describe};
use crate::shading::{Sky, World};

/// What is gathered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Channel {
    /// Ambient occlusion; the picture shows 1 − occlusion.
    Occlusion,
    /// Mean open direction; the picture shows (n + 1)/2.
    BentNormal,
    /// Irradiance from the elements, W/m².
    Indirect,
    /// Irradiance from the sky through the open directions, W/m²; without a sky, of a sky of
    /// radiance 1/π.
    Environment,
}

/// What is told of a picture from a cloud.
#[derive(Debug, Serialize)]
struct GatherFigures {
    method: &'static str,
    backend: Backend,
    width: u32,
    height: u32,
    seed: u64,
    triangles: usize,
    elements: usize,
    bytes_per_element: f64,
    shading_points: usize,
    gathers: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    traced: Option<TracedFigures>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rays_of_equal_error: Option<EqualRays>,
    #[serde(flatten)]
    of_run: RunStatistics,
}

/// How far gathered occlusion is from traced.
#[derive(Debug, Serialize)]
struct TracedFigures {
    rays: u32,
    mean_absolute_error: f64,
    rms: f64,
    bias: f64,
}

/// What as good an occlusion costs by rays.
#[derive(Debug, Serialize)]
struct EqualRays {
    rays: f64,
    seconds: f64,
}

/// The layer of traced occlusion.
pub(super) const TRACED: Layer = Layer::alone("traced", "occlusion by rays, 0 to 1");

/// Options of `nearfar gather`.
#[derive(Debug, Args)]
pub(super) struct GatherArgs {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    output: OutputOptions,
    /// Point cloud of `nearfar bake`.
    #[arg(long, value_name = "CLOUD.ply")]
    cloud: PathBuf,
    /// What to gather; the first is the picture, all are layers.
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Channel::Occlusion])]
    channel: Vec<Channel>,
    /// Also trace occlusion with this many rays a point, as layer "traced", and say how far the
    /// gathered one is from it.
    #[arg(long, value_name = "N")]
    traced: Option<u32>,
}

/// # Errors
/// Whatever is wrong with the scene, the cloud or the settings, or files that cannot be written.
pub(super) fn gather(args: &GatherArgs, cancel: &Arc<AtomicBool>) -> Result<()> {
    args.output.check()?;
    let extra: Vec<(&str, toml::Value)> = args
        .output
        .spp
        .map(|spp| ("record.spp", toml::Value::Integer(spp.into())))
        .into_iter()
        .collect();
    let job = args.scene.prepare(&extra, args.output.time_limit, cancel)?;
    let cloud = {
        let _phase = job.run.phase("cloud", 1);
        read_cloud(&args.cloud)?
    };
    let settings = &job.config.point_based;
    let tree = {
        let _phase = job.run.phase("tree", 1);
        job.run.install(|| Hierarchy::new(&cloud, settings.hitsides))?
    };
    if args.channel.contains(&Channel::Indirect) && !tree.is_lit() {
        return Err(Error::input(
            &args.cloud,
            None,
            "has no \"_radiosity\": bake it without --channels, or gather occlusion alone",
        ));
    }
    let world = World::new(&job.scene, job.config.backend, &job.run)?;
    let layers = gather_picture(
        &world,
        &cloud,
        &tree,
        settings,
        job.config.inputs(world.diagonal),
        &job.run,
    )?;
    let mut film = film(&layers, &args.channel, &world.lights.sky);
    let mut figures = GatherFigures {
        method: "cloud-gather",
        backend: job.config.backend,
        width: film.width,
        height: film.height,
        seed: job.config.seed,
        triangles: world.geometry.len(),
        elements: tree.len(),
        bytes_per_element: tree.bytes() as f64 / tree.len() as f64,
        shading_points: layers.gathered.len(),
        gathers: layers.gathers,
        traced: None,
        rays_of_equal_error: None,
        of_run: RunStatistics::new(&job.run),
    };
    if let Some(rays) = args.traced {
        let traced = traced_occlusion(
            &world,
            &layers.samples.points,
            settings,
            rays,
            job.config.seed,
            &job.run,
        )?;
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
            "occlusion against {rays} rays: mean absolute error {mae:.4}, root mean square \
             {rmse:.4}, bias {bias:+.4}"
        );
        figures.traced = Some(TracedFigures { rays, mean_absolute_error: mae, rms: rmse, bias });
        figures.rays_of_equal_error = equal_rays(&world, &layers, &traced, mae, &job)?
            .map(|(rays, seconds)| EqualRays { rays, seconds });
        let values: Vec<Rgb> = traced.into_iter().map(Rgb::splat).collect();
        film.set(TRACED.name, layers.samples.mean(&values).iter().map(|c| c.x).collect());
    }
    describe(&mut film, figures.method, &job.config, &job.run)?;
    args.output.image.write(&mut film, &args.output.output, &job)?;
    figures.of_run = RunStatistics::new(&job.run);
    args.output.finish(&figures, &job)
}

/// Rays a point whose mean absolute error is `mae`, and the seconds that they take at all points;
/// none when `truth` is no better than that. Prints both. Between powers of two the error is taken
/// as a power of the number.
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
            &job.config.point_based,
            rays,
            job.config.seed + 1,
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

fn film(layers: &PointLayers, channels: &[Channel], sky: &Sky) -> Film {
    let mut film = Film::new(layers.samples.width, layers.samples.height);
    let white = Sky::new(Rgb::splat(std::f32::consts::FRAC_1_PI));
    let sky = if sky.is_dark() { &white } else { sky };
    // Pixels that show no surface stay black in every layer.
    let seen: Vec<bool> = layers.layer(|_| Rgb::ONE).iter().map(|c| c.x > 0.0).collect();
    for (i, channel) in channels.iter().enumerate() {
        let values = match channel {
            Channel::Occlusion => {
                let values = layers.layer(|g| Rgb::splat(g.occlusion));
                film.set("occlusion", values.iter().map(|c| c.x).collect());
                values
                    .into_iter()
                    .zip(&seen)
                    .map(|(v, &s)| if s { Rgb::ONE - v } else { Rgb::ZERO })
                    .collect()
            }
            Channel::BentNormal => {
                let values = layers.layer(|g| g.bent_normal);
                film.set_xyz("bent", &values);
                values
                    .into_iter()
                    .zip(&seen)
                    .map(|(v, &s)| if s { (v.normalize_or_zero() + 1.0) * 0.5 } else { Rgb::ZERO })
                    .collect()
            }
            Channel::Indirect => {
                let values = layers.layer(|g| g.irradiance);
                film.set_rgb("indirect", &values);
                values
            }
            Channel::Environment => {
                let values = layers.layer(|g| g.from_sky(sky));
                film.set_rgb("open", &values);
                values
            }
        };
        if i == 0 {
            film.set_rgb("", &values);
        }
    }
    film
}
