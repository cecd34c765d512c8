//! `nearfar cloud gather`: a picture of what the camera's points see of a baked cloud.
//!
//! The command reads the cloud, builds its tree, lets the camera find shading points (the only rays
//! that are shot) and gathers at each of them. The channels that were asked for become layers of
//! the picture; the first is the picture itself. Occlusion can be traced by rays as well, which
//! tells how far the gathered one is off.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::{Args, ValueEnum};

use serde::Serialize;

use super::against_rays::{EqualRays, TRACED, TracedFigures, against_rays};
use crate::accel::Backend;
use crate::cli::options::SceneOptions;
use crate::cli::picture::OutputOptions;
use crate::cloud::{Hierarchy, differing_scene, read_cloud};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::method::point_based::{PointLayers, gather_picture};
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

/// Options of `nearfar cloud gather`.
#[derive(Debug, Args)]
pub(in crate::cli) struct GatherArgs {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    output: OutputOptions,
    /// Point cloud of `nearfar cloud bake`.
    #[arg(long, value_name = "CLOUD.ply")]
    cloud: PathBuf,
    /// What to gather; the first is the picture, all are layers.
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Channel::Occlusion])]
    channel: Vec<Channel>,
    /// Also trace occlusion with this many rays a point, as layer "traced", and say how far the
    /// gathered one is from it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
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
    if let Some(parts) = differing_scene(&args.cloud, &job.scene)? {
        let cloud = args.cloud.display();
        job.run.warn(format!("{cloud} was baked of a scene with other {parts}"));
    }
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
        job.config.inputs(world.around.extent),
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
        let compared = against_rays(&world, &layers, &job, rays)?;
        figures.traced = Some(compared.figures);
        figures.rays_of_equal_error = compared.equal;
        film.set(TRACED.name, compared.layer);
    }
    describe(&mut film, figures.method, &job.config, &job.run)?;
    args.output.image.write(&mut film, &args.output.output, &job)?;
    figures.of_run = RunStatistics::new(&job.run);
    args.output.finish(&figures, &job)
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
