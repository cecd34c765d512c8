//! A film against a truth: all figures, what is to be said about them, and pictures of the
//! difference.

use std::path::Path;

use super::errors::{Errors, errors};
use super::flip;
use super::reference::{beauty, origin, same_size};
use super::truth::{Cleaned, Truth};
use crate::error::Result;
use crate::film::Film;
use crate::radiometry::{Rgb, luminance};

/// A truth whose own relMSE is above this many times the error is too noisy to judge by: its
/// halves cancel its noise on average, but the cleaned denominators are no longer known well.
const TOO_NOISY: f64 = 10.0;

/// All figures of a comparison.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Comparison {
    /// relMSE and the like.
    #[serde(flatten)]
    pub errors: Errors,
    /// Mean LDR-FLIP at `exposure`, against the cleaned reference.
    pub flip: f64,
    /// Standard error of `flip`.
    pub flip_standard_error: f64,
    /// Stops that put the reference's log-average luminance at 0.18.
    pub exposure: f32,
    /// True when relMSE, MSE and bias are free of the reference's noise on average.
    pub halves: bool,
    /// What cleaned the reference.
    pub cleaned: Cleaned,
    /// relMSE of the reference's own noise without the 0.1 % worst pixels; none without halves.
    pub truth_noise: Option<f64>,
}

impl Comparison {
    /// What a reader has to know before believing the figures.
    pub fn warnings(&self) -> Vec<String> {
        let (error, spread) =
            (self.errors.relmse_trimmed, self.errors.relmse_trimmed_standard_error);
        let mut found = Vec::new();
        if let Some(noise) = self.truth_noise.filter(|n| *n > TOO_NOISY * error.abs()) {
            found.push(format!(
                "the reference is too noisy to judge this picture by: its own relMSE of \
                 {noise:.2e} is above {TOO_NOISY} times the error of {error:.2e}; take more \
                 samples for it"
            ));
        }
        if error < -2.0 * spread {
            found.push(format!(
                "relMSE is negative ({error:.2e} ± {spread:.0e}): the picture shares samples with \
                 the reference; give one of them another seed"
            ));
        } else if error.abs() < spread {
            found.push(format!(
                "the error of {error:.2e} is below its standard error of {spread:.0e}: it cannot \
                 be told from none"
            ));
        }
        found
    }
}

/// Stops of exposure that put the log-average luminance at 0.18; 0 for a black image.
pub fn exposure_of(pixels: &[Rgb]) -> f32 {
    let logs: Vec<f64> = pixels
        .iter()
        .map(|&c| luminance(c))
        .filter(|l| l.is_finite() && *l > 0.0)
        .map(|l| f64::from(l).ln())
        .collect();
    if logs.is_empty() {
        0.0
    } else {
        (0.18f64.ln() - logs.iter().sum::<f64>() / logs.len() as f64).exp().log2() as f32
    }
}

/// All figures of `image` (a film read from `path`) against `truth`.
///
/// # Errors
/// [`crate::error::Error::Image`] when the film has no beauty or another size.
pub fn compare(image: &Film, path: &Path, truth: &Truth) -> Result<Comparison> {
    Ok(compare_with_flip(image, path, truth)?.0)
}

/// As [`compare`], with FLIP per pixel.
///
/// # Errors
/// As [`compare`].
pub fn compare_with_flip(
    image: &Film,
    path: &Path,
    truth: &Truth,
) -> Result<(Comparison, Vec<f32>)> {
    let reference = truth.reference();
    same_size(image, reference.width, reference.height, path)?;
    let pixels = beauty(image, path)?;
    // Of the reference as it is: cleaning fills black pixels with next to nothing, which would
    // count in a mean of logarithms.
    let exposure = exposure_of(&reference.mean);
    let shown = |p: &[Rgb]| {
        p.iter()
            .map(|&c| if c.is_finite() { c * exposure.exp2() } else { Rgb::ZERO })
            .collect::<Vec<_>>()
    };
    let map = flip(
        &shown(&pixels),
        &shown(truth.quiet()),
        reference.width as usize,
        reference.height as usize,
    );
    let flip = truth.blocks.mean(map.iter().map(|&v| f64::from(v)).enumerate());
    let found = Comparison {
        errors: errors(&pixels, truth),
        flip: flip.value,
        flip_standard_error: flip.standard_error,
        exposure,
        halves: reference.halves.is_some(),
        cleaned: truth.cleaned(),
        truth_noise: truth.noise(),
    };
    Ok((found, map))
}

/// What is to be known of a picture and a truth before any figure of them is believed.
pub fn notes(image: &Film, truth: &Truth) -> Vec<String> {
    let reference = truth.reference();
    let mut notes = reference.notes.clone();
    if origin(image).is_some() && origin(image) == reference.origin {
        notes.push(
            "picture and reference are of one method and one seed, so that their noise cancels: \
             give one of them another seed"
                .into(),
        );
    }
    if truth.level == 0.0 {
        notes.push(
            "the reference is black: nothing is relative to it, only MSE and MAE hold".into(),
        );
    }
    notes
}

/// |image − reference| · `amplify`, linear; NaN where either is.
pub fn difference(image: &[Rgb], reference: &[Rgb], amplify: f32) -> Vec<Rgb> {
    image.iter().zip(reference).map(|(a, b)| (*a - *b).abs() * amplify).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::{Halves, Reference, read_reference};

    /// Black surroundings, as around an open box, do not count for the exposure, however the
    /// reference is cleaned.
    #[test]
    fn black_surroundings_do_not_count() {
        let (width, height) = (24u32, 16u32);
        let half = |sign: f32| -> Vec<Rgb> {
            let value = |i: u32| {
                let odd = (i % width + i / width) % 2 == 1;
                let noise = sign * if odd { 0.02 } else { -0.02 };
                Rgb::splat(if i % width < width / 2 { 0.0 } else { 0.18 + noise })
            };
            (0..width * height).map(value).collect()
        };
        let mean: Vec<Rgb> = half(0.0);
        let halves = Some(Halves(half(1.0), half(-1.0)));
        let reference = Reference {
            mean: mean.clone(),
            halves,
            ..Truth::exact(width, height, &mean).reference().clone()
        };
        let truth = Truth::new(reference, None).unwrap();
        let mut film = Film::new(width, height);
        film.set_rgb("", &mean);
        let found = compare(&film, Path::new("a.exr"), &truth).unwrap();
        assert!(found.exposure.abs() < 1e-3, "{}", found.exposure);
    }

    #[test]
    fn exposure_puts_the_log_average_at_middle_grey() {
        assert!((exposure_of(&[Rgb::splat(0.09); 4]) - 1.0).abs() < 1e-5);
        assert!((exposure_of(&[Rgb::splat(0.045), Rgb::splat(0.18)]) - 1.0).abs() < 1e-5);
        assert_eq!(exposure_of(&[Rgb::ZERO]), 0.0);
    }

    #[test]
    fn doubts_are_told() {
        let grey = |v: f32| vec![Rgb::splat(v); 64];
        let of = |a: f32, b: f32, x: f32| {
            let mut film = Film::new(8, 8);
            film.set_rgb("", &grey(x));
            let exact = Truth::exact(8, 8, &grey(0.5 * (a + b)));
            let reference =
                Reference { halves: Some(Halves(grey(a), grey(b))), ..exact.reference().clone() };
            let truth = Truth::new(reference, None).unwrap();
            compare(&film, Path::new("x.exr"), &truth).unwrap().warnings()
        };
        assert!(of(1.01, 0.99, 1.1).is_empty());
        assert!(of(1.1, 0.9, 1.101)[0].contains("too noisy"), "{:?}", of(1.1, 0.9, 1.101));
        assert!(of(1.0, 1.0, 1.0)[..].is_empty());
    }

    #[test]
    fn halves_are_found_in_siblings_and_sizes_are_checked() {
        let folder = std::env::temp_dir().join(format!("nearfar-compare-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let write = |name: &str, width: u32, v: f32| {
            let mut film = Film::new(width, 2);
            film.set_rgb("", &vec![Rgb::splat(v); width as usize * 2]);
            crate::film::write_exr(&film, &folder.join(name), crate::film::Precision::Full)
                .unwrap();
            film
        };
        let film = write("a.exr", 2, 1.0);
        assert!(read_reference(&folder.join("a.exr")).unwrap().halves.is_none());
        write("a.half0.exr", 2, 0.9);
        write("a.half1.exr", 2, 1.1);
        let reference = read_reference(&folder.join("a.exr")).unwrap();
        let truth = Truth::new(reference, None).unwrap();
        let c = compare(&film, Path::new("a.exr"), &truth).unwrap();
        // −0.1² over 0.9² + 0.01 and over 1.1² + 0.01; FLIP sees the rounding of their mean.
        let expected = -0.01 * 0.5 * (1.0 / 0.82 + 1.0 / 1.22);
        assert!(c.halves && (c.errors.relmse - expected).abs() < 1e-6 && c.flip < 1e-3);
        assert!(c.warnings()[0].contains("shares samples"), "{:?}", c.warnings());
        let wide = write("w.exr", 3, 1.0);
        let error = compare(&wide, Path::new("w.exr"), &truth).unwrap_err().to_string();
        assert!(error.contains("has 3×2 pixels, the reference 2×2"), "{error}");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
