//! Means over pixels with their standard errors.
//!
//! Errors of neighbouring pixels are alike: a cloud covers hundreds of them. A standard error over
//! single pixels would take them for independent and come out far too small, so pixels are first
//! summed over square blocks:
//!
//! ```text
//! R = Σ S / Σ n        se² = B / (B − 1) · Σ (S − R n)² / (Σ n)²
//! ```
//! with S the sum of the values in a block, n how many there are, and B the number of blocks that
//! hold any (the ratio estimator; [Cochran, Sampling Techniques, 3rd edition, §6.3]). The blocks
//! are 32 pixels wide where the picture holds at least 30 of them, else half as wide, and so on:
//! clouds of up to about that size are accounted for, larger ones are not.
//!
//! The standard error holds the noise of the reference, the noise of the picture, and how much the
//! error differs from place to place: it says how well the mean is known as a property of pictures
//! like this one. It does not hold what all blocks share.

/// Widest block, in pixels.
const WIDEST: usize = 32;
/// So many blocks tell a standard error to about an eighth of it.
const ENOUGH: usize = 30;

/// How the pixels of a picture are summed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blocks {
    width: usize,
    side: usize,
    columns: usize,
    count: usize,
}

/// A mean and its standard error; 0 where there is one block only.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Estimate {
    pub value: f64,
    pub standard_error: f64,
}

impl Blocks {
    pub(super) fn new(width: u32, height: u32) -> Self {
        let (width, height) = (width as usize, height as usize);
        let count = |side: usize| width.div_ceil(side) * height.div_ceil(side);
        let mut side = WIDEST;
        while side > 1 && count(side) < ENOUGH {
            side /= 2;
        }
        Self { width, side, columns: width.div_ceil(side), count: count(side) }
    }

    /// Mean of the values of (pixel, value) pairs; zero without any.
    pub(super) fn mean(&self, values: impl IntoIterator<Item = (usize, f64)>) -> Estimate {
        let mut sums = vec![(0.0f64, 0.0f64); self.count];
        for (pixel, value) in values {
            let block =
                pixel / self.width / self.side * self.columns + pixel % self.width / self.side;
            sums[block].0 += value;
            sums[block].1 += 1.0;
        }
        ratio(&sums)
    }
}

/// The mean of blocks given as (sum, number of values).
pub(super) fn ratio(sums: &[(f64, f64)]) -> Estimate {
    let n: f64 = sums.iter().map(|s| s.1).sum();
    if n == 0.0 {
        return Estimate::default();
    }
    let value = sums.iter().map(|s| s.0).sum::<f64>() / n;
    let filled = sums.iter().filter(|s| s.1 > 0.0).count() as f64;
    let squares: f64 = sums.iter().map(|s| (s.0 - value * s.1).powi(2)).sum();
    let standard_error =
        if filled > 1.0 { (filled / (filled - 1.0) * squares).sqrt() / n } else { 0.0 };
    Estimate { value, standard_error }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream};

    #[test]
    fn blocks_of_one_pixel_give_the_textbook_error() {
        let values = [1.0, 0.0, 4.0, 3.0];
        let found = Blocks::new(2, 2).mean(values.into_iter().enumerate());
        let spread = values.iter().map(|v: &f64| (v - 2.0).powi(2)).sum::<f64>() / 3.0 / 4.0;
        assert_eq!(found.value, 2.0);
        assert!((found.standard_error - spread.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn blocks_grow_with_the_picture() {
        let side = |w, h| Blocks::new(w, h).side;
        assert_eq!([side(240, 135), side(100, 100), side(4, 4), side(1, 1)], [32, 16, 1, 1]);
    }

    /// Clouds of 16 × 16 pixels, independent of each other: their mean scatters as the standard
    /// error says, which one over single pixels would put at a sixteenth.
    #[test]
    fn clouds_count_once() {
        let (mut means, mut claimed) = (Vec::new(), 0.0);
        for seed in 0..200 {
            let cloud = |i: usize| {
                let at = (i / 256 / 16 * 16 + i % 256 / 16) as u64;
                f64::from(Rng::new(seed, Stream::Test, at, 0).next_f32())
            };
            let found = Blocks::new(256, 256).mean((0..256 * 256).map(|i| (i, cloud(i))));
            means.push(found.value);
            claimed += found.standard_error / 200.0;
        }
        let spread = (means.iter().map(|m| (m - 0.5).powi(2)).sum::<f64>() / 200.0).sqrt();
        assert!((claimed / spread - 1.0).abs() < 0.15, "{claimed} against {spread}");
    }
}
