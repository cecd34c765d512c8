//! One picture of the gallery, rendered by a child process.
//!
//! The child is a group of its own: the terminal's Ctrl-C reaches this process alone, which asks
//! the child to stop once and waits until it has kept what is done. A second signal, which would
//! end the child at once, never comes.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use serde_json::Value;

use super::key::{Key, with};
use super::plan::{Picture, Plan, TRUTH};
use crate::atomic_file;
use crate::error::{Error, Result};
use crate::input_file;

/// How often a running child is looked at.
const PATIENCE: Duration = Duration::from_millis(20);

/// Renders a picture to `at` (a path without extension) with its statistics and key.
///
/// # Errors
/// [`Error::Interrupted`]; [`Error::Render`] with what the child said; [`Error::Io`].
pub(super) fn render(
    plan: &Plan,
    picture: &Picture,
    at: &Path,
    key: &Key,
    again: bool,
    cancel: &AtomicBool,
) -> Result<()> {
    let (image, stats, unfinished) = (with(at, "exr"), with(at, "json"), with(at, "partial.json"));
    if let Some(folder) = at.parent() {
        std::fs::create_dir_all(folder)
            .map_err(|source| Error::Io { path: folder.into(), source })?;
    }
    let (width, height) = plan.size_of(picture.scene);
    let program = std::env::current_exe()
        .map_err(|source| Error::Io { path: "the running program".into(), source })?;
    let mut command = Command::new(&program);
    command.arg(picture.command).arg(picture.scene.file()).args(&picture.options);
    command.args(["--size", &format!("{width}x{height}"), "-q", "-o"]).arg(&image);
    command.arg("--stats").arg(&stats);
    let goes_on = picture.name == TRUTH && !again && key.is_begun(at);
    // Put aside: what is there when the child has ended is its own.
    let earlier = input_file::read_text(&unfinished).ok().filter(|_| goes_on);
    drop(std::fs::remove_file(&unfinished));
    if goes_on {
        command.arg("--resume");
    } else {
        // What another key began is not to be gone on from.
        drop(std::fs::remove_file(with(at, "partial.exr")));
    }
    key.begin(at)?;
    let io = |source| Error::Io { path: program.clone(), source };
    let mut child =
        own_group(&mut command).stdin(Stdio::null()).stdout(Stdio::null()).spawn().map_err(io)?;
    let mut asked = false;
    let status = loop {
        if let Some(status) = child.try_wait().map_err(io)? {
            break status;
        }
        if cancel.load(Ordering::Relaxed) && !asked {
            asked = true;
            stop(&mut child);
        }
        std::thread::sleep(PATIENCE);
    };
    if let Some(earlier) = earlier {
        let told = if status.success() { &stats } else { &unfinished };
        if told.is_file() {
            Seconds::of(&earlier).add_to(told)?;
        } else {
            atomic_file::write_bytes(&unfinished, earlier)?;
        }
    }
    if status.success() {
        key.end(at)
    } else if asked || status.code() == Some(130) {
        Err(Error::Interrupted)
    } else {
        Err(Error::Render(format!("failed ({status})")))
    }
}

#[cfg(unix)]
fn own_group(command: &mut Command) -> &mut Command {
    std::os::unix::process::CommandExt::process_group(command, 0)
}
#[cfg(not(unix))]
fn own_group(command: &mut Command) -> &mut Command {
    command
}

/// Asks a child to stop; ends it where it cannot be asked.
fn stop(child: &mut Child) {
    let asked = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    if !asked.is_ok_and(|s| s.success()) {
        drop(child.kill());
    }
}

/// What an earlier part of a picture took.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seconds {
    cpu: f64,
    wall: f64,
}

impl Seconds {
    /// From statistics; zero where they do not say.
    fn of(stats: &str) -> Self {
        let stats: Value = serde_json::from_str(stats).unwrap_or_default();
        let number = |v: &Value| v.as_f64().unwrap_or(0.0);
        Self { cpu: number(&stats["cpu_seconds"]), wall: number(&stats["seconds"]["total"]) }
    }

    /// Adds them to the statistics of the later part.
    fn add_to(self, stats: &Path) -> Result<()> {
        let text = std::fs::read_to_string(stats)
            .map_err(|source| Error::Io { path: stats.into(), source })?;
        let json = |e: serde_json::Error| Error::Render(format!("{}: {e}", stats.display()));
        let now = Self::of(&text);
        let mut value: Value = serde_json::from_str(&text).map_err(json)?;
        value["cpu_seconds"] = (now.cpu + self.cpu).into();
        value["seconds"]["total"] = (now.wall + self.wall).into();
        let text = serde_json::to_string_pretty(&value).map_err(json)?;
        atomic_file::write_bytes(stats, text + "\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_of_both_parts_are_told() {
        let path = std::env::temp_dir().join(format!("nearfar-sum-{}.json", std::process::id()));
        let text = r#"{ "cpu_seconds": 1.5, "seconds": { "total": 2.0, "render": 1.0 } }"#;
        std::fs::write(&path, text).unwrap();
        let first = Seconds::of(text);
        assert_eq!(first, Seconds { cpu: 1.5, wall: 2.0 });
        first.add_to(&path).unwrap();
        let sum = std::fs::read_to_string(&path).unwrap();
        assert_eq!(Seconds::of(&sum), Seconds { cpu: 3.0, wall: 4.0 });
        assert!(sum.contains("\"render\": 1.0"), "{sum}");
        std::fs::remove_file(&path).unwrap();
        assert_eq!(Seconds::of("nothing"), Seconds { cpu: 0.0, wall: 0.0 });
    }
}
