//! The statistics of a run as JSON, and what the system knows of the process.

use std::path::Path;

use serde_json::{Map, Value, json};

use crate::error::{Error, Result};
use crate::run::{RayKind, Run};

/// User and system seconds of the whole process so far; 0 where the system does not tell.
pub(super) fn cpu_seconds() -> f64 {
    two_times(11)
}

/// User and system seconds of all child processes that have ended and were waited for; 0 where the
/// system does not tell.
pub(super) fn children_cpu_seconds() -> f64 {
    two_times(13)
}

/// Two neighbouring fields of /proc/self/stat, counted from 0 after the parenthesised name; in
/// ticks of 1/100 s on every Linux.
fn two_times(first: usize) -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = text.rsplit(')').next().unwrap_or_default();
    let ticks: u64 =
        after.split_whitespace().skip(first).take(2).filter_map(|t| t.parse::<u64>().ok()).sum();
    ticks as f64 / 100.0
}

/// Largest resident set so far; 0 where the system does not tell.
pub(super) fn peak_rss_bytes() -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|l| l.strip_prefix("VmHWM:")).unwrap_or_default();
    line.trim().trim_end_matches("kB").trim().parse::<u64>().unwrap_or(0) * 1024
}

/// Rays and seconds of the run, and the process's own figures, added to what the method says.
pub(super) fn collect(
    run: &Run,
    total_seconds: f64,
    mut of_method: Map<String, Value>,
) -> Map<String, Value> {
    let rays: Map<String, Value> = [
        ("primary", RayKind::Primary),
        ("shadow", RayKind::Shadow),
        ("photon", RayKind::Photon),
        ("sample", RayKind::Sample),
        ("visibility", RayKind::Visibility),
    ]
    .into_iter()
    .map(|(name, kind)| (name.to_owned(), run.rays.get(kind).into()))
    .collect();
    let mut seconds: Map<String, Value> =
        run.seconds().into_iter().map(|(name, s)| (name, s.into())).collect();
    seconds.insert("total".into(), total_seconds.into());
    of_method.insert("threads".into(), run.threads().into());
    of_method.insert("rays".into(), rays.into());
    of_method.insert("seconds".into(), seconds.into());
    of_method.insert("cpu_seconds".into(), json!(cpu_seconds()));
    of_method.insert("peak_rss_bytes".into(), peak_rss_bytes().into());
    of_method.insert("warnings".into(), json!(run.warnings()));
    of_method
}

/// Writes the statistics as indented JSON.
///
/// # Errors
/// [`Error::Io`] when the system refuses.
pub(super) fn write(stats: &Map<String, Value>, path: &Path) -> Result<()> {
    let text = serde_json::to_string_pretty(stats)
        .map_err(|e| Error::Render(format!("statistics: {e}")))?;
    crate::atomic_file::write_bytes(path, text + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_process_uses_memory_and_time() {
        if !Path::new("/proc/self/stat").exists() {
            eprintln!("skipped: no /proc here");
            return;
        }
        assert!(peak_rss_bytes() > 100_000);
        let mut x = 1u64;
        while cpu_seconds() == 0.0 {
            x = crate::sampling::hash64(x);
        }
        assert_ne!(x, 0);
    }
}
