//! Real spherical harmonics, the clamped-cosine convolution, least-squares fits, and their exact
//! integrals over polygons.
//!
//! Order and sign, stated once: coefficient `l² + l + m`; orthonormal; no Condon–Shortley phase, so
//! Y₁ = 0.4886 · (y, z, x) for m = −1, 0, 1. A field of radiance is [`ShRgb`]: one RGB triple a
//! coefficient. `bands` = l_max + 1.

mod basis;
mod fit;
mod polygon;
mod polygon8;
mod quadratic;

pub use basis::{COEFFICIENTS, MAX_BANDS, basis, cosine_band};
pub use fit::Fit;
pub use polygon::{clip_to_horizon, form_integral, moments};
pub use polygon8::{cross, dot, moments8};
pub use quadratic::{MOMENTS, Quadratic};

use crate::journal::Stored;
use crate::radiometry::Rgb;
use glam::Vec3;

/// Radiance over directions: coefficients of up to [`MAX_BANDS`] bands, RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShRgb(pub [Rgb; COEFFICIENTS]);

impl Stored for ShRgb {
    fn put(&self, out: &mut Vec<u8>) {
        self.0.put(out);
    }
    fn take(from: &mut &[u8]) -> Option<Self> {
        Stored::take(from).map(Self)
    }
}

impl Default for ShRgb {
    fn default() -> Self {
        Self([Rgb::ZERO; COEFFICIENTS])
    }
}

impl ShRgb {
    /// Radiance in direction `w` (unit).
    pub fn radiance(&self, w: Vec3) -> Rgb {
        basis(w).iter().zip(&self.0).map(|(&y, &c)| c * y).sum()
    }
    /// Irradiance on a plane with unit normal `n`: Σ A_l c_lm Y_lm(n) `[RH01]`.
    pub fn irradiance(&self, n: Vec3) -> Rgb {
        let y = basis(n);
        let mut sum = Rgb::ZERO;
        for l in 0..MAX_BANDS {
            let band: Rgb = (l * l..(l + 1) * (l + 1)).map(|i| self.0[i] * y[i]).sum();
            sum += band * cosine_band(l);
        }
        sum
    }
    /// Adds `other · weight`.
    pub fn add_scaled(&mut self, other: &Self, weight: f32) {
        for (a, b) in self.0.iter_mut().zip(&other.0) {
            *a += *b * weight;
        }
    }
}
