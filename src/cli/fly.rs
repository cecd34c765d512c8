//! `nearfar fly`: the frames of a camera path, by one process that keeps proxy and clusters between
//! them.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::{Args, ValueEnum};
use glam::Vec3;
use serde_json::{Map, Value as Json, json};
use toml::Value;

use super::options::{Job, SceneOptions};
use super::render::{describe, keep_layers};
use super::{check_writable, statistics};
use crate::compare::flicker::{Flicker, Frame};
use crate::error::{Error, Result};
use crate::film::{self, Precision};
use crate::load::load_camera_path;
use crate::method::decompose::near_boxes::NearBoxes;
use crate::method::decompose::store::{self, Known};
use crate::method::decompose::{self, NearNoise, Prepared};
use crate::scene::{Camera, CameraPath, Fingerprint};
use crate::shading::World;

/// What frames have in common.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Reuse {
    /// Everything is made for all frames beforehand: nothing appears in the middle of the film.
    #[default]
    Plan,
    /// Every frame adds what it sees first: no look ahead, small pops where something comes into
    /// view.
    Extend,
    /// Nothing: every frame is made as `render` would make it.
    None,
}

/// Options of `nearfar fly`.
#[derive(Debug, Args)]
pub(super) struct FlyArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// Key views as TOML: [[key]] with eye, target, and optional up, vfov_deg, time.
    #[arg(long, value_name = "FILE.toml", conflicts_with_all = ["to_eye", "to_target"])]
    path: Option<PathBuf>,
    /// Fly in a straight line from the scene's camera to this eye.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    to_eye: Option<Vec3>,
    /// Turn from the scene's target to this one.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    to_target: Option<Vec3>,
    /// Frames, the first and the last view included.
    #[arg(long, default_value_t = 24, value_name = "N", value_parser = clap::value_parser!(u32).range(1..100_000))]
    frames: u32,
    /// Folder for frame_0001.exr and so on; made if it is not there.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// What frames share.
    #[arg(long, default_value_t, value_enum)]
    reuse: Reuse,
    /// Start from the proxy and clusters of this file, as of `render --save-cache`.
    #[arg(long, value_name = "FILE.ply")]
    load_cache: Option<PathBuf>,
    /// Write proxy and clusters of all frames.
    #[arg(long, value_name = "FILE.ply")]
    save_cache: Option<PathBuf>,
    /// Near/far distance: a length, or a share of the scene's diagonal such as "2%".
    #[arg(long, value_name = "LENGTH")]
    alpha: Option<String>,
    /// Samples per pixel.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Layers to write beside the beauty; default all.
    #[arg(long, value_name = "LAYERS", value_delimiter = ',')]
    aov: Vec<String>,
    /// Write statistics as JSON.
    #[arg(long, value_name = "FILE.json")]
    stats: Option<PathBuf>,
    /// Write a PNG beside every frame.
    #[arg(long)]
    png: bool,
    /// Exposure of the PNGs in stops.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_name = "STOPS")]
    exposure: f32,
    /// Store colours in 16 bits.
    #[arg(long)]
    half: bool,
}

fn parse_point(text: &str) -> std::result::Result<Vec3, String> {
    let numbers: Vec<f32> = text
        .split(',')
        .filter_map(|t| t.trim().parse().ok())
        .filter(|v: &f32| v.is_finite())
        .collect();
    match (numbers.as_slice(), text.split(',').count()) {
        ([x, y, z], 3) => Ok(Vec3::new(*x, *y, *z)),
        _ => Err("write three numbers: X,Y,Z".into()),
    }
}

fn views(args: &FlyArgs, camera: &Camera) -> Result<Vec<Camera>> {
    let path = match &args.path {
        Some(file) => load_camera_path(file, camera)?,
        None if args.to_eye.is_none() && args.to_target.is_none() => {
            return Err(Error::Usage(
                "fly: no camera path: give --path FILE.toml, or --to-eye and --to-target".into(),
            ));
        }
        None => {
            let end = Camera {
                eye: args.to_eye.unwrap_or(camera.eye),
                target: args.to_target.unwrap_or(camera.target),
                ..camera.clone()
            };
            CameraPath::new(vec![(0.0, camera.clone()), (1.0, end)])
                .ok_or_else(|| Error::Usage("fly: no camera path".into()))?
        }
    };
    let views: Vec<Camera> = (0..args.frames).map(|i| path.frame(i, args.frames)).collect();
    let blind = |c: &&Camera| {
        (c.target - c.eye).normalize_or_zero().cross(c.up.normalize_or_zero()).length() < 1e-6
    };
    match views.iter().position(|c| blind(&c)) {
        Some(i) => Err(Error::Usage(format!(
            "fly: frame {} looks at its own eye or along its up vector; move a key view or give another up",
            i + 1
        ))),
        None => Ok(views),
    }
}

/// # Errors
/// Whatever stops a render; see [`Error`]. Frames that are done stay.
pub(super) fn fly(args: &FlyArgs, cancel: &Arc<AtomicBool>) -> Result<()> {
    let mut extra = Vec::new();
    if let Some(spp) = args.spp {
        extra.push(("record.spp", Value::Integer(spp.into())));
    }
    if let Some(alpha) = &args.alpha {
        extra.push(("decompose.alpha", crate::config::parse_value(alpha)));
    }
    if args.reuse == Reuse::None && (args.load_cache.is_some() || args.save_cache.is_some()) {
        return Err(Error::Usage(
            "fly: --reuse none keeps nothing: leave out --load-cache and --save-cache".into(),
        ));
    }
    [&args.stats, &args.save_cache]
        .into_iter()
        .flatten()
        .try_for_each(|path| check_writable(path))?;
    let mut job = args.scene.prepare(&extra, None, cancel)?;
    // Noise that stays on the surfaces, unless another is asked for.
    if job.config.decompose.near_noise == NearNoise::Point
        && args.reuse != Reuse::None
        && !args.scene.sets("decompose.near_noise")?
    {
        job.config.decompose.near_noise = NearNoise::World;
    }
    let views = views(args, &job.scene.camera)?;
    std::fs::create_dir_all(&args.output)
        .map_err(|source| Error::Io { path: args.output.clone(), source })?;
    let mut world = World::new(&job.scene, args.scene.backend, &job.run)?;
    let (settings, inputs) = (&job.config.decompose, job.config.inputs(world.diagonal));
    let key = || store::key(Fingerprint::new(&job.scene), &inputs, settings, world.diagonal);
    let key = (args.load_cache.is_some() || args.save_cache.is_some()).then(key);
    let load = |path: &PathBuf, key| store::load(path, key, &inputs, settings);
    let known = args
        .load_cache
        .as_ref()
        .zip(key.as_ref())
        .map(|(path, key)| load(path, key))
        .transpose()?;
    let (mut film, mut boxes) = (Vec::new(), NearBoxes::default());
    let (mut last, mut changes): (Option<Frame>, Vec<f32>) = (None, Vec::new());
    let mut before = statistics::cpu_seconds();
    let tell = args.scene.verbose || (!args.scene.quiet && std::io::stderr().is_terminal());
    let mut prepared = match (args.reuse, known) {
        (Reuse::Plan, known) => {
            Some(decompose::plan(&world, settings, inputs, &views, known, &job.run)?)
        }
        (_, Some(known)) => Some(Prepared::known(&world, settings, inputs, known, &job.run)?),
        (_, None) => None,
    };
    let preparing = statistics::cpu_seconds();
    let shared = preparing - before;
    before = preparing;
    for (i, view) in views.iter().enumerate() {
        world.camera = view.clone();
        let now = match prepared.take() {
            Some(mut known) if args.reuse != Reuse::None => {
                known.look(&world, settings, inputs, args.reuse == Reuse::Extend, &job.run)?;
                known
            }
            _ => decompose::prepare(&world, settings, inputs, &job.run)?,
        };
        let kept = (args.reuse != Reuse::None && settings.near_noise == NearNoise::World)
            .then_some(&mut boxes);
        let rendered =
            decompose::picture_with(&world, settings, &now, kept, inputs.seed, &job.run)?;
        let frame = Frame::new(&rendered.film, view);
        let change =
            last.as_ref().zip(frame.as_ref()).map(|(a, b)| a.changes(b)).unwrap_or_default();
        last = frame;
        let file = args.output.join(format!("frame_{:04}.exr", i + 1));
        write(args, &job, &file, rendered.film)?;
        let seconds = statistics::cpu_seconds();
        film.push(json!({
            "file": file.display().to_string(),
            "cpu_seconds": seconds - before,
            "clusters": now.clusters.len(),
            "clusters_added": now.clusters.len() - now.earlier,
            "sides_added": now.sides_added,
            "flicker": Flicker::new(change.clone()),
        }));
        before = seconds;
        changes.extend(change);
        prepared = Some(now);
        if tell {
            eprintln!("{}/{} {}", i + 1, views.len(), file.display());
        }
    }
    if let (Some(path), Some(key), Some(prepared)) = (&args.save_cache, &key, &prepared) {
        store::save(path, key, &Known::new(prepared), settings)?;
    }
    finish(args, &job, &film, Flicker::new(changes), shared)
}

fn write(args: &FlyArgs, job: &Job, file: &std::path::Path, mut film: film::Film) -> Result<()> {
    let _phase = job.run.phase("write", 1);
    keep_layers(&mut film, &args.aov, &job.run);
    describe(&mut film, &args.scene, "decomposition", job)?;
    film::write_exr(&film, file, if args.half { Precision::Half } else { Precision::Full })?;
    if args.png {
        film::write_png(&film, &file.with_extension("png"), args.exposure)?;
    }
    Ok(())
}

fn finish(args: &FlyArgs, job: &Job, frames: &[Json], flicker: Flicker, shared: f64) -> Result<()> {
    let camera = &job.scene.camera;
    let each: Vec<f64> = frames.iter().filter_map(|f| f["cpu_seconds"].as_f64()).collect();
    let after_first = each.iter().skip(1).sum::<f64>() / (each.len() - 1).max(1) as f64;
    if !args.scene.quiet {
        job.run.warnings().iter().for_each(|w| eprintln!("warning: {w}"));
        println!("frames                       {}", frames.len());
        println!("CPU seconds before them      {shared:.2}");
        println!("CPU seconds of the first     {:.2}", each.first().copied().unwrap_or_default());
        println!("CPU seconds of each other    {after_first:.2}");
        if flicker.points > 0 {
            println!(
                "temporal variance            {:.3e} at {} static points",
                flicker.temporal_variance, flicker.points
            );
            println!("worst thousandth of them     {:.3e}", flicker.worst_thousandth);
        }
    }
    if let Some(path) = &args.stats {
        let mut stats: Map<String, Json> = Map::new();
        for (key, value) in [
            ("method", json!("decomposition")),
            ("reuse", json!(args.reuse.to_possible_value().map(|v| v.get_name().to_owned()))),
            ("backend", json!(args.scene.backend)),
            ("width", json!(camera.width)),
            ("height", json!(camera.height)),
            ("seed", json!(job.config.seed)),
            ("cpu_seconds_before_frames", json!(shared)),
            ("cpu_seconds_per_frame_after_first", json!(after_first)),
            ("flicker", json!(flicker)),
            ("frames", json!(frames)),
        ] {
            stats.insert(key.into(), value);
        }
        statistics::write(
            &statistics::collect(&job.run, job.start.elapsed().as_secs_f64(), stats),
            path,
        )?;
    }
    if job.run.cancelled() { Err(Error::Interrupted) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_read() {
        assert_eq!(parse_point("1, -2,0.5"), Ok(Vec3::new(1.0, -2.0, 0.5)));
        for wrong in ["1,2", "1,2,3,4", "a,b,c", "1,2,nan", ""] {
            assert!(parse_point(wrong).is_err(), "{wrong}");
        }
    }
}
