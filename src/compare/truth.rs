//! A reference made ready to judge by: cleaned of its noise, with what does not depend on the
//! picture that is judged.
//!
//! Computes   c, the reference without most of its noise; m, the mean of the reference over pixels
//!            and channels; 0.01 m², which keeps black pixels from counting without bound; the
//!            reference's own noise, the relMSE of its mean: mean of ((half0 − half1)/2)² / (c² +
//!            0.01 m²).
//! Why        Squares of a noisy reference r in a denominator are too small wherever r happens to
//!            be: dark noisy pixels then count a hundredfold. One picture's relMSE read 52.8, 0.58,
//!            0.0315, 0.0024 and 0.00135 against truths of 2, 64, 256, 1024 and 4096 samples.
//! Method     c is what Open Image Denoise makes of the reference, of its albedo and of its normals
//!            where it can be opened; else what the reference's halves make of each other
//!            (`cross_filter`); a reference that has neither stays as it is. Never below 0.
//! Not        exact: c is denoised from the noise that the numerators hold, and blurs what is finer
//!            than the noise. [`Truth::cleaned`] tells which cleaning it was; figures of different
//!            cleanings differ by some per cent where the reference is very noisy.
//! Cost       see [`crate::ffi::oidn`] and `cross_filter`; once a reference.

use std::path::Path;

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
        let (clean, cleaned) = match (denoiser, &reference.halves) {
            (Some(denoiser), _) => {
                let albedo: Option<Vec<Rgb>> = reference
                    .albedo
                    .as_ref()
                    .map(|a| a.iter().map(|c| c.clamp(Rgb::ZERO, Rgb::ONE)).collect());
                let clean = denoiser.denoise(&Input {
                    width,
                    height,
                    color: &reference.mean,
                    albedo: albedo.as_deref(),
                    normal: reference.normal.as_deref(),
                    clean: false,
                })?;
                (clean, Cleaned::Oidn(denoiser.version()))
            }
            (None, Some(Halves(a, b))) => (cross_filter(a, b, width, height), Cleaned::Halves),
            (None, None) => (reference.mean.clone(), Cleaned::Not),
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
        };
        Self::with(reference, pixels.to_vec(), Cleaned::Not)
    }

    /// Reads a reference (see [`read_reference`]) and cleans it by what there is.
    ///
    /// # Errors
    /// As [`read_reference`] and [`Denoiser::denoise`].
    pub fn read(path: &Path) -> Result<Self> {
        let denoiser = Denoiser::open(rayon::current_num_threads()).ok();
        Self::new(read_reference(path)?, denoiser.as_ref())
    }

    fn with(reference: Reference, mut clean: Vec<Rgb>, cleaned: Cleaned) -> Self {
        clean.iter_mut().for_each(|c| *c = c.max(Rgb::ZERO));
        let finite = || reference.mean.iter().filter(|c| c.is_finite());
        let total: f64 = finite().map(|c| c.as_dvec3().element_sum()).sum();
        let level = total / (3 * finite().count()).max(1) as f64;
        let blocks = Blocks::new(reference.width, reference.height);
        let mut truth = Self { reference, clean, level, blocks, cleaned, noise: None };
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

    /// Mean over channels of a square over c² + 0.01 m² at a pixel.
    pub(super) fn relative(&self, pixel: usize, square: glam::DVec3) -> f64 {
        let floor = self.denominator(self.clean[pixel].as_dvec3());
        (0..3).map(|k| if square[k] == 0.0 { 0.0 } else { square[k] / floor[k] }).sum::<f64>() / 3.0
    }

    /// c² + 0.01 m² for any c.
    pub(super) fn denominator(&self, clean: glam::DVec3) -> glam::DVec3 {
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
        let truth = Truth::with(reference, grey(1.0), Cleaned::Halves);
        assert!((truth.noise().unwrap() - 0.01 / 1.01).abs() < 1e-8);
        assert!(Truth::exact(2, 2, &grey(1.0)).noise().is_none());
    }
}
