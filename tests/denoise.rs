//! `--denoise oidn` as a user types it: refused with a fix where the library is missing, less error
//! where it is there.

use std::process::{Command, Output};

use nearfar::compare::{Truth, compare};
use nearfar::ffi::oidn::{Denoiser, VARIABLE};
use nearfar::film::{Film, read_exr};
use nearfar::method::Method;

use crate::support::Folder;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box/cornell-box.toml");
const TRUTH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box/cornell-box.exr");

/// A folder of pictures.
struct Pictures(Folder);

impl Pictures {
    fn new(name: &str) -> Self {
        Self(Folder::new(&format!("denoise-{name}")))
    }
    /// Renders to NAME.exr with NAME.json beside it.
    fn render(&self, name: &str, variable: Option<&str>, more: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_nearfar"));
        command
            .args(["render", SCENE, "-q", "-o"])
            .arg(self.0.join(format!("{name}.exr")))
            .arg("--stats")
            .arg(self.0.join(format!("{name}.json")));
        if let Some(value) = variable {
            command.env(VARIABLE, value);
        }
        command.args(more).output().unwrap()
    }
    fn film(&self, name: &str, more: &[&str]) -> Film {
        let done = self.render(name, None, more);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        read_exr(&self.0.join(format!("{name}.exr"))).unwrap()
    }
}

fn bits(film: &Film, channel: &str) -> Vec<u32> {
    film.channels[channel].iter().map(|v| v.to_bits()).collect()
}

fn library() -> bool {
    let found = Denoiser::open(1);
    if let Err(error) = &found {
        eprintln!("skipped: {error}");
    }
    found.is_ok()
}

#[test]
fn without_the_library_nothing_is_rendered_and_the_fix_is_named() {
    let folder = Pictures::new("missing");
    for asked in [["--denoise", "oidn"], ["--set", "denoise=oidn"]] {
        let refused = folder.render("a", Some("/nowhere/lib"), &asked);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(
            refused.status.code() == Some(2)
                && said.contains("NEARFAR_OIDN=/nowhere/lib")
                && said.contains("unset it"),
            "{said}"
        );
        assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), 0);
    }
    let unknown = folder.render("a", None, &["--set", "denoise=magic"]);
    assert!(
        unknown.status.code() == Some(2)
            && String::from_utf8_lossy(&unknown.stderr).contains("setting \"denoise\"")
    );
}

#[test]
fn not_asked_for_it_changes_no_bit() {
    let folder = Pictures::new("none");
    let common = ["--size", "24x24", "--method", "path", "--spp", "2"];
    let plain = folder.film("plain", &common);
    let none = folder.film("none", &[&common[..], &["--denoise", "none"]].concat());
    assert!(
        plain.channels.keys().eq(none.channels.keys()) && !plain.channels.contains_key("noisy.R")
    );
    assert!(plain.channels.keys().all(|c| bits(&plain, c) == bits(&none, c)));
}

#[test]
fn path_tracing_loses_its_noise_and_keeps_it_beside() {
    if !library() {
        return;
    }
    let folder = Pictures::new("path");
    let common = ["--method", "path", "--spp", "16"];
    let noisy = folder.film("noisy", &common);
    let denoised = folder.film("denoised", &[&common[..], &["--denoise", "oidn"]].concat());
    let truth = Truth::read(TRUTH.as_ref()).unwrap();
    let error = |film: &Film| compare(film, SCENE.as_ref(), &truth).unwrap().errors;
    let (before, after) = (error(&noisy), error(&denoised));
    // Measured: 78 times less.
    assert!(
        after.relmse_trimmed < before.relmse_trimmed / 20.0,
        "{} to {}",
        before.relmse_trimmed,
        after.relmse_trimmed
    );
    assert!(after.bias.abs() < 0.01, "{}", after.bias);
    for c in ["R", "G", "B"] {
        assert_eq!(bits(&denoised, &format!("noisy.{c}")), bits(&noisy, c));
        assert_eq!(
            bits(&denoised, &format!("noisy.half0.{c}")),
            bits(&noisy, &format!("half0.{c}"))
        );
    }
    for c in ["direct.R", "indirect.G", "albedo.B", "N.X", "samples"] {
        assert_eq!(bits(&denoised, c), bits(&noisy, c), "{c}");
    }
    assert!(
        !denoised.channels.contains_key("half0.R") && !denoised.channels.contains_key("variance.R"),
        "they are not the denoised picture's"
    );
    assert!(denoised.header["nearfar.denoiser"].starts_with("Open Image Denoise 2."));
    let stats: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.0.join("denoised.json")).unwrap())
            .unwrap();
    assert!(
        stats["seconds"]["denoise"].as_f64().unwrap() > 0.0
            && stats["denoiser"] == denoised.header["nearfar.denoiser"],
        "{stats}"
    );
}

#[test]
fn every_method_takes_it() {
    if !library() {
        return;
    }
    let folder = Pictures::new("methods");
    for method in Method::ALL {
        let name = method.name();
        let method = name;
        let film = folder.film(
            method,
            &[
                "--size",
                "24x24",
                "--spp",
                "2",
                "--set",
                "proxy.photons=1000",
                "--method",
                method,
                "--denoise",
                "oidn",
                "--aov",
                "noisy",
            ],
        );
        assert!(
            film.channels.len() >= 6
                && film.channels.contains_key("noisy.R")
                && !film.channels.contains_key("albedo.R"),
            "{method}"
        );
        assert!(film.channels.values().flatten().all(|v| v.is_finite()), "{method}");
        assert_ne!(bits(&film, "R"), bits(&film, "noisy.R"), "{method}");
    }
}
