//! 8-bit textures, looked up bilinearly in linear colour, repeating, v upward (texel (0, 0) is the
//! upper left of the image).

use crate::radiometry::{Rgb, linear_from_srgb};
use glam::{Vec2, Vec3};
use std::sync::LazyLock;

static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0)));

/// An image used as a texture.
#[derive(Clone, Debug, Default)]
pub struct Texture {
    /// File it came from, for messages.
    pub name: String,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// sRGB-encoded texels, row by row from the top.
    pub srgb: Vec<[u8; 3]>,
    /// Mask values (the alpha channel where the image has one, else its red channel, not
    /// sRGB-decoded), row by row.
    pub mask: Vec<u8>,
}

impl Texture {
    fn bilinear<T: std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>>(
        &self,
        uv: Vec2,
        at: impl Fn(usize) -> T,
    ) -> T {
        let (w, h) = (self.width as i64, self.height as i64);
        let x = uv.x.rem_euclid(1.0) * w as f32 - 0.5;
        let y = (1.0 - uv.y.rem_euclid(1.0)) * h as f32 - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let index = |dx: i64, dy: i64| {
            ((y0 as i64 + dy).rem_euclid(h) * w + (x0 as i64 + dx).rem_euclid(w)) as usize
        };
        (at(index(0, 0)) * (1.0 - fx) + at(index(1, 0)) * fx) * (1.0 - fy)
            + (at(index(0, 1)) * (1.0 - fx) + at(index(1, 1)) * fx) * fy
    }

    /// Linear colour at `uv`; white for an empty or non-finite lookup.
    pub fn color(&self, uv: Vec2) -> Rgb {
        if self.srgb.is_empty() || !uv.is_finite() {
            return Rgb::ONE;
        }
        self.bilinear(uv, |i| Vec3::from_array(self.srgb[i].map(|c| LINEAR[c as usize])))
    }

    /// Mask value in \[0, 1\] at `uv`; 1 for an empty or non-finite lookup.
    pub fn mask(&self, uv: Vec2) -> f32 {
        if self.mask.is_empty() || !uv.is_finite() {
            return 1.0;
        }
        self.bilinear(uv, |i| f32::from(self.mask[i])) / 255.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orientation_and_interpolation() {
        let t = Texture {
            name: String::new(),
            width: 2,
            height: 2,
            srgb: vec![[255, 0, 0], [0, 255, 0], [0, 0, 255], [0, 0, 0]],
            mask: vec![255, 0, 0, 0],
        };
        assert!(
            (t.color(Vec2::new(0.25, 0.75)) - Vec3::X).length() < 1e-6,
            "upper left texel at v = 0.75"
        );
        assert!((t.color(Vec2::new(0.25, 0.25)) - Vec3::Z).length() < 1e-6);
        assert!((t.color(Vec2::new(0.5, 0.75)) - Vec3::new(0.5, 0.5, 0.0)).length() < 1e-6);
        assert!((t.color(Vec2::new(-0.75, 1.75)) - Vec3::X).length() < 1e-6, "repeats");
        assert!((t.mask(Vec2::new(0.5, 0.75)) - 0.5).abs() < 1e-6);
    }
}
