//! Hostile inputs of our own making, given to the real program.
//!
//! Each comes out right, or is refused with exit code 2 in words that name a file of it and leaves
//! no output; none takes 1 GB or 10 s.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use nearfar::film::{Film, read_exr};

use crate::support::Folder;
use crate::support::absurd::{Case, Entry, Must, cases, plain};

/// Most that the program may hold, in kB.
const MEMORY: u64 = 1_000_000;
const PATIENCE: Duration = Duration::from_secs(10);

/// What came of a run: its exit code, none when a limit ended it, and what it said.
struct Outcome {
    code: Option<i32>,
    said: String,
}

/// Runs the program until it ends or a limit is reached.
fn limited(folder: &Folder, arguments: &[String]) -> Outcome {
    let said = folder.at("said");
    let mut child = Command::new(env!("CARGO_BIN_EXE_nearfar"))
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(std::fs::File::create(&said).unwrap())
        .spawn()
        .unwrap();
    let (begun, status) = (Instant::now(), format!("/proc/{}/status", child.id()));
    let held = || {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|l| l.strip_prefix("VmHWM:"));
        line.and_then(|l| l.trim().trim_end_matches(" kB").parse::<u64>().ok()).unwrap_or(0)
    };
    let mut limit = None;
    let ended = loop {
        if let Some(ended) = child.try_wait().unwrap() {
            break ended;
        }
        if held() > MEMORY || begun.elapsed() > PATIENCE {
            let what = if held() > MEMORY { "more than 1 GB" } else { "more than 10 s" };
            limit = Some(what);
            child.kill().unwrap();
        }
        std::thread::sleep(Duration::from_millis(3));
    };
    let said = String::from_utf8_lossy(&std::fs::read(&said).unwrap()).into_owned();
    Outcome { code: ended.code(), said: limit.map_or(said, str::to_owned) }
}

fn laid_out(folder: &Folder, case: &Case) {
    for (name, entry) in &case.files {
        let path = folder.0.join(name);
        match entry {
            Entry::Bytes(bytes) => std::fs::write(&path, bytes).unwrap(),
            Entry::Folder => std::fs::create_dir(&path).unwrap(),
            Entry::Pipe => {
                assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
            }
            Entry::Link(to) => std::os::unix::fs::symlink(to, &path).unwrap(),
        }
    }
}

/// What is wrong with what the program makes of a case; the picture, if there is one.
fn judged(
    case: &Case,
    (step, number): (usize, usize),
    plain: Option<&Film>,
) -> Result<Option<Film>, String> {
    let folder = Folder::new(&format!("absurd-{step}-{number}"));
    laid_out(&folder, case);
    let out = folder.at("out.exr");
    let mut arguments: Vec<String> =
        ["render", "-q", "--set", "path.spp=2", "-o", &out].map(str::to_owned).to_vec();
    let given = |name: &str| case.arguments.iter().any(|a| a == name);
    for (name, value) in [("--size", "16x12"), ("--method", "path")] {
        if !given(name) && !(name == "--size" && case.name.contains("width = ")) {
            arguments.extend([name.into(), value.into()]);
        }
    }
    let own = |a: &String| a.strip_prefix('@').map_or_else(|| a.clone(), |name| folder.at(name));
    arguments.extend(case.arguments.iter().map(own));
    arguments.push(folder.at(&case.scene));
    let Outcome { code, said } = limited(&folder, &arguments);
    let wrong = |what: &str| Err(format!("{}\n    {what}: {code:?} {}", case.name, said.trim()));
    match code {
        Some(2) => {
            let own = case.files.iter().any(|(name, _)| said.contains(name));
            let argument = case.arguments.iter().any(|a| said.contains(a.as_str()));
            if case.must == Must::Plain {
                return wrong("is right, and refused");
            }
            if !(own || argument || said.contains("\"name\"")) {
                return wrong("names no file");
            }
            if Path::new(&out).exists() {
                return wrong("refused, and leaves a picture");
            }
            Ok(None)
        }
        Some(0) if case.must == Must::BeRefused => wrong("is taken"),
        Some(0) => {
            let film = read_exr(Path::new(&out)).map_err(|e| format!("{}: {e}", case.name))?;
            let light = ["R", "G", "B"].map(|c| film.channels[c].clone()).concat();
            if light.iter().any(|x| !x.is_finite() || *x < 0.0) {
                return wrong("has light that is not finite");
            }
            if case.must == Must::Plain && plain.is_some_and(|p| p.channels != film.channels) {
                return wrong("is another picture than the plain scene's");
            }
            Ok(Some(film))
        }
        _ => wrong("failed"),
    }
}

/// Every so many cases, from the first.
fn every(step: usize) {
    let truth = judged(&plain(), (step, 0), None).unwrap().unwrap();
    let light = truth.channels["R"].iter().copied().fold(0.0, f32::max);
    assert!(light > 0.1, "the plain scene is dark");
    let all = cases();
    assert!(all.len() >= 300, "{} cases", all.len());
    let wrong: Vec<String> = (all.iter().enumerate().step_by(step))
        .filter_map(|(i, case)| judged(case, (step, i + 1), Some(&truth)).err())
        .collect();
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

/// A tenth of the list.
#[test]
fn a_share_of_hostile_inputs() {
    every(10);
}

#[test]
#[ignore = "slow: every hostile input with the real program"]
fn all_hostile_inputs() {
    every(1);
}
