//! Settings as a user meets them: on the command line, in a scene file, and on their page.

use std::path::PathBuf;
use std::process::Command;

use nearfar::film::read_exr;

use crate::support::Folder;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box/cornell-box.toml");

/// Exit code, standard output, standard error.
fn nearfar(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_nearfar")).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn the_page_is_up_to_date() {
    if cfg!(not(feature = "embree")) {
        eprintln!("skipped: the page has the default backend of a build with Embree");
        return;
    }
    let page = std::fs::read_to_string(
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs/guide/settings.md"),
    )
    .unwrap_or_default();
    let (code, made, err) = nearfar(&["settings", "--markdown"]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(made.lines().all(|l| l.chars().count() <= 100), "lines are too long");
    assert!(page == made, "run: nearfar settings --markdown > docs/guide/settings.md");
}

#[test]
fn settings_are_looked_up() {
    let (code, out, _) = nearfar(&["settings"]);
    assert!(code == 0 && out.lines().count() > 140, "{out}");
    let (code, out, _) = nearfar(&["settings", "path.target"]);
    assert_eq!(code, 0);
    let lines: Vec<&str> = out.lines().collect();
    assert!(
        lines[0].starts_with("key") && lines[1].starts_with("path.target_error  number  0 "),
        "{out}"
    );
    assert!(lines[2].contains("Stop once the estimated relMSE"), "{out}");
    let (code, out, _) = nearfar(&["settings", "proxy.estimate", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert!(
        code == 0
            && json[0]["key"] == "proxy.estimate"
            && json[0]["default"].as_str().unwrap().starts_with("follows: places; gather for")
            && json[0]["choices"][1]["name"] == "gather",
        "{out}"
    );
    let (code, _, err) = nearfar(&["settings", "recrod"]);
    assert!(code == 2 && err.contains("did you mean \"record\"?"), "{err}");
}

#[test]
fn every_command_checks_its_settings() {
    let folder = Folder::new("settings-check");
    let out = folder.at("o.exr");
    for arguments in [
        &["info", SCENE][..],
        &["export", SCENE, "-o", &folder.at("scene")],
        &["render", SCENE, "-o", &out],
        &["reference", SCENE, "-o", &out],
        &["fly", SCENE, "-o", &folder.at("film"), "--to-eye", "1,2,3"],
        &["bench", SCENE, "--backends"],
    ] {
        let with = |set: &str| nearfar(&[arguments, &["--set", set]].concat());
        let (code, _, err) = with("nonsense=1");
        assert!(code == 2 && err.contains("setting \"nonsense\": unknown key"), "{err}");
        let (code, _, err) = with("direct.light_samples=0");
        assert!(code == 2 && err.contains("setting \"direct.light_samples\": 0 is not"), "{err}");
    }
    assert!(std::fs::read_dir(&folder).unwrap().next().is_none());
}

/// Noise that stays on surfaces is a film's default; a scene file or the command line may want
/// another.
#[test]
fn a_film_keeps_the_near_noise_that_is_set() {
    let folder = Folder::new("settings-fly");
    let scene = folder.at("scene.toml");
    let text = std::fs::read_to_string(SCENE).unwrap();
    let here = PathBuf::from(SCENE).parent().unwrap().display().to_string();
    let noise = |set_in_file: bool, extra: &[&str]| {
        let settings = "\n[settings.decompose]\nnear_noise = \"point\"\n";
        let text = text.replace("file = \"", &format!("file = \"{here}/"));
        std::fs::write(&scene, if set_in_file { text + settings } else { text }).unwrap();
        let film = folder.at("film");
        let common = [
            "fly",
            "--replace",
            &scene,
            "-o",
            &film,
            "--to-eye",
            "278,273,-700",
            "--frames",
            "1",
            "--size",
            "8x8",
            "--spp",
            "1",
            "--set",
            "proxy.photons=1000",
            "--set",
            "decompose.rays=16",
            "-q",
        ];
        let (code, _, err) = nearfar(&[&common[..], extra].concat());
        assert_eq!((code, err.as_str()), (0, ""));
        let header = read_exr(&folder.join("film/frame_0001.exr")).unwrap().header;
        let line = header["nearfar.settings"].lines().find(|l| l.starts_with("near_noise"));
        line.map(str::to_owned)
    };
    assert_eq!(noise(false, &[]).as_deref(), Some("near_noise = \"world\""));
    assert_eq!(noise(true, &[]).as_deref(), Some("near_noise = \"point\""));
    let set = ["--set", "decompose.near_noise=pixel"];
    assert_eq!(noise(true, &set).as_deref(), Some("near_noise = \"pixel\""));
    assert_eq!(noise(false, &["--reuse", "none"]), None);
}

#[test]
fn a_wrong_setting_of_a_scene_file_is_told_with_its_line() {
    let folder = Folder::new("settings-lines");
    let scene = folder.at("scene.toml");
    let write = |settings: &str| {
        let mesh = SCENE.replace(".toml", ".obj");
        let text = format!("[[mesh]]\nfile = \"{mesh}\"\n\n[settings.decompose]\n{settings}\n");
        std::fs::write(&scene, text).unwrap();
    };
    for (settings, word) in [("rays = -3", "rays"), ("raiys = 3", "did you mean"), ("tau = 1", "")]
    {
        write(settings);
        let (code, _, err) = nearfar(&["info", &scene]);
        assert!(code == 2 && err.contains(&format!("{scene}:5: ")) && err.contains(word), "{err}");
    }
    write("rays = 3");
    let (code, _, err) = nearfar(&["info", &scene, "--set", "decompose.rays=-3"]);
    assert!(code == 2 && !err.contains("scene.toml:"), "{err}");
    let (code, _, err) = nearfar(&["settings", "photon.count"]);
    assert!(code == 2 && err.contains("proxy.photons"), "{err}");
}
