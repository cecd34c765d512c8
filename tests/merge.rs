//! Ground truths of one scene and different seeds become one, by adding their samples; what does
//! not belong together is refused.

use nearfar::Scene;
use nearfar::film::Film;
use nearfar::method::path::{self, PathSettings, Progress};
use nearfar::run::Run;
use nearfar::scene::Camera;

use crate::support::{Folder, backends, program, small_room, world};

fn scene() -> Scene {
    let mut scene = small_room();
    (scene.camera.width, scene.camera.height) = (10, 7);
    scene
}

fn traced(scene: &Scene, spp: u32, seed: u64, max_depth: u32) -> Film {
    let world = world(scene, backends()[0]);
    let settings = PathSettings { spp, max_depth, ..PathSettings::default() };
    let progress = Progress { keep_state: true, ..Progress::default() };
    path::reference(&world, &settings, seed, &Run::new(2).unwrap(), progress).unwrap().film
}

/// Relative to the size of the numbers.
fn close(a: &[f32], b: impl Iterator<Item = f64>, what: &str) {
    for (i, (&a, b)) in a.iter().zip(b).enumerate() {
        assert!((f64::from(a) - b).abs() <= 1e-5 * b.abs().max(1e-6), "{what} {i}: {a} {b}");
    }
}

#[test]
fn merged_pictures_are_the_mean_weighted_by_samples() {
    let scene = scene();
    for (n, m) in [(8, 8), (5, 3), (2, 9)] {
        let (a, b) = (traced(&scene, n, 1, 0), traced(&scene, m, 2, 0));
        let merged = path::merge(&[a.clone(), b.clone()]).unwrap();
        let (n, m) = (f64::from(n), f64::from(m));
        for name in ["R", "G", "B", "direct.G", "indirect.B", "emission.R"] {
            let of = |film: &Film| film.channels[name].clone();
            let pairs = of(&a).into_iter().zip(of(&b));
            let mean = pairs.map(|(a, b)| (n * f64::from(a) + m * f64::from(b)) / (n + m));
            close(&merged.channels[name], mean, name);
        }
        assert!(merged.channels["samples"].iter().all(|&s| f64::from(s) == n + m));
        // Variance of the mean: sums of squares about the common mean.
        let channel = |film: &Film, name: &str, i: usize| f64::from(film.channels[name][i]);
        for i in 0..70 {
            let squares = |film: &Film, n: f64| {
                channel(film, "variance.G", i) * n * (n - 1.0) + n * channel(film, "G", i).powi(2)
            };
            let all = squares(&a, n) + squares(&b, m) - (n + m) * channel(&merged, "G", i).powi(2);
            let expected = all.max(0.0) / (n + m - 1.0) / (n + m);
            let found = channel(&merged, "variance.G", i);
            let scale = channel(&merged, "G", i).powi(2);
            assert!((found - expected).abs() <= 1e-4 * expected + 1e-6 * scale, "{i}");
        }
        // The halves are means of disjoint halves of all samples.
        let halves = [("half0.G", ((n + m) / 2.0).ceil()), ("half1.G", ((n + m) / 2.0).floor())];
        let sum = |i: usize| halves.iter().map(|(h, n)| n * channel(&merged, h, i)).sum::<f64>();
        let beauty = &merged.channels["G"];
        close(beauty, (0..70).map(|i| sum(i) / (n + m)), "halves");
        assert_eq!(merged.header["nearfar.seed"], "1+2");
    }
}

#[test]
fn the_order_does_not_matter_and_merged_pictures_merge_again() {
    let scene = scene();
    let films = [3, 1, 2].map(|seed| traced(&scene, 2 + seed as u32, seed, 0));
    let [c, a, b] = films.clone();
    let all = path::merge(&films).unwrap();
    let others = path::merge(&[b.clone(), c.clone(), a.clone()]).unwrap();
    assert_eq!(all.channels, others.channels);
    let two = path::merge(&[a.clone(), b]).unwrap();
    let again = path::merge(&[c, two.clone()]).unwrap();
    assert_eq!(again.channels, all.channels);
    assert_eq!(again.header, all.header);
    assert_eq!(all.header["nearfar.seed"], "1+2+3");
    let twice = path::merge(&[two, a]).unwrap_err().to_string();
    assert!(twice.contains("seed 1 comes twice"), "{twice}");
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let scene = scene();
    let film = traced(&scene, 2, 1, 0);
    let refused =
        |other: &Film| path::merge(&[film.clone(), other.clone()]).unwrap_err().to_string();
    assert!(refused(&traced(&scene, 3, 1, 0)).contains("seed 1 comes twice"));
    assert!(refused(&traced(&scene, 2, 2, 3)).contains("path settings"));
    let mut moved = scene.clone();
    moved.camera = Camera { vfov_deg: 70.0, ..scene.camera.clone() };
    assert!(refused(&traced(&moved, 2, 2, 0)).contains("another scene or camera"));
    let mut lighter = scene.clone();
    lighter.materials[0].albedo *= 1.01;
    assert!(refused(&traced(&lighter, 2, 2, 0)).contains("another scene or camera"));
    let mut bare = traced(&scene, 2, 2, 0);
    bare.forget_sums();
    assert!(refused(&bare).contains("without its running sums"));
    bare.header.remove(path::KEY);
    assert!(refused(&bare).contains("not made by path tracing"));
    assert!(path::merge(&[film]).unwrap_err().to_string().contains("two pictures"));
}

const SCENE: &str = "scenes/cornell-box/cornell-box.toml";

#[test]
fn the_command_merges_and_refuses_in_words() {
    let folder = Folder::new("merge");
    let (a, b, out) = (folder.at("a.exr"), folder.at("b.exr"), folder.at("c.exr"));
    let small = ["--size", "12x9", "-q"];
    for (file, seed) in [(&a, "1"), (&b, "2")] {
        let made = ["reference", SCENE, "--spp", "3", "--seed", seed, "-o", file];
        assert_eq!(program(&[&made[..], &small].concat()).status.code(), Some(0));
    }
    let done = program(&["merge", &a, &b, "-o", &out, "--png"]);
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    assert_eq!(String::from_utf8_lossy(&done.stdout), "6 samples a pixel, seeds 1+2\n");
    assert_eq!(folder.names(), ["a.exr", "b.exr", "c.exr", "c.png"]);
    for (words, reason) in [
        (vec!["merge", &a, &a, "-o", &out], "seed 1 comes twice"),
        (vec!["merge", &a, &out, "-o", &b], "seed 1 comes twice"),
        (vec!["reference", SCENE, "--spp", "9", "-o", &b, "--resume", &out], "several seeds"),
        (vec!["merge", &a, "-o", &out], "required"),
    ] {
        let words = if words[0] == "merge" { words } else { [&words[..], &small].concat() };
        let refused = program(&words);
        let text = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{words:?}: {text}");
        assert!(text.contains(reason), "{words:?}: {text}");
    }
}
