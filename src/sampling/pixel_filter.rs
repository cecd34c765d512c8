//! Pixel filters by importance: a pixel's value is the plain mean over image positions drawn with
//! the filter's own density.
//!
//! ```text
//! I(pixel) = ∫ f(x − centre) L(x) dx,  ∫ f = 1,  f ≥ 0
//! x = centre + W(u),  density of W(u) = f
//! box       1 / (2r)² on the square |x|, |y| ≤ r
//! tent      (1 − |x| / r)(1 − |y| / r) / r² there
//! gaussian  exp(−(x² + y²) / 2σ²), cut off and normalised at x² + y² = r², σ = r / 3
//! ```
//! Input  a uniform point of the unit square. Output  an image position, from the pixel's upper
//!        left corner, in pixels. Guarantees  strata of the square stay compact; the box of radius
//!        ½ gives the point itself, bit for bit. Not  filters with negative lobes: means of
//!        positive samples stay positive.

use super::sample_disc;
use crate::settings::choices;
use glam::Vec2;

choices! {
    /// Shape of a pixel filter.
    #[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
    pub enum FilterShape default Box {
        /// Every position of a square counts alike; the pixel itself with radius ½.
        Box = "box",
        /// Falls off linearly.
        Tent = "tent",
        /// Falls off as a Gaussian with a third of the radius as its deviation.
        Gaussian = "gaussian",
    }
}

impl FilterShape {
    /// The usual radius, in pixels.
    pub fn default_radius(self) -> f32 {
        match self {
            Self::Box => 0.5,
            Self::Tent => 1.0,
            Self::Gaussian => 1.5,
        }
    }
}

/// A pixel filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelFilter {
    /// Shape.
    pub shape: FilterShape,
    /// Where it ends, in pixels from the pixel's centre.
    pub radius: f32,
}

impl Default for PixelFilter {
    fn default() -> Self {
        Self { shape: FilterShape::Box, radius: 0.5 }
    }
}

impl PixelFilter {
    /// The image position for a uniform point, relative to the pixel's upper left corner.
    pub fn position(&self, u: Vec2) -> Vec2 {
        if *self == Self::default() {
            return u;
        }
        let centre = Vec2::splat(0.5);
        match self.shape {
            FilterShape::Box => centre + (u * 2.0 - Vec2::ONE) * self.radius,
            FilterShape::Tent => centre + Vec2::new(tent(u.x), tent(u.y)) * self.radius,
            FilterShape::Gaussian => {
                let disc = sample_disc(u);
                let share = disc.length_squared();
                let distance = -2.0 * (share * (-4.5f32).exp_m1()).ln_1p();
                centre + disc.normalize_or_zero() * (distance.max(0.0).sqrt() * self.radius / 3.0)
            }
        }
    }
}

/// Inverse of the tent's distribution on −1..1.
fn tent(u: f32) -> f32 {
    if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 * (1.0 - u)).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sobol, Stream};

    #[test]
    fn positions_follow_the_density() {
        let sobol = Sobol::new(3, Stream::Test, 0);
        let n = 1 << 14;
        // Variance per axis and the share within half the radius of the vertical axis, both in
        // closed form; the Gaussian's with a = 9/2 cut off.
        let cut = (-4.5f64).exp() / (1.0 - (-4.5f64).exp());
        for (shape, variance, radius) in [
            (FilterShape::Box, 1.0 / 3.0, 0.5),
            (FilterShape::Box, 1.0 / 3.0, 2.0),
            (FilterShape::Tent, 1.0 / 6.0, 1.0),
            (FilterShape::Gaussian, (1.0 - 4.5 * cut) / 9.0, 1.5),
        ] {
            let filter = PixelFilter { shape, radius };
            let (mut mean, mut square, mut inside) = (glam::DVec2::ZERO, glam::DVec2::ZERO, 0);
            for i in 0..n {
                let p = (filter.position(sobol.sample_2d(i, 0)) - 0.5) / radius;
                assert!(
                    p.abs().max_element() <= 1.0 + 1e-6
                        && (shape != FilterShape::Gaussian || p.length() <= 1.0 + 1e-5),
                    "{p}"
                );
                mean += p.as_dvec2() / f64::from(n);
                square += p.as_dvec2() * p.as_dvec2() / f64::from(n);
                inside += i32::from(p.x.abs() < 0.5);
            }
            assert!(
                mean.length() < 1e-3
                    && (square - variance).abs().max_element() < 2e-3 * variance + 2e-4,
                "{shape:?}: {mean} {square} {variance}"
            );
            if shape != FilterShape::Gaussian {
                let expected = if shape == FilterShape::Box { 0.5 } else { 0.75 };
                assert!(
                    (f64::from(inside) / f64::from(n) - expected).abs() < 1e-3,
                    "{shape:?}: {inside}"
                );
            }
        }
        let u = Vec2::new(0.1, 0.7);
        assert_eq!(PixelFilter::default().position(u), u);
    }
}
