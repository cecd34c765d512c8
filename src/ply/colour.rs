//! The 8-bit colour that a viewer shows for a value.
//!
//! Values are scaled so that their mean is at 0.2, clamped to 0..1 and raised to 1/2.2.

use crate::radiometry::Rgb;

/// Scale that brings the mean of the values to middle grey; 1 when it is not positive.
pub fn colour_scale(values: impl Iterator<Item = Rgb>) -> f32 {
    let (sum, count) =
        values.fold((0.0f64, 0.0f64), |(s, n), v| (s + f64::from(v.element_sum() / 3.0), n + 1.0));
    if sum > 0.0 { (0.2 * count / sum) as f32 } else { 1.0 }
}

/// The colour that a viewer shows for a value.
pub fn colour(value: Rgb, scale: f32) -> [u8; 3] {
    (value * scale).to_array().map(|v| (v.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0 + 0.5) as u8)
}
