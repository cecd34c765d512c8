//! A reference made ready to judge by: cleaned of its noise, with what does not depend on the
//! picture that is judged.
//!
//! Computes   c₀ and c₁, the reference's halves without most of their noise, and their mean c; m,
//!            the mean of the reference over pixels and channels; with them what turns squares into
//!            relative ones, (1 / (c₀² + 0.01 m²) + 1 / (c₁² + 0.01 m²)) / 2, where 0.01 m² keeps
//!            black pixels from counting without bound; the reference's own noise, the relMSE of
//!            its mean: mean of ((half0 − half1)/2)² made relative, without the 0.1 % worst pixels.
//! Why        Squares of a noisy reference r in a denominator are too small wherever r happens to
//!            be: dark noisy pixels then count a hundredfold. One picture's relMSE read 52.8, 0.58,
//!            0.0315, 0.0024 and 0.00135 against truths of 2, 64, 256, 1024 and 4096 samples.
//! Why two    What is cleaned still follows the noise a little. With one c made of both halves the
//!            product of their noises does not cancel: it added about 3 % of the reference's own
//!            noise, 0.021 for 0.0088 against a truth of 64 samples whose noise is 0.44. c₀ knows
//!            nothing of the noise of half1, so the noise of half1 still averages out beside it.
//! Method     c₀ and c₁ are what Open Image Denoise makes of the halves, of albedo and of normals
//!            where it can be opened; else what the halves make of each other (`cross_filter`). A
//!            reference without halves is denoised as a whole, or stays as it is. Never below 0.
//! Not        exact: cleaning blurs what is finer than the noise. [`Truth::cleaned`] tells which it
//!            was; figures of different cleanings differ by some per cent where the reference is
//!            very noisy.
//! Cost       see [`crate::ffi::oidn`] and `cross_filter`; once a reference.

use std::path::Path;

use glam::DVec3;

use super::blocks::Blocks;
use super::cross_filter::cross_filter;
use super::errors::{Halves, kept};
use super::reference::{Reference, read_reference};
use crate::error::Result;
use crate::ffi::oidn::{Denoiser, Input};
use crate::radiometry::Rgb;

/// What took the noise out of a reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cleaned {
    /// Open Image Denoise of this version.
    Oidn([u32; 3]),
    /// Its two halves, each filtered with weights from the other.
    Halves,
    /// Nothing: it has no halves, and no denoiser is there.
    Not,
}

impl std::fmt::Display for Cleaned {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Oidn([major, minor, patch]) => {
                write!(f, "Open Image Denoise {major}.{minor}.{patch}")
            }
            Self::Halves => f.write_str("its halves, each filtering the other"),
            Self::Not => f.write_str("nothing"),
        }
    }
}

impl serde::Serialize for Cleaned {
    fn serialize<S: serde::Serializer>(
        &self,
        serializer: S,
    ) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// A reference, ready to judge by.
#[derive(Clone, Debug)]
pub struct Truth {
    pub(super) reference: Reference,
    /// The cleaned halves; the cleaned mean twice where there are none.
    pub(super) cleaned_halves: [Vec<Rgb>; 2],
    /// The mean of the cleaned halves.
    pub(super) clean: Vec<Rgb>,
    pub(super) level: f64,
    pub(super) blocks: Blocks,
    cleaned: Cleaned,
    noise: Option<f64>,
}

impl Truth {
    /// Cleans a reference by `denoiser`, or without one by its halves.
    ///
    /// # Errors
    /// As [`Denoiser::denoise`].
    pub fn new(reference: Reference, denoiser: Option<&Denoiser>) -> Result<Self> {
        let (width, height) = (reference.width as usize, reference.height as usize);
        let albedo: Option<Vec<Rgb>> = reference
            .albedo
            .as_ref()
            .map(|a| a.iter().map(|c| c.clamp(Rgb::ZERO, Rgb::ONE)).collect());
        let denoised = |color: &[Rgb], denoiser: &Denoiser| {
            denoiser.denoise(&Input {
                width,
                height,
                color,
                albedo: albedo.as_deref(),
                normal: reference.normal.as_deref(),
                clean: false,
            })
        };
        let (clean, cleaned) = match (denoiser, &reference.halves) {
            (Some(denoiser), Some(Halves(a, b))) => (
                [denoised(a, denoiser)?, denoised(b, denoiser)?],
                Cleaned::Oidn(denoiser.version()),
            ),
            (Some(denoiser), None) => {
                let clean = denoised(&reference.mean, denoiser)?;
                ([clean.clone(), clean], Cleaned::Oidn(denoiser.version()))
            }
            (None, Some(Halves(a, b))) => (cross_filter(a, b, width, height), Cleaned::Halves),
            (None, None) => ([reference.mean.clone(), reference.mean.clone()], Cleaned::Not),
        };
        Ok(Self::with(reference, clean, cleaned))
    }

    /// An image without noise, such as one of a closed form: it is its own clean form.
    pub fn exact(width: u32, height: u32, pixels: &[Rgb]) -> Self {
        let reference = Reference {
            width,
            height,
            mean: pixels.to_vec(),
            halves: None,
            albedo: None,
            normal: None,
            notes: Vec::new(),
            origin: None,
        };
        Self::with(reference, [pixels.to_vec(), pixels.to_vec()], Cleaned::Not)
    }

    /// Reads a reference (see [`read_reference`]) and cleans it by what there is.
    ///
    /// # Errors
    /// As [`read_reference`] and [`Denoiser::denoise`].
    pub fn read(path: &Path) -> Result<Self> {
        let mut reference = read_reference(path)?;
        let denoiser = match Denoiser::found(rayon::current_num_threads()) {
            Ok(denoiser) => denoiser,
            Err(error) => {
                reference.notes.push(format!("the reference is cleaned without it: {error}"));
                None
            }
        };
        Self::new(reference, denoiser.as_ref())
    }

    fn with(reference: Reference, mut halves: [Vec<Rgb>; 2], cleaned: Cleaned) -> Self {
        halves.iter_mut().flatten().for_each(|c| *c = c.max(Rgb::ZERO));
        let clean = halves[0].iter().zip(&halves[1]).map(|(&a, &b)| (a + b) * 0.5).collect();
        let finite = || reference.mean.iter().filter(|c| c.is_finite());
        let total: f64 = finite().map(|c| c.as_dvec3().element_sum()).sum();
        let level = total / (3 * finite().count()).max(1) as f64;
        let blocks = Blocks::new(reference.width, reference.height);
        let cleaned_halves = halves;
        let mut truth =
            Self { reference, cleaned_halves, clean, level, blocks, cleaned, noise: None };
        truth.noise = truth.own_noise();
        truth
    }

    /// relMSE of the mean of the halves, without the 0.1 % of the pixels where it is largest.
    fn own_noise(&self) -> Option<f64> {
        let Halves(a, b) = self.reference.halves.as_ref()?;
        let mut of_pixel: Vec<f64> = (0..a.len())
            .filter(|&i| a[i].is_finite() && b[i].is_finite())
            .map(|i| {
                let d = (a[i].as_dvec3() - b[i].as_dvec3()) * 0.5;
                self.relative(i, d * d)
            })
            .collect();
        of_pixel.sort_by(f64::total_cmp);
        of_pixel.truncate(kept(of_pixel.len()));
        Some(of_pixel.iter().sum::<f64>() / of_pixel.len().max(1) as f64)
    }

    /// Mean over channels of a square at a pixel, made relative.
    pub(super) fn relative(&self, pixel: usize, square: DVec3) -> f64 {
        let [a, b] = self.relative_by_half(pixel, square);
        0.5 * (a + b)
    }

    /// The same by each of the cleaned halves alone.
    pub(super) fn relative_by_half(&self, pixel: usize, square: DVec3) -> [f64; 2] {
        [0, 1].map(|k| self.relative_to(square, self.cleaned_halves[k][pixel].as_dvec3()))
    }

    /// Mean over channels of a square over c² + 0.01 m² for any c.
    pub(super) fn relative_to(&self, square: DVec3, clean: DVec3) -> f64 {
        let floor = self.denominator(clean);
        let of = |k: usize| if square[k] == 0.0 { 0.0 } else { square[k] / floor[k] };
        (0..3).map(of).sum::<f64>() / 3.0
    }

    /// c² + 0.01 m² for any c.
    pub(super) fn denominator(&self, clean: DVec3) -> DVec3 {
        clean * clean + 0.01 * self.level * self.level
    }

    /// The two images whose product with the picture estimates a square: the halves, or the mean
    /// twice.
    pub(super) fn pair(&self) -> [&[Rgb]; 2] {
        match &self.reference.halves {
            Some(Halves(a, b)) => [a, b],
            None => [&self.reference.mean; 2],
        }
    }

    /// Whether all that is known of a pixel is finite.
    pub(super) fn is_finite(&self, pixel: usize) -> bool {
        self.pair().iter().all(|h| h[pixel].is_finite())
            && self.reference.mean[pixel].is_finite()
            && self.clean[pixel].is_finite()
    }

    /// The reference as read.
    pub fn reference(&self) -> &Reference {
        &self.reference
    }

    /// What pictures are compared with where squares are not to be had (absolute differences,
    /// FLIP): the cleaned reference where its noise is known from halves, else the reference.
    pub fn quiet(&self) -> &[Rgb] {
        if self.reference.halves.is_some() { &self.clean } else { &self.reference.mean }
    }

    /// What cleaned it.
    pub fn cleaned(&self) -> Cleaned {
        self.cleaned
    }

    /// relMSE of its own noise without the 0.1 % worst pixels; none without halves.
    pub fn noise(&self) -> Option<f64> {
        self.noise
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_noise_by_hand() {
        let grey = |v: f32| vec![Rgb::splat(v); 4];
        let reference = Reference {
            halves: Some(Halves(grey(1.1), grey(0.9))),
            ..Truth::exact(2, 2, &grey(1.0)).reference
        };
        let truth = Truth::with(reference, [grey(1.0), grey(1.0)], Cleaned::Halves);
        assert!((truth.noise().unwrap() - 0.01 / 1.01).abs() < 1e-8);
        assert!(Truth::exact(2, 2, &grey(1.0)).noise().is_none());
    }
}
