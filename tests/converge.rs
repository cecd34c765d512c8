//! The picture that converges: unbiased at weight one whatever the model, better by default, and
//! honest about its error.

use nearfar::accel::Backend;
use nearfar::compare::{Truth, errors};
use nearfar::film::Film;
use nearfar::method::converge::{Certificate, ConvergeSettings, Halves, Weight, render};
use nearfar::method::locations::Locations;
use nearfar::method::path::{PathSettings, Progress, reference};
use nearfar::method::{MethodStatistics, Rendered};
use nearfar::radiometry::Rgb;
use nearfar::run::Run;
use nearfar::scene::Scene;
use nearfar::shading::World;

use crate::support::{small_room, world};

/// A film as the picture of a method that counts nothing.
fn model_of(film: Film) -> Rendered {
    let statistics = MethodStatistics::Direct {};
    Rendered { film, statistics, locations: Locations::default() }
}

fn room(width: u32, height: u32) -> Scene {
    let mut scene = small_room();
    (scene.camera.width, scene.camera.height) = (width, height);
    scene
}

fn trace(world: &World, seed: u64, spp: u32, earlier: Option<&Film>, run: &Run) -> Film {
    let progress = Progress { earlier, keep_state: true, pause: None };
    reference(world, &PathSettings { spp, ..PathSettings::default() }, seed, run, progress)
        .unwrap()
        .film
}

/// The truth, changed as asked: a model whose error is known.
fn model(truth: &Film, change: impl Fn(usize, Rgb) -> Rgb) -> Film {
    let mut film = truth.clone();
    let beauty: Vec<Rgb> =
        truth.rgb("").unwrap().into_iter().enumerate().map(|(i, c)| change(i, c)).collect();
    film.set_rgb("", &beauty);
    film
}

/// The converged picture, and its certificate where there is one.
fn converge(
    world: &World,
    model: &Film,
    settings: &ConvergeSettings,
    seed: u64,
) -> (Film, Option<Certificate>) {
    let run = Run::new(2).unwrap();
    let start = model_of(model.clone());
    let (found, figures) = render(
        start,
        &mut Halves::default(),
        settings,
        &mut |half, halves, spp| {
            let seed = 1000 + 2 * seed + half as u64;
            Ok(trace(world, seed, spp, halves[half].as_ref(), &run))
        },
        &run,
    )
    .unwrap();
    (found.film, figures.certificate)
}

fn relmse(film: &Film, truth: &Film) -> f64 {
    let exact = Truth::exact(truth.width, truth.height, &truth.rgb("").unwrap());
    errors(&film.rgb("").unwrap(), &exact).relmse
}

/// Largest |z| over the pixels of the mean over seeds against the truth.
fn worst_z(size: u32, truth_spp: u32, seeds: u64, change: impl Fn(usize, Rgb) -> Rgb) -> f64 {
    let world = world(&room(size, size), Backend::Bvh);
    let truth = trace(&world, 1, truth_spp, None, &Run::new(2).unwrap());
    let model = model(&truth, change);
    let settings = ConvergeSettings { spp: 8, weight: Weight::One, ..ConvergeSettings::default() };
    let count = (size * size) as usize;
    let (mut sum, mut square) = (vec![0.0f64; count], vec![0.0f64; count]);
    for seed in 0..seeds {
        for (i, c) in
            converge(&world, &model, &settings, seed).0.rgb("").unwrap().iter().enumerate()
        {
            sum[i] += f64::from(c.y);
            square[i] += f64::from(c.y).powi(2);
        }
    }
    let n = seeds as f64;
    let (expected, variance) = (truth.rgb("").unwrap(), truth.rgb("variance").unwrap());
    let z = |i: usize| {
        let mean = sum[i] / n;
        let error = (square[i] / n - mean * mean).max(0.0) / (n - 1.0) + f64::from(variance[i].y);
        (mean - f64::from(expected[i].y)).abs() / error.sqrt().max(1e-12)
    };
    (0..count).map(z).fold(0.0, f64::max)
}

/// Two-sided 0.1 % over 64 (256) pixels is z = 4.3 (4.6); the tails of few seeds are wider than
/// normal.
#[test]
fn weight_one_is_unbiased_whatever_the_model() {
    for (name, z) in [
        ("half", worst_z(8, 2048, 64, |_, c| c * 0.5)),
        ("stripes", worst_z(8, 2048, 64, |i, c| c + Rgb::splat((i % 3) as f32))),
    ] {
        assert!(z < 5.0, "{name}: z = {z}");
    }
}

#[test]
#[ignore = "slow: 1000 renders for the Z-test"]
fn weight_one_is_unbiased_over_many_seeds() {
    for z in [
        worst_z(16, 65_536, 500, |_, c| c * 0.5),
        worst_z(16, 65_536, 500, |i, c| c + Rgb::splat((i % 5) as f32)),
    ] {
        assert!(z < 4.6, "z = {z}");
    }
}

#[test]
fn error_falls_stays_below_both_and_is_certified() {
    let world = world(&room(48, 32), Backend::Bvh);
    let truth = trace(&world, 1, 2048, None, &Run::new(2).unwrap());
    // Ten per cent too dark, and a gradient across: what proxies get wrong.
    let start = model(&truth, |i, c| c * (0.85 + 0.1 * (i % 48) as f32 / 48.0));
    let model_error = relmse(&start, &truth);
    let mut errors = Vec::new();
    for spp in [8, 32, 128] {
        let at = |weight| {
            converge(
                &world,
                &start,
                &ConvergeSettings { spp, weight, ..ConvergeSettings::default() },
                3,
            )
        };
        let ((found, certificate), (plain, _)) = (at(Weight::Shrink), at(Weight::One));
        let error = relmse(&found, &truth);
        let best = model_error.min(relmse(&plain, &truth));
        let claimed = certificate.unwrap().relmse;
        eprintln!(
            "{spp} spp: {error:.5}, certified {claimed:.5}; model {model_error:.5}, path {:.5}",
            relmse(&plain, &truth)
        );
        assert!(error < 1.25 * best, "{spp} spp: {error} against {best}");
        if spp > 8 {
            assert!(
                claimed < 2.5 * error && error < 2.5 * claimed,
                "{spp} spp: certified {claimed}, true {error}"
            );
        }
        errors.push(error);
    }
    assert!(errors.windows(2).all(|w| w[1] < w[0]), "{errors:?}");
}

#[test]
fn a_cancelled_run_is_the_model() {
    let world = world(&room(16, 12), Backend::Bvh);
    let run = Run::new(1).unwrap();
    let film = trace(&world, 1, 4, None, &run);
    run.cancel_flag().store(true, std::sync::atomic::Ordering::SeqCst);
    let start = model_of(film.clone());
    let (mut halves, settings) = (Halves::default(), ConvergeSettings::default());
    let (kept, _) =
        render(start, &mut halves, &settings, &mut |_, _, _| unreachable!(), &run).unwrap();
    assert_eq!(kept.film.rgb(""), film.rgb(""));
}
