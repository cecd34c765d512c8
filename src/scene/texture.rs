//! 8-bit textures, looked up bilinearly in linear colour, v upward (texel (0, 0) is the upper left
//! of the image), placed on the surface by a [`Placement`].

use crate::radiometry::{Rgb, linear_from_srgb};
use glam::{Vec2, Vec3};
use std::sync::LazyLock;

static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0)));

/// How an image lies on a surface, and what its values mean there: those of a lookup at `uv` are
/// `base + gain · image(scale · uv + offset)`, linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Factor of the texture coordinates.
    pub scale: Vec2,
    /// Added to them afterwards.
    pub offset: Vec2,
    /// Outside 0 to 1 the texel at the edge counts; else the image repeats.
    pub clamp: bool,
    /// Added to the values.
    pub base: f32,
    /// Factor of the values.
    pub gain: f32,
}

impl Default for Placement {
    fn default() -> Self {
        Self { scale: Vec2::ONE, offset: Vec2::ZERO, clamp: false, base: 0.0, gain: 1.0 }
    }
}

impl Placement {
    /// What a value of the image means.
    pub fn value(&self, image: f32) -> f32 {
        self.base + self.gain * image
    }

    /// All of it as numbers.
    pub fn numbers(&self) -> [f32; 7] {
        let Self { scale, offset, clamp, base, gain } = *self;
        [scale.x, scale.y, offset.x, offset.y, f32::from(u8::from(clamp)), base, gain]
    }
}

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
    /// How it lies on surfaces.
    pub placement: Placement,
}

impl Texture {
    fn bilinear<T: std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>>(
        &self,
        uv: Vec2,
        at: impl Fn(usize) -> T,
    ) -> T {
        let (w, h) = (self.width as i64, self.height as i64);
        let Placement { scale, offset, clamp, .. } = self.placement;
        let uv = uv * scale + offset;
        let uv = if clamp {
            uv.clamp(Vec2::ZERO, Vec2::ONE)
        } else {
            Vec2::new(uv.x.rem_euclid(1.0), uv.y.rem_euclid(1.0))
        };
        let x = uv.x * w as f32 - 0.5;
        let y = (1.0 - uv.y) * h as f32 - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let inside = |i: i64, n: i64| if clamp { i.clamp(0, n - 1) } else { i.rem_euclid(n) };
        let index =
            |dx: i64, dy: i64| (inside(y0 as i64 + dy, h) * w + inside(x0 as i64 + dx, w)) as usize;
        (at(index(0, 0)) * (1.0 - fx) + at(index(1, 0)) * fx) * (1.0 - fy)
            + (at(index(0, 1)) * (1.0 - fx) + at(index(1, 1)) * fx) * fy
    }

    /// Linear colour at `uv`; white for an empty or non-finite lookup.
    pub fn color(&self, uv: Vec2) -> Rgb {
        if self.srgb.is_empty() || !uv.is_finite() {
            return Rgb::ONE;
        }
        let Placement { base, gain, .. } = self.placement;
        let image =
            self.bilinear(uv, |i| Vec3::from_array(self.srgb[i].map(|c| LINEAR[c as usize])));
        (image * gain + base).max(Vec3::ZERO)
    }

    /// Mean linear colour of the image.
    pub fn mean(&self) -> Rgb {
        let sum = |sum: glam::DVec3, texel: &[u8; 3]| {
            sum + Vec3::from_array(texel.map(|c| LINEAR[c as usize])).as_dvec3()
        };
        let sum = self.srgb.iter().fold(glam::DVec3::ZERO, sum);
        let Placement { base, gain, .. } = self.placement;
        let mean = (sum / self.srgb.len().max(1) as f64).as_vec3();
        (mean * gain + base).max(Vec3::ZERO)
    }

    /// Greatest linear colour of the image, by channel.
    pub fn brightest(&self) -> Rgb {
        let Placement { base, gain, .. } = self.placement;
        let ends = self.srgb.iter().fold([Vec3::splat(1.0), Vec3::ZERO], |[low, high], texel| {
            let c = Vec3::from_array(texel.map(|c| LINEAR[c as usize]));
            [low.min(c), high.max(c)]
        });
        let [a, b] = ends.map(|c| (c * gain + base).max(Vec3::ZERO));
        if self.srgb.is_empty() { Rgb::ONE } else { a.max(b) }
    }

    /// Mask value in \[0, 1\] at `uv`; 1 for an empty or non-finite lookup.
    pub fn mask(&self, uv: Vec2) -> f32 {
        if self.mask.is_empty() || !uv.is_finite() {
            return 1.0;
        }
        let Placement { base, gain, .. } = self.placement;
        (self.bilinear(uv, |i| f32::from(self.mask[i])) / 255.0 * gain + base).clamp(0.0, 1.0)
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
            placement: Placement::default(),
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
    #[test]
    fn placements() {
        let row = |placement| Texture {
            width: 2,
            height: 1,
            srgb: vec![[0; 3], [255; 3]],
            mask: vec![0, 255],
            placement,
            ..Texture::default()
        };
        let at = |placement, u: f32| row(placement).color(Vec2::new(u, 0.5)).x;
        let twice = Placement { scale: Vec2::splat(2.0), ..Placement::default() };
        for (u, expected) in [(0.125, 0.0), (0.375, 1.0), (0.625, 0.0), (0.875, 1.0)] {
            assert!((at(twice, u) - expected).abs() < 1e-6);
        }
        let shifted = Placement { offset: Vec2::new(0.5, 0.0), ..Placement::default() };
        assert!((at(shifted, 0.25) - 1.0).abs() < 1e-6);
        let clamped = Placement { clamp: true, ..twice };
        assert!((at(clamped, 0.9) - 1.0).abs() < 1e-6 && at(clamped, -0.3).abs() < 1e-6);
        let faded = Placement { base: 0.2, gain: 0.5, ..Placement::default() };
        assert!((at(faded, 0.25) - 0.2).abs() < 1e-6 && (at(faded, 0.75) - 0.7).abs() < 1e-6);
        assert!((row(faded).mask(Vec2::new(0.75, 0.5)) - 0.7).abs() < 1e-6);
    }
}
