//! Input that is absurd, broken or endless: told in words with exit code 2, and nothing is written.

use std::path::Path;

use crate::support::{Folder, program};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
const SKY: &str = "[[light]]\ntype = \"sky\"\nradiance = 1\n";

/// What is said of arguments that are refused; `{out}` is where nothing may be written.
fn refused(folder: &Folder, arguments: &[&str]) -> String {
    let out = folder.at("out.exr");
    let arguments: Vec<&str> =
        arguments.iter().map(|&a| if a == "{out}" { out.as_str() } else { a }).collect();
    let done = program(&arguments);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(2), "{arguments:?}: {said}");
    assert!(!Path::new(&out).exists(), "{arguments:?} left a file");
    said
}

/// What does not fit is refused before it is begun, by the machine's memory or the user's limit.
#[test]
fn memory_is_asked_for_before_it_is_taken() {
    let folder = Folder::new("hostile-memory");
    let scene = "scenes/cornell-box/cornell-box.toml";
    let render = ["render", scene, "-q", "-o", "{out}"];
    let more = |more: &[&str]| refused(&folder, &[&render[..], more].concat());
    let said = more(&["--size", "2048x2048", "--memory-limit", "300M"]);
    assert!(said.contains("picture of 2048×2048 pixels needs about 1.5 GB"), "{said}");
    let cells = ["--method", "photon-map", "--set", "decompose.near_cell=0.5"];
    let said = more(&[&cells[..], &["--memory-limit", "300M"]].concat());
    assert!(said.contains("use a larger length"), "{said}");
    assert!(more(&["--memory-limit", "much"]).contains("such as 8G"));
    let bake = ["cloud", "bake", scene, "-o", "{out}", "--elements", "9000000"];
    let said = refused(&folder, &[&bake[..], &["--memory-limit", "300M"]].concat());
    assert!(said.contains("a cloud of 9000000 elements needs about"), "{said}");
    let said = refused(&folder, &["bench", scene, "--rays", "1000000000000000000"]);
    assert!(said.contains("give fewer --rays"), "{said}");
}

/// A pipe without a writer would be waited for until the end of time.
#[cfg(unix)]
#[test]
fn pipes_are_refused() {
    let folder = Folder::new("hostile-pipes");
    let pipe = |name: &str| {
        let path = folder.at(name);
        assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
        path
    };
    let (exr, ply, toml) = (pipe("p.exr"), pipe("p.ply"), pipe("p.toml"));
    let cornell = "scenes/cornell-box/cornell-box.toml";
    let mut told = vec![
        refused(&folder, &["render", &toml, "-o", "{out}"]),
        refused(&folder, &["render", cornell, "--load-cache", &ply, "-o", "{out}"]),
        refused(&folder, &["compare", &exr, &exr]),
        refused(&folder, &["reference", cornell, "--resume", &exr, "-o", "{out}"]),
        refused(
            &folder,
            &["fly", cornell, "--to-eye", "0,0,9", "--load-cache", &ply, "-o", "{out}"],
        ),
        refused(&folder, &["fly", cornell, "--path", &toml, "--frames", "2", "-o", "{out}"]),
    ];
    for name in ["p.obj", "p.hair", "p.curves"] {
        pipe(name);
        let scene = folder.file("s.toml", format!("[[mesh]]\nfile = \"{name}\"\n{SKY}"));
        told.push(refused(&folder, &["render", &scene, "-o", "{out}"]));
    }
    pipe("p.png");
    folder.file("a.obj", SQUARE);
    let mesh = "[[mesh]]\nfile = \"a.obj\"\nmaterial = \"m\"\n";
    let texture = "[material.m]\nalbedo_texture = \"p.png\"\n";
    let scene = folder.file("s.toml", format!("{mesh}{SKY}{texture}"));
    told.push(refused(&folder, &["render", &scene, "-o", "{out}"]));
    for said in told {
        assert!(said.contains("is a pipe or a device"), "{said}");
    }
}

/// Files beside pictures are looked at as all others are.
#[cfg(unix)]
#[test]
fn pipes_beside_pictures_are_refused() {
    for name in ["report.toml", "a.json"] {
        let folder = Folder::new("hostile-report");
        let mut film = nearfar::film::Film::new(2, 1);
        film.set_rgb("", &[glam::Vec3::ONE; 2]);
        let picture = folder.join("a.exr");
        nearfar::film::write_exr(&film, &picture, nearfar::film::Precision::Full).unwrap();
        let pipe = folder.at(name);
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let said = refused(&folder, &["report", &folder.at("."), "-o", "{out}"]);
        assert!(said.contains(name) && said.contains("is a pipe or a device"), "{said}");
    }
}

/// What would be read as something else, or would leave single precision, is told where it stands.
#[test]
fn what_is_no_scene_is_told() {
    let folder = Folder::new("hostile-told");
    folder.file("a.obj", SQUARE);
    folder.file("empty.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n");
    let mesh = "[[mesh]]\nfile = \"a.obj\"\n";
    let said = |text: &str, overrides: &[(&str, &str)]| {
        let scene = folder.file("s.toml", text);
        let overrides: Vec<_> =
            overrides.iter().map(|&(k, v)| (k.to_owned(), v.to_owned())).collect();
        let error = nearfar::load::load(Path::new(&scene), &overrides).unwrap_err();
        folder.plain(&error.to_string())
    };
    let lit = format!("{mesh}{SKY}");
    for (text, expected) in [
        (format!("camera = [[0, 0, 3], [0, 0, 0]]\n{lit}"), "s.toml:1: camera is a table"),
        (format!("mesh = [[\"a.obj\"]]\n{SKY}"), "s.toml:1: mesh is a table"),
        (format!("{mesh}subdivision = [2]\n{SKY}"), "s.toml:3: subdivision is a table"),
        (format!("material = {{ m = [0.5] }}\n{lit}"), "s.toml:1: m is a table"),
        (format!("{mesh}{}", SKY.replace('1', "1e16")), "s.toml: a light of 1e16 is too bright"),
        (format!("{lit}[[mesh]]\nfile = \"empty.obj\"\n"), "empty.obj: holds no faces"),
    ] {
        let said = said(&text, &[]);
        assert!(said.starts_with(expected), "{said}");
    }
    let long = vec!["a"; 50_000].join(".");
    let key = |key: &str| said(&lit, &[(key, "1")]);
    assert!(key(&long).contains("more than 16 parts"));
    assert!(said(&lit, &[("camera", "[1]")]).contains("camera is a table"));
    assert!(nearfar::load::load(Path::new(&folder.file("s.toml", &lit)), &[]).is_ok());
}

/// Polygons of very many corners are cut, or refused; they do not take for ever.
#[test]
fn polygons_of_many_corners() {
    let folder = Folder::new("hostile-polygons");
    let polygon = |n: usize, radius: &dyn Fn(usize) -> f64| {
        let corner = |i: usize| {
            let (angle, r) = (i as f64 * std::f64::consts::TAU / n as f64, radius(i));
            format!("v {} {} 0\n", r * angle.cos(), r * angle.sin())
        };
        let face: String = (1..=n).map(|i| format!(" {i}")).collect();
        (0..n).map(corner).collect::<String>() + &format!("f{face}\n")
    };
    let load = |text: String| {
        folder.file("a.obj", text);
        let scene = folder.file("s.toml", format!("[[mesh]]\nfile = \"a.obj\"\n{SKY}"));
        nearfar::load::load(Path::new(&scene), &[])
    };
    let disc = load(polygon(100_000, &|_| 1.0)).unwrap().scene;
    assert_eq!(disc.meshes[0].triangles.len(), 99_998);
    let saw = load(polygon(100_000, &|i| 1.0 + 0.1 * (i % 2) as f64)).unwrap_err().to_string();
    assert!(saw.contains("a.obj: has polygons of very many corners"), "{saw}");
}

/// A scene of which nothing is seen shows its sky, by every method.
#[test]
fn invisible_scenes_show_the_sky() {
    let mut scene = crate::support::small_room();
    scene.materials.iter_mut().for_each(|m| m.opacity = 0.0);
    let radiance = nearfar::radiometry::Rgb::new(0.25, 0.5, 1.0);
    scene.lights = vec![nearfar::scene::Light::Sky { radiance }];
    let run = nearfar::run::Run::new(2).unwrap();
    for method in nearfar::method::Method::ALL {
        let found = nearfar::render(&scene, &crate::support::quick(2), method, &run);
        let film = found.unwrap_or_else(|e| panic!("{method:?}: {e}")).film;
        assert!(film.rgb("").unwrap().iter().all(|&c| c == radiance), "{method:?}");
    }
}

/// Very many of something small takes no longer than it must.
#[test]
fn long_camera_paths_are_read() {
    let folder = Folder::new("hostile-path");
    let keys: String = (0..100_000)
        .map(|i| format!("[[key]]\neye = [{i}, 0, 5]\ntarget = [{i}, 0, 0]\n"))
        .collect();
    let path = folder.file("p.toml", keys);
    let camera = nearfar::scene::Camera::default();
    let read =
        |path: &str| nearfar::load::load_camera_path(Path::new(path), &camera, glam::DVec3::ZERO);
    assert!((read(&path).unwrap().frame(1, 2).eye.x - 99_999.0).abs() < 1e-2);
    let last = format!("{}[[key]]\neye = [0, 0, 0]\ntarget = [0, 0, 0]\n", "\n\n".repeat(50));
    let said = read(&folder.file("q.toml", last)).unwrap_err().to_string();
    assert!(said.contains("q.toml:101:"), "{said}");
}

/// Surfaces whose area is lost in single precision are black to the methods that need area.
#[test]
fn hair_without_width_is_no_panic() {
    let folder = Folder::new("hostile-hair");
    folder.file("c.curves", "0 0 0 1e-30\n0 1 0 1e-30\n\n0 0 0 1e-30\n1 0 0 1e-30\n");
    let scene = folder.file("s.toml", format!("[[mesh]]\nfile = \"c.curves\"\n{SKY}"));
    for method in ["decomposition", "photon-map", "course", "gather"] {
        let out = folder.at("o.exr");
        let done =
            program(&["render", &scene, "-q", "--size", "16x12", "--method", method, "-o", &out]);
        assert!(done.status.success(), "{method}: {}", String::from_utf8_lossy(&done.stderr));
    }
}
