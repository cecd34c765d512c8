//! Hostile inputs by kind (`support::hostile`), each given to the program: a picture of light, the
//! right one where it is known, or exit code 2 with the reason and nothing left.
//!
//! The ordinary suite takes some of each kind. All of them, with their time and memory held against
//! 10 s and 1 GB, by one command:
//!
//! ```text
//! cargo test --release every_hostile_input -- --ignored --nocapture
//! ```
#![cfg(unix)]

use std::io::Read;
use std::process::Stdio;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::support::hostile::{Case, cases};

const LONGEST: Duration = Duration::from_secs(10);
const MOST_KIB: u64 = 1_000_000;

/// What a case took.
struct Taken {
    time: Duration,
    cpu: Duration,
    peak_kib: u64,
    fault: Option<String>,
}

/// Runs a case; with a limit it is ended when its time is over.
fn run(case: &Case, number: usize, limit: Option<Duration>) -> Taken {
    let folder = case.folder(&format!("hostile-{number}"));
    let before = folder.names();
    let (start, mut peak_kib, mut cpu) = (Instant::now(), 0, Duration::ZERO);
    let mut child =
        case.program(&folder).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    // Read beside, so that many words do not fill the pipe.
    let mut pipe = child.stderr.take().unwrap();
    let words = std::thread::spawn(move || {
        let mut said = Vec::new();
        pipe.read_to_end(&mut said).map(|_| String::from_utf8_lossy(&said).into_owned())
    });
    let code = loop {
        peak_kib = peak_kib.max(peak_of(child.id()));
        cpu = cpu.max(cpu_of(child.id()));
        if let Some(status) = child.try_wait().unwrap() {
            break Some(status.code());
        }
        if limit.is_some_and(|limit| start.elapsed() > limit) {
            child.kill().unwrap();
            child.wait().unwrap();
            break None;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let (time, said) = (start.elapsed(), words.join().unwrap().unwrap());
    let said: String = said.chars().take(600).collect();
    let left = || {
        let new: Vec<String> =
            folder.names().into_iter().filter(|name| !before.contains(name)).collect();
        (code == Some(Some(2)) && !new.is_empty())
            .then(|| format!("{}: was refused and left {new:?}", case.name))
    };
    let fault = match code {
        None => Some(format!("{}: has no end", case.name)),
        Some(code) => case.judge(&folder, code, &said).or_else(left),
    };
    Taken { time, cpu, peak_kib, fault }
}

/// The most that a process has held so far.
fn peak_of(process: u32) -> u64 {
    let text = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse().ok()).unwrap_or_default()
}

/// The time of all its threads.
fn cpu_of(process: u32) -> Duration {
    let text = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    // After the name, which may hold anything: user and system time are the 12th and 13th.
    let rest = text.rsplit(')').next().unwrap_or_default();
    let hundredths: u64 =
        rest.split_whitespace().skip(11).take(2).filter_map(|n| n.parse::<u64>().ok()).sum();
    Duration::from_millis(10 * hundredths)
}

#[test]
fn some_hostile_inputs_of_every_kind() {
    let all = cases();
    assert!(all.len() > 1500, "{}", all.len());
    let all: Vec<Case> = all.into_iter().step_by(9).collect();
    let faults: Vec<String> =
        all.par_iter().enumerate().filter_map(|(i, case)| run(case, i, None).fault).collect();
    assert!(faults.is_empty(), "{} of {}\n{}", faults.len(), all.len(), faults.join("\n"));
}

#[test]
#[ignore = "slow: minutes; its time and memory are measured"]
fn every_hostile_input() {
    let mut faults = Vec::new();
    let (mut longest, mut largest) = ((Duration::ZERO, String::new()), (0, String::new()));
    let all = cases();
    for (i, case) in all.iter().enumerate() {
        let taken = run(case, i, Some(LONGEST * 3));
        let name = &case.name;
        // A machine that is busy otherwise makes it longer than it is.
        if taken.time.min(taken.cpu) > LONGEST {
            faults.push(format!("{name}: took {:.1} s", taken.time.as_secs_f64()));
        }
        if taken.peak_kib > MOST_KIB {
            faults.push(format!("{name}: took {} MB", taken.peak_kib / 1000));
        }
        faults.extend(taken.fault);
        longest = longest.max((taken.time, name.clone()));
        largest = largest.max((taken.peak_kib, name.clone()));
    }
    eprintln!("{} inputs; longest {:?}; largest {:?} KiB", all.len(), longest, largest);
    assert!(faults.is_empty(), "{} of {}\n{}", faults.len(), all.len(), faults.join("\n"));
}
