//! RGB quantities and the sRGB curve. Linear BT.709 throughout.
//!
//! Units: radiance W·sr⁻¹·m⁻², irradiance and radiosity W·m⁻², flux W, each per channel.
//! `radiosity = albedo · irradiance`, `radiance = radiosity / π` for the diffuse surfaces of this
//! renderer.

use glam::Vec3;

/// A linear BT.709 triple.
pub type Rgb = Vec3;

/// BT.709 luminance.
pub fn luminance(c: Rgb) -> f32 {
    c.dot(Rgb::new(0.2126, 0.7152, 0.0722))
}

/// sRGB-encoded value in \[0, 1\] to linear (IEC 61966-2-1).
pub fn linear_from_srgb(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Linear value in \[0, 1\] to sRGB-encoded (IEC 61966-2-1).
pub fn srgb_from_linear(v: f32) -> f32 {
    let v = v.clamp(0.0, 1.0);
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// Largest albedo a surface may have; brighter inputs are clamped so that light always dies out.
pub const MAX_ALBEDO: f32 = 0.95;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_round_trip() {
        for i in 0..=255 {
            let v = i as f32 / 255.0;
            assert!((srgb_from_linear(linear_from_srgb(v)) - v).abs() < 1e-5);
        }
    }
}
