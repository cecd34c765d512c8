//! relMSE, bias, MSE, MAE of a picture x against a truth, each with its standard error.
//!
//! ```text
//! relMSE = mean over pixels and channels of (x − half0)(x − half1) / (c² + 0.01 m²)
//! bias   = mean(x − r) / m        MSE = mean of (x − half0)(x − half1)        MAE = mean |x − c|
//! ```
//! r is the reference, half0 and half1 its two independent halves, c the reference cleaned and m
//! its mean; the division by c² + 0.01 m² is the mean of that by the two cleaned halves, and
//! [`Truth`] says why. relMSE is given plain and without the 0.1 % of the pixels where (x − c)² /
//! (c² + 0.01 m²) is largest.
//!
//! Guarantees  the product with the halves is free of the reference's noise: its expected value is
//!             (x − r)² with the exact r. Single terms, and the figure of a very good picture, may
//!             then be negative. The worst pixels are not found by the product, whose noise would
//!             choose. Sums in f64 in pixel order: the same bits on every run.
//! Not         MAE: it holds whatever c lacks to be exact. Without halves r stands for half0,
//!             half1, and for c in MAE; the reference's noise is then part of every figure.
//! Not         defined for NaN and infinities: pixels with any in the picture or the reference are
//!             left out and counted in `non_finite`.
//! Error       standard errors are those of means over blocks (`blocks`): they hold the noise of
//!             the reference as well as the unevenness of the error. What all blocks share, the
//!             error of the cleaned denominators, is told by how far relMSE by the one cleaned half
//!             is from that by the other: half of the difference is added in squares.

use super::blocks::Estimate;
use super::truth::Truth;
use crate::radiometry::Rgb;

/// Two independent images whose mean is the reference.
#[derive(Clone, Debug)]
pub struct Halves(pub Vec<Rgb>, pub Vec<Rgb>);

/// Figures of one comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Errors {
    /// relMSE over all pixels.
    pub relmse: f64,
    /// Standard error of `relmse`.
    pub relmse_standard_error: f64,
    /// relMSE without the 0.1 % worst pixels.
    pub relmse_trimmed: f64,
    /// Standard error of `relmse_trimmed`.
    pub relmse_trimmed_standard_error: f64,
    /// mean(x − r) / mean(r).
    pub bias: f64,
    /// Standard error of `bias`.
    pub bias_standard_error: f64,
    /// Mean squared difference.
    pub mse: f64,
    /// Standard error of `mse`.
    pub mse_standard_error: f64,
    /// Mean absolute difference to the cleaned reference.
    pub mae: f64,
    /// Standard error of `mae`.
    pub mae_standard_error: f64,
    /// Pixels left out because a channel is NaN or infinite.
    pub non_finite: usize,
}

/// How many of `n` pixels are left when the 0.1 % worst are not.
pub(super) fn kept(n: usize) -> usize {
    n - n / 1000
}

/// Compares a picture of the truth's size with it. All zero for a picture without a finite pixel.
pub fn errors(image: &[Rgb], truth: &Truth) -> Errors {
    let pixels: Vec<u32> = (0..image.len() as u32).collect();
    errors_at(&pixels, image, truth)
}

/// As [`errors`], for some pixels of a picture, given with their places in it.
pub fn errors_at(pixels: &[u32], values: &[Rgb], truth: &Truth) -> Errors {
    let mut finite: Vec<(usize, Rgb)> = Vec::with_capacity(pixels.len());
    finite.extend(
        pixels
            .iter()
            .zip(values)
            .map(|(&i, &x)| (i as usize, x))
            .filter(|&(i, x)| x.is_finite() && truth.is_finite(i)),
    );
    let non_finite = pixels.len() - finite.len();
    if finite.is_empty() {
        return Errors { non_finite, ..Errors::default() };
    }
    let [a, b] = truth.pair();
    let square = |&(i, x): &(usize, Rgb)| {
        let x = x.as_dvec3();
        (x - a[i].as_dvec3()) * (x - b[i].as_dvec3())
    };
    let of_channels = |v: glam::DVec3| v.element_sum() / 3.0;
    let mean = |of: &dyn Fn(&(usize, Rgb)) -> f64| {
        truth.blocks.mean(finite.iter().map(|pixel| (pixel.0, of(pixel))))
    };
    let relative = |keep: &dyn Fn(usize) -> bool| {
        let kept = || (0..finite.len()).filter(|&k| keep(k)).map(|k| &finite[k]);
        let [first, second] = [0, 1].map(|half| {
            let of = |p: &(usize, Rgb)| truth.relative_by_half(p.0, square(p))[half];
            kept().map(of).sum::<f64>() / kept().count() as f64
        });
        let of = |p: &(usize, Rgb)| (p.0, truth.relative(p.0, square(p)));
        let Estimate { value, standard_error } = truth.blocks.mean(kept().map(of));
        Estimate { value, standard_error: standard_error.hypot(0.5 * (first - second)) }
    };
    let relmse = relative(&|_| true);
    let mse = mean(&|pixel| of_channels(square(pixel)));
    let quiet = truth.quiet();
    let mae = mean(&|&(i, x)| of_channels((x.as_dvec3() - quiet[i].as_dvec3()).abs()));
    let r = &truth.reference.mean;
    let bias = mean(&|&(i, x)| of_channels(x.as_dvec3() - r[i].as_dvec3()));
    let of_level = |v: f64| if truth.level == 0.0 { 0.0 } else { v / truth.level };
    let keep = worst_left_out(&finite, truth);
    let trimmed = relative(&|k| keep[k]);
    Errors {
        relmse: relmse.value,
        relmse_standard_error: relmse.standard_error,
        relmse_trimmed: trimmed.value,
        relmse_trimmed_standard_error: trimmed.standard_error,
        bias: of_level(bias.value),
        bias_standard_error: of_level(bias.standard_error),
        mse: mse.value,
        mse_standard_error: mse.standard_error,
        mae: mae.value,
        mae_standard_error: mae.standard_error,
        non_finite,
    }
}

/// For each pixel whether it stays when the worst by (x − c)² / (c² + 0.01 m²) are left out.
pub(super) fn worst_left_out(pixels: &[(usize, Rgb)], truth: &Truth) -> Vec<bool> {
    let rank = |&(i, x): &(usize, Rgb)| {
        let d = x.as_dvec3() - truth.clean[i].as_dvec3();
        truth.relative(i, d * d)
    };
    let mut order: Vec<(f64, usize)> = pixels.iter().map(rank).zip(0..).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut keep = vec![true; pixels.len()];
    order[kept(pixels.len())..].iter().for_each(|&(_, i)| keep[i] = false);
    keep
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::Reference;
    use crate::sampling::{Rng, Stream};

    fn grey(values: [f32; 4]) -> Vec<Rgb> {
        values.map(Rgb::splat).to_vec()
    }

    fn of(image: &[Rgb], exact: &[Rgb]) -> Errors {
        errors(image, &Truth::exact(exact.len() as u32, 1, exact))
    }

    #[test]
    fn two_by_two_by_hand() {
        // m = 2; floors 1 + 0.04, 4 + 0.04 and so on; only pixels 0 and 3 differ.
        let e = of(&grey([2.0, 2.0, 1.0, 3.0]), &grey([1.0, 2.0, 1.0, 4.0]));
        let terms = [1.0 / 1.04, 0.0, 0.0, 1.0 / 16.04];
        let mean: f64 = terms.iter().sum::<f64>() / 4.0;
        let spread = (terms.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / 3.0 / 4.0).sqrt();
        assert!((e.relmse - mean).abs() < 1e-12 && (e.relmse_trimmed - mean).abs() < 1e-12);
        assert!((e.relmse_standard_error - spread).abs() < 1e-12);
        assert_eq!((e.bias, e.mse, e.mae, e.non_finite), (0.0, 0.5, 0.5, 0));
        // Squares and absolute values 1, 0, 0, 1.
        let spread = (4.0 * 0.25f64 / 3.0 / 4.0).sqrt();
        assert!((e.mse_standard_error - spread).abs() < 1e-12);
        assert!((e.mae_standard_error - spread).abs() < 1e-12);
        let e = of(&grey([3.0, 2.0, 1.0, 4.0]), &grey([1.0, 2.0, 1.0, 4.0]));
        assert!((e.bias - 0.25).abs() < 1e-12 && (e.bias_standard_error - 0.25).abs() < 1e-12);
    }

    #[test]
    fn equal_images_and_nan() {
        let x = grey([0.0, 2.0, 5.0, 1.0]);
        assert_eq!(of(&x, &x), Errors::default());
        assert_eq!(of(&grey([0.0; 4]), &grey([0.0; 4])), Errors::default());
        let mut bad = x.clone();
        bad[1].y = f32::NAN;
        assert_eq!(of(&bad, &x), Errors { non_finite: 1, ..Errors::default() });
    }

    #[test]
    fn worst_pixels_are_left_out() {
        let reference = vec![Rgb::ONE; 2000];
        let mut image = reference.clone();
        image[7] = Rgb::splat(101.0);
        image[8] = Rgb::splat(2.0);
        image[9] = Rgb::splat(1.1);
        let e = of(&image, &reference);
        assert!((e.relmse_trimmed - 0.01 / 1.01 / 1998.0).abs() < 1e-8 && e.relmse > 4.0);
    }

    /// A room: a bright and a dark half with a soft border, and a picture of it that is 5 % off in
    /// stripes. Its truth has noise of several times a dark pixel's value, as a path tracer's
    /// rare bright samples make it: r² in the denominator would be near 0 in most dark pixels.
    #[test]
    fn noise_of_the_truth_counts_neither_above_nor_below_the_line() {
        let (width, height) = (256u32, 192u32);
        let exact: Vec<Rgb> = (0..width * height)
            .map(|i| {
                let t = 1.0 / (1.0 + (((i % width) as f32 - 128.0) / 12.0).exp());
                Rgb::new(1.0, 0.8, 0.5) * (0.05 + t)
            })
            .collect();
        let image: Vec<Rgb> = exact
            .iter()
            .zip(0u32..)
            .map(|(&c, i)| c * if (i % width / 8).is_multiple_of(2) { 1.05 } else { 0.97 })
            .collect();
        let noisy = |seed| -> Vec<Rgb> {
            let mut rng = Rng::new(seed, Stream::Test, 0, 0);
            exact.iter().map(|&c| c * if rng.next_f32() < 0.25 { 4.0 } else { 0.0 }).collect()
        };
        let right = errors(&image, &Truth::exact(width, height, &exact));
        let halves = Halves(noisy(1), noisy(2));
        let mean: Vec<Rgb> = halves.0.iter().zip(&halves.1).map(|(a, b)| (*a + *b) * 0.5).collect();
        let reference = Reference {
            mean,
            halves: Some(halves),
            ..Truth::exact(width, height, &exact).reference
        };
        let truth = Truth::new(reference, None).unwrap();
        let found = errors(&image, &truth);
        // Its own noise is 1.5 where it is 1 to the floor: a thousand times the error.
        assert!(truth.noise().unwrap() > 500.0 * right.relmse, "{:?}", truth.noise());
        for (got, want, error) in [
            (found.relmse, right.relmse, found.relmse_standard_error),
            (found.relmse_trimmed, right.relmse_trimmed, found.relmse_trimmed_standard_error),
            (found.mse, right.mse, found.mse_standard_error),
            (found.bias, right.bias, found.bias_standard_error),
        ] {
            assert!((got - want).abs() < 3.0 * error, "{got} ± {error}, not {want}");
        }
    }
}
