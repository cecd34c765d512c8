//! A finished picture's files: EXR, PNG, statistics, and what is said of it.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::options::Job;
use super::{parse_finite, parse_seconds, write_json};
use crate::atomic_file;
use crate::error::{Error, Result};
use crate::film::{self, Film, Layer, Precision, layer_of};
use crate::method::Method;
use crate::process;
use crate::run::Run;

/// Which layers a picture keeps, and how it is written.
#[derive(Debug, Args)]
pub(super) struct ImageOptions {
    /// Layers to write beside the beauty; default all, "none" for none.
    #[arg(long, value_name = "LAYERS", value_delimiter = ',')]
    pub(super) aov: Vec<String>,
    /// Write a PNG beside the image.
    #[arg(long)]
    pub(super) png: bool,
    /// Exposure of the PNG in stops.
    #[arg(
        long,
        default_value_t = 0.0,
        allow_hyphen_values = true,
        value_name = "STOPS",
        value_parser = parse_finite
    )]
    pub(super) exposure: f32,
    /// Store colours in 16 bits.
    #[arg(long)]
    pub(super) half: bool,
}

/// Options about one picture and what is told of it.
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
    /// Write statistics as JSON.
    #[arg(long, value_name = "FILE.json")]
    pub(super) stats: Option<PathBuf>,
    #[command(flatten)]
    pub(super) image: ImageOptions,
}

/// Layers that some method or a later step writes.
fn all_layers() -> Vec<Layer> {
    let of_methods = Method::ALL.into_iter().flat_map(Method::layers);
    let more = [super::cloud::TRACED, crate::denoise::NOISY];
    let mut all: Vec<Layer> = Vec::new();
    for layer in of_methods.chain(more) {
        if !all.iter().any(|l| l.name == layer.name) {
            all.push(layer);
        }
    }
    all
}

impl ImageOptions {
    /// # Errors
    /// [`Error::Usage`] for layers that nothing writes.
    pub(super) fn check(&self) -> Result<()> {
        let all = all_layers();
        let known = |name: &str| name == "none" || all.iter().any(|l| l.name == layer_of(name));
        match self.aov.iter().find(|name| !known(name)) {
            Some(layer) => {
                let names: Vec<&str> = all.iter().map(|l| l.name).collect();
                Err(Error::Usage(format!(
                    "--aov {layer}: no method has such a layer; choose among none, {}",
                    names.join(", ")
                )))
            }
            None => Ok(()),
        }
    }

    /// Keeps the beauty, the running sums and the named layers; warns of layers that this picture
    /// does not have.
    pub(super) fn keep(&self, film: &mut Film, run: &Run) {
        if self.aov.is_empty() {
            return;
        }
        let has = |film: &Film, w: &str| film.channels.keys().any(|c| layer_of(c) == layer_of(w));
        for layer in self.aov.iter().filter(|w| *w != "none" && !has(film, w)) {
            run.warn(format!("--aov {layer}: this picture has no such layer"));
        }
        let wanted = |c: &str| self.aov.iter().any(|w| layer_of(w) == layer_of(c));
        film.channels.retain(|c, _| layer_of(c).is_empty() || layer_of(c) == "state" || wanted(c));
    }

    /// Writes the image, and the PNG beside it (phase `write`).
    ///
    /// # Errors
    /// When the system refuses.
    pub(super) fn write(&self, film: &mut Film, path: &Path, job: &Job) -> Result<()> {
        self.keep(film, &job.run);
        film.header.insert("nearfar.scene".into(), job.path.display().to_string());
        let _phase = job.run.phase("write", 1);
        let precision = if self.half { Precision::Half } else { Precision::Full };
        atomic_file::rescued(path, |path| film::write_exr(film, path, precision))?;
        if self.png {
            film::write_png(film, &path.with_extension("png"), self.exposure)?;
        }
        Ok(())
    }
}

impl OutputOptions {
    /// Refuses files that cannot be written before hours are spent on their content.
    ///
    /// # Errors
    /// [`Error::Usage`], or the folder that is not there.
    pub(super) fn check(&self) -> Result<()> {
        if self.output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("exr")) {
            return Err(Error::Usage(format!(
                "--output {}: the image is OpenEXR, name it .exr (--png writes a PNG beside it)",
                self.output.display()
            )));
        }
        self.image.check()?;
        atomic_file::check(&self.output)?;
        if self.image.png {
            atomic_file::check(&self.output.with_extension("png"))?;
        }
        self.stats.as_deref().map_or(Ok(()), atomic_file::check)
    }

    /// Refuses files that would overwrite each other or the scene: the image, its PNG, the
    /// statistics, and `others`.
    ///
    /// # Errors
    /// [`Error::Usage`] with the name that stands twice.
    pub(super) fn check_distinct(&self, scene: &Path, others: &[&PathBuf]) -> Result<()> {
        let png = self.image.png.then(|| self.output.with_extension("png"));
        let own = [Some(&self.output), png.as_ref(), self.stats.as_ref()];
        let mut seen = vec![scene];
        for path in own.into_iter().flatten().chain(others.iter().copied()) {
            if seen.contains(&path.as_path()) {
                return Err(Error::Usage(format!(
                    "{} is named twice: give every file a name of its own",
                    path.display()
                )));
            }
            seen.push(path);
        }
        Ok(())
    }

    /// Writes statistics and says how long everything took.
    ///
    /// # Errors
    /// When the system refuses.
    pub(super) fn finish(&self, statistics: &impl Serialize, job: &Job) -> Result<()> {
        if let Some(path) = &self.stats {
            write_json(path, statistics)?;
        }
        if job.verbose {
            let seconds = job.run.seconds();
            seconds.iter().for_each(|(phase, s)| eprintln!("{phase:>12} {s:8.2} s"));
            let (total, cpu) = (job.run.started.elapsed().as_secs_f64(), process::cpu_seconds());
            eprintln!("{:>12} {total:8.2} s, {cpu:.2} s of CPU", "total");
        }
        Ok(())
    }
}
