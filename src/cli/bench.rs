//! `nearfar bench`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;

use super::budget;
use super::methods::{self, MethodsOptions};
use super::options::SceneOptions;
use crate::atomic_file;
use crate::bench::backends::{BackendBenchSettings, bench_backends};
use crate::error::{Error, Result};
use crate::memory;
use crate::shading::World;

/// Bytes of a recorded ray with what every backend answers, all streams together.
const RECORDED: f64 = 400.0;

/// Options of `nearfar bench`.
#[derive(Debug, Args)]
pub(super) struct BenchArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// The same rays through every ray backend and packet width, and through a C++ loop on Embree's
    /// own API (the default).
    #[arg(long, conflicts_with = "methods")]
    backends: bool,
    /// Every rendering method: a sweep of its own quality knob, and what its picture costs at equal
    /// error.
    #[arg(long)]
    methods: bool,
    /// Where the error of the decomposition sits; needs --reference.
    #[arg(long, conflicts_with_all = ["backends", "methods"], requires = "reference")]
    budget: bool,
    /// Ground truth of --methods and --budget: same size, better with two halves (see `nearfar
    /// reference`).
    #[arg(long, value_name = "REF.exr")]
    reference: Option<PathBuf>,
    /// --budget looks at every n-th pixel in x and y.
    #[arg(
        long,
        default_value_t = 8,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..)
    )]
    stride: u32,
    /// Rays of the exact gathers of --budget.
    #[arg(
        long,
        default_value_t = 4096,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=1_000_000)
    )]
    gather_rays: u32,
    /// Rays of each kind.
    #[arg(long, default_value_t = BackendBenchSettings::default().rays, value_name = "N")]
    rays: usize,
    /// Alternating runs of which the median counts; by default 5 of --backends, 1 of --methods.
    #[arg(long, value_name = "N")]
    rounds: Option<usize>,
    /// Print JSON in place of the table; with =FILE write it there, beside the table.
    #[arg(
        long,
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "-",
        value_name = "FILE"
    )]
    json: Option<PathBuf>,
    #[command(flatten)]
    sweeps: MethodsOptions,
}

/// Shows a report: its table, or JSON on stdout, or both with the JSON in a file.
fn show(
    table: &dyn std::fmt::Display,
    json: &impl serde::Serialize,
    to: Option<&Path>,
) -> Result<()> {
    let text = || {
        serde_json::to_string_pretty(json)
            .map_err(|e| Error::Render(format!("cannot write JSON: {e}")))
    };
    match to {
        Some(path) if path == Path::new("-") => println!("{}", text()?),
        Some(path) => {
            atomic_file::write_bytes(path, text()? + "\n")?;
            print!("{table}");
        }
        None => print!("{table}"),
    }
    Ok(())
}

/// Measures and prints a table, or JSON.
///
/// # Errors
/// Whatever is wrong with the scene; [`Error::Accel`] when a backend cannot be built.
pub(super) fn bench(args: &BenchArgs, cancel: &Arc<AtomicBool>) -> Result<()> {
    if args.rays == 0 || args.rounds == Some(0) {
        return Err(Error::Usage(
            "bench needs at least one ray and one round: give --rays and --rounds above 0".into(),
        ));
    }
    if let Some(path) = args.json.as_deref().filter(|p| *p != Path::new("-")) {
        atomic_file::check(path)?;
    }
    if args.methods {
        let report = methods::run(
            &args.scene,
            &args.sweeps,
            args.reference.as_deref(),
            args.rounds.unwrap_or(1),
            cancel,
        )?;
        return show(&report, &report, args.json.as_deref());
    }
    let job = args.scene.prepare(&[], None, cancel)?;
    let world = World::new(&job.scene, job.config.backend, &job.run)?;
    if let Some(reference) = args.reference.as_deref().filter(|_| args.budget) {
        let rows = budget::run(&job, &world, reference, args.stride, args.gather_rays)?;
        return show(&budget::Table(&rows), &rows, args.json.as_deref());
    }
    let bytes = args.rays as f64 * RECORDED;
    memory::claim(bytes, &format!("a bench of {} rays", args.rays), "give fewer --rays")?;
    let default = BackendBenchSettings::default();
    let settings = BackendBenchSettings {
        rays: args.rays,
        rounds: args.rounds.unwrap_or(default.rounds),
        seed: args.scene.seed.unwrap_or(0),
    };
    let report = bench_backends(&world, &settings, &job.run)?;
    show(&report, &report, args.json.as_deref())
}
