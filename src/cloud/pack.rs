//! Compact forms: unit vectors in 4 bytes, colours in 4 bytes, spherical harmonics in 2 bytes a
//! coefficient.

use glam::{Vec2, Vec3};

use crate::radiometry::Rgb;

/// A unit vector on the octahedron, 16 bits an axis; error below 4e-5 rad.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PackedNormal([i16; 2]);

impl PackedNormal {
    pub fn new(n: Vec3) -> Self {
        let p = n / (n.x.abs() + n.y.abs() + n.z.abs());
        let folded = if p.z >= 0.0 {
            Vec2::new(p.x, p.y)
        } else {
            Vec2::new(
                (1.0 - p.y.abs()) * 1f32.copysign(p.x),
                (1.0 - p.x.abs()) * 1f32.copysign(p.y),
            )
        };
        Self(folded.to_array().map(|v| (v * 32767.0).round() as i16))
    }
    pub fn get(self) -> Vec3 {
        let [x, y] = self.0.map(|v| f32::from(v) * (1.0 / 32767.0));
        let z = 1.0 - x.abs() - y.abs();
        let t = (-z).max(0.0);
        Vec3::new(x - t.copysign(x), y - t.copysign(y), z).normalize()
    }
}

/// A colour that is not negative: three mantissas of 9 bits, one exponent of 5; error below 1/512
/// of the largest channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PackedRgb(u32);

impl PackedRgb {
    const BIAS: i32 = 15 + 9;

    /// `scale` brings the colours of a scene to about 1; the same is needed to read.
    pub fn new(c: Rgb, scale: f32) -> Self {
        let c = (c * scale).clamp(Vec3::ZERO, Vec3::splat(65_000.0));
        let most = c.max_element();
        if most < 1e-7 {
            return Self(0);
        }
        let exponent = (most.log2().floor() as i32 + 1).max(-14);
        let mantissas = (c * 2f32.powi(9 - exponent)).round().min(Vec3::splat(511.0));
        Self(
            mantissas.x as u32
                | (mantissas.y as u32) << 9
                | (mantissas.z as u32) << 18
                | ((exponent + 15) as u32) << 27,
        )
    }
    /// The colour times the scale it was made with.
    pub fn get(self) -> Rgb {
        let m = |shift: u32| (self.0 >> shift & 511) as f32;
        // 2^(e − bias) by its bits.
        let power = f32::from_bits(((self.0 >> 27) as i32 - Self::BIAS + 127) as u32 * (1 << 23));
        Vec3::new(m(0), m(9), m(18)) * power
    }
}

/// Nine coefficients and the scale they share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PackedSh<const N: usize> {
    scale: f32,
    coefficients: [i16; N],
}

impl<const N: usize> PackedSh<N> {
    pub fn new(c: &[f32; N]) -> Self {
        let most = c.iter().fold(0f32, |m, v| m.max(v.abs()));
        if most == 0.0 {
            return Self { scale: 0.0, coefficients: [0; N] };
        }
        let inverse = 32767.0 / most;
        Self { scale: most / 32767.0, coefficients: c.map(|v| (v * inverse).round() as i16) }
    }
    /// Σ `yᵢ` · coefficient `first + i`.
    pub fn dot(&self, first: usize, y: &[f32; 9]) -> f32 {
        self.coefficients[first..first + 9]
            .iter()
            .zip(y)
            .map(|(&c, &y)| f32::from(c) * y)
            .sum::<f32>()
            * self.scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream, sample_uniform_sphere};

    #[test]
    fn round_trips() {
        let mut rng = Rng::new(1, Stream::Test, 0, 0);
        for n in (0..10_000).map(|_| sample_uniform_sphere(rng.next_2d())).chain([
            Vec3::X,
            Vec3::Y,
            Vec3::Z,
            -Vec3::X,
            -Vec3::Y,
            -Vec3::Z,
        ]) {
            assert!(PackedNormal::new(n).get().distance(n) < 1e-4, "{n}");
        }
        let mut rng = Rng::new(2, Stream::Test, 0, 0);
        for i in 0..10_000 {
            let c =
                Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 10f32.powi(i % 8 - 3);
            let scale = 0.37;
            let back = PackedRgb::new(c, scale).get() / scale;
            assert!((back - c).abs().max_element() <= c.max_element() / 500.0 + 1e-6, "{c} {back}");
        }
        assert_eq!(PackedRgb::new(Vec3::ZERO, 1.0).get(), Vec3::ZERO);
        let sh = PackedSh::new(&[1.0, -2.0, 0.5, 0.0, 0.0, 3.0, 0.0, 0.0, 1e-3]);
        let mut one = [0.0; 9];
        one[1] = 1.0;
        assert!((sh.dot(0, &one) + 2.0).abs() < 1e-4);
    }
}
