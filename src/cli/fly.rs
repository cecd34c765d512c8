//! `nearfar fly`: the frames of a camera path, by one process that keeps proxy and clusters between
//! them.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use clap::Args;
use glam::DVec3;
use serde::Serialize;
use toml::Value;

use super::options::{Job, SceneOptions};
use super::picture::ImageOptions;
use super::shelf::Shelf;
use super::{parse_seconds, stop, write_json};
use crate::accel::Backend;
use crate::atomic_file;
use crate::compare::flicker::{Flicker, Frame};
use crate::error::{Error, Result};
use crate::load::load_camera_path;
use crate::method::Method;
use crate::method::decompose::NearNoise;
use crate::process;
use crate::render::{Checkpoint, Flight, Kept, Reuse, RunStatistics, Shots};
use crate::scene::{Camera, CameraPath, Scene};

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
    to_eye: Option<DVec3>,
    /// Turn from the scene's target to this one.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    to_target: Option<DVec3>,
    /// Frames, the first and the last view included.
    #[arg(
        long,
        default_value_t = 24,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..100_000)
    )]
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
    /// Near/far distance: a length, or a share of the scene's extent such as "2%".
    #[arg(long, value_name = "LENGTH")]
    alpha: Option<String>,
    /// Samples per pixel.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Write statistics as JSON.
    #[arg(long, value_name = "FILE.json")]
    stats: Option<PathBuf>,
    /// Go on at the frame where the same command was stopped; from the first where nothing is kept.
    #[arg(long)]
    resume: bool,
    /// Keep what frames share, as film.partial.ply in the folder, whenever this time has passed:
    /// seconds, or 90s, 1.5m, 2h.
    #[arg(long, value_name = "TIME", default_value = "60", value_parser = parse_seconds)]
    checkpoint: f64,
    /// Make frames of another film in the folder again, and remove those beyond the last.
    #[arg(long)]
    replace: bool,
    #[command(flatten)]
    image: ImageOptions,
}

/// What frames share, while a film is made.
const STATE: &str = "film.partial.ply";

fn parse_point(text: &str) -> std::result::Result<DVec3, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .filter_map(|t| t.trim().parse().ok())
        .filter(|v: &f64| v.is_finite())
        .collect();
    match (numbers.as_slice(), text.split(',').count()) {
        ([x, y, z], 3) => Ok(DVec3::new(*x, *y, *z)),
        _ => Err("write three numbers: X,Y,Z".into()),
    }
}

fn views(args: &FlyArgs, scene: &Scene) -> Result<Vec<Camera>> {
    let camera = &scene.camera;
    let path = match &args.path {
        Some(file) => load_camera_path(file, camera, scene.origin)?,
        None if args.to_eye.is_none() && args.to_target.is_none() => {
            return Err(Error::Usage(
                "fly: no camera path: give --path FILE.toml, or --to-eye and --to-target".into(),
            ));
        }
        None => {
            let near = |p: DVec3| (p - scene.origin).as_vec3();
            let end = Camera {
                eye: args.to_eye.map_or(camera.eye, near),
                target: args.to_target.map_or(camera.target, near),
                ..camera.clone()
            };
            CameraPath::new(vec![(0.0, camera.clone()), (1.0, end)])
                .ok_or_else(|| Error::Usage("fly: no camera path".into()))?
        }
    };
    Ok((0..args.frames).map(|i| path.frame(i, args.frames)).collect())
}

/// What is told of one frame.
#[derive(Debug, Serialize)]
struct FrameFigures {
    file: String,
    /// By an earlier run, of which no other figures are known.
    made_before: bool,
    cpu_seconds: f64,
    clusters: usize,
    clusters_added: usize,
    sides_added: usize,
    flicker: Flicker,
}

/// What is told of a film.
#[derive(Debug, Serialize)]
struct FilmFigures {
    method: Method,
    reuse: Reuse,
    backend: Backend,
    width: u32,
    height: u32,
    seed: u64,
    cpu_seconds_before_frames: f64,
    cpu_seconds_per_frame_after_first: f64,
    flicker: Flicker,
    frames: Vec<FrameFigures>,
    #[serde(flatten)]
    of_run: RunStatistics,
}

/// # Errors
/// Whatever stops a render; see [`Error`]. Frames that are done stay.
pub(super) fn fly(args: &FlyArgs, cancel: &Arc<AtomicBool>) -> Result<()> {
    let mut settings = Vec::new();
    if let Some(spp) = args.spp {
        settings.push(("record.spp", Value::Integer(spp.into())));
    }
    if let Some(alpha) = &args.alpha {
        settings.push(("decompose.alpha", crate::config::parse_value(alpha)));
    }
    args.image.check()?;
    [&args.stats, &args.save_cache]
        .into_iter()
        .flatten()
        .try_for_each(|path| atomic_file::check(path))?;
    if args.output.is_dir() {
        atomic_file::check(&args.output.join(STATE))?;
    } else {
        // What a folder can be made of, a file can.
        atomic_file::check(&args.output)?;
    }
    let mut job = args.scene.prepare(&settings, None, cancel)?;
    // Noise that stays on the surfaces, unless another is asked for.
    if args.reuse != Reuse::None {
        job.config.decompose.near_noise.get_or_insert(NearNoise::World);
    }
    let job = job;
    let views = views(args, &job.scene)?;
    let load = args.load_cache.as_deref();
    let shots = Shots::new(&job.scene, &job.config, views.clone(), args.reuse, load)?;
    std::fs::create_dir_all(&args.output)
        .map_err(|source| Error::Io { path: args.output.clone(), source })?;
    let shelf = Shelf::new(&args.output, shots.mark(), &args.image, args.replace);
    let state = args.output.join(STATE);
    shelf.check()?;
    let start = process::cpu_seconds();
    let every = Duration::try_from_secs_f64(args.checkpoint).unwrap_or(Duration::MAX);
    let shares = args.reuse != Reuse::None;
    let kept = Kept {
        load: args.load_cache.clone(),
        save: args.save_cache.clone(),
        resume: (args.resume && shares && state.exists()).then(|| state.clone()),
        checkpoint: Some(Checkpoint { file: state.clone(), every }),
    };
    let mut flight = Flight::new(&job.scene, &job.config, shots, &kept, &job.run)?;
    let done = match (args.resume, shares) {
        (true, false) => shelf.done(views.len()),
        _ => flight.done(),
    };
    let keep = |flight: &mut Flight<'_>, done: usize| {
        if let Err(error) = flight.keep(done) {
            job.run.warn(format!("what frames share is not kept: {error}"));
        }
    };
    keep(&mut flight, done);
    let mut before = process::cpu_seconds();
    let shared = before - start;
    let (mut figures, mut changes): (Vec<FrameFigures>, Vec<f32>) = (Vec::new(), Vec::new());
    let mut last: Option<Frame> = None;
    let tell = job.verbose || (!job.quiet && std::io::stderr().is_terminal());
    stop::keeps();
    for (i, view) in views.iter().enumerate() {
        let file = shelf.frame(i);
        let (mut film, [clusters, clusters_added, sides_added]) = if i < done {
            let mut film = shelf.read(i)?;
            film.rebase(job.scene.origin);
            (film, [0; 3])
        } else {
            let made = flight.frame(i).map_err(|error| stopped(error, i, args))?;
            (made.film, [made.clusters, made.clusters_added, made.sides_added])
        };
        let frame = Frame::new(&film, view);
        let change = last.as_ref().zip(frame.as_ref()).map(|(a, b)| a.changes(b));
        let change = change.unwrap_or_default();
        last = frame;
        if i >= done {
            shelf.write(&mut film, i, &job)?;
            keep(&mut flight, i + 1);
        }
        let seconds = process::cpu_seconds();
        figures.push(FrameFigures {
            file: file.display().to_string(),
            made_before: i < done,
            cpu_seconds: seconds - before,
            clusters,
            clusters_added,
            sides_added,
            flicker: Flicker::new(change.clone()),
        });
        before = seconds;
        changes.extend(change);
        if tell {
            eprintln!("{}/{} {}", i + 1, views.len(), file.display());
        }
        if job.run.cancelled() && i + 1 < views.len() {
            return Err(stopped(Error::Interrupted, i + 1, args));
        }
    }
    shelf.remove_beyond(views.len())?;
    drop(std::fs::remove_file(&state));
    if let Some(path) = &args.save_cache {
        flight.save(path)?;
    }
    finish(args, &job, figures, Flicker::new(changes), shared)
}

/// What is said of a film that was stopped after so many frames.
fn stopped(error: Error, done: usize, args: &FlyArgs) -> Error {
    match error {
        Error::Interrupted if done > 0 => Error::Stopped(format!(
            "{done} of {} frames are done; the same command with --resume goes on from there",
            args.frames
        )),
        other => other,
    }
}

fn finish(
    args: &FlyArgs,
    job: &Job,
    frames: Vec<FrameFigures>,
    flicker: Flicker,
    shared: f64,
) -> Result<()> {
    let (config, camera) = (&job.config, &job.scene.camera);
    let made = || frames.iter().filter(|f| !f.made_before);
    let others = made().skip(1).map(|f| f.cpu_seconds);
    let after_first = others.sum::<f64>() / made().skip(1).count().max(1) as f64;
    if !job.quiet {
        let first = made().next().map_or(0.0, |f| f.cpu_seconds);
        println!("frames                       {}", frames.len());
        println!("CPU seconds before them      {shared:.2}");
        println!("CPU seconds of the first     {first:.2}");
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
        let figures = FilmFigures {
            method: Method::Decomposition,
            reuse: args.reuse,
            backend: config.backend,
            width: camera.width,
            height: camera.height,
            seed: config.seed,
            cpu_seconds_before_frames: shared,
            cpu_seconds_per_frame_after_first: after_first,
            flicker,
            frames,
            of_run: RunStatistics::new(&job.run),
        };
        write_json(path, &figures)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_read() {
        assert_eq!(parse_point("1, -2,0.5"), Ok(DVec3::new(1.0, -2.0, 0.5)));
        for wrong in ["1,2", "1,2,3,4", "a,b,c", "1,2,nan", ""] {
            assert!(parse_point(wrong).is_err(), "{wrong}");
        }
    }
}
