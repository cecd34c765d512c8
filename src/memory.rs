//! How much memory there is, and whether what is about to be made fits into it.
//!
//! Whoever makes something large asks first with [`claim`] (or [`fits`]), from a count that is
//! known: pixels, triangles, cells, elements, bytes of a file. What would not fit is an error that
//! says what it needs; nothing is taken before. Estimates are those of measured peaks, rounded up;
//! they do not add up over claims of things that are there at once, beyond what the process already
//! holds when it asks.
//!
//! The limit is one for the process: what [`set_limit`] says, else the machine's memory or that of
//! the control group, whichever is less. Where neither is known, there is no limit.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};
use crate::process::resident_bytes;

/// 0: as the machine has it.
static LIMIT: AtomicU64 = AtomicU64::new(0);

/// Bytes of a pixel in a picture with all layers, and of what is kept of it while it is made.
const PIXEL: f64 = 350.0;
/// Bytes of a triangle with its share of the ray structure and of what is computed from it.
const TRIANGLE: f64 = 250.0;
/// Bytes of a render beside them: light of places, clusters.
const REST: f64 = 150e6;

/// Sets the most that the process should hold, in bytes; 0 is the machine's own.
pub fn set_limit(bytes: u64) {
    LIMIT.store(bytes, Ordering::Relaxed);
}

/// The most that the process should hold, in bytes.
pub fn limit() -> u64 {
    match LIMIT.load(Ordering::Relaxed) {
        0 => machine(),
        bytes => bytes,
    }
}

fn machine() -> u64 {
    let total = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text.lines().find_map(|l| l.strip_prefix("MemTotal:"))?;
        line.trim().trim_end_matches("kB").trim().parse::<u64>().ok()
    });
    let group = std::fs::read_to_string("/sys/fs/cgroup/memory.max")
        .ok()
        .and_then(|text| text.trim().parse::<u64>().ok());
    total.map_or(u64::MAX, |kib| kib * 1024).min(group.unwrap_or(u64::MAX))
}

/// Whether so many bytes more stay below the limit.
pub fn fits(bytes: f64) -> bool {
    bytes + resident_bytes() as f64 <= limit() as f64
}

/// Asks for so many bytes.
///
/// # Errors
/// [`Error::Usage`] when they do not fit: "`what` needs about …; `fix`, or raise the limit".
pub fn claim(bytes: f64, what: &str, fix: &str) -> Result<()> {
    if fits(bytes) {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "{what} needs about {}, and {} of {} are taken; {fix}, or raise the limit",
        size(bytes),
        size(resident_bytes() as f64),
        size(limit() as f64)
    )))
}

/// The peak of a render of so many pixels and triangles, in bytes.
pub fn of_render(pixels: u64, triangles: u64) -> f64 {
    of_picture(pixels) + of_triangles(triangles) + REST
}

/// What a picture of so many pixels takes while it is made, in bytes.
pub fn of_picture(pixels: u64) -> f64 {
    pixels as f64 * PIXEL
}

/// What so many triangles take, in bytes.
pub fn of_triangles(triangles: u64) -> f64 {
    triangles as f64 * TRIANGLE
}

/// A number of bytes as people write it.
pub fn size(bytes: f64) -> String {
    match bytes {
        b if b >= 1e9 => format!("{:.1} GB", b * 1e-9),
        b => format!("{:.0} MB", b * 1e-6),
    }
}

/// A size as people write it: `8G`, `500M`, `1.5GB`; bytes without a unit.
///
/// # Errors
/// What was expected.
pub fn parse_size(text: &str) -> std::result::Result<u64, String> {
    let upper = text.trim().to_ascii_uppercase();
    let bare = upper.trim_end_matches("IB").trim_end_matches('B');
    let (digits, unit) = match bare.strip_suffix(['K', 'M', 'G', 'T']) {
        Some(digits) => (digits, bare[digits.len()..].to_owned()),
        None => (bare, String::new()),
    };
    let factor = match unit.as_str() {
        "K" => 1e3,
        "M" => 1e6,
        "G" => 1e9,
        "T" => 1e12,
        _ => 1.0,
    };
    match digits.trim().parse::<f64>().map(|n| n * factor) {
        Ok(bytes) if (1e6..1e18).contains(&bytes) => Ok(bytes as u64),
        _ => Err("write a size of at least 1M, such as 8G or 500M".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_written() {
        for (text, bytes) in [("8G", 8e9), ("1.5gb", 1.5e9), ("500M", 5e8), ("2000000", 2e6)] {
            assert_eq!(parse_size(text), Ok(bytes as u64), "{text}");
        }
        for wrong in ["", "G", "8Q", "-1G", "10", "inf", "1e30"] {
            assert!(parse_size(wrong).is_err(), "{wrong}");
        }
        assert_eq!((size(2.34e9), size(5e6)), ("2.3 GB".into(), "5 MB".into()));
    }

    #[test]
    fn what_no_machine_has_is_refused() {
        assert!(claim(1e3, "little", "").is_ok());
        let refused = claim(1e18, "a picture of all pixels", "give fewer").unwrap_err();
        assert!(refused.to_string().contains("needs about 1000000000.0 GB"), "{refused}");
        assert_eq!(refused.exit_code(), 2);
    }
}
