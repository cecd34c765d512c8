//! The decomposition's error against ground truth falls with each knob that spends time, and has a
//! minimum in alpha.

use nearfar::compare::{Halves, Reference, Truth, errors};
use nearfar::length::Length;
use nearfar::method::decompose::{DecomposeSettings, render};
use nearfar::method::path::{self, PathSettings};
use nearfar::method::stage::Inputs;
use nearfar::proxy::{Estimate, ProxySettings};
use nearfar::record::RecordSettings;
use nearfar::run::Run;
use nearfar::shading::{DirectSettings, World};

use crate::support::{backends, small_room, world};

struct Bench {
    world: World,
    run: Run,
    truth: Truth,
}

impl Bench {
    /// The small room, path traced far below the errors that are compared.
    fn new() -> Self {
        let world = world(&small_room(), *backends().last().unwrap());
        let run = Run::new(2).unwrap();
        let film =
            path::render(&world, &PathSettings { spp: 2048, ..PathSettings::default() }, 1, &run)
                .unwrap()
                .film;
        let halves = Halves(film.rgb("half0").unwrap(), film.rgb("half1").unwrap());
        let exact = Truth::exact(film.width, film.height, &film.rgb("").unwrap());
        let reference = Reference { halves: Some(halves), ..exact.reference().clone() };
        Self { world, run, truth: Truth::new(reference, None).unwrap() }
    }

    /// relMSE of the final image, mean over seeds (one picture's error is itself random).
    fn error(&self, decompose: &DecomposeSettings, photon: &ProxySettings) -> f64 {
        let (record, direct) = (
            RecordSettings { spp: 16, ..RecordSettings::default() },
            DirectSettings { light_samples: Some(16), ..DirectSettings::default() },
        );
        let seeds = 3;
        let one = |seed| {
            let near_cell = decompose.lengths(self.world.diagonal).near_cell;
            let inputs = Inputs { near_cell, photon, record: &record, direct: &direct, seed };
            let film = render(&self.world, decompose, inputs, &self.run).unwrap().film;
            errors(&film.rgb("").unwrap(), &self.truth).relmse
        };
        (0..seeds).map(one).sum::<f64>() / seeds as f64
    }
}

fn settings() -> DecomposeSettings {
    DecomposeSettings {
        alpha: Length::Percent(6.0),
        cluster_radius: Some(Length::Percent(4.0)),
        rays: 1024,
        ..DecomposeSettings::default()
    }
}

/// Each entry must be at most `ratio` of the one before.
fn falls(name: &str, errors: &[f64], ratio: f64) {
    eprintln!("{name}: {errors:.6?}");
    assert!(
        errors.windows(2).all(|e| e[1] < ratio * e[0]),
        "{name}: {errors:?} does not fall by {ratio} a step"
    );
}

#[test]
fn error_falls_with_rays_photons_and_clusters_and_alpha_has_a_minimum() {
    let bench = Bench::new();
    let photon = ProxySettings { photons: 100_000, ..ProxySettings::default() };
    let rays =
        [12, 48, 192].map(|rays| bench.error(&DecomposeSettings { rays, ..settings() }, &photon));
    falls("rays 12, 48, 192", &rays, 0.7);
    let photons = [300, 3000, 30_000].map(|count| {
        bench.error(
            &settings(),
            &ProxySettings { photons: count, estimate: Some(Estimate::Cells), ..photon.clone() },
        )
    });
    falls("photons 300, 3000, 30000", &photons, 0.7);
    let radius = [24.0, 12.0, 6.0].map(|p| {
        bench.error(
            &DecomposeSettings { cluster_radius: Some(Length::Percent(p)), ..settings() },
            &photon,
        )
    });
    falls("cluster radius 24 %, 12 %, 6 %", &radius, 0.8);
    let alpha = [0.0, 6.0, 300.0].map(|p| {
        bench.error(
            &DecomposeSettings {
                alpha: Length::Percent(p),
                near_cell: Some(Length::Percent(3.0)),
                ..settings()
            },
            &photon,
        )
    });
    eprintln!("alpha 0, 6 %, 300 %: {alpha:.6?}");
    assert!(alpha[1] < alpha[0] && alpha[1] < alpha[2], "a middle alpha is best: {alpha:?}");
}
