//! `nearfar compare` as a user types it: what it prints, refuses and warns of.

use std::path::Path;
use std::process::Output;

use nearfar::film::{Film, Precision, write_exr};
use nearfar::radiometry::Rgb;

use crate::support::{Folder, program};

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn at(folder: &Path, name: &str) -> String {
    folder.join(name).display().to_string()
}

#[test]
fn compare_prints_judges_and_draws() {
    let folder = Folder::new("compare");
    let (a, b, diff) = (at(&folder, "a.exr"), at(&folder, "b.exr"), at(&folder, "d.png"));
    for (path, v) in [(&a, 1.1f32), (&b, 1.0)] {
        let mut film = Film::new(8, 8);
        film.set_rgb("", &[Rgb::splat(v); 64]);
        write_exr(&film, Path::new(path), Precision::Full).unwrap();
    }
    let same = program(&["compare", &a, &a, "--json", "--max-relmse", "0"]);
    assert_eq!(code(&same), 0);
    let figures: serde_json::Value = serde_json::from_slice(&same.stdout).unwrap();
    assert!(figures["relmse"] == 0.0 && figures["flip"] == 0.0 && figures["bias"] == 0.0);
    let differs = program(&["compare", &a, &b, "--output", &diff, "--max-relmse", "0.001"]);
    assert_eq!(code(&differs), 1);
    assert!(
        String::from_utf8_lossy(&differs.stdout).contains("relMSE                 0.0099"),
        "{differs:?}"
    );
    assert!(Path::new(&diff).is_file() && stderr(&differs).contains("allowed 0.001"));
    assert_eq!(code(&program(&["compare", &a, &b, "--max-relmse", "0.02"])), 0);
    for wrong in [["-o", "d.jpg"], ["--amplify", "nan"]] {
        let refused = program(&[["compare", &a, &b].as_slice(), &wrong].concat());
        assert_eq!(code(&refused), 2, "{wrong:?}");
    }
}

#[test]
fn compare_says_what_makes_its_figures_doubtful() {
    let folder = Folder::new("compare-doubtful");
    let grey = |v: f32| [Rgb::splat(v); 64];
    let write = |name: &str, v: f32, change: &dyn Fn(&mut Film)| {
        let mut film = Film::new(8, 8);
        film.set_rgb("", &grey(v));
        change(&mut film);
        let path = at(&folder, name);
        write_exr(&film, Path::new(&path), Precision::Full).unwrap();
        path
    };
    let of_seed = |seed: &'static str| {
        move |film: &mut Film| {
            film.header.insert("nearfar.method".into(), "path".into());
            film.header.insert("nearfar.seed".into(), seed.into());
        }
    };
    let picture = write("picture.exr", 1.1, &of_seed("3"));
    for (reference, said) in [
        (write("same.exr", 1.0, &of_seed("3")), "one method and one seed"),
        (write("other.exr", 1.0, &of_seed("4")), ""),
        (write("half.exr", 1.0, &|f| f.set_rgb("half0", &grey(1.0))), "one half without"),
        (write("black.exr", 0.0, &|_| ()), "is black"),
    ] {
        let told = stderr(&program(&["compare", &picture, &reference]));
        let right = if said.is_empty() { told.is_empty() } else { told.contains(said) };
        assert!(right, "{reference}: {told}");
    }
}
