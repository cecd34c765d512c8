//! What is done is not lost: killed and stopped renders go on to the same bits, old files stay
//! until new ones are whole, and what cannot be kept is said.

use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use nearfar::film::read_header;

use crate::support::Folder;

const SCENE: &str = "scenes/cornell-box/cornell-box.toml";

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

/// A picture, byte for byte.
fn content(path: &str) -> Vec<u8> {
    std::fs::read(path).unwrap()
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

/// Commands that make one picture or cloud, pass by pass, for about a second each.
const BY_PASSES: [&[&str]; 8] = [
    &["render", SCENE, "--size", "40x30", "--method", "gather", "--set", "gather.rays=3000"],
    &[
        "render",
        SCENE,
        "--size",
        "40x30",
        "--method",
        "decomposition",
        "--set",
        "decompose.near_rays=2000",
        "--set",
        "proxy.gather_rays=16",
    ],
    &[
        "render",
        SCENE,
        "--size",
        "40x30",
        "--method",
        "irradiance-cache",
        "--set",
        "cache.rays=8000",
        "--set",
        "cache.mode=split-sphere",
    ],
    &["render", SCENE, "--size", "40x30", "--method", "photon-map", "--spp", "2000"],
    &[
        "render",
        SCENE,
        "--size",
        "40x30",
        "--method",
        "point-based",
        "--set",
        "point_based.elements=6000",
    ],
    &[
        "render",
        SCENE,
        "--size",
        "120x90",
        "--method",
        "local-correction",
        "--set",
        "local.elements=20000",
    ],
    &["render", SCENE, "--size", "40x30", "--method", "direct", "--spp", "500"],
    &["cloud", "bake", SCENE, "--elements", "6000"],
];

/// Shares of a time, evenly spread, the same in every run.
struct Moments(u64);

impl Iterator for Moments {
    type Item = f64;
    fn next(&mut self) -> Option<f64> {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        Some((self.0 >> 32) as f64 / 4_294_967_296.0)
    }
}

/// Runs a command that goes on, and kills it after a share of `time`, again and again, until it was
/// killed so often.
fn kill(command: &[&str], times: usize, time: Duration, moments: &mut Moments) {
    let mut kills = 0;
    for moment in moments {
        let mut child = start(command);
        std::thread::sleep(time.mul_f64(moment));
        kills += usize::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        if kills == times {
            return;
        }
    }
}

/// Kills a command, goes on, and compares with the command left alone.
fn killed(folder: &Folder, command: &[&str], kills: &dyn Fn(&[&str], Duration)) {
    let end = if command[0] == "cloud" { "ply" } else { "exr" };
    let (whole, out) = (folder.at(&format!("whole.{end}")), folder.at(&format!("o.{end}")));
    let common = ["-q", "--checkpoint", "0.05", "-o"];
    let begin = Instant::now();
    let done = nearfar(&[command, &common, &[&whole]].concat());
    let time = begin.elapsed();
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    let expected = content(&whole);
    let going = [command, &common, &[&out, "--resume"]].concat();
    kills(&going, time);
    let done = nearfar(&going);
    assert_eq!(done.status.code(), Some(0), "{command:?}: {}", said(&done));
    assert!(content(&out) == expected, "{command:?}");
    let left = folder.names();
    assert!(!left.iter().any(|name| name.contains("partial")), "{left:?}");
}

#[test]
fn what_is_killed_goes_on_to_the_same_bits() {
    for (i, command) in PROGRESSIVE.iter().chain(&BY_PASSES).enumerate() {
        let folder = Folder::new(&format!("lost-killed-{i}"));
        let partial = folder.at("o.partial.exr");
        killed(&folder, command, &|going, _| {
            for _ in 0..2 {
                let mut child = start(going);
                until(&mut child, || std::path::Path::new(&partial).exists());
                child.kill().unwrap();
                child.wait().unwrap();
            }
        });
    }
}

#[test]
#[ignore = "slow: a minute of renders that are killed"]
fn what_is_killed_at_random_moments_goes_on_to_the_same_bits() {
    for round in 0..7 {
        for (i, command) in PROGRESSIVE.iter().enumerate() {
            let folder = Folder::new(&format!("lost-random-{round}-{i}"));
            let mut moments = Moments(100 * round + i as u64);
            let moments = std::cell::RefCell::new(&mut moments);
            killed(&folder, command, &|going, time| {
                kill(going, 2, time, &mut moments.borrow_mut());
            });
        }
        for reuse in ["plan", "extend", "none"] {
            let folder = Folder::new(&format!("lost-random-{round}-{reuse}"));
            let kept = ["--reuse", reuse, "--checkpoint", "0.000001"];
            let begin = Instant::now();
            assert_eq!(nearfar(&strings(&fly(&folder, "whole", &kept))).status.code(), Some(0));
            let going = fly(&folder, "film", &[&kept[..], &["--resume"]].concat());
            kill(&strings(&going), 1, begin.elapsed(), &mut Moments(round));
            assert_eq!(nearfar(&strings(&going)).status.code(), Some(0));
            for i in 1..=4 {
                let frame = |film: &str| content(&folder.at(&format!("{film}/frame_{i:04}.exr")));
                assert!(frame("film") == frame("whole"), "{reuse} {i}");
            }
        }
    }
}

#[test]
#[ignore = "slow: minutes of renders that are killed"]
fn passes_that_are_killed_at_random_moments_go_on_to_the_same_bits() {
    for round in 0..7 {
        for (i, command) in BY_PASSES.iter().enumerate() {
            let folder = Folder::new(&format!("lost-passes-{round}-{i}"));
            let mut moments = Moments(1000 + 100 * round + i as u64);
            let moments = std::cell::RefCell::new(&mut moments);
            killed(&folder, command, &|going, time| {
                kill(going, 1, time, &mut moments.borrow_mut());
            });
        }
    }
    eprintln!("{} kills, all resumed to the same bits", 7 * BY_PASSES.len());
}

#[test]
#[cfg(unix)]
fn ctrl_c_keeps_the_passes_that_are_made_and_says_so() {
    let folder = Folder::new("lost-passes-stopped");
    let (whole, out) = (folder.at("whole.exr"), folder.at("o.exr"));
    let command = BY_PASSES[0];
    let done = nearfar(&[command, &["-o", &whole][..]].concat());
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    std::fs::write(&out, "old").unwrap();
    let going = [command, &["-o", &out, "--checkpoint", "0.05"][..]].concat();
    let partial = folder.at("o.partial.exr");
    let mut child = start(&going);
    until(&mut child, || std::path::Path::new(&partial).exists());
    interrupt(&child);
    let stopped = child.wait_with_output().unwrap();
    let text = said(&stopped);
    assert_eq!(stopped.status.code(), Some(130), "{text}");
    assert!(text.contains(&format!("what is done is in {partial}")), "{text}");
    assert_eq!(std::fs::read(&out).unwrap(), b"old", "the earlier file was touched");
    // Another job's file is refused, and stays.
    let kept = content(&partial);
    for other in [&["--seed", "5"][..], &["--set", "gather.guided=0.25"], &["--spp", "3"]] {
        let refused = nearfar(&[&going[..], &["--resume"], other].concat());
        let text = said(&refused);
        assert!(refused.status.code() == Some(2) && text.contains("another job"), "{text}");
    }
    let begun = folder.at("begun.exr");
    let path = ["reference", SCENE, "--size", "40x30", "--spp", "1", "-q", "-o", &begun];
    assert_eq!(nearfar(&path).status.code(), Some(0));
    let refused = nearfar(&[&going[..], &["--resume", &begun]].concat());
    assert!(said(&refused).contains("not left by a job of this kind"), "{}", said(&refused));
    assert!(content(&partial) == kept);
    let done = nearfar(&[&going[..], &["--resume"]].concat());
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    assert!(content(&out) == content(&whole));
    assert_eq!(folder.names(), ["begun.exr", "o.exr", "whole.exr"]);
}

#[test]
#[cfg(unix)]
fn ctrl_c_leaves_the_finished_picture_and_says_what_is_kept() {
    for (i, command) in PROGRESSIVE.iter().enumerate() {
        let folder = Folder::new(&format!("lost-stopped-{i}"));
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

/// A film of the Cornell box in four small frames.
fn fly(folder: &Folder, film: &str, more: &[&str]) -> Vec<String> {
    let scene = ["--size", "24x24", "--spp", "2", "--frames", "4", "--to-eye", "300,273,-780"];
    let cheap = ["--set", "proxy.photons=5000", "--set", "decompose.rays=64", "-q"];
    let out = folder.at(film);
    let words = [&["fly", SCENE, "-o", &out], &scene[..], &cheap, more].concat();
    words.into_iter().map(str::to_owned).collect()
}

fn strings(words: &[String]) -> Vec<&str> {
    words.iter().map(String::as_str).collect()
}

#[test]
fn a_film_goes_on_at_the_frame_where_it_stopped() {
    for reuse in ["plan", "extend", "none"] {
        let folder = Folder::new(&format!("lost-film-{reuse}"));
        let kept = ["--reuse", reuse, "--checkpoint", "0.000001"];
        let whole = nearfar(&strings(&fly(&folder, "whole", &kept)));
        assert_eq!(whole.status.code(), Some(0), "{}", said(&whole));
        let frame = |film: &str, i: usize| folder.at(&format!("{film}/frame_{i:04}.exr"));
        let going = fly(&folder, "film", &[&kept[..], &["--resume"]].concat());
        let mut child = start(&strings(&going));
        until(&mut child, || std::path::Path::new(&frame("film", 2)).exists());
        child.kill().unwrap();
        child.wait().unwrap();
        let first = std::fs::metadata(frame("film", 1)).unwrap().modified().unwrap();
        let done = nearfar(&strings(&going));
        assert_eq!(done.status.code(), Some(0), "{}", said(&done));
        assert_eq!(std::fs::metadata(frame("film", 1)).unwrap().modified().unwrap(), first);
        for i in 1..=4 {
            assert!(content(&frame("film", i)) == content(&frame("whole", i)), "{reuse} {i}");
        }
        assert!(!std::path::Path::new(&folder.at("film/film.partial.ply")).exists());
    }
}

#[test]
fn frames_of_two_films_do_not_mix() {
    let folder = Folder::new("lost-films");
    let film = |more: &[&str]| nearfar(&strings(&fly(&folder, "film", more)));
    assert_eq!(film(&[]).status.code(), Some(0));
    let frame = folder.at("film/frame_0002.exr");
    let old = std::fs::read(&frame).unwrap();
    for other in [&["--seed", "9"][..], &["--seed", "9", "--resume"], &["--half"]] {
        let refused = film(other);
        let text = said(&refused);
        assert_eq!(refused.status.code(), Some(2), "{other:?}: {text}");
        assert!(text.contains("frame_0001.exr") && text.contains("another film"), "{text}");
        assert_eq!(std::fs::read(&frame).unwrap(), old);
    }
    let again = film(&["--seed", "9", "--replace", "--frames", "2"]);
    assert!(again.status.code() == Some(2), "an option twice");
    let short = fly(&folder, "film", &["--seed", "9", "--replace"]);
    let short: Vec<&str> =
        strings(&short).into_iter().map(|w| if w == "4" { "2" } else { w }).collect();
    let again = nearfar(&short);
    assert_eq!(again.status.code(), Some(0), "{}", said(&again));
    let left: Vec<_> = std::fs::read_dir(folder.at("film")).unwrap().collect();
    assert_eq!(left.len(), 2, "frames of the other film are left");
}

/// Every bit of a file counts.
#[test]
fn a_damaged_file_is_refused_with_its_name() {
    let folder = Folder::new("lost-damaged");
    let at = |name: &str| folder.at(name);
    let (begun, cache, cloud) = (at("begun.exr"), at("cache.ply"), at("cloud.ply"));
    let (out, small) = (at("o.exr"), ["--size", "16x12", "-q"]);
    let run = |words: &[&str]| nearfar(&[words, &small].concat());
    let cheap = ["--set", "proxy.photons=2000", "--set", "decompose.rays=32"];
    let first = run(&["reference", SCENE, "--spp", "2", "-o", &begun]);
    assert_eq!(first.status.code(), Some(0), "{}", said(&first));
    let saved = [&["render", SCENE, "-o", &out, "--save-cache", &cache], &cheap[..]].concat();
    assert_eq!(run(&saved).status.code(), Some(0));
    let baked = ["cloud", "bake", SCENE, "-o", &cloud, "--elements", "300"];
    assert_eq!(run(&baked).status.code(), Some(0));
    let loaded = [&["render", SCENE, "-o", &out, "--load-cache", &cache], &cheap[..]].concat();
    for (file, command) in [
        (&begun, vec!["reference", SCENE, "--spp", "4", "-o", &out, "--resume", &begun]),
        (&cache, loaded),
        (&cloud, vec!["cloud", "gather", SCENE, "-o", &out, "--cloud", &cloud]),
    ] {
        let good = std::fs::read(file).unwrap();
        assert_eq!(run(&command).status.code(), Some(0), "{file}");
        for part in 1..8 {
            let mut bytes = good.clone();
            bytes[good.len() * part / 8] ^= 1 << part;
            std::fs::write(file, &bytes).unwrap();
            let refused = run(&command);
            let text = said(&refused);
            assert!(refused.status.code() == Some(2) && text.contains(file.as_str()), "{text}");
        }
    }
}

#[test]
#[cfg(unix)]
fn a_film_that_is_stopped_says_how_far_it_came() {
    let folder = Folder::new("lost-film-stopped");
    let mut child = start(&strings(&fly(&folder, "film", &["--checkpoint", "0.000001"])));
    until(&mut child, || std::path::Path::new(&folder.at("film/frame_0001.exr")).exists());
    interrupt(&child);
    let stopped = child.wait_with_output().unwrap();
    let text = said(&stopped);
    assert_eq!(stopped.status.code(), Some(130), "{text}");
    assert!(text.contains("of 4 frames are done; the same command with --resume"), "{text}");
}

/// Nothing is there yet to be kept while a scene of millions of triangles is made and built.
#[test]
#[cfg(target_os = "linux")]
fn ctrl_c_does_not_wait_for_what_keeps_nothing() {
    let folder = Folder::new("lost-large");
    let large = ["scenes/atrium/atrium.toml", "--set", "mesh.0.parameters.detail=3"];
    for command in ["render", "reference"] {
        let out = folder.at("o.exr");
        let mut child = start(&[&[command], &large[..], &["-o", &out]].concat());
        // Until the program catches signals, one would end it anyhow.
        let stat = format!("/proc/{}/status", child.id());
        until(&mut child, || {
            let status = std::fs::read_to_string(&stat).unwrap_or_default();
            let caught = status.lines().find_map(|l| l.strip_prefix("SigCgt:"));
            caught.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).unwrap() & 2 != 0)
        });
        interrupt(&child);
        let stopped = child.wait_with_output().unwrap();
        assert_eq!(stopped.status.code(), Some(130), "{}", said(&stopped));
        // One that was asked to stop would have been told so first.
        assert_eq!(said(&stopped), "interrupted; nothing of this run is kept\n");
    }
    assert!(folder.names().is_empty(), "{:?}", folder.names());
}

/// The scene is not there either: what is told first was looked at first.
#[test]
fn outputs_are_tried_before_the_scene_is_read() {
    let folder = Folder::new("lost-outputs");
    let (locked, long) = (folder.at("locked"), folder.at(&"x".repeat(252)));
    std::fs::create_dir(folder.at("in.exr")).unwrap();
    std::fs::create_dir(folder.at("in.ply")).unwrap();
    for end in [".exr", ".ply"] {
        let file = locked.clone() + end;
        std::fs::write(&file, "old").unwrap();
        let mut mode = std::fs::metadata(&file).unwrap().permissions();
        mode.set_readonly(true);
        std::fs::set_permissions(&file, mode).unwrap();
    }
    let absent = folder.at("absent.toml");
    for (command, end) in [
        (&["render", &absent][..], ".exr"),
        (&["reference", &absent], ".exr"),
        (&["cloud", "gather", &absent, "--cloud", "none.ply"], ".exr"),
        (&["cloud", "bake", &absent], ".ply"),
    ] {
        for (output, reason) in [
            (folder.at("in"), "is a folder"),
            (locked.clone(), "is read-only"),
            (folder.at("no/o"), "does not exist: create it first"),
            (long.clone(), "name too long"),
        ] {
            let output = output + end;
            let refused = nearfar(&[command, &["-o", &output]].concat());
            let text = said(&refused);
            assert!(refused.status.code() == Some(2) && text.contains(reason), "{text}");
        }
    }
    let file = locked + ".exr";
    let film = nearfar(&["fly", &absent, "--to-eye", "1,2,3", "-o", &file]);
    assert!(said(&film).contains("is read-only"), "{}", said(&film));
    assert_eq!(std::fs::read(&file).unwrap(), b"old");
    assert_eq!(folder.names().len(), 4, "{:?}", folder.names());
}

#[test]
#[cfg(unix)]
fn a_picture_whose_folder_is_gone_is_rescued() {
    let folder = Folder::new("lost-rescued");
    let (gone, other) = (folder.at("gone"), folder.at("other"));
    std::fs::create_dir(&gone).unwrap();
    std::fs::create_dir(&other).unwrap();
    let out = format!("{gone}/o.exr");
    let limits = ["--size", "16x12", "--time-limit", "2s", "--checkpoint", "0.05"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_nearfar"))
        .args([&["reference", SCENE, "-o", &out][..], &limits].concat())
        .env("TMPDIR", &other)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    until(&mut child, || std::path::Path::new(&format!("{gone}/o.partial.exr")).exists());
    std::fs::rename(&gone, folder.at("moved")).unwrap();
    let ended = child.wait_with_output().unwrap();
    let text = said(&ended);
    assert_eq!(ended.status.code(), Some(3), "{text}");
    assert!(text.contains(&format!("{out}: cannot be written: folder {gone} does not exist")));
    let saved = text.rsplit("it is saved as ").next().unwrap().trim();
    assert!(saved.starts_with(&other), "{text}");
    assert_eq!(read_header(saved.as_ref()).unwrap()["nearfar.complete"], "true");
}

#[test]
fn a_time_limit_that_comes_too_early_is_told() {
    let folder = Folder::new("lost-late");
    let (out, stats) = (folder.at("o.exr"), folder.at("o.json"));
    let files = ["-o", &out, "--stats", &stats, "--size", "16x12", "--time-limit", "0.2"];
    for (asked, complete) in [
        (&["--spp", "1000000"][..], "false"),
        (&["--target-error", "1e-12"], "false"),
        (&[], "true"),
    ] {
        let limited = nearfar(&[&["reference", SCENE], &files[..], asked].concat());
        let text = said(&limited);
        assert_eq!(limited.status.code(), Some(0), "{text}");
        assert_eq!(text.contains("the time limit came at"), complete == "false", "{text}");
        assert_eq!(read_header(out.as_ref()).unwrap()["nearfar.complete"], complete);
        let told = std::fs::read_to_string(&stats).unwrap();
        assert!(told.contains("\"ended_by\": \"time_limit\""), "{told}");
    }
    let ignored = ["render", SCENE, "--method", "direct"];
    let ignored = nearfar(&[&ignored[..], &files].concat());
    assert!(said(&ignored).contains("--time-limit: method direct"), "{}", said(&ignored));
    let small = ["--size", "16x12", "-o", &out, "--resume"];
    let fresh = nearfar(&[&["render", SCENE, "--method", "direct"][..], &small].concat());
    assert_eq!(fresh.status.code(), Some(0), "{}", said(&fresh));
}

/// What comes after a whole picture may be what is lacking: standard output is a file as well.
#[test]
#[cfg(target_os = "linux")]
fn a_full_standard_output_is_told() {
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_nearfar"));
    let told = command.args(["info", SCENE]).stdout(full).output().unwrap();
    assert_eq!(told.status.code(), Some(3));
    assert!(said(&told).contains("standard output: cannot be written"), "{}", said(&told));
}
