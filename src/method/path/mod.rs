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

mod merge;
mod pixels;
mod resume;
mod trace;

use std::time::Instant;

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::film::{COMPLETE, Film};
use crate::forecast::samples_needed;
use crate::method::locations::Locations;
use crate::method::{MethodStatistics, Rendered};
use crate::run::{Ended, RayKind, Run};
use crate::sampling::{ENDLESS, PixelFilter};
use crate::settings::section;
use crate::shading::World;
pub use merge::merge;
pub use pixels::LAYERS;
use pixels::Pixel;
pub use resume::KEY;

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
    /// Why it ended there.
    #[serde(rename = "ended_by")]
    pub ended: Ended,
}

/// What [`reference()`] goes on from, and what it leaves.
#[derive(Clone, Copy, Debug, Default)]
pub struct Progress<'a> {
    /// A film that [`reference()`] made with `keep_state`: goes on as if it had never stopped.
    pub earlier: Option<&'a Film>,
    /// Adds the running sums to the film (layers `state.*`).
    pub keep_state: bool,
    /// Returns what is done by then, to be gone on from; some pixels may have no sample yet.
    pub pause: Option<Instant>,
}

/// Pixels worked on as one task.
const BLOCK: usize = 64;
/// Most samples per pixel between two looks at the error; a power of two.
const MAX_PASS: u32 = 32;

/// Path traces the view until `settings.spp`, `settings.target_error`, the run's deadline, or
/// cancelling; keeps what was done.
///
/// # Errors
/// [`Error::Setting`] for settings out of range; [`Error::Interrupted`] when cancelled before the
/// first sample.
pub fn render(world: &World, settings: &PathSettings, seed: u64, run: &Run) -> Result<Rendered> {
    reference(world, settings, seed, run, Progress::default())
}

/// Samples per pixel at the first look at the error after `n`: 1, 3, 7, 15, 31, 63, 95 …, whatever
/// run took the first `n`.
fn next_look(n: u32) -> u32 {
    if n < MAX_PASS - 1 {
        (n + 2).next_power_of_two() - 1
    } else {
        ((n + 1) / MAX_PASS + 1) * MAX_PASS - 1
    }
}

/// As [`render`], in parts: the bits of the finished film are the same however often it was paused,
/// cancelled and gone on with. A film that was ended before its time has `nearfar.complete` false.
///
/// # Errors
/// As [`render`], and [`Error::Usage`] when `progress.earlier` is of another scene, size, seed,
/// backend, or setting that changes samples, or has impossible sums.
pub fn reference(
    world: &World,
    settings: &PathSettings,
    seed: u64,
    run: &Run,
    progress: Progress<'_>,
) -> Result<Rendered> {
    settings.validate()?;
    let (width, height) = (world.camera.width, world.camera.height);
    let key = resume::key(world, settings, seed);
    let mut pixels = match progress.earlier {
        Some(film) => resume::pixels_from(film, &key, width, height)?,
        None => vec![Pixel::default(); width as usize * height as usize],
    };
    let (fewest, ended, error) = take_samples(world, settings, seed, run, (&mut pixels, progress));
    if ended == Ended::Interrupted && pixels.iter().all(|p| p.count == 0) {
        return Err(Error::Interrupted);
    }
    let error = error.unwrap_or_else(|| pixels::noise(&pixels));
    let mut film = pixels::film(&pixels, width, height);
    film.origin = world.origin;
    if progress.keep_state {
        resume::add_state(&mut film, &pixels);
    }
    let limited = settings.spp < ENDLESS || settings.target_error > 0.0;
    for (name, value) in [
        (KEY, key),
        (COMPLETE, (!ended.is_short(limited)).to_string()),
        ("nearfar.spp", fewest.to_string()),
        ("nearfar.noise_relmse", format!("{error:e}")),
    ] {
        film.header.insert(name.into(), value);
    }
    let statistics = PathStatistics { spp: fewest, noise_relmse: error, ended };
    let statistics = MethodStatistics::Path(statistics);
    Ok(Rendered { film, statistics, locations: Locations::default() })
}

/// Takes samples until something ends it: the fewest of a pixel, what ended it, and the error where
/// it was looked at last.
fn take_samples(
    world: &World,
    settings: &PathSettings,
    seed: u64,
    run: &Run,
    (pixels, progress): (&mut [Pixel], Progress<'_>),
) -> (u32, Ended, Option<f64>) {
    let view = trace::View::new(world, settings, seed);
    let count = pixels.len() as u64;
    let taken = |pixels: &[Pixel]| pixels.iter().map(|p| u64::from(p.count)).sum::<u64>();
    let all = u64::from(settings.spp) * count;
    let phase = run.phase("sample", all.saturating_sub(taken(pixels)));
    let paused = || progress.pause.is_some_and(|at| Instant::now() >= at);
    let fewest_of = |pixels: &[Pixel]| pixels.iter().map(|p| p.count).min().unwrap_or(0);
    let mut fewest = fewest_of(pixels);
    let mut found = Vec::new();
    loop {
        let looks = fewest >= 4 && (fewest == settings.spp || next_look(fewest - 1) == fewest);
        let error = (settings.target_error > 0.0 && looks).then(|| pixels::noise(pixels));
        if let Some(error) = error {
            found.push((f64::from(fewest), error));
            if let Some(samples) = samples_needed(&found, settings.target_error) {
                let needed = next_look((samples as u32).saturating_sub(1)).min(settings.spp);
                run.expect("sample", (u64::from(needed) * count).saturating_sub(taken(pixels)));
            }
        }
        if error.is_some_and(|error| error < settings.target_error) {
            return (fewest, Ended::TargetError, error);
        }
        if fewest >= settings.spp {
            return (fewest, Ended::Samples, error);
        }
        if let Some(ended) = run.stops().filter(|&e| fewest > 0 || e == Ended::Interrupted) {
            return (fewest, ended, error);
        }
        if paused() {
            return (fewest, Ended::Paused, error);
        }
        let until = next_look(fewest).min(settings.spp);
        run.install(|| {
            pixels.par_chunks_mut(BLOCK).enumerate().for_each(|(block, chunk)| {
                let mut rays = trace::Rays::default();
                let mut done = 0;
                for (k, pixel) in chunk.iter_mut().enumerate() {
                    let stops = run.stops();
                    if stops == Some(Ended::Interrupted)
                        || (pixel.count > 0 && stops.is_some())
                        || paused()
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
        fewest = fewest_of(pixels);
    }
}

#[cfg(test)]
mod tests {
    use super::next_look;

    #[test]
    fn looks_at_the_error_do_not_depend_on_where_a_run_began() {
        let looks: Vec<u32> =
            std::iter::successors(Some(1), |&n| Some(next_look(n))).take(8).collect();
        assert_eq!(looks, [1, 3, 7, 15, 31, 63, 95, 127]);
        for n in 0..127 {
            let next = *looks.iter().find(|&&look| look > n).unwrap();
            assert_eq!(next_look(n), next, "{n}");
        }
    }
}
