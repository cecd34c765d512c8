//! Renders of this very program as child processes, measured, and kept so that a comparison can go
//! on where it stopped.
//!
//! CPU seconds are user and system seconds of the whole child (loading, building and ending
//! included), as the system books them when the child has been waited for. A child is told the
//! value of every setting, as this process resolved them: what the scene file, `--set`, `--quality`
//! and the configuration itself give, and all that follows from these. A configuration's image and
//! figures lie in the work folder under a name that holds a fingerprint of everything that decides
//! them: the scene as loaded, method and settings, backend, threads, and the program's own file.
//! Another fingerprint is another file, so nothing stale is ever read; a run that was stopped
//! leaves nothing behind.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use toml::Table;

use super::options::{Job, SceneOptions};
use crate::atomic_file;
use crate::config::{self, RenderConfig};
use crate::error::{Error, Result};
use crate::input_file;
use crate::method::Method;
use crate::process::children_cpu_seconds;
use crate::scene::Fingerprint;

/// How often a running child is looked at.
const PATIENCE: Duration = Duration::from_millis(5);
/// The system counts in ticks of 0.01 s: a child that took less than one took about half of it.
const HALF_TICK: f64 = 0.005;

/// One render: a method and its settings.
#[derive(Clone, Debug)]
pub(super) struct Configuration {
    /// What to call it in file names and messages.
    pub(super) name: String,
    /// What renders it.
    method: Method,
    /// Every setting.
    settings: Table,
}

impl Configuration {
    /// A method with what `given` says of its settings, and `changes` to that (dotted keys).
    ///
    /// # Errors
    /// [`Error::Setting`] for keys and values that are none.
    pub(super) fn new(
        name: String,
        method: Method,
        given: &Table,
        changes: &[(String, String)],
    ) -> Result<Self> {
        let mut settings = given.clone();
        for (key, value) in changes {
            config::set(&mut settings, key, config::parse_value(value))?;
        }
        let settings = RenderConfig::from_table(settings)?.to_table()?;
        Ok(Self { name, method, settings })
    }

    /// Every setting.
    pub(super) fn settings(&self) -> &Table {
        &self.settings
    }

    /// `--method …` and a `--set` for every setting.
    fn arguments(&self) -> Vec<String> {
        let mut arguments = vec!["--method".to_owned(), self.method.name().to_owned()];
        assign("settings", &self.settings, &mut arguments);
        arguments
    }
}

/// `--set` for everything in a section.
fn assign(section: &str, settings: &Table, arguments: &mut Vec<String>) {
    for (key, value) in settings {
        match value {
            toml::Value::Table(inner) => assign(&format!("{section}.{key}"), inner, arguments),
            value => arguments.extend(["--set".to_owned(), format!("{section}.{key}={value}")]),
        }
    }
}

/// What is known of a configuration.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Measured {
    /// The command line, for readers.
    arguments: Vec<String>,
    /// CPU and wall-clock seconds of every run.
    pub(super) runs: Vec<[f64; 2]>,
    /// Statistics of the last run.
    pub(super) stats: Value,
}

impl Measured {
    /// Median CPU and wall-clock seconds; of an even number of runs the mean of the middle two.
    pub(super) fn seconds(&self) -> [f64; 2] {
        [0, 1].map(|i| median(self.runs.iter().map(|r| r[i]).collect()))
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[n / 2],
        n => 0.5 * (values[n / 2 - 1] + values[n / 2]),
    }
}

/// The work folder, and what all its renders have in common.
#[derive(Debug)]
pub(super) struct Workshop {
    folder: PathBuf,
    program: PathBuf,
    common: Vec<String>,
    fingerprint: u64,
}

impl Workshop {
    /// Makes the folder.
    ///
    /// # Errors
    /// [`Error::Io`] when the system refuses.
    pub(super) fn new(folder: &Path, options: &SceneOptions, job: &Job) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(io(folder))?;
        let program = std::env::current_exe().map_err(io(Path::new("the running program")))?;
        let file = std::fs::metadata(&program).map_err(io(&program))?;
        let mut hash = DefaultHasher::new();
        (file.len(), file.modified().ok()).hash(&mut hash);
        (Fingerprint::new(&job.scene), format!("{:?}", job.scene.camera)).hash(&mut hash);
        job.run.threads().hash(&mut hash);
        let mut common = vec![options.scene.display().to_string()];
        let mut give = |name: &str, value: String| common.extend([name.to_owned(), value]);
        give("--threads", job.run.threads().to_string());
        if let Some((width, height)) = options.size {
            give("--size", format!("{width}x{height}"));
        }
        options.assignments.iter().for_each(|a| give("--set", a.clone()));
        Ok(Self { folder: folder.into(), program, common, fingerprint: hash.finish() })
    }

    fn file(&self, configuration: &Configuration, extension: &str) -> PathBuf {
        let mut hash = DefaultHasher::new();
        (self.fingerprint, configuration.arguments()).hash(&mut hash);
        let plain: String = configuration
            .name
            .replace('%', "pct")
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() || ".-_".contains(c) { c } else { '_' })
            .collect();
        self.folder.join(format!("{plain}-{:08x}.{extension}", hash.finish() as u32))
    }

    /// The image of a configuration.
    pub(super) fn image(&self, configuration: &Configuration) -> PathBuf {
        self.file(configuration, "exr")
    }

    /// What is known of a configuration; nothing when it was not rendered yet.
    pub(super) fn known(&self, configuration: &Configuration) -> Option<Measured> {
        let text = input_file::read_text(&self.file(configuration, "json"))
            .ok()
            .filter(|_| self.image(configuration).is_file())?;
        serde_json::from_str(&text).ok()
    }

    /// Renders a configuration once more and adds the run to what is known.
    ///
    /// # Errors
    /// [`Error::Interrupted`]; whatever the child says is wrong.
    pub(super) fn render(
        &self,
        configuration: &Configuration,
        cancel: &AtomicBool,
    ) -> Result<Measured> {
        let [image, stats] = ["part.exr", "part.json"].map(|e| self.file(configuration, e));
        let mut arguments = vec!["render".to_owned()];
        arguments.extend(self.common.iter().cloned().chain(configuration.arguments()));
        arguments.extend(["-q", "--aov", "none", "-o"].map(String::from));
        arguments.extend([
            image.display().to_string(),
            "--stats".into(),
            stats.display().to_string(),
        ]);
        let run =
            spawn(&self.program, &arguments, &configuration.name, cancel).inspect_err(|_| {
                let _ = (std::fs::remove_file(&image), std::fs::remove_file(&stats));
            })?;
        let text = std::fs::read_to_string(&stats).map_err(io(&stats))?;
        let parsed = serde_json::from_str(&text)
            .map_err(|e| Error::Render(format!("{}: {e}", stats.display())))?;
        let mut known = self.known(configuration).unwrap_or_default();
        known.arguments = arguments;
        known.runs.push(run);
        known.stats = parsed;
        let text = serde_json::to_string_pretty(&known)
            .map_err(|e| Error::Render(format!("figures: {e}")))?;
        let (to, figures) = (self.image(configuration), self.file(configuration, "json"));
        // The image first: figures without an image count as nothing known.
        std::fs::rename(&image, &to).map_err(io(&to))?;
        atomic_file::write_bytes(&figures, text + "\n")?;
        std::fs::remove_file(&stats).map_err(io(&stats))?;
        Ok(known)
    }
}

fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Error {
    move |source| Error::Io { path: path.into(), source }
}

/// Runs a child to its end: CPU and wall-clock seconds.
fn spawn(
    program: &Path,
    arguments: &[String],
    name: &str,
    cancel: &AtomicBool,
) -> Result<[f64; 2]> {
    let fail = |source| Error::Io { path: program.into(), source };
    let (before, start) = (children_cpu_seconds(), Instant::now());
    let mut child = Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(fail)?;
    let status = loop {
        if let Some(status) = child.try_wait().map_err(fail)? {
            break status;
        }
        if cancel.load(Ordering::Relaxed) {
            let _ = child.kill();
            let _ = child.wait();
            return Err(Error::Interrupted);
        }
        std::thread::sleep(PATIENCE);
    };
    let seconds = [(children_cpu_seconds() - before).max(HALF_TICK), start.elapsed().as_secs_f64()];
    if status.success() {
        return Ok(seconds);
    }
    if cancel.load(Ordering::Relaxed) || status.code() == Some(130) {
        return Err(Error::Interrupted);
    }
    let mut said = String::new();
    let _ = child.stderr.take().map(|mut s| s.read_to_string(&mut said));
    let reason = said
        .lines()
        .find_map(|l| l.strip_prefix("error: "))
        .unwrap_or_else(|| said.lines().next().unwrap_or("no word"));
    let message = format!("{name}: {reason} ({status})");
    Err(if status.code() == Some(2) { Error::Usage(message) } else { Error::Render(message) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_child_is_told_every_setting() {
        let given: Table = "denoise = \"oidn\"\n[decompose]\nrays = 100".parse().unwrap();
        let changes = [("decompose.alpha".to_owned(), "4%".to_owned())];
        let made = Configuration::new("a".into(), Method::Gather, &given, &changes).unwrap();
        let arguments = made.arguments();
        assert_eq!(arguments[..2], ["--method", "gather"]);
        // The last one follows from denoising.
        for told in [
            "settings.decompose.rays=100",
            "settings.decompose.alpha=\"4%\"",
            "settings.seed=0",
            "settings.denoise=\"oidn\"",
            "settings.decompose.near_filter=0",
        ] {
            assert!(arguments.iter().any(|a| a == told), "{told} not in {arguments:?}");
        }
        let mut back = Table::new();
        for pair in arguments[2..].chunks(2) {
            let (key, value) = config::parse_assignment(&pair[1]).unwrap();
            let key = key.strip_prefix("settings.").unwrap();
            config::set(&mut back, key, config::parse_value(&value)).unwrap();
        }
        assert_eq!(RenderConfig::from_table(back).unwrap().to_table().unwrap(), made.settings);
    }

    #[test]
    fn the_median_of_runs_counts() {
        let measured =
            |runs: &[[f64; 2]]| Measured { runs: runs.to_vec(), ..Measured::default() }.seconds();
        assert_eq!(measured(&[[3.0, 1.0], [1.0, 5.0], [2.0, 0.0]]), [2.0, 1.0]);
        assert_eq!(measured(&[[3.0, 1.0], [1.0, 5.0]]), [2.0, 3.0]);
        assert!(measured(&[])[0].is_nan());
    }
}
