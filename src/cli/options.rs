//! Options that rendering commands share, and how they become a scene and settings.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use clap::Args;
use toml::Value;

use super::progress::Progress;
use super::{parse_seconds, parse_size, tell};
use crate::accel::Backend;
use crate::config::{self, Quality, RenderConfig};
use crate::error::{Error, Result};
use crate::forecast::Part;
use crate::load::{Loaded, load};
use crate::memory;
use crate::render::Expected;
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
    #[arg(long, value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    pub(super) seed: Option<u64>,
    /// Worker threads; 0: all cores.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub(super) threads: usize,
    /// Most memory to take, such as 8G; default: what the machine has.
    #[arg(long, value_name = "SIZE", value_parser = memory::parse_size)]
    pub(super) memory_limit: Option<u64>,
    /// Who answers ray queries.
    #[arg(long, value_enum)]
    pub(super) backend: Option<Backend>,
    /// Only errors.
    #[arg(short, long, conflicts_with = "verbose")]
    pub(super) quiet: bool,
    /// Tell how far it is, how long it still takes and which phase runs, as a line on standard
    /// error whenever this time has passed. Default: a bar, where there is a terminal.
    #[arg(
        long,
        value_name = "TIME",
        value_parser = parse_seconds,
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "1"
    )]
    pub(super) progress: Option<f64>,
    /// The seconds of every phase.
    #[arg(short, long)]
    pub(super) verbose: bool,
}

/// A scene and what is to be done with it.
pub(super) struct Job {
    /// The scene's file, as the user named it.
    pub(super) path: PathBuf,
    pub(super) scene: Scene,
    /// Settings that anything gives: scene file, command line, quality; the others follow.
    pub(super) given: toml::Table,
    pub(super) config: RenderConfig,
    pub(super) run: Run,
    pub(super) quiet: bool,
    pub(super) verbose: bool,
}

impl Job {
    /// Tells the phases to come: the building of the world, and those of what is made of it.
    pub(super) fn plan(&self, of: impl FnOnce(&Expected<'_>) -> Vec<Part>) {
        let expected = Expected::new(&self.scene, &self.config, self.run.threads(), false);
        self.run.plan(&[expected.build(), of(&expected)].concat());
    }
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
        let mut run = Run::new(self.threads)?;
        // A limit that no clock can tell is none.
        let limit = time_limit.and_then(|s| Duration::try_from_secs_f64(s).ok());
        run.deadline = limit.and_then(|limit| run.started.checked_add(limit));
        run = with_bar(run, self.quiet, self.progress, cancel);
        let phase = run.phase("load", 1);
        let Loaded { scene, mut settings, notes, warnings, setting_lines } = self.read()?;
        drop(phase);
        tell(self.quiet, &notes, &warnings);
        for (key, value) in extra {
            config::set(&mut settings, key, value.clone())?;
        }
        if let Some(seed) = self.seed {
            config::set(&mut settings, "seed", Value::Integer(seed as i64))?;
        }
        if let Some(backend) = self.backend {
            config::set(&mut settings, "backend", Value::String(value_name(backend)))?;
        }
        self.quality.fill(&mut settings)?;
        let config = RenderConfig::from_table(settings.clone())
            .map_err(|error| self.placed(error, &setting_lines))?;
        let (path, quiet, verbose) = (self.scene.clone(), self.quiet, self.verbose);
        Ok(Job { path, scene, given: settings, config, run, quiet, verbose })
    }

    /// The scene with overrides and size applied, its settings checked.
    ///
    /// # Errors
    /// Whatever is wrong with the scene or a setting.
    pub(super) fn load(&self) -> Result<Loaded> {
        let loaded = self.read()?;
        RenderConfig::at_quality(loaded.settings.clone(), self.quality)
            .map_err(|error| self.placed(error, &loaded.setting_lines))?;
        Ok(loaded)
    }

    /// The fault of a setting with its place in the scene file, where it comes from there.
    fn placed(&self, error: Error, lines: &BTreeMap<String, usize>) -> Error {
        match &error {
            Error::Setting { key, .. } => match lines.get(key) {
                Some(&line) => Error::input(&self.scene, Some(line), error.to_string()),
                None => error,
            },
            _ => error,
        }
    }

    fn read(&self) -> Result<Loaded> {
        memory::set_limit(self.memory_limit.unwrap_or(0));
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

/// The run with progress shown where it can be, and with Ctrl-C; `lines`: seconds between two.
pub(super) fn with_bar(run: Run, quiet: bool, lines: Option<f64>, cancel: &Arc<AtomicBool>) -> Run {
    run.with_reporter(Box::new(Progress::new(quiet, lines)), Arc::clone(cancel))
}

/// The name of a choice, as written on the command line.
pub(super) fn value_name<T: clap::ValueEnum>(choice: T) -> String {
    choice.to_possible_value().map_or_else(String::new, |v| v.get_name().to_owned())
}
