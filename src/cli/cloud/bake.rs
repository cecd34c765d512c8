//! `nearfar cloud bake`: a scene's surfaces as a cloud of discs with their light.
//!
//! All surfaces are diced into pieces of equal area, direct light and bounces are computed on them,
//! and positions, normals, areas and the channels that are wanted are written as binary PLY.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;
use serde::Serialize;
use toml::Value;

use crate::atomic_file;
use crate::cli::keep::{KeepOptions, forget_job};
use crate::cli::options::SceneOptions;
use crate::cli::{stop, write_json};
use crate::cloud::{RadiositySource, bake, bake_areas, scene_comment, write_cloud};
use crate::error::{Error, Result};
use crate::render::{RunStatistics, job_key, keeping};
use crate::shading::World;

/// Options of `nearfar cloud bake`.
#[derive(Debug, Args)]
pub(in crate::cli) struct BakeArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// Point cloud to write: binary PLY.
    #[arg(short, long, value_name = "CLOUD.ply")]
    output: PathBuf,
    /// Elements in all; default `points.elements`.
    #[arg(long, value_name = "N", conflicts_with = "density")]
    elements: Option<u64>,
    /// Elements per unit of area.
    #[arg(long, value_name = "D")]
    density: Option<f64>,
    /// Where the light on the elements comes from; default `points.radiosity`.
    #[arg(long, value_enum)]
    radiosity: Option<RadiositySource>,
    /// Bounces of light; default `points.bounces`.
    #[arg(long, value_name = "N")]
    bounces: Option<u32>,
    /// Channels to keep beside position, normal and area; "none": areas alone, no ray is shot.
    /// Default all.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    channels: Vec<String>,
    /// Write statistics as JSON.
    #[arg(long, value_name = "FILE.json")]
    stats: Option<PathBuf>,
    #[command(flatten)]
    keep: KeepOptions,
}

/// What is told of a cloud.
#[derive(Debug, Serialize)]
struct BakeFigures {
    elements: usize,
    area: f64,
    triangles: usize,
    #[serde(flatten)]
    of_run: RunStatistics,
}

/// Channels that can be kept.
const CHANNELS: [&str; 6] =
    ["_radiosity", "_radiosity_back", "albedo", "direct", "direct_back", "emission"];

/// # Errors
/// Whatever is wrong with the scene or the settings, or files that cannot be written.
pub(super) fn bake_to_file(args: &BakeArgs, cancel: &Arc<AtomicBool>) -> Result<()> {
    let none = args.channels.iter().any(|c| c == "none");
    if let Some(unknown) =
        args.channels.iter().find(|c| !CHANNELS.contains(&c.as_str()) && *c != "none")
    {
        return Err(Error::Usage(format!(
            "--channels {unknown}: choose among none, {}",
            CHANNELS.join(", ")
        )));
    }
    atomic_file::check(&args.output)?;
    args.stats.as_deref().map_or(Ok(()), atomic_file::check)?;
    let mut extra = Vec::new();
    if let Some(n) = args.elements {
        extra.extend([
            ("point_based.elements", Value::Integer(n as i64)),
            ("point_based.density", Value::Float(0.0)),
        ]);
    }
    if let Some(d) = args.density {
        extra.push(("point_based.density", Value::Float(d)));
    }
    if let Some(n) = args.bounces {
        extra.push(("point_based.bounces", Value::Integer(n.into())));
    }
    if let Some(source) = args.radiosity {
        let name = clap::ValueEnum::to_possible_value(&source)
            .map_or_else(String::new, |v| v.get_name().to_owned());
        extra.push(("point_based.radiosity", Value::String(name)));
    }
    let kept = args.keep.begin(&args.output, args.scene.quiet)?;
    let job = args.scene.prepare(&extra, None, cancel)?;
    job.plan(|expected| expected.bake());
    let world = World::new(&job.scene, job.config.backend, &job.run)?;
    let (config, inputs) = (&job.config, job.config.inputs(world.around.extent));
    let mut cloud = if none {
        bake_areas(&world, &config.point_based, &job.run)?.0
    } else {
        stop::keeps();
        let key = || job_key("cloud", &job.scene, config, &kept);
        let baked = keeping(&job.run, &kept, key, || {
            bake(&world, &config.point_based, inputs.proxy(), config.seed, &job.run)
        });
        baked.map_err(|error| args.keep.told(error, &args.output))?
    };
    if !args.channels.is_empty() {
        cloud.channels.retain(|c| args.channels.contains(&c.name));
    }
    {
        let _phase = job.run.phase("write", 1);
        let scene = args.scene.scene.display();
        let comments = [
            format!("nearfar {} cloud bake of {scene}", env!("CARGO_PKG_VERSION")),
            "areas in scene units squared, light in W/m2".into(),
            scene_comment(&job.scene),
        ];
        atomic_file::rescued(&args.output, |path| write_cloud(path, &cloud, &comments))?;
    }
    forget_job(&args.output);
    println!("{} elements, area {:.6}", cloud.len(), cloud.total_area());
    if let Some(path) = &args.stats {
        let figures = BakeFigures {
            elements: cloud.len(),
            area: cloud.total_area(),
            triangles: world.geometry.len(),
            of_run: RunStatistics::new(&job.run),
        };
        write_json(path, &figures)?;
    }
    if args.scene.verbose {
        job.run
            .seconds()
            .iter()
            .for_each(|(phase, seconds)| eprintln!("{phase:>12} {seconds:8.2} s"));
    }
    Ok(())
}
