//! The programs of `examples/` do what they say. The test runner has built them beside this one.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::Folder;

/// Runs an example from the top of the checkout; its output.
fn example(name: &str, arguments: &[&str]) -> (bool, String) {
    let mut program = PathBuf::from(env!("CARGO_BIN_EXE_nearfar"));
    program.set_file_name("examples");
    program.push(name);
    let done = Command::new(&program)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments)
        .output()
        .unwrap_or_else(|e| panic!("{}: {e}; run the whole of `cargo test`", program.display()));
    let text =
        String::from_utf8_lossy(if done.status.success() { &done.stdout } else { &done.stderr });
    (done.status.success(), text.into_owned())
}

/// A scene of few pixels and samples.
fn small_scene(folder: &Path) -> String {
    let obj = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box/cornell-box.obj");
    let text = format!(
        "[camera]\neye = [278, 273, -800]\ntarget = [278, 273, 0]\nvfov_deg = 39\nwidth = 24\n\
         height = 24\n[[mesh]]\nfile = \"{obj}\"\n[settings.record]\nspp = 2\n[settings.proxy]\n\
         photons = 2000\n[settings.decompose]\nrays = 32\n[settings.gather]\nrays = 16\n"
    );
    let file = folder.join("small.toml");
    std::fs::write(&file, text).unwrap();
    file.to_str().unwrap().to_owned()
}

#[test]
fn render_writes_the_picture() {
    let folder = Folder::new("example-render");
    let (scene, out) = (small_scene(&folder), folder.join("a.exr"));
    let (ok, text) = example("render", &[&scene, out.to_str().unwrap()]);
    assert!(ok, "{text}");
    let film = nearfar::film::read_exr(&out).unwrap();
    assert_eq!((film.width, film.height), (24, 24));
    assert!(film.rgb("").unwrap().iter().any(|c| c.max_element() > 0.0));
    let own = std::fs::read_to_string("examples/render.rs").unwrap();
    let lines = own.lines().filter(|l| {
        let l = l.trim();
        !l.is_empty() && !l.starts_with("//") && !l.starts_with("use ")
    });
    assert!(lines.count() <= 15, "a library render is short");
}

#[test]
fn irradiance_tells_of_every_point() {
    let folder = Folder::new("example-irradiance");
    let (ok, text) = example("irradiance", &[&small_scene(&folder), "278,0.1,279", "100,0.1,100"]);
    assert!(ok, "{text}");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 2, "{text}");
    assert!(lines.iter().all(|l| l.contains("direct [") && l.contains("indirect [")), "{text}");
    let (ok, text) = example("irradiance", &[&small_scene(&folder), "1,2"]);
    assert!(!ok && text.contains("1,2"), "{text}");
}

/// An own backend meets what the built-in one meets, but for rays within rounding of an edge.
#[test]
fn an_own_backend_agrees_with_the_built_in_one() {
    let folder = Folder::new("example-backend");
    let (ok, text) = example("backend", &[&small_scene(&folder)]);
    assert!(ok, "{text}");
    let mut seen = 0;
    for line in text.lines() {
        let (_, hits) = line.split_once("hits ").unwrap();
        let (a, b) = hits.split_once(" and ").unwrap();
        let (a, b): (f64, f64) = (a.parse().unwrap(), b.parse().unwrap());
        assert!((a - b).abs() <= 1e-3 * a, "{line}");
        seen += 1;
    }
    assert!(seen >= 3, "{text}");
}
