//! `--converge`: a picture that starts as the fast one and approaches the ground truth.
//!
//! ```text
//! M     the model, a finished picture
//! A, B  two independent halves of path-traced samples, each with two quarters
//! D_X   = (X − M) / albedo = Σ_j D_X,j              bands of the edge-aware pyramid (`pyramid`)
//! O     = M + albedo · (s_A Σ_j w_B,j D_A,j + s_B Σ_j w_A,j D_B,j)
//!       s: share of the samples, s_A + s_B = 1
//! w_X,j = b² / (b² + s_X σ²)
//!       b² = (Σ D_X0,j D_X1,j − 3 √(K Σ σ⁴))₊,   σ² = Σ (D_X0,j − D_X1,j)² / 4
//!       Σ: over the picture, by relative error; K pixels are joined by the bands below
//! ```
//! Method     b² is what the model lacks in a band, σ² the noise of X there, both from X alone; the
//!            weight is used on the other half. So a firefly neither chooses its own weight nor is
//!            clamped. The subtracted term is what noise alone would bring to b². One weight serves
//!            a whole band: coarse bands, where noise averages out, are repaired after few samples.
//!            Local weights were tried: two quarters that both missed the light agree, and the
//!            Cornell box had 20 times the model's error after 4 spp.
//! Certificate  Δ_X = (X0 − X1) / 2 has the noise of X, and F_X Δ_X, the same weighted sum of its
//!              bands, that of the share of O, so that mean (O − A)(O − B) + s_A Δ_A F_B Δ_A + s_B
//!              Δ_B F_A Δ_B   estimates (O − T)² for the truth T (the covariance of O with A, B
//!              added back); noise = (s_A F_B Δ_A)² + (s_B F_A Δ_B)²; M alone (M − A)(M − B);
//!              samples alone s_A s_B (A − B)².
//! Source     James, Stein (1961) and Wiener's filter for the weight; Stein's unbiased risk
//!            estimate for the certificate.
//! Input      the model's film with layers `""`, `albedo`, `N`, `P`; a closure that grows a half to
//!            so many samples a pixel (methods do not import each other). Output  the model's film
//!            with another beauty and layer `samples`, figures in header and statistics. Guarantees
//!            weight `one`: the mean of the samples, unbiased whatever the model; `shrink`:
//!            consistent, for w → 1 wherever b > 0. The same bits for any thread count unless the
//!            clock stops it. Fewer than two samples in a quarter pair: the model itself.
//!            Goes on from halves that an earlier run left as if that had never stopped.
//! Not        layers other than the beauty stay the model's. The certificate neglects how w_X
//!            depends on X: a little low; of a few samples it is itself noisy. Pixels may be
//!            slightly negative.
//! Measured   relMSE (two-half ground truth). Cornell box 256², 4, 16, 64, 256 spp: 0.0006, 0.0006,
//!            0.0006, 0.0007 (certified 0.0018, 0.0011, 0.0003, 0.0007); path tracing alone 0.27,
//!            0.055, 0.011, 0.0015; model alone 0.0006. veach_ajar 320×180, 8 and 64 spp: 0.0048
//!            both (certified 0.00, 0.003); path tracing alone 15.6, 2.1; model alone 0.0048. Known
//!            gap  where single samples carry the light (veach_ajar) the certificate of few samples
//!            says little.
//! Cost       the samples, and 4 · levels smoothings of 25 taps at the end (and with `target_error`
//!            whenever samples have grown by half).
//! Knobs      [`ConvergeSettings`].

mod pyramid;
mod shrink;

pub use pyramid::Guide;
pub use shrink::{Certificate, combine};

use crate::error::{Error, Result};
use crate::film::{COMPLETE, Film, layer};
use crate::forecast::samples_needed;
use crate::method::Rendered;
use crate::run::{Ended, Run};
use crate::sampling::ENDLESS;
use crate::settings::{choices, section};

choices! {
    /// How much of a band of the difference is kept.
    pub enum Weight default Shrink {
        /// By what is known of it: the least expected error.
        Shrink = "shrink",
        /// All: unbiased, the model plays no part.
        One = "one",
    }
}

section! {
    /// The picture that converges.
    pub struct ConvergeSettings in "converge" {
        /// Go on from the method's picture towards the ground truth.
        enabled: bool = false;
        /// Path-traced samples per pixel, both halves together: two in each at the least.
        spp: u32 = 256, in from(4.0), unit "samples per pixel";
        /// Weight of the samples against the model.
        weight: Weight = Weight::Shrink;
        /// Bands of the pyramid; the coarsest reaches 2^levels pixels.
        levels: u32 = 6, in from(1.0).to(10.0), unit "bands";
        /// Stop once the certified relMSE is below this; 0: never.
        target_error: f64 = 0.0, unit "relMSE";
    }
}

/// What `converge` tells of its picture.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct ConvergeStatistics {
    /// Mean path-traced samples a pixel; 0: the picture is the model's.
    #[serde(rename = "converge_spp")]
    pub spp: f64,
    /// Why it ended there.
    #[serde(rename = "ended_by")]
    pub ended: Option<Ended>,
    /// What is known of the picture's error.
    #[serde(flatten)]
    pub certificate: Option<Certificate>,
}

impl std::fmt::Display for ConvergeStatistics {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Some(c) = &self.certificate else {
            return f.write_str("no time for samples: the picture is the model's");
        };
        write!(
            f,
            "{:.1} samples a pixel; estimated relMSE {:.2e} (bias {:.2e}, noise {:.2e}); \
             model alone {:.2e}, samples alone {:.2e}",
            self.spp, c.relmse, c.bias, c.noise, c.model, c.path
        )
    }
}

/// Most samples that a half grows by between two looks at the clock.
const MAX_PASS: u32 = 32;
/// Growth of the samples between two certificates.
const AGAIN: f64 = 1.5;

/// What is traced so far; a half that is not begun is none.
pub type Halves = [Option<Film>; 2];

/// Grows half 0 or 1 of what there is to so many samples a pixel; stops early at the run's deadline
/// or when cancelled.
pub type Sampler<'a> = dyn FnMut(usize, &Halves, u32) -> Result<Film> + 'a;

/// Samples of a half after the pass that begins with `done`, without a limit.
fn next_pass(done: u32) -> u32 {
    done + done.clamp(2, MAX_PASS)
}

/// Whether the error is looked at after `done` samples, having been looked at after `checked`.
fn looks(done: u32, checked: u32) -> bool {
    done >= 4 && f64::from(done) >= AGAIN * f64::from(checked)
}

/// Where a run stands that has `halves`: samples after its last whole pass, and at the look at the
/// error before.
fn standing(halves: &Halves) -> (u32, u32) {
    let fewest = |film: &Film| {
        let samples = film.channels.get("samples").map_or(&[][..], Vec::as_slice);
        samples.iter().fold(f32::INFINITY, |least, &n| least.min(n)) as u32
    };
    let [Some(a), Some(b)] = halves else { return (0, 0) };
    let (there, mut done, mut checked) = (fewest(a).min(fewest(b)), 0, 0);
    while next_pass(done) <= there {
        if looks(done, checked) {
            checked = done;
        }
        done = next_pass(done);
    }
    (done, checked)
}

/// The model's picture, brought towards the truth by samples until their number, the certified
/// error, the deadline or cancelling stops it; `halves` are those of an earlier run, and become
/// what is traced.
///
/// # Errors
/// Settings out of range, layers that the model lacks, errors of `sample` other than
/// [`Error::Interrupted`].
pub fn render(
    model: Rendered,
    halves: &mut Halves,
    settings: &ConvergeSettings,
    sample: &mut Sampler<'_>,
    run: &Run,
) -> Result<(Rendered, ConvergeStatistics)> {
    settings.validate()?;
    let limit = settings.spp / 2;
    let (mut done, mut checked) = standing(halves);
    let mut found = Vec::new();
    let ended = loop {
        if let Some(ended) = run.stops() {
            break ended;
        }
        if settings.target_error > 0.0 && looks(done, checked) {
            checked = done;
            if let Some(films) = usable(halves) {
                let error = run.install(|| combine(&model.film, films, settings))?.1.relmse;
                if error < settings.target_error {
                    break Ended::TargetError;
                }
                found.push((2.0 * f64::from(done), error));
                if let Some(samples) = samples_needed(&found, settings.target_error) {
                    let more = samples.min(f64::from(settings.spp)) - 2.0 * f64::from(done);
                    let pixels = u64::from(model.film.width) * u64::from(model.film.height);
                    run.expect("sample", more.max(0.0) as u64 * pixels);
                }
            }
        }
        if done >= limit {
            break Ended::Samples;
        }
        let next = next_pass(done).min(limit);
        for half in 0..2 {
            match sample(half, halves, next) {
                Ok(grown) => halves[half] = Some(grown),
                Err(Error::Interrupted) => break,
                Err(error) => return Err(error),
            }
        }
        done = next;
    };
    let Rendered { mut film, statistics, locations } = model;
    let mut converge = ConvergeStatistics { ended: Some(ended), ..ConvergeStatistics::default() };
    if let Some(films) = usable(halves) {
        let _phase = run.phase("converge", 1);
        let (picture, certificate) = run.install(|| combine(&film, films, settings))?;
        film.set_rgb("", &picture);
        let counts = films.map(|f| f.channels.get("samples").cloned().unwrap_or_default());
        let samples: Vec<f32> = counts[0].iter().zip(&counts[1]).map(|(a, b)| a + b).collect();
        converge.spp =
            samples.iter().map(|&n| f64::from(n)).sum::<f64>() / samples.len().max(1) as f64;
        film.set(layer::SAMPLES.name, samples);
        converge.certificate = Some(certificate);
    }
    let limited = settings.spp < ENDLESS || settings.target_error > 0.0;
    let complete = !ended.is_short(limited);
    film.header.insert(COMPLETE.into(), complete.to_string());
    film.header.insert("nearfar.converge.spp".into(), converge.spp.to_string());
    if let Some(c) = converge.certificate {
        for (name, value) in [
            ("relmse", c.relmse),
            ("bias", c.bias),
            ("noise", c.noise),
            ("model", c.model),
            ("path", c.path),
        ] {
            film.header.insert(format!("nearfar.converge.{name}"), format!("{value:e}"));
        }
    }
    Ok((Rendered { film, statistics, locations }, converge))
}

/// Both halves, once every pixel has both quarters of each.
fn usable(halves: &Halves) -> Option<[&Film; 2]> {
    let enough =
        |film: &&Film| film.channels.get("samples").is_some_and(|s| s.iter().all(|&n| n >= 2.0));
    Some([halves[0].as_ref().filter(enough)?, halves[1].as_ref().filter(enough)?])
}

#[cfg(test)]
mod tests {
    use super::shrink::wiener;
    use super::*;

    #[test]
    fn weights_follow_signal_and_noise() {
        assert_eq!(
            (wiener(3.0, 1.0), wiener(-3.0, 1.0), wiener(2.0, 0.0), wiener(0.0, 0.0)),
            (0.75, 0.0, 1.0, 1.0)
        );
    }

    #[test]
    fn where_a_run_stands_does_not_depend_on_where_it_was_stopped() {
        let film = |n: f32| {
            let mut film = Film::new(2, 1);
            film.set("samples", vec![n, n + 1.0]);
            Some(film)
        };
        // Passes end at 2, 4, 8, 16, 32, 64, 96, 128, 160; looks are at 4, 8, 16, 32, 64, 96, 160.
        for (a, b, expected) in [
            (1.0, 9.0, (0, 0)),
            (4.0, 5.0, (4, 0)),
            (9.0, 8.0, (8, 4)),
            (100.0, 128.0, (96, 64)),
            (130.0, 130.0, (128, 96)),
            (160.0, 160.0, (160, 96)),
        ] {
            assert_eq!(standing(&[film(a), film(b)]), expected, "{a} {b}");
        }
        assert_eq!(standing(&[film(9.0), None]), (0, 0));
    }

    #[test]
    fn settings_are_checked() {
        assert!(ConvergeSettings::default().validate().is_ok());
        for bad in [
            ConvergeSettings { spp: 3, ..ConvergeSettings::default() },
            ConvergeSettings { levels: 11, ..ConvergeSettings::default() },
        ] {
            assert!(bad.validate().is_err());
        }
    }
}
