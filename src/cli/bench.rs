//! `nearfar bench`.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;

use super::options::SceneOptions;
use crate::error::{Error, Result};
use crate::report::backends::{BackendBenchSettings, bench_backends};
use crate::shading::World;

/// Options of `nearfar bench`.
#[derive(Debug, Args)]
pub(super) struct BenchArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// The same rays through every ray backend and packet width, and through a C++ loop on Embree's own API (the default).
    #[arg(long, conflicts_with = "methods")]
    backends: bool,
    /// Every rendering method at equal time.
    #[arg(long)]
    methods: bool,
    /// Where the error of the decomposition sits; needs --reference.
    #[arg(long, conflicts_with_all = ["backends", "methods"], requires = "reference")]
    budget: bool,
    /// Ground truth of --budget: same size, better with two halves (see `nearfar reference`).
    #[arg(long, value_name = "REF.exr")]
    reference: Option<std::path::PathBuf>,
    /// --budget looks at every n-th pixel in x and y.
    #[arg(long, default_value_t = 8, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    stride: u32,
    /// Rays of the exact gathers of --budget.
    #[arg(long, default_value_t = 4096, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    gather_rays: u32,
    /// Rays of each kind.
    #[arg(long, default_value_t = BackendBenchSettings::default().rays, value_name = "N")]
    rays: usize,
    /// Alternating runs of which the median counts.
    #[arg(long, default_value_t = BackendBenchSettings::default().rounds, value_name = "N")]
    rounds: usize,
    /// Print JSON in place of the table.
    #[arg(long)]
    json: bool,
}

/// Measures and prints a table, or JSON.
///
/// # Errors
/// Whatever is wrong with the scene; [`Error::Accel`] when a backend cannot be built.
pub(super) fn bench(args: &BenchArgs, cancel: &Arc<AtomicBool>) -> Result<()> {
    if args.methods {
        return Err(Error::Usage("bench --methods: not built yet; use --backends".into()));
    }
    if args.rays == 0 || args.rounds == 0 {
        return Err(Error::Usage("bench needs at least one ray and one round: give --rays and --rounds above 0".into()));
    }
    let job = args.scene.prepare(&[], None, cancel)?;
    let world = World::new(&job.scene, args.scene.backend, &job.run)?;
    if let Some(reference) = args.reference.as_deref().filter(|_| args.budget) {
        return super::budget::run(&job, &world, reference, args.stride, args.gather_rays, args.json);
    }
    let settings = BackendBenchSettings { rays: args.rays, rounds: args.rounds, seed: args.scene.seed.unwrap_or(0) };
    let report = bench_backends(&world, &settings, &job.run)?;
    if args.json {
        let text = serde_json::to_string_pretty(&report).map_err(|e| Error::Render(format!("cannot write JSON: {e}")))?;
        println!("{text}");
    } else {
        print!("{report}");
    }
    Ok(())
}
