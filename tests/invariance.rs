//! Pictures do not depend on the unit of length, on where zero is and on which axis is upwards, and
//! no layer holds what is no light.

use glam::{Mat3, Vec3};
use nearfar::RenderConfig;
use nearfar::film::Film;
use nearfar::method::Method;
use nearfar::run::Run;
use nearfar::scene::{Light, Scene};

use crate::support::{quick, small_room};

const METHODS: [Method; 5] =
    [Method::Path, Method::Decomposition, Method::IrradianceCache, Method::Gather, Method::Direct];

/// The small room with every position `p` replaced by `turn · p · scale + shift`.
fn moved(turn: Mat3, scale: f32, shift: Vec3) -> Scene {
    let mut scene = small_room();
    let at = |p: Vec3| turn * p * scale + shift;
    for mesh in &mut scene.meshes {
        mesh.positions.iter_mut().for_each(|p| *p = at(*p));
    }
    let camera = &mut scene.camera;
    (camera.eye, camera.target, camera.up) = (at(camera.eye), at(camera.target), turn * camera.up);
    for light in &mut scene.lights {
        if let Light::Quad { corner, edge1, edge2, .. } = light {
            (*corner, *edge1, *edge2) = (at(*corner), turn * *edge1 * scale, turn * *edge2 * scale);
        }
    }
    scene
}

fn picture(scene: &Scene, method: Method, spp: u32) -> Film {
    picture_of_seed(scene, method, spp, 0)
}

fn picture_of_seed(scene: &Scene, method: Method, spp: u32, seed: u64) -> Film {
    let config = RenderConfig { seed, ..quick(spp) };
    nearfar::render(scene, &config, method, &Run::new(2).unwrap()).unwrap().film
}

fn mean(film: &Film) -> f64 {
    let all = film.rgb("").unwrap();
    all.iter().map(|c| f64::from(c.element_sum())).sum::<f64>() / all.len() as f64
}

/// A power of two changes the exponents of lengths and nothing else.
#[test]
fn powers_of_two_give_the_same_bits() {
    for method in METHODS {
        let plain = picture(&small_room(), method, 4);
        for scale in [1.0 / 1024.0, 4096.0] {
            let scaled = picture(&moved(Mat3::IDENTITY, scale, Vec3::ZERO), method, 4);
            assert!(plain.rgb("") == scaled.rgb(""), "{method:?} × {scale}");
        }
    }
}

/// Rounding moves a picture by less than a thousandth, where it does not decide which points share
/// light: other rays are shot then, and means over seeds agree.
#[test]
fn other_units_and_places_give_the_same_picture() {
    for method in METHODS {
        let shares = !matches!(method, Method::Path | Method::Direct);
        let (seeds, bound) = if shares { (4, 0.01) } else { (1, 1e-3) };
        let mean_of = |scene: &Scene| {
            let of_seed = |seed| mean(&picture_of_seed(scene, method, 64, seed));
            (0..seeds).map(of_seed).sum::<f64>() / seeds as f64
        };
        let plain = mean_of(&small_room());
        for (scale, shift) in [
            (1e-3, Vec3::ZERO),
            (1e3, Vec3::ZERO),
            (1e6, Vec3::ZERO),
            (1e-6, Vec3::ZERO),
            (1.0, Vec3::new(20.0, -10.0, 5.0)),
        ] {
            let found = mean_of(&moved(Mat3::IDENTITY, scale, shift));
            let error = (found / plain - 1.0).abs();
            assert!(error < bound, "{method:?} × {scale} + {shift}: {found}, not {plain}");
        }
    }
}

/// Mean and standard error of numbers.
fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// Methods that share light, over many seeds: mean and error against the truth, in other units, at
/// another place and turned, with their standard errors.
#[test]
#[ignore = "slow: minutes; a measurement"]
fn means_and_errors_of_methods_that_share() {
    const SEEDS: u64 = 24;
    let truth = picture(&small_room(), Method::Path, 16_384).rgb("").unwrap();
    let oblique = Mat3::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 1.0);
    let plain = (Mat3::IDENTITY, 1.0, Vec3::ZERO);
    let places = [
        ("plain", plain),
        ("× 1e-3", (Mat3::IDENTITY, 1e-3, Vec3::ZERO)),
        ("× 1e3", (Mat3::IDENTITY, 1e3, Vec3::ZERO)),
        ("shifted", (Mat3::IDENTITY, 1.0, Vec3::new(20.0, -10.0, 5.0))),
        ("turned", (oblique, 1.0, Vec3::ZERO)),
    ];
    let mut wrong = Vec::new();
    for method in [Method::Decomposition, Method::IrradianceCache, Method::Gather] {
        let mut first = None;
        for (name, (turn, scale, shift)) in places {
            let scene = moved(turn, scale, shift);
            let of_seed = |seed| {
                let film = picture_of_seed(&scene, method, 16, seed);
                let pixels = film.rgb("").unwrap();
                let squares = pixels.iter().zip(&truth).map(|(&c, &t)| {
                    f64::from(((c - t) * (c - t) / (t * t + 1e-4)).element_sum()) / 3.0
                });
                (mean(&film), squares.sum::<f64>() / pixels.len() as f64)
            };
            let (means, errors): (Vec<f64>, Vec<f64>) = (0..SEEDS).map(of_seed).unzip();
            let found = (mean_and_error(&means), mean_and_error(&errors));
            let ((m, dm), (e, de)) = *first.get_or_insert(found);
            let ((n, dn), (f, df)) = found;
            let (ratio, error) = (n / m - 1.0, dn.hypot(dm) / m);
            eprintln!(
                "{method:?} {name}: mean {ratio:+.5} ± {error:.5}, relMSE {f:.6} ± {df:.6} ({:+.1} \
                 standard errors)",
                (f - e) / df.hypot(de).max(1e-12)
            );
            // Three standard errors above what is allowed.
            if ratio.abs() > 1e-3 + 3.0 * error || (f - e).abs() > 4.0 * df.hypot(de) {
                wrong.push(format!("{method:?} {name}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Turned scenes have other random directions: their means agree within their noise.
#[test]
fn any_axis_may_be_upwards() {
    let axes = Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X);
    let oblique = Mat3::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 1.0);
    for method in METHODS {
        let plain = mean(&picture(&small_room(), method, 128));
        for turn in [axes, oblique] {
            let found = mean(&picture(&moved(turn, 1.0, Vec3::ZERO), method, 128));
            // Path tracing has 98,000 paths whose deviation is about 1.3 of their mean: 0.4 %;
            // the others are smoother.
            assert!((found / plain - 1.0).abs() < 0.015, "{method:?}: {found} {plain}");
        }
    }
}

/// Colours are finite and not negative in every layer of every method.
#[test]
fn every_layer_holds_light() {
    for method in Method::ALL {
        let film = picture(&small_room(), method, 2);
        for (name, values) in &film.channels {
            let colour = [".R", ".G", ".B"].iter().any(|c| name.ends_with(c))
                || ["R", "G", "B"].contains(&name.as_str());
            let signed = ["near", "far", "error"].iter().any(|layer| name.starts_with(layer));
            let bad = values.iter().find(|v| !v.is_finite() || (**v < 0.0 && !signed));
            assert!(!colour || bad.is_none(), "{method:?} {name} {bad:?}");
        }
    }
}
