//! Guides change noise and nothing else: rays that go where light was found, lamps that are chosen
//! by what of them is seen.

use nearfar::RenderConfig;
use nearfar::accel::Backend;
use nearfar::film::Film;
use nearfar::guide::{Guide, LampGuide};
use nearfar::load::load;
use nearfar::method::Method;
use nearfar::method::final_gather::{Rays, gather};
use nearfar::method::stage::Stage;
use nearfar::radiometry::{Rgb, luminance};
use nearfar::record::ShadingPoints;
use nearfar::run::Run;
use nearfar::scene::Scene;
use nearfar::shading::World;

use crate::support::world;

/// A shipped scene as a small picture.
fn scene(name: &str, width: u32) -> Scene {
    let file = format!("{}/scenes/{name}/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let size = [("camera.width", width), ("camera.height", width * 9 / 16)];
    let overrides: Vec<(String, String)> =
        size.map(|(key, value)| (key.to_owned(), value.to_string())).into();
    load(file.as_ref(), &overrides).unwrap().scene
}

struct Found {
    bias: f64,
    /// Of the mean, from single points.
    standard_error: f64,
    mean_square: f64,
}

/// Relative to the mean of the truth.
fn compare(estimate: &[Rgb], truth: &[Rgb]) -> Found {
    let n = truth.len() as f64;
    let mean: f64 = truth.iter().map(|&e| f64::from(luminance(e))).sum::<f64>() / n;
    let errors: Vec<f64> =
        estimate.iter().zip(truth).map(|(&a, &b)| f64::from(luminance(a - b)) / mean).collect();
    let bias = errors.iter().sum::<f64>() / n;
    let mean_square = errors.iter().map(|e| e * e).sum::<f64>() / n;
    let variance = mean_square - bias * bias;
    Found { bias, standard_error: (variance / n).sqrt(), mean_square }
}

fn staged(scene: &Scene) -> (World, Stage, f32) {
    let w = world(scene, Backend::default());
    let config = RenderConfig::default();
    let inputs = config.inputs(w.around.extent);
    let stage = Stage::new(&w, inputs, &Run::new(2).unwrap()).unwrap();
    (w, stage, inputs.near_cell)
}

/// Every `step`-th point, so that neighbours are apart.
fn some(points: &ShadingPoints, step: usize) -> ShadingPoints {
    fn every<T: Copy>(values: &[T], step: usize) -> Vec<T> {
        values.iter().copied().step_by(step).collect()
    }
    ShadingPoints {
        p: every(&points.p, step),
        ng: every(&points.ng, step),
        ns: every(&points.ns, step),
        albedo_weight: every(&points.albedo_weight, step),
        pixel: every(&points.pixel, step),
        footprint: every(&points.footprint, step),
    }
}

#[test]
fn guided_rays_find_the_same_light_with_less_noise() {
    let (w, stage, size) = staged(&scene("sun-room", 80));
    let run = Run::new(2).unwrap();
    let points = some(&stage.samples.points, 3);
    let gathered = |rays, seed| gather(&w, &stage.proxy, &points, rays, seed, &run).unwrap();
    let truth = gathered(Rays::cosine(4096), 1);
    let guide = Guide::new(&w, &stage.proxy, size, 2, &run).unwrap();
    assert!(guide.len() > 50);
    let cosine = compare(&gathered(Rays::cosine(16), 3), &truth);
    let guided = compare(&gathered(Rays { count: 16, guide: Some((&guide, 0.5)) }, 3), &truth);
    for found in [&cosine, &guided] {
        assert!(
            found.bias.abs() < 4.0 * found.standard_error + 0.004,
            "{} {}",
            found.bias,
            found.standard_error
        );
    }
    // A single ray in a few thousand finds the sun's patch where no guide expects it and weighs as
    // much as all others: one seed alone says little.
    let of_seeds = |rays: Rays<'_>| -> f64 {
        (4..8)
            .map(|seed| {
                compare(&gather(&w, &stage.proxy, &points, rays, seed, &run).unwrap(), &truth)
                    .mean_square
            })
            .sum()
    };
    let (guided, cosine) =
        (of_seeds(Rays { count: 16, guide: Some((&guide, 0.5)) }), of_seeds(Rays::cosine(16)));
    assert!(guided < 0.75 * cosine, "{guided} {cosine}");
}

#[test]
fn lamps_chosen_by_sight_give_the_same_light_with_less_noise() {
    let scene = scene("lamp-hall", 96);
    let direct = |learned: bool, samples: u32, spp: u32, seed: u64| -> Vec<Rgb> {
        let mut config = RenderConfig { seed, ..RenderConfig::default() };
        (config.record.spp, config.direct.learned) = (spp, learned);
        config.direct.light_samples = Some(samples);
        let run = Run::new(2).unwrap();
        let film: Film = nearfar::render(&scene, &config, Method::Direct, &run).unwrap().film;
        film.rgb("direct").unwrap()
    };
    let truth = direct(false, 64, 64, 1);
    let plain = compare(&direct(false, 4, 16, 2), &truth);
    let learned = compare(&direct(true, 4, 16, 2), &truth);
    // Camera samples of the pixels differ too: edges are noise for both.
    assert!(learned.bias.abs() < 5.0 * learned.standard_error + 0.01, "{}", learned.bias);
    assert!(
        learned.mean_square < 0.75 * plain.mean_square,
        "{} {}",
        learned.mean_square,
        plain.mean_square
    );
}

#[test]
fn one_lamp_leaves_nothing_to_choose() {
    let w = world(&scene("cornell-box", 32), Backend::default());
    assert!(w.lights.choices() >= 2, "a quad is two triangles");
    let sun = world(&scene("sun-room", 32), Backend::default());
    assert!(LampGuide::new(&sun, 0.1, 0, &Run::new(1).unwrap()).unwrap().is_none());
}

#[test]
fn same_bits_for_any_number_of_threads() {
    let scene = scene("lamp-hall", 32);
    let picture = |threads: usize| {
        let mut config = RenderConfig::default();
        (config.record.spp, config.gather.rays) = (2, Some(4));
        let run = Run::new(threads).unwrap();
        nearfar::render(&scene, &config, Method::Gather, &run).unwrap().film.channels
    };
    assert_eq!(picture(1), picture(3));
}
