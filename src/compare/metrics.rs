//! relMSE, bias, MSE, MAE.
//!
//! Computes   relMSE = mean over pixels and channels of (x−r)² / (r² + 0.01 m²), m the mean of r
//!            over all pixels and channels; plain and with the 0.1 % worst pixels left out. bias =
//!            mean(x−r) / m.
//! Method     With two independent half images of the reference (x−r)² is estimated by
//!            (x−half0)(x−half1), which the reference's noise does not bias; single terms, and the
//!            figure of a very good image, may then be negative. The standard error is that of the
//!            mean over pixels. The worst pixels are found by (x−r)².
//! Not        free of the noise in the denominator r²: a reference whose own relMSE is s shifts the
//!            figure by about 4 (x−r)/r · s, so a reference should be known to a tenth of the error
//!            that is to be measured (`nearfar reference` prints its noise). Guarantees sums in
//!            f64, in pixel order: the same bits on every run.
//! Not        defined for NaN and infinities: pixels with any in either image are left out and
//!            counted in `non_finite`.

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
    /// Mean squared difference.
    pub mse: f64,
    /// Mean absolute difference.
    pub mae: f64,
    /// Pixels left out because a channel is NaN or infinite.
    pub non_finite: usize,
}

/// Compares `image` with `reference` (equal lengths); `halves` when the reference has them. All
/// zero for images without a finite pixel.
pub fn errors(image: &[Rgb], reference: &[Rgb], halves: Option<&Halves>) -> Errors {
    let finite: Vec<usize> = (0..image.len().min(reference.len()))
        .filter(|&i| image[i].is_finite() && reference[i].is_finite())
        .collect();
    let non_finite = image.len() - finite.len();
    if finite.is_empty() {
        return Errors { non_finite, ..Errors::default() };
    }
    let n = finite.len() as f64;
    let m = finite.iter().map(|&i| reference[i].as_dvec3().element_sum()).sum::<f64>() / (3.0 * n);
    let mut out = Errors { non_finite, ..Errors::default() };
    // Per pixel: (x−r)² for ranking, the estimate for the figure.
    let mut terms: Vec<(f64, f64)> = Vec::with_capacity(finite.len());
    for &i in &finite {
        let (x, r) = (image[i].as_dvec3(), reference[i].as_dvec3());
        let d = x - r;
        let floor = r * r + 0.01 * m * m;
        let share = |v: glam::DVec3| {
            (0..3).map(|c| if v[c] == 0.0 { 0.0 } else { v[c] / floor[c] }).sum::<f64>() / 3.0
        };
        let plain = share(d * d);
        let estimate =
            halves.map_or(plain, |h| share((x - h.0[i].as_dvec3()) * (x - h.1[i].as_dvec3())));
        terms.push((plain, estimate));
        out.bias += d.element_sum() / (3.0 * n);
        out.mse += (d * d).element_sum() / (3.0 * n);
        out.mae += d.abs().element_sum() / (3.0 * n);
    }
    out.bias = if m == 0.0 { 0.0 } else { out.bias / m };
    (out.relmse, out.relmse_standard_error) = mean_and_error(terms.iter().map(|t| t.1));
    terms.sort_by(|a, b| a.0.total_cmp(&b.0));
    terms.truncate(finite.len() - finite.len() / 1000);
    (out.relmse_trimmed, out.relmse_trimmed_standard_error) =
        mean_and_error(terms.iter().map(|t| t.1));
    out
}

fn mean_and_error(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    let squares = values.map(|v| (v - mean).powi(2)).sum::<f64>();
    (mean, if n > 1.0 { (squares / (n - 1.0) / n).sqrt() } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(values: [f32; 4]) -> Vec<Rgb> {
        values.map(Rgb::splat).to_vec()
    }

    #[test]
    fn two_by_two_by_hand() {
        // m = 2; floors 1 + 0.04, 4 + 0.04 and so on; only pixels 0 and 3 differ.
        let e = errors(&grey([2.0, 2.0, 1.0, 3.0]), &grey([1.0, 2.0, 1.0, 4.0]), None);
        let terms = [1.0 / 1.04, 0.0, 0.0, 1.0 / 16.04];
        let mean: f64 = terms.iter().sum::<f64>() / 4.0;
        let spread = (terms.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / 3.0 / 4.0).sqrt();
        assert!((e.relmse - mean).abs() < 1e-12 && (e.relmse_trimmed - mean).abs() < 1e-12);
        assert!((e.relmse_standard_error - spread).abs() < 1e-12);
        assert_eq!((e.bias, e.mse, e.mae, e.non_finite), (0.0, 0.5, 0.5, 0));
        let e = errors(&grey([3.0, 2.0, 1.0, 4.0]), &grey([1.0, 2.0, 1.0, 4.0]), None);
        assert!((e.bias - 0.25).abs() < 1e-12);
    }

    #[test]
    fn equal_images_and_nan() {
        let x = grey([0.0, 2.0, 5.0, 1.0]);
        assert_eq!(errors(&x, &x, None), Errors::default());
        assert_eq!(errors(&grey([0.0; 4]), &grey([0.0; 4]), None), Errors::default());
        let mut bad = x.clone();
        bad[1].y = f32::NAN;
        assert_eq!(errors(&bad, &x, None), Errors { non_finite: 1, ..Errors::default() });
    }

    #[test]
    fn halves_cancel_the_references_noise() {
        let mut rng = crate::sampling::Rng::new(1, crate::sampling::Stream::Test, 0, 0);
        let mut noisy = || {
            (0..400_000).map(|_| Rgb::splat(1.0 + 0.1 * (rng.next_f32() - 0.5))).collect::<Vec<_>>()
        };
        let halves = Halves(noisy(), noisy());
        let mean: Vec<Rgb> = halves.0.iter().zip(&halves.1).map(|(a, b)| (*a + *b) * 0.5).collect();
        let image = vec![Rgb::splat(1.02); mean.len()];
        let plain = errors(&image, &mean, None);
        let e = errors(&image, &mean, Some(&halves));
        let truth = 4e-4 / 1.01;
        // The noise of the denominator stays: with noise variance s = 4.2e-4 of the mean it adds
        // about 4 (x−r) s = 3.3e-5.
        assert!(
            (e.relmse - truth).abs() < 4.0 * e.relmse_standard_error + 4e-5,
            "{} ± {}",
            e.relmse,
            e.relmse_standard_error
        );
        assert!(plain.relmse > 1.8 * truth);
    }

    #[test]
    fn worst_pixels_are_left_out() {
        let reference = vec![Rgb::ONE; 2000];
        let mut image = reference.clone();
        image[7] = Rgb::splat(101.0);
        image[8] = Rgb::splat(2.0);
        image[9] = Rgb::splat(1.1);
        let e = errors(&image, &reference, None);
        assert!((e.relmse_trimmed - 0.01 / 1.01 / 1998.0).abs() < 1e-8 && e.relmse > 4.0);
    }
}
