//! The program as a user types it.

use std::path::Path;
use std::process::{Command, Output};

use nearfar::film::read_exr;

use crate::support::Folder;

fn nearfar(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_nearfar")).args(arguments).output().unwrap()
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A folder with a small scene in it.
fn card(name: &str) -> Folder {
    let folder = Folder::new(&format!("cli-{name}"));
    folder.file("card.obj", "v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\n");
    let scene = "[camera]\neye = [0, 1, 2]\ntarget = [0, 0, 0]\nwidth = 16\nheight = \
                 12\n\n[[mesh]]\nfile = \"card.obj\"\n\n\
                 [[light]]\ntype = \"sky\"\nradiance = [1, 1, 1]\n\n[[light]]\ntype = \
                 \"point\"\nposition = [0, 1, 0]\nintensity = [1, 1, 1]\n\n\
                 [settings]\nseed = 7\n\n[settings.path]\nspp = 3\n";
    folder.file("card.toml", scene);
    folder
}

/// Whether a help text lists an option: a line begins with it, alone or beside its other form.
fn names_option(help: &str, option: &str) -> bool {
    help.lines().any(|line| {
        let line = line.trim_start();
        let listed = line.starts_with('-').then(|| line.split([' ', ',', '=', '[']));
        listed.is_some_and(|mut words| words.any(|w| w == option))
    })
}

#[test]
fn help_names_every_command_and_option() {
    let help = nearfar(&["--help"]);
    assert_eq!(code(&help), 0);
    let text = String::from_utf8(help.stdout).unwrap();
    for command in nearfar::cli::command().get_subcommands().filter(|c| !c.is_hide_set()) {
        let name = command.get_name();
        assert!(text.lines().any(|l| l.split_whitespace().next() == Some(name)), "{name}");
    }
    let text = String::from_utf8(nearfar(&["render", "--help"]).stdout).unwrap();
    for word in [
        "--method",
        "--alpha",
        "--size",
        "--spp",
        "--time-limit",
        "--threads",
        "--seed",
        "--backend",
        "--set",
        "--aov",
        "--stats",
        "--png",
        "--exposure",
        "-q",
        "-v",
    ] {
        assert!(names_option(&text, word), "{word}");
    }
    assert!(!names_option(&text, "--sta"), "an option's beginning is no option");
    let text = String::from_utf8(nearfar(&["reference", "--help"]).stdout).unwrap();
    for word in ["--resume", "--target-error", "--time-limit"] {
        assert!(names_option(&text, word), "{word}");
    }
    assert_eq!(code(&nearfar(&["--version"])), 0);
}

#[test]
fn usage_errors_exit_with_2_and_say_the_fix() {
    let folder = card("usage");
    let (scene, out) = (folder.at("card.toml"), folder.at("o.exr"));
    for (arguments, expected) in [
        (vec!["render"], "required"),
        (vec!["paint"], "unrecognized subcommand"),
        (vec!["render", &scene, "-o", &out, "--size", "640"], "WIDTHxHEIGHT"),
        (vec!["render", &scene, "-o", &out, "--spp", "0"], "0 is not in"),
        (vec!["render", &scene, "-o", &out, "--time-limit", "soon"], "write seconds"),
        (vec!["render", &scene, "-o", &out, "--method", "magic"], "possible values"),
        (vec!["render", &scene, "-o", &out, "--set", "path.spp"], "write key=value"),
        (
            vec!["render", &scene, "-o", &out, "--set", "path.sppp=3"],
            "setting \"path.sppp\": unknown key",
        ),
        (vec!["render", &scene, "-o", &out, "--set", "path.spp=many"], "setting \"path.spp\""),
        (vec!["render", &scene, "-o", &folder.at("o.png")], "name it .exr"),
        (vec!["render", &scene, "-o", &folder.at("no/o.exr")], "does not exist"),
        (vec!["render", &folder.at("none.toml"), "-o", &out], "none.toml"),
        (vec!["render", &folder.at("none.obj"), "-o", &out], "none.obj"),
        (vec!["compare", &folder.at("a.exr"), &folder.at("b.exr")], "no such file"),
        (vec!["reference", &scene, "-o", &out, "--resume", &folder.at("none.exr")], "no such file"),
    ] {
        let output = nearfar(&arguments);
        assert_eq!(code(&output), 2, "{arguments:?}");
        assert!(stderr(&output).contains(expected), "{arguments:?}: {}", stderr(&output));
        assert!(output.stdout.is_empty(), "{arguments:?}");
    }
    let left: Vec<_> =
        std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2, "{left:?}");
}

#[test]
fn settings_precedence() {
    let folder = card("precedence");
    let (scene, out, stats) = (folder.at("card.toml"), folder.at("o.exr"), folder.at("o.json"));
    let spp = |extra: &[&str]| {
        let mut arguments = vec![
            "render",
            &scene,
            "-o",
            &out,
            "--method",
            "path",
            "--stats",
            &stats,
            "--threads",
            "1",
        ];
        arguments.extend(extra);
        let output = nearfar(&arguments);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        let stats: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(&stats).unwrap()).unwrap();
        (stats["spp"].as_u64().unwrap(), stats["seed"].as_u64().unwrap())
    };
    assert_eq!(spp(&[]), (3, 7), "the scene file");
    assert_eq!(spp(&["--set", "path.spp=5", "--set", "seed=8"]), (5, 8), "--set over the file");
    assert_eq!(
        spp(&["--set", "path.spp=5", "--spp", "4", "--seed", "9"]),
        (4, 9),
        "options of their own over --set"
    );
}

#[test]
fn render_writes_image_picture_and_statistics() {
    let folder = card("render");
    let (scene, out, stats) = (folder.at("card.toml"), folder.at("o.exr"), folder.at("o.json"));
    let output = nearfar(&[
        "render",
        &scene,
        "-o",
        &out,
        "--method",
        "path",
        "--size",
        "20x10",
        "--png",
        "--stats",
        &stats,
        "--aov",
        "direct,albedo",
    ]);
    assert_eq!((code(&output), output.stdout.len()), (0, 0), "{}", stderr(&output));
    let film = read_exr(Path::new(&out)).unwrap();
    assert_eq!((film.width, film.height), (20, 10));
    let names: Vec<_> = film.channels.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        ["B", "G", "R", "albedo.B", "albedo.G", "albedo.R", "direct.B", "direct.G", "direct.R"]
    );
    assert!(
        film.header["nearfar.settings"].contains("seed = 7")
            && film.header["nearfar.method"] == "path"
    );
    assert!(Path::new(&folder.at("o.png")).is_file());
    let stats: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&stats).unwrap()).unwrap();
    for key in [
        "method",
        "backend",
        "width",
        "height",
        "threads",
        "seed",
        "triangles",
        "cpu_seconds",
        "peak_rss_bytes",
    ] {
        assert!(!stats[key].is_null(), "{key}");
    }
    for key in ["total", "load", "build", "write"] {
        assert!(stats["seconds"][key].is_number(), "{key}");
    }
    assert!(
        stats["rays"]["primary"].as_u64() == Some(600)
            && stats["rays"]["shadow"].as_u64() > Some(0)
    );
    let output = nearfar(&["render", &scene, "-o", &out, "--method", "path", "--aov", "shine"]);
    assert!(
        code(&output) == 2 && stderr(&output).contains("choose among none, direct"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn what_was_chosen_is_told_unless_quiet() {
    let folder = card("notes");
    let (card, cube, out) = (folder.at("card.obj"), folder.at("cube.toml"), folder.at("o.exr"));
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n";
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    std::fs::write(folder.at("cube.obj"), format!("{corners}{faces}")).unwrap();
    let scene = "[camera]\neye = [0.5, 0.5, 0.4]\ntarget = [0.5, 0.5, 1]\n\n[[mesh]]\nfile = \
                 \"cube.obj\"\n\n[[light]]\ntype = \"sky\"\nradiance = 1\n";
    std::fs::write(&cube, scene).unwrap();
    let (camera, sky, wall) =
        ("note: no camera given", "note: no light given", "warning: the camera is inside a wall");
    for command in ["render", "reference"] {
        for (scene, expected) in [(&card, vec![camera, sky]), (&cube, vec![wall])] {
            let arguments = [command, scene, "-o", &out, "--size", "8x8", "--spp", "1"];
            let output = nearfar(&arguments);
            let said = stderr(&output);
            assert_eq!(code(&output), 0, "{said}");
            for line in [camera, sky, wall] {
                assert_eq!(
                    said.contains(line),
                    expected.contains(&line),
                    "{command} {scene}: {line} in {said}"
                );
            }
            let quiet = nearfar(&[&arguments[..], &["-q"]].concat());
            assert_eq!((code(&quiet), stderr(&quiet).as_str()), (0, ""), "{command} {scene}");
        }
    }
}

#[test]
fn reference_resumes_to_the_same_bits() {
    let folder = card("resume");
    let (scene, whole, part) =
        (folder.at("card.toml"), folder.at("whole.exr"), folder.at("part.exr"));
    for arguments in [
        vec!["reference", &scene, "-o", &whole, "--spp", "11", "-q"],
        vec!["reference", &scene, "-o", &part, "--spp", "4", "-q"],
        vec!["reference", &scene, "-o", &part, "--spp", "11", "-q", "--resume", &part],
    ] {
        let output = nearfar(&arguments);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
    }
    let bits = |path: &str| {
        let film = read_exr(Path::new(path)).unwrap();
        film.channels
            .into_iter()
            .map(|(k, v)| (k, v.into_iter().map(f32::to_bits).collect::<Vec<_>>()))
            .collect::<Vec<_>>()
    };
    assert!(bits(&whole) == bits(&part));
    let output = nearfar(&[
        "reference",
        &scene,
        "-o",
        &part,
        "--spp",
        "12",
        "--resume",
        &whole,
        "--seed",
        "99",
    ]);
    assert!(code(&output) == 2 && stderr(&output).contains("cannot resume"), "{}", stderr(&output));
}

/// User and system seconds of a process.
#[cfg(target_os = "linux")]
fn cpu_seconds(process: u32) -> f64 {
    let text = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    let fields = text.rsplit(')').next().unwrap().split_whitespace().skip(11).take(2);
    fields.map(|ticks| ticks.parse::<f64>().unwrap() / 100.0).sum()
}

#[test]
#[cfg(target_os = "linux")]
fn ctrl_c_keeps_what_was_done() {
    let folder = card("interrupt");
    let out = folder.at("o.exr");
    let mut child = Command::new(env!("CARGO_BIN_EXE_nearfar"))
        .args(["reference", &folder.at("card.toml"), "-o", &out, "--spp", "100000000"])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    // A second of its CPU is past loading and the first sample of 192 pixels, however busy the
    // machine is; the render itself would take hours.
    let start = std::time::Instant::now();
    while cpu_seconds(child.id()) < 1.0 {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        assert!(start.elapsed().as_secs() < 300, "it does nothing");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let sent = Command::new("bash")
        .args(["-c", &format!("kill -INT {}", child.id())])
        .status()
        .is_ok_and(|s| s.success());
    if !sent {
        child.kill().unwrap();
    }
    assert!(sent, "the signal was not sent");
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let film = read_exr(Path::new(&folder.at("o.partial.exr"))).unwrap();
    assert_eq!(film.header["nearfar.complete"], "false");
    assert!(film.channels["samples"].iter().any(|&n| n >= 1.0));
    assert!(!Path::new(&out).exists(), "a partial picture is not the finished one");
}

#[cfg(unix)]
#[test]
fn a_reader_that_leaves_ends_the_program_quietly() {
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_nearfar"))
        .args(["info", concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box/cornell-box.toml")])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(!stderr(&output).contains("panicked"), "{}", stderr(&output));
    assert_eq!(output.status.code(), Some(141));
}

#[test]
fn a_cloud_is_baked_and_gathered_from() {
    let folder = card("cloud");
    let baked = nearfar(&[
        "cloud",
        "bake",
        &folder.at("card.toml"),
        "-o",
        &folder.at("card.ply"),
        "--elements",
        "2000",
    ]);
    assert_eq!(code(&baked), 0, "{}", stderr(&baked));
    assert_eq!(String::from_utf8_lossy(&baked.stdout), "2000 elements, area 4.000000\n");
    let (scene, cloud, out) = (folder.at("card.toml"), folder.at("card.ply"), folder.at("ao.exr"));
    let arguments = [
        "cloud",
        "gather",
        &scene,
        "--cloud",
        &cloud,
        "-o",
        &out,
        "--channel",
        "occlusion,bent-normal,indirect,environment",
        "--traced",
        "16",
        "-q",
    ];
    let gathered = nearfar(&arguments);
    assert_eq!(code(&gathered), 0, "{}", stderr(&gathered));
    // A card alone occludes nothing.
    assert!(
        String::from_utf8_lossy(&gathered.stdout)
            .starts_with("occlusion against 16 rays: mean absolute error 0.0000")
    );
    let film = read_exr(out.as_ref()).unwrap();
    let at = film.width as usize * 6 + 8;
    assert!(
        film.channels["occlusion"][at] == 0.0
            && film.channels["R"][at] == 1.0
            && film.channels["bent.Y"][at] > 0.6
    );
    assert!((film.channels["open.R"][at] - std::f32::consts::PI).abs() < 1e-3);

    let usage = nearfar(&[
        "cloud",
        "bake",
        &folder.at("card.toml"),
        "-o",
        &folder.at("x.ply"),
        "--channels",
        "colour",
    ]);
    assert_eq!(code(&usage), 2);
    assert!(stderr(&usage).contains("--channels colour: choose among none, _radiosity"));
    assert_eq!(
        code(&nearfar(&[
            "cloud",
            "bake",
            &folder.at("card.toml"),
            "-o",
            &folder.at("bare.ply"),
            "--elements",
            "100",
            "--channels",
            "none",
            "-q"
        ])),
        0
    );
    let unlit = nearfar(&[
        "cloud",
        "gather",
        &scene,
        "--cloud",
        &folder.at("bare.ply"),
        "-o",
        &out,
        "--channel",
        "indirect",
    ]);
    assert!(
        code(&unlit) == 2 && stderr(&unlit).contains("has no \"_radiosity\""),
        "{}",
        stderr(&unlit)
    );
    let setting = nearfar(&[
        "render",
        &scene,
        "-o",
        &out,
        "--method",
        "point-based",
        "--set",
        "point_based.maxsolidangle=7",
    ]);
    assert!(
        code(&setting) == 2 && stderr(&setting).contains("point_based.maxsolidangle"),
        "{}",
        stderr(&setting)
    );
}

#[test]
fn old_names_of_commands_tell_the_new_ones() {
    let folder = card("renamed");
    let (scene, out) = (folder.at("card.toml"), folder.at("out.ply"));
    let old: [(&[&str], &str); 4] = [
        (&["bake", &scene, "-o", &out, "--elements", "9"], "nearfar cloud bake"),
        (&["gather", &scene, "--cloud", &out, "--help"], "nearfar cloud gather"),
        (&["show", &out], "nearfar cloud show"),
        (&["render", &scene, "-o", &out, "--method", "points"], "point-based"),
    ];
    for (arguments, new) in old {
        let output = nearfar(arguments);
        assert!(
            code(&output) == 2 && stderr(&output).contains(new),
            "{arguments:?}: {}",
            stderr(&output)
        );
    }
    let help = nearfar(&["--help"]);
    let help = String::from_utf8_lossy(&help.stdout);
    assert!(help.contains("  cloud ") && !help.contains("  bake ") && !help.contains("  gather "));
}

#[test]
fn a_cloud_is_shown_as_a_page() {
    let folder = card("shown");
    let (scene, ply) = (folder.at("card.toml"), folder.at("card.ply"));
    let baked = nearfar(&["cloud", "bake", &scene, "-o", &ply, "--elements", "100", "-q"]);
    assert_eq!(code(&baked), 0, "{}", stderr(&baked));
    let shown = nearfar(&["cloud", "show", &ply]);
    assert_eq!(code(&shown), 0, "{}", stderr(&shown));
    let page = folder.at("card.html");
    assert_eq!(String::from_utf8_lossy(&shown.stdout).trim_end(), page);
    assert!(std::fs::read_to_string(&page).unwrap().contains("<h1>card.ply</h1>"));
    let named = nearfar(&["cloud", "show", &ply, "-o", &folder.at("card.png")]);
    assert!(code(&named) == 2 && stderr(&named).contains("OUT.html"), "{}", stderr(&named));
}

#[test]
fn a_picture_that_converges_tells_its_error() {
    let folder = card("converge");
    let (scene, out, stats) = (folder.at("card.toml"), folder.at("o.exr"), folder.at("o.json"));
    let output =
        nearfar(&["render", &scene, "-o", &out, "--converge", "--spp", "16", "--stats", &stats]);
    assert!(
        code(&output) == 0
            && output.stdout.is_empty()
            && stderr(&output).contains("estimated relMSE"),
        "{}",
        stderr(&output)
    );
    let film = read_exr(Path::new(&out)).unwrap();
    assert!(
        film.channels["samples"].iter().all(|&n| n == 16.0)
            && film.header.contains_key("nearfar.converge.relmse")
    );
    let stats: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&stats).unwrap()).unwrap();
    assert!(stats["converge_spp"] == 16.0 && stats["converge_relmse"].is_number());
    let stopped = nearfar(&["render", &scene, "-o", &out, "--converge", "--target-error", "1e9"]);
    assert!(
        code(&stopped) == 0 && stderr(&stopped).contains("note: 8.0 samples"),
        "{}",
        stderr(&stopped)
    );
    let limited =
        nearfar(&["render", &scene, "-o", &out, "--converge", "--time-limit", "0.01", "-q"]);
    assert!(code(&limited) == 0 && limited.stderr.is_empty(), "{}", stderr(&limited));
    for (arguments, fix) in [
        (vec!["--target-error", "0.1"], "--converge"),
        (vec!["--converge", "--spp", "2"], "converge.spp"),
        (vec!["--converge", "--method", "path"], "nearfar reference"),
    ] {
        let output = nearfar(&[&["render", &scene, "-o", &out], &arguments[..]].concat());
        assert!(
            code(&output) == 2 && stderr(&output).contains(fix),
            "{arguments:?}: {}",
            stderr(&output)
        );
    }
}

/// Files that would overwrite each other are refused before anything is rendered.
#[test]
fn every_file_has_a_name_of_its_own() {
    let folder = Folder::new("cli-distinct");
    let at = |name: &str| folder.join(name).display().to_string();
    let (out, other) = (at("a.exr"), at("b.ply"));
    let scene = "scenes/lit-sheet/lit-sheet.toml";
    for arguments in [
        vec!["--stats", &out],
        vec!["--save-cache", &other, "--locations", &other],
        vec!["--stats", scene],
    ] {
        let common = ["render", scene, "--size", "4x4", "-o", &out];
        let done = crate::support::program(&[&common[..], &arguments].concat());
        let text = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(done.status.code() == Some(2) && text.contains("named twice"), "{text}");
    }
    assert!(!std::path::Path::new(&out).exists());
    let many = ["info", scene, "--threads", "100000"];
    assert_eq!(crate::support::program(&many).status.code(), Some(2));
}
