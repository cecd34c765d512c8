//! The path tracer against images of an independent renderer: per-pixel Z-tests with Šidák's
//! correction, and the mean.

use std::path::Path;

use nearfar::accel::Backend;
use nearfar::film::{Film, Precision, read_exr, write_exr, write_png, write_png_rgb};
use nearfar::load::load;
use nearfar::method::path::{PathSettings, render};
use nearfar::radiometry::Rgb;
use nearfar::run::Run;
use nearfar::shading::World;

use crate::support::shared;

/// Chance that a correct renderer fails one picture: over all channels of all pixels.
const SIGNIFICANCE: f64 = 0.01;

/// z beyond which |N(0, 1)| lies with probability `p`; by bisection on the tail's continued
/// fraction, good for z > 2.
fn critical(p: f64) -> f64 {
    let tail = |z: f64| {
        let fraction = (1..60).rev().fold(z, |f, k| z + f64::from(k) / f);
        2.0 * (-z * z / 2.0).exp() / (2.0 * std::f64::consts::PI).sqrt() / fraction
    };
    let (mut low, mut high) = (2.0, 12.0);
    for _ in 0..80 {
        let z = 0.5 * (low + high);
        if tail(z) > p { low = z } else { high = z }
    }
    low
}

#[test]
fn critical_values() {
    assert!((critical(0.0026998) - 3.0).abs() < 1e-4 && (critical(5.733e-7) - 5.0).abs() < 1e-4);
}

/// Whose variance the test trusts.
#[derive(Clone, Copy, PartialEq)]
enum Trust {
    /// Our own sample variance alone: needs thousands of samples.
    Own,
    /// The larger of ours and the reference's, scaled to our number of samples.
    Larger,
}

fn agrees(name: &str, spp: u32, trust: Trust) {
    let Some((film, verdict, reference)) =
        judged(name, PathSettings { spp, ..PathSettings::default() }, trust)
    else {
        return;
    };
    eprintln!("{name} at {spp} spp: {verdict}");
    if !verdict.passed() {
        keep(name, &film, &reference);
        panic!("{name}: {verdict}; see target/truth/{name}.*");
    }
}

fn judged(name: &str, settings: PathSettings, trust: Trust) -> Option<(Film, Verdict, Film)> {
    let shared = shared()?;
    let folder = shared.join("references");
    let reference = read_exr(&folder.join(format!("{name}.exr"))).unwrap();
    let variance = read_exr(&folder.join(format!("{name}.var.exr"))).unwrap();
    let scene =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references").join(format!("{name}.toml"));
    let run = Run::new(0).unwrap();
    let world = World::new(&load(&scene, &[]).unwrap().scene, Backend::default(), &run).unwrap();
    let film = render(&world, &settings, 1, &run).unwrap().film;
    let told: serde_json::Value = serde_json::from_str(
        &std::fs::read_to_string(folder.join(format!("{name}.json"))).unwrap(),
    )
    .unwrap();
    let reference_spp = told["spp"].as_f64().or(told["spp_about"].as_f64()).unwrap();
    let ratio =
        if trust == Trust::Own { 0.0 } else { (reference_spp / f64::from(settings.spp)) as f32 };
    let verdict = verdict(&film, &reference, &variance, ratio);
    Some((film, verdict, reference))
}

struct Verdict {
    share: f64,
    deviation: f64,
    sigma: f64,
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{:.3} % of the pixels pass, mean off by {:+.3} % ({:+.2} standard errors)",
            self.share * 100.0,
            self.deviation * 100.0,
            self.deviation / self.sigma
        )
    }
}

impl Verdict {
    fn passed(&self) -> bool {
        self.share >= 0.9975
            && (self.deviation.abs() < 0.003 || self.deviation.abs() < 3.0 * self.sigma)
    }
}

/// `samples_ratio`: samples per pixel of the reference over ours.
fn verdict(film: &Film, reference: &Film, variance: &Film, samples_ratio: f32) -> Verdict {
    let (ours, theirs) = (film.rgb("").unwrap(), reference.rgb("").unwrap());
    let (our_variance, their_variance) = (film.rgb("variance").unwrap(), variance.rgb("").unwrap());
    assert_eq!(ours.len(), theirs.len());
    let n = ours.len() as f64;
    let z = critical(1.0 - (1.0 - SIGNIFICANCE).powf(1.0 / (3.0 * n)));
    let (mut passed, mut difference, mut total, mut spread) = (0.0, 0.0, 0.0, 0.0);
    for i in 0..ours.len() {
        let d = (ours[i] - theirs[i]).as_dvec3();
        // A few samples that all missed the light know nothing of their own variance: the
        // reference's samples, thousands of the same kind, tell it better. The larger of both
        // counts.
        let v = our_variance[i].max(their_variance[i] * samples_ratio).as_dvec3()
            + their_variance[i].as_dvec3();
        // A picture stored in 32 bits is not better than its last digits.
        let rounding = (theirs[i].as_dvec3() * 1e-5).abs();
        passed += f64::from(u8::from((0..3).all(|c| d[c].abs() <= z * v[c].sqrt() + rounding[c])));
        difference += d.element_sum();
        total += theirs[i].as_dvec3().element_sum();
        // The channels of a pixel share their samples: at worst they err together.
        spread += (0..3).map(|c| v[c].sqrt()).sum::<f64>().powi(2);
    }
    Verdict { share: passed / n, deviation: difference / total, sigma: spread.sqrt() / total }
}

fn keep(name: &str, film: &Film, reference: &Film) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/truth");
    std::fs::create_dir_all(&folder).unwrap();
    let at = |end: &str| folder.join(format!("{name}.{end}"));
    write_exr(film, &at("ours.exr"), Precision::Full).unwrap();
    write_png(film, &at("ours.png"), 1.0).unwrap();
    write_png(reference, &at("reference.png"), 1.0).unwrap();
    let difference: Vec<Rgb> = film
        .rgb("")
        .unwrap()
        .iter()
        .zip(reference.rgb("").unwrap())
        .map(|(a, b)| (*a - b).abs() * 4.0)
        .collect();
    write_png_rgb(&difference, film.width, film.height, &at("difference.png"), 1.0).unwrap();
}

#[test]
fn cornell() {
    agrees("cornell", 64, Trust::Larger);
}

#[test]
fn sponza_day() {
    agrees("sponza_day", 64, Trust::Larger);
}

#[test]
fn sponza_night() {
    agrees("sponza_night", 64, Trust::Larger);
}

#[test]
fn veach_ajar() {
    agrees("veach_ajar", 128, Trust::Larger);
}

#[test]
fn the_test_sees_a_missing_bounce() {
    let Some((_, verdict, _)) = judged(
        "cornell",
        PathSettings { spp: 16, max_depth: 4, ..PathSettings::default() },
        Trust::Larger,
    ) else {
        return;
    };
    assert!(!verdict.passed(), "{verdict}");
}

#[test]
#[ignore = "slow: minutes of path tracing for every reference"]
fn all_references_at_full_quality() {
    for (name, spp) in
        [("cornell", 1024), ("sponza_day", 512), ("sponza_night", 512), ("veach_ajar", 1024)]
    {
        agrees(name, spp, Trust::Own);
    }
}
