//! Unidirectional path tracing: the ground truth.
//!
//! Computes   L(x, ωo) = Le + ∫ (albedo/π) L(x', −ωi) cos θi dωi, averaged over every pixel by the
//!            pixel filter.
//! Source     `[Veach97]` §9.2 (power heuristic), `[Burley20]` (Owen-scrambled Sobol).
//! Input      [`World`]. Output  [`Rendered`] with layers: beauty, emission (lights and background
//!            seen directly), direct, indirect, albedo, N, P, depth, variance (of the mean),
//!            samples, and two independent halves.
//! Method     Every bounce: one shadow ray to a light (not the sky) and one cosine-distributed ray,
//!            combined by the power heuristic; the sky is found by cosine-distributed rays alone.
//!            Russian roulette from the third bounce on, by throughput. Sample i of a pixel belongs
//!            to half i mod 2, and each half has its own Sobol key: the halves are independent.
//!            Guarantees unbiased; the same bits for any thread count and any division into passes
//!            or resumed runs, because every pixel adds its samples one after another and every
//!            running sum is kept to what two f32 hold (`pixels`).
//! Not        the same bits for two ray backends. `variance` is the sample variance over n: an
//!            upper bound, since Sobol points do better.
//! Cost       O(pixels · spp · path length) rays; 240 B per pixel.
//! Knobs      [`PathSettings`].

mod pixels;
mod resume;
mod trace;

use std::time::Instant;

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::method::locations::Locations;
use crate::method::{MethodStatistics, Rendered};
use crate::run::{RayKind, Run};
use crate::sampling::PixelFilter;
use crate::settings::section;
use crate::shading::World;
pub use pixels::LAYERS;
use pixels::Pixel;

section! {
    /// Path tracing.
    pub struct PathSettings in "path" {
        /// Samples per pixel; the render stops there at the latest.
        spp: u32 = 256, in from(1.0), unit "samples per pixel";
        /// Longest path in surface points (1: direct light only); 0: unbounded.
        max_depth: u32 = 0, unit "surface points";
        /// Stop once the estimated relMSE of the image's own noise is below this; 0: never.
        target_error: f64 = 0.0, unit "relMSE";
        /// First bounce at which a path may end by Russian roulette.
        roulette_from: u32 = 3, unit "bounces";
    } also {
        /// Pixel filter: the one of `record.filter`.
        filter: PixelFilter = PixelFilter::default();
    }
}

/// What path tracing tells of its picture.
#[derive(Clone, Debug, serde::Serialize)]
pub struct PathStatistics {
    /// Samples of the pixel that has fewest.
    pub spp: u32,
    /// Estimated relMSE of the picture's own noise.
    pub noise_relmse: f64,
}

/// Pixels worked on as one task.
const BLOCK: usize = 64;
/// Most samples per pixel between two looks at the error.
const MAX_PASS: u32 = 32;

/// Path traces the view until `settings.spp`, `settings.target_error`, the run's deadline, or
/// cancelling; keeps what was done.
///
/// # Errors
/// [`Error::Setting`] for settings out of range; [`Error::Interrupted`] when cancelled before the
/// first sample.
pub fn render(world: &World, settings: &PathSettings, seed: u64, run: &Run) -> Result<Rendered> {
    reference(world, settings, seed, run, None, false)
}

/// As [`render`]; continues `earlier` (a film this function made with `keep_state`) as if it had
/// never stopped, and with `keep_state` adds the running sums to the film (layers `state.*`).
///
/// # Errors
/// As [`render`], and [`Error::Usage`] when `earlier` is of another scene, size, seed, or setting
/// that changes samples.
pub fn reference(
    world: &World,
    settings: &PathSettings,
    seed: u64,
    run: &Run,
    earlier: Option<&crate::film::Film>,
    keep_state: bool,
) -> Result<Rendered> {
    settings.validate()?;
    let (width, height) = (world.camera.width, world.camera.height);
    let count = width as usize * height as usize;
    let key = resume::fingerprint(world, settings, seed);
    let mut pixels = match earlier {
        Some(film) => resume::pixels_from(film, &key, width, height)?,
        None => vec![Pixel::default(); count],
    };
    let view = trace::View::new(world, settings, seed);
    let phase = run.phase("sample", u64::from(settings.spp) * count as u64);
    let mut error = f64::INFINITY;
    let mut pass = 1;
    let mut fewest = pixels.iter().map(|p| p.count).min().unwrap_or(0);
    phase.advance(u64::from(fewest) * count as u64);
    while fewest < settings.spp {
        let until = (fewest + pass).min(settings.spp);
        run.install(|| {
            pixels.par_chunks_mut(BLOCK).enumerate().for_each(|(block, chunk)| {
                let mut rays = trace::Rays::default();
                let mut done = 0;
                for (k, pixel) in chunk.iter_mut().enumerate() {
                    if run.cancelled()
                        || (pixel.count > 0 && run.deadline.is_some_and(|d| Instant::now() >= d))
                    {
                        break;
                    }
                    let index = (block * BLOCK + k) as u32;
                    while pixel.count < until {
                        view.sample(index, pixel, &mut rays);
                        done += 1;
                    }
                }
                run.rays.add(RayKind::Primary, rays.primary);
                run.rays.add(RayKind::Shadow, rays.shadow);
                run.rays.add(RayKind::Sample, rays.sample);
                phase.advance(done);
            });
        });
        fewest = pixels.iter().map(|p| p.count).min().unwrap_or(0);
        if run.cancelled() || run.deadline.is_some_and(|d| Instant::now() >= d) {
            break;
        }
        if settings.target_error > 0.0 && fewest >= 4 {
            error = pixels::noise(&pixels);
            if error < settings.target_error {
                break;
            }
        }
        pass = (pass * 2).min(MAX_PASS);
    }
    drop(phase);
    if fewest == 0 {
        return Err(Error::Interrupted);
    }
    if error.is_infinite() {
        error = pixels::noise(&pixels);
    }
    let mut film = pixels::film(&pixels, width, height);
    if keep_state {
        resume::add_state(&mut film, &pixels);
    }
    film.header.insert(resume::KEY.into(), key);
    film.header.insert("nearfar.spp".into(), fewest.to_string());
    film.header.insert("nearfar.noise_relmse".into(), format!("{error:e}"));
    let statistics = MethodStatistics::Path(PathStatistics { spp: fewest, noise_relmse: error });
    Ok(Rendered { film, statistics, locations: Locations::default() })
}
