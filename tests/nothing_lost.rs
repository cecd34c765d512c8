//! What is done is not lost: killed and stopped renders go on to the same bits, old files stay
//! until new ones are whole, and what cannot be kept is said.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use nearfar::film::{read_exr, read_header};

const SCENE: &str = "scenes/cornell-box/cornell-box.toml";

/// A folder that is removed when the test is over.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        Self(crate::support::temporary(&format!("lost-{name}")))
    }
    fn at(&self, name: &str) -> String {
        self.0.join(name).display().to_string()
    }
    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn nearfar(arguments: &[&str]) -> Output {
    crate::support::program(arguments)
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn start(arguments: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_nearfar"));
    command.args(arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

#[cfg(unix)]
fn interrupt(child: &Child) {
    let sent = Command::new("bash").args(["-c", &format!("kill -INT {}", child.id())]).status();
    assert!(sent.is_ok_and(|s| s.success()), "the signal was not sent");
}

/// Waits until something is so, while the child runs.
fn until(child: &mut Child, what: impl Fn() -> bool) {
    let begin = Instant::now();
    while !what() {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        assert!(begin.elapsed().as_secs() < 300, "it does nothing");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Everything in a picture but the time it took.
fn content(path: &str) -> (BTreeMap<String, Vec<u32>>, BTreeMap<String, String>) {
    let mut film = read_exr(path.as_ref()).unwrap();
    film.header.retain(|key, _| key != "nearfar.seconds" && key != "nearfar.checksum");
    let bits = |values: Vec<f32>| values.into_iter().map(f32::to_bits).collect();
    (film.channels.into_iter().map(|(name, v)| (name, bits(v))).collect(), film.header)
}

/// Commands that make progressive pictures, for about a second each.
const PROGRESSIVE: [&[&str]; 3] = [
    &["reference", SCENE, "--size", "40x30", "--spp", "500", "--target-error", "1e-9"],
    &["render", SCENE, "--size", "40x30", "--method", "path", "--spp", "500", "--aov", "N"],
    &[
        "render",
        SCENE,
        "--size",
        "40x30",
        "--converge",
        "--spp",
        "300",
        "--target-error",
        "1e-9",
        "--method",
        "direct",
    ],
];

/// Kills a command after each time, goes on, and compares with the command left alone.
fn killed(folder: &Folder, command: &[&str], moments: impl Iterator<Item = Option<Duration>>) {
    let (whole, out) = (folder.at("whole.exr"), folder.at("o.exr"));
    let common = ["-q", "--checkpoint", "0.05", "-o"];
    let done = nearfar(&[command, &common, &[&whole]].concat());
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    let expected = content(&whole);
    let going = [command, &common, &[&out, "--resume"]].concat();
    let mut kills = 0;
    for moment in moments {
        let mut child = start(&going);
        match moment {
            Some(moment) => std::thread::sleep(moment),
            None => {
                until(&mut child, || std::path::Path::new(&folder.at("o.partial.exr")).exists())
            }
        }
        kills += usize::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        if std::path::Path::new(&out).exists() {
            std::fs::remove_file(&out).unwrap();
        }
    }
    assert!(kills > 0, "nothing was killed");
    let done = nearfar(&going);
    assert_eq!(done.status.code(), Some(0), "{command:?}: {}", said(&done));
    assert!(content(&out) == expected, "{command:?} after {kills} kills");
    let left = folder.names();
    assert!(!left.iter().any(|name| name.contains("partial")), "{left:?}");
}

#[test]
fn what_is_killed_goes_on_to_the_same_bits() {
    for (i, command) in PROGRESSIVE.iter().enumerate() {
        killed(&Folder::new(&format!("killed-{i}")), command, [None, None].into_iter());
    }
}

#[test]
#[ignore = "slow: minutes of renders that are killed"]
fn what_is_killed_at_random_moments_goes_on_to_the_same_bits() {
    let mut random = 12_345u64;
    for round in 0..17 {
        for (i, command) in PROGRESSIVE.iter().enumerate() {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let moment = Duration::from_millis(random >> 33 & 1023);
            let folder = Folder::new(&format!("random-{round}-{i}"));
            killed(&folder, command, [Some(moment)].into_iter());
        }
    }
}

#[test]
#[cfg(unix)]
fn ctrl_c_leaves_the_finished_picture_and_says_what_is_kept() {
    for (i, command) in PROGRESSIVE.iter().enumerate() {
        let folder = Folder::new(&format!("stopped-{i}"));
        let (whole, out, stats) = (folder.at("whole.exr"), folder.at("o.exr"), folder.at("o.json"));
        assert_eq!(nearfar(&[command, &["-o", &whole][..]].concat()).status.code(), Some(0));
        std::fs::copy(&whole, &out).unwrap();
        std::fs::write(&stats, "old").unwrap();
        let old = std::fs::read(&out).unwrap();
        let files = ["-o", &out, "--stats", &stats, "--checkpoint", "0.05"];
        let going = [command, &files[..]].concat();
        let partial = folder.at("o.partial.exr");
        let mut child = start(&going);
        until(&mut child, || std::path::Path::new(&partial).exists());
        interrupt(&child);
        let stopped = child.wait_with_output().unwrap();
        let text = said(&stopped);
        assert_eq!(stopped.status.code(), Some(130), "{text}");
        assert!(text.contains(&format!("what is done is in {partial}")), "{text}");
        assert_eq!(std::fs::read(&out).unwrap(), old, "the finished picture was touched");
        assert_eq!(std::fs::read(&stats).unwrap(), b"old", "its statistics were touched");
        assert_eq!(read_header(partial.as_ref()).unwrap()["nearfar.complete"], "false");
        let told = std::fs::read_to_string(folder.at("o.partial.json")).unwrap();
        assert!(told.contains("\"ended_by\": \"interrupted\""), "{told}");
        let done = nearfar(&[&going[..], &["--resume"]].concat());
        assert_eq!(done.status.code(), Some(0), "{}", said(&done));
        assert!(content(&out) == content(&whole), "{command:?}");
        assert_eq!(folder.names(), ["o.exr", "o.json", "whole.exr"]);
    }
}
