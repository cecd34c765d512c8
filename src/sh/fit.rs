//! Least-squares spherical harmonics from weighted radiance samples, with a smoothness ridge.
//!
//! ```text
//! minimise  Σ wᵢ |Lᵢ − Σ c Y(ωᵢ)|² + λ Σ wᵢ · Σ_lm [l(l+1)]²/(4π) |c_lm|²
//! ```
//! The ridge is the squared Laplacian on the sphere: it leaves l = 0 free, so a constant field is
//! recovered exactly whatever λ, and the unseen hemisphere is filled smoothly instead of with zeros
//! (which would halve the radiance at the horizon).
//!
//! Guarantees  a field inside the span is recovered exactly with λ = 0 and enough samples. Cost
//!             O(bands⁴) a sample, one Cholesky a fit.

use glam::Vec3;

use super::{COEFFICIENTS, ShRgb, basis};
use crate::radiometry::Rgb;

/// Running normal equations of one fit.
#[derive(Clone, Debug)]
pub struct Fit {
    bands: usize,
    gram: [[f64; COEFFICIENTS]; COEFFICIENTS],
    right: [[f64; 3]; COEFFICIENTS],
    weight: f64,
}

impl Fit {
    /// An empty fit with `bands` bands (1..=5).
    pub fn new(bands: usize) -> Self {
        Self {
            bands,
            gram: [[0.0; COEFFICIENTS]; COEFFICIENTS],
            right: [[0.0; 3]; COEFFICIENTS],
            weight: 0.0,
        }
    }

    /// Adds an observation of `radiance` from the unit direction `w`.
    pub fn add(&mut self, w: Vec3, radiance: Rgb, weight: f32) {
        let y = basis(w).map(f64::from);
        let (n, weight) = (self.bands * self.bands, f64::from(weight));
        for i in 0..n {
            let wy = weight * y[i];
            for (g, &yj) in self.gram[i].iter_mut().zip(&y).take(i + 1) {
                *g += wy * yj;
            }
            for (r, value) in self.right[i].iter_mut().zip(radiance.to_array()) {
                *r += wy * f64::from(value);
            }
        }
        self.weight += weight;
    }

    /// The coefficients for the ridge `lambda`; zero when nothing was added.
    pub fn solve(&self, lambda: f64) -> ShRgb {
        let mut out = ShRgb::default();
        if self.weight <= 0.0 {
            return out;
        }
        let n = self.bands * self.bands;
        let mut l = [[0.0f64; COEFFICIENTS]; COEFFICIENTS];
        for i in 0..n {
            for j in 0..=i {
                let mut sum = self.gram[i][j];
                if i == j {
                    let band = (i as f64).sqrt().floor();
                    sum += lambda * self.weight * (band * (band + 1.0)).powi(2)
                        / (4.0 * std::f64::consts::PI)
                        + 1e-12 * self.weight;
                }
                for (a, b) in l[i].iter().zip(&l[j]).take(j) {
                    sum -= a * b;
                }
                l[i][j] = if i == j { sum.max(1e-14 * self.weight).sqrt() } else { sum / l[j][j] };
            }
        }
        for channel in 0..3 {
            let mut x = [0.0f64; COEFFICIENTS];
            for i in 0..n {
                let known: f64 = (0..i).map(|k| l[i][k] * x[k]).sum();
                x[i] = (self.right[i][channel] - known) / l[i][i];
            }
            for i in (0..n).rev() {
                let known: f64 = (i + 1..n).map(|k| l[k][i] * x[k]).sum();
                x[i] = (x[i] - known) / l[i][i];
                out.0[i][channel] = x[i] as f32;
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream, sample_uniform_hemisphere};

    #[test]
    fn recovers_fields_in_the_span_from_a_hemisphere() {
        let mut rng = Rng::new(1, Stream::Test, 0, 0);
        for bands in 1..=4 {
            let mut truth = ShRgb::default();
            for c in truth.0.iter_mut().take(bands * bands) {
                *c = Vec3::new(rng.next_f32() - 0.5, rng.next_f32() - 0.5, rng.next_f32());
            }
            let mut fit = Fit::new(bands);
            for _ in 0..4000 {
                let w = sample_uniform_hemisphere(rng.next_2d());
                fit.add(w, truth.radiance(w), 1.0);
            }
            let found = fit.solve(0.0);
            for (a, b) in found.0.iter().zip(&truth.0) {
                // Radiances are f32: their rounding times the condition number of the hemisphere
                // Gram matrix (6e3 at four bands).
                assert!(
                    (*a - *b).length() < if bands < 4 { 1e-4 } else { 2e-3 },
                    "{bands}: {a} {b}"
                );
            }
        }
    }

    #[test]
    fn ridge_keeps_a_constant() {
        let mut rng = Rng::new(1, Stream::Test, 1, 0);
        let mut fit = Fit::new(3);
        for _ in 0..50 {
            fit.add(sample_uniform_hemisphere(rng.next_2d()), Vec3::ONE, 1.0);
        }
        let sh = fit.solve(1e-3);
        for w in [Vec3::Z, -Vec3::Z, Vec3::X] {
            assert!((sh.radiance(w).x - 1.0).abs() < 1e-5);
        }
    }
}
