//! What the operating system knows of this process: CPU time and memory.
//!
//! Reads `/proc/self`, so every figure is 0 where there is no such folder; callers show them and
//! never decide by them. Times come in ticks of 1/100 s.

/// User and system seconds of all threads of this process so far.
pub fn cpu_seconds() -> f64 {
    two_times(11)
}

/// User and system seconds of all child processes that have ended and were waited for.
pub fn children_cpu_seconds() -> f64 {
    two_times(13)
}

/// Largest resident set so far, in bytes.
pub fn peak_rss_bytes() -> u64 {
    of_status("VmHWM:")
}

/// Resident set, in bytes.
pub fn resident_bytes() -> u64 {
    of_status("VmRSS:")
}

fn of_status(name: &str) -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|l| l.strip_prefix(name)).unwrap_or_default();
    line.trim().trim_end_matches("kB").trim().parse::<u64>().unwrap_or(0) * 1024
}

/// Two neighbouring fields of `/proc/self/stat` in seconds, counted from 0 after the parenthesised
/// name of the program.
fn two_times(first: usize) -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = text.rsplit(')').next().unwrap_or_default();
    let fields = after.split_whitespace().skip(first).take(2);
    let ticks: u64 = fields.filter_map(|t| t.parse::<u64>().ok()).sum();
    ticks as f64 / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_process_uses_memory_and_time() {
        if !std::path::Path::new("/proc/self/stat").exists() {
            eprintln!("skipped: no /proc here");
            return;
        }
        assert!(peak_rss_bytes() > 100_000);
        // Two seconds of work are 200 ticks; a count that stands still fails.
        let (before, start) = (cpu_seconds(), std::time::Instant::now());
        let mut x = 1u64;
        while cpu_seconds() == before && start.elapsed().as_secs() < 30 {
            x = (0..100_000).fold(x, |x, _| crate::sampling::hash64(x));
        }
        assert!(cpu_seconds() > before && x != 0);
    }
}
