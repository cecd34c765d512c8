//! How long a job still takes: every phase that runs is planned, lines tell where a job stands, and
//! how right they are is measured by one slow test.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use nearfar::forecast::Part;
use nearfar::method::Method;
use nearfar::run::{Reporter, Run};

use crate::support::{Folder, program, quick, small_room};

/// What was planned, and what began.
#[derive(Clone, Debug, Default)]
struct Heard {
    planned: Arc<Mutex<Vec<String>>>,
    begun: Arc<Mutex<Vec<String>>>,
}

impl Reporter for Heard {
    fn begin(&self, phase: &str, _: u64) {
        self.begun.lock().unwrap().push(phase.into());
    }
    fn advance(&self, _: u64) {}
    fn end(&self) {}
    fn warn(&self, _: &str) {}
    fn plan(&self, parts: &[Part], _: Option<Instant>) {
        assert!(parts.iter().all(|p| p.seconds() > 0.0 && p.seconds().is_finite()), "{parts:?}");
        *self.planned.lock().unwrap() = parts.iter().map(|p| p.phase().into()).collect();
    }
}

/// Phases that any job may have, and that take no time to speak of.
const ANYWHERE: [&str; 3] = ["build", "checkpoint", "save"];

#[test]
fn every_phase_that_runs_is_planned_in_its_order() {
    let mut scene = small_room();
    (scene.camera.width, scene.camera.height) = (12, 8);
    for (method, converge) in
        Method::ALL.into_iter().map(|m| (m, false)).chain([(Method::Gather, true)])
    {
        let heard = Heard::default();
        let run = Run::new(1).unwrap();
        let run = run.with_reporter(Box::new(heard.clone()), Arc::default());
        let mut config = quick(8);
        config.point_based.elements = 500;
        config.local.elements = 500;
        (config.converge.enabled, config.converge.spp) = (converge, 8);
        nearfar::render(&scene, &config, method, &run).unwrap();
        let planned = heard.planned.lock().unwrap().clone();
        let begun = heard.begun.lock().unwrap().clone();
        let mut at = 0;
        for phase in begun.iter().filter(|p| !ANYWHERE.contains(&p.as_str())) {
            let here = planned[at..].iter().position(|p| p == phase).map(|i| at + i);
            // Pieces of the phase that runs are one phase.
            let piece = at > 0 && planned[at - 1] == *phase;
            assert!(here.is_some() || piece, "{}: {phase}: {planned:?} {begun:?}", method.name());
            at = here.map_or(at, |i| i + 1);
        }
    }
}

const SCENE: &str = "scenes/cornell-box/cornell-box.toml";

/// Seconds that have passed, percent, seconds left if they are known, phase.
type Line = (f64, f64, Option<f64>, String);

fn read(line: &str) -> Option<Line> {
    let words: Vec<&str> = line.strip_prefix("progress ")?.split_whitespace().collect();
    let [seconds, "s", percent, "%", left, "s", "left", phase @ ..] = &words[..] else {
        panic!("{line}");
    };
    Some((seconds.parse().unwrap(), percent.parse().unwrap(), left.parse().ok(), phase.concat()))
}

#[test]
fn lines_tell_how_far_a_job_is() {
    let folder = Folder::new("time-left-lines");
    let out = folder.at("o.exr");
    let job = ["reference", SCENE, "--size", "32x24", "--spp", "400", "-o", &out];
    let said = program(&[&job[..], &["-q", "--progress=0.001"]].concat());
    assert_eq!(said.status.code(), Some(0));
    let text = String::from_utf8_lossy(&said.stderr).into_owned();
    let lines: Vec<_> = text.lines().map(|line| read(line).unwrap()).collect();
    assert!(!lines.is_empty(), "{text}");
    assert!(lines.windows(2).all(|w| w[0].0 <= w[1].0 && w[0].1 <= w[1].1), "{text}");
    let silent = program(&job);
    assert!(silent.stderr.is_empty(), "{}", String::from_utf8_lossy(&silent.stderr));
    let refused = program(&[&job[..], &["--progress=soon"]].concat());
    assert_eq!(refused.status.code(), Some(2));
}

/// Runs a job: what it took, and what it told.
fn told(arguments: &[&str]) -> (f64, Vec<Line>) {
    let begin = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_nearfar"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments)
        .args(["-q", "--progress=0.1"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let lines: Vec<_> = BufReader::new(child.stderr.take().unwrap())
        .lines()
        .filter_map(|line| read(&line.unwrap()))
        .collect();
    assert!(child.wait().unwrap().success(), "{arguments:?}");
    (begin.elapsed().as_secs_f64(), lines)
}

/// Real jobs, and by which factor what they told was wrong, at worst, from a fifth of their time
/// on; seconds that nobody waits for (two, or 2 % of the job) do not count. Another machine's
/// load counts as error: it is not asserted.
#[test]
#[ignore = "slow: renders real scenes, and prints how right the time left was"]
fn how_right_is_the_time_left() {
    let folder = Folder::new("time-left");
    let (out, cloud, film) = (folder.at("o.exr"), folder.at("o.ply"), folder.at("film"));
    let only = std::env::var("NEARFAR_JOBS").unwrap_or_default();
    let atrium = "scenes/atrium/atrium.toml";
    let interior = "scenes/interior/interior.toml";
    let size = ["--size", "480x270"];
    let jobs: Vec<(&str, Vec<&str>)> = vec![
        ("gather cornell", vec!["render", SCENE, "--method", "gather", "-o", &out]),
        ("gather atrium", vec!["render", atrium, "--method", "gather", "-o", &out]),
        ("gather interior", vec!["render", interior, "--method", "gather", "-o", &out]),
        ("decomposition cornell", vec!["render", SCENE, "--method", "decomposition", "-o", &out]),
        ("decomposition atrium", vec!["render", atrium, "--method", "decomposition", "-o", &out]),
        (
            "irradiance-cache cornell",
            vec!["render", SCENE, "--method", "irradiance-cache", "-o", &out],
        ),
        (
            "irradiance-cache interior",
            vec!["render", interior, "--method", "irradiance-cache", "-o", &out],
        ),
        ("photon-map interior", vec!["render", interior, "--method", "photon-map", "-o", &out]),
        ("point-based cornell", vec!["render", SCENE, "--method", "point-based", "-o", &out]),
        (
            "local-correction cornell",
            vec!["render", SCENE, "--method", "local-correction", "-o", &out],
        ),
        ("direct interior", vec!["render", interior, "--method", "direct", "-o", &out]),
        ("reference spp", vec!["reference", interior, "--spp", "24", "-o", &out]),
        ("reference limit", vec!["reference", interior, "--time-limit", "20", "-o", &out]),
        ("reference error", vec!["reference", SCENE, "--target-error", "0.004", "-o", &out]),
        (
            "converge spp",
            vec!["render", SCENE, "--converge", "--spp", "24", "--method", "gather", "-o", &out],
        ),
        ("converge limit", vec!["render", SCENE, "--converge", "--time-limit", "25", "-o", &out]),
        ("fly", vec!["fly", SCENE, "--frames", "6", "--to-eye", "300,273,-780", "-o", &film]),
        ("cloud bake", vec!["cloud", "bake", SCENE, "-o", &cloud]),
    ];
    eprintln!("{:28} {:>8} {:>9} {:>7} {:>9}", "job", "seconds", "from 20 %", "at", "in phase");
    for (name, arguments) in jobs.iter().filter(|(name, _)| name.contains(&only)) {
        let (whole, lines) = told(&[&arguments[..], &size].concat());
        let slack = (0.02 * whole).max(2.0);
        let mut worst = (1.0, 0.0, String::new());
        for (now, _, left, phase) in lines.iter().filter(|l| l.0 >= 0.2 * whole) {
            let (truth, left) = ((whole - now).max(0.0), left.unwrap_or(f64::INFINITY));
            if (truth - left).abs() < slack {
                continue;
            }
            let factor = (left / truth.max(1e-3)).max(truth / left.max(1e-3));
            if factor > worst.0 {
                worst = (factor, now / whole, phase.clone());
            }
        }
        let (factor, at, phase) = worst;
        eprintln!("{name:28} {whole:8.1} {factor:9.2} {:5.0} % {phase:>9}", 100.0 * at);
    }
}
