//! Options that rendering commands share, and how they become a scene and settings.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::Args;
use std::io::IsTerminal;
use toml::Value;

use super::progress::Bar;
use super::quality::Quality;
use super::{parse_seconds, parse_size, tell};
use crate::accel::Backend;
use crate::config::{self, RenderConfig};
use crate::error::Result;
use crate::load::{Loaded, load};
use crate::run::Run;
use crate::scene::Scene;

/// Options of every command that reads a scene.
#[derive(Debug, Args)]
pub(super) struct SceneOptions {
    /// Scene TOML or OBJ.
    pub(super) scene: PathBuf,
    /// Image size in pixels.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub(super) size: Option<(u32, u32)>,
    /// Override any key of the scene file; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) assignments: Vec<String>,
    /// How much time the picture is worth; settings given elsewhere win.
    #[arg(long, default_value_t, value_enum)]
    pub(super) quality: Quality,
    /// Seed of every random number.
    #[arg(long)]
    pub(super) seed: Option<u64>,
    /// Worker threads; 0: all cores.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub(super) threads: usize,
    /// Who answers ray queries.
    #[arg(long, default_value_t, value_enum)]
    pub(super) backend: Backend,
    /// Only errors.
    #[arg(short, long, conflicts_with = "verbose")]
    pub(super) quiet: bool,
    /// The seconds of every phase.
    #[arg(short, long)]
    pub(super) verbose: bool,
}

/// A scene and what is to be done with it.
pub(super) struct Job {
    pub(super) scene: Scene,
    /// Settings that anything gives: scene file, command line, quality; the others follow.
    pub(super) given: toml::Table,
    pub(super) config: RenderConfig,
    pub(super) run: Run,
    pub(super) start: Instant,
}

impl SceneOptions {
    /// Loads the scene, merges `extra` (dotted key, value) over the settings, and starts the
    /// threads.
    ///
    /// # Errors
    /// Whatever is wrong with the scene or a setting.
    pub(super) fn prepare(
        &self,
        extra: &[(&str, Value)],
        time_limit: Option<f64>,
        cancel: &Arc<AtomicBool>,
    ) -> Result<Job> {
        let start = Instant::now();
        let mut run = Run::new(self.threads)?;
        run.deadline = time_limit.map(|s| start + Duration::from_secs_f64(s));
        run = with_bar(run, self.quiet, cancel);
        let phase = run.phase("load", 1);
        let Loaded { scene, mut settings, notes, warnings } = self.load()?;
        drop(phase);
        tell(self.quiet, &notes, &warnings);
        self.quality.fill(&mut settings)?;
        for (key, value) in extra {
            config::set(&mut settings, key, value.clone())?;
        }
        if let Some(seed) = self.seed {
            config::set(&mut settings, "seed", Value::Integer(seed as i64))?;
        }
        let config = RenderConfig::from_table(settings.clone())?;
        Ok(Job { scene, given: settings, config, run, start })
    }

    /// Whether the command line sets this key.
    ///
    /// # Errors
    /// Assignments that cannot be read.
    pub(super) fn sets(&self, key: &str) -> Result<bool> {
        for text in &self.assignments {
            if config::parse_assignment(text)?.0.trim_start_matches("settings.") == key {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The scene with overrides and size applied.
    pub(super) fn load(&self) -> Result<Loaded> {
        let mut overrides = Vec::new();
        for text in &self.assignments {
            overrides.push(config::parse_assignment(text)?);
        }
        if let Some((width, height)) = self.size {
            overrides.extend([
                ("camera.width".into(), width.to_string()),
                ("camera.height".into(), height.to_string()),
            ]);
        }
        load(&self.scene, &overrides)
    }
}

/// The run with a progress bar where there is a terminal to show it, and with Ctrl-C.
pub(super) fn with_bar(run: Run, quiet: bool, cancel: &Arc<AtomicBool>) -> Run {
    let reporter: Box<dyn crate::run::Reporter> = if !quiet && std::io::stderr().is_terminal() {
        Box::new(Bar::default())
    } else {
        Box::new(NoBar)
    };
    run.with_reporter(reporter, Arc::clone(cancel))
}

#[derive(Debug)]
struct NoBar;
impl crate::run::Reporter for NoBar {
    fn begin(&self, _: &str, _: u64) {}
    fn advance(&self, _: u64) {}
    fn end(&self) {}
}

/// Options about the picture and what is told of it.
#[derive(Debug, Args)]
pub(super) struct OutputOptions {
    /// Image to write: OpenEXR with all layers.
    #[arg(short, long, value_name = "OUT.exr")]
    pub(super) output: PathBuf,
    /// Samples per pixel.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) spp: Option<u32>,
    /// Stop a progressive method after this time: seconds, or 90s, 1.5m, 2h.
    #[arg(long, value_name = "TIME", value_parser = parse_seconds)]
    pub(super) time_limit: Option<f64>,
    /// Layers to write beside the beauty; default all.
    #[arg(long, value_name = "LAYERS", value_delimiter = ',')]
    pub(super) aov: Vec<String>,
    /// Write statistics as JSON.
    #[arg(long, value_name = "FILE.json")]
    pub(super) stats: Option<PathBuf>,
    /// Write a PNG beside the image.
    #[arg(long)]
    pub(super) png: bool,
    /// Exposure of the PNG in stops.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_name = "STOPS")]
    pub(super) exposure: f32,
    /// Store colours in 16 bits.
    #[arg(long)]
    pub(super) half: bool,
}
