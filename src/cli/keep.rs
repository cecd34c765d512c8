//! Jobs that can be stopped: what is done so far, beside the finished file.
//!
//! While `NAME.exr` is made, `NAME.partial.exr` holds what is done so far: of path tracing and
//! converging pictures a picture with its running sums, of others the blocks that are made. It is
//! written now and then, and when Ctrl-C stops the job (a picture then with `NAME.partial.json` and
//! `NAME.partial.png` where statistics and a PNG were asked for). It goes when the finished file is
//! there. An earlier `NAME.exr` stays until then. Of a cloud `NAME.ply` it is `NAME.partial.exr`
//! too.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;

use super::options::Job;
use super::picture::OutputOptions;
use super::{parse_seconds, write_json};
use crate::atomic_file;
use crate::error::{Error, Result};
use crate::film::{self, Precision, SUMS_OF};
use crate::render::{Checkpoint, Kept, Rendered};

/// Seconds between two partial pictures.
const EVERY: f64 = 60.0;

/// Options of jobs that can be gone on with.
#[derive(Debug, Args)]
pub(super) struct KeepOptions {
    /// Keep what is done so far, as NAME.partial.exr beside the output, whenever this time has
    /// passed: seconds, or 90s, 1.5m, 2h. Default 60.
    #[arg(long, value_name = "TIME", value_parser = parse_seconds)]
    checkpoint: Option<f64>,
    /// Go on from a partial file, or from a finished picture with its running sums, as if the job
    /// had never stopped. Without a name: from NAME.partial.exr or NAME.exr, or from the beginning
    /// where neither can be gone on from.
    #[arg(long, value_name = "FILE.exr", num_args = 0..=1)]
    resume: Option<Option<PathBuf>>,
}

/// `NAME.EXT` → `NAME.partial.EXT`.
pub(super) fn partial(path: &Path) -> PathBuf {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    path.with_extension(format!("partial.{extension}"))
}

/// Where what is made so far of a file is kept.
fn partial_job(path: &Path) -> PathBuf {
    path.with_extension("partial.exr")
}

fn kept_in(file: &Path) -> Error {
    Error::Stopped(format!(
        "what is done is in {}; the same command with --resume goes on from there",
        file.display()
    ))
}

/// Removes what was kept of a file that is finished.
pub(super) fn forget_job(output: &Path) {
    drop(std::fs::remove_file(partial_job(output)));
}

/// Removes what was kept of a picture that is finished.
pub(super) fn forget(output: &OutputOptions) {
    let picture = partial(&output.output);
    drop(std::fs::remove_file(picture.with_extension("png")));
    drop(std::fs::remove_file(picture));
    if let Some(stats) = &output.stats {
        drop(std::fs::remove_file(partial(stats)));
    }
}

impl KeepOptions {
    /// Where the render goes on from, and where it keeps what it has.
    ///
    /// # Errors
    /// [`Error::Input`] when a partial picture cannot be written; [`Error::Image`] for a file to go
    /// on from that is missing.
    pub(super) fn begin(&self, output: &Path, quiet: bool) -> Result<Kept> {
        let file = partial_job(output);
        atomic_file::check(&file)?;
        let sums = |path: &Path| film::read_header(path).map(|h| h.contains_key(SUMS_OF));
        let resume = match &self.resume {
            Some(Some(named)) => {
                film::read_header(named)?;
                Some(named.clone())
            }
            Some(None) if file.exists() => Some(file.clone()),
            Some(None) if output.exists() && file == partial(output) => {
                sums(output)?.then(|| output.to_path_buf())
            }
            Some(None) => None,
            None => {
                if file.exists() && !quiet {
                    let shown = file.display();
                    eprintln!(
                        "warning: {shown} of an earlier run will be replaced; --resume goes \
                               on from it"
                    );
                }
                None
            }
        };
        let every =
            Duration::try_from_secs_f64(self.checkpoint.unwrap_or(EVERY)).unwrap_or(Duration::MAX);
        let checkpoint = Some(Checkpoint { file, every });
        Ok(Kept { resume, checkpoint, ..Kept::default() })
    }

    /// What is said of a job that an error ended; one that was interrupted has kept what it made.
    pub(super) fn told(&self, error: Error, output: &Path) -> Error {
        let file = partial_job(output);
        match error {
            Error::Interrupted if file.exists() => kept_in(&file),
            other => other,
        }
    }

    /// Keeps a picture that was interrupted, and says so.
    pub(super) fn stopped(&self, output: &OutputOptions, job: &Job, rendered: Rendered) -> Error {
        let Rendered { mut film, mut statistics, .. } = rendered;
        if !film.header.contains_key(SUMS_OF) {
            return Error::Interrupted;
        }
        film.header.insert("nearfar.scene".into(), job.path.display().to_string());
        let file = partial(&output.output);
        let kept = || {
            atomic_file::rescued(&file, |path| film::write_exr(&film, path, Precision::Full))?;
            if output.image.png {
                let png = file.with_extension("png");
                film::write_png(&film, &png, output.image.exposure)?;
            }
            Ok(())
        };
        let kept: Result<()> = kept();
        statistics.refresh(&job.run);
        let told = output.stats.as_deref().map_or(Ok(()), |s| write_json(&partial(s), &statistics));
        match kept.and(told) {
            Ok(()) => kept_in(&file),
            Err(error) => error,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partial_files_stand_beside_finished_ones() {
        assert_eq!(partial(Path::new("a/b.exr")), Path::new("a/b.partial.exr"));
        assert_eq!(partial_job(Path::new("a/b.ply")), Path::new("a/b.partial.exr"));
        assert_eq!(partial_job(Path::new("a/b-0.5.exr")), Path::new("a/b-0.5.partial.exr"));
        assert_eq!(partial(Path::new("alpha-0.5.exr")), Path::new("alpha-0.5.partial.exr"));
    }
}
