//! What the random numbers of short rays are keyed by: what their noise sticks to when the camera
//! moves.
//!
//! With `point` the key is the number of the shading point: noise is independent everywhere, and
//! new in every frame of a film. With `pixel` it is the pixel, and which of its points: independent
//! everywhere in a picture, while in a film the noise stands still on the screen and the scene
//! moves under it. With `world` it is a box of space, at most a pixel wide, and the facing: nearly
//! independent in a picture, and in a film the noise moves with the surface.
//!
//! Boxes of `world` have sides of powers of two, so that they stay while a camera comes nearer,
//! until it is twice as near. The key is a function of the shading points alone, never of threads
//! or of earlier frames.

use crate::record::ShadingPoints;
use crate::sampling::hash64;
use crate::settings::choices;

choices! {
    /// What near noise sticks to.
    pub enum NearNoise default Point {
        /// Nothing: a number of its own for every shading point of a picture.
        Point = "point",
        /// The screen.
        Pixel = "pixel",
        /// The surfaces.
        World = "world",
    }
}

/// Side of a box in pixel footprints, at most.
const BOX: f32 = 1.0;

impl NearNoise {
    /// The element that keys the random numbers of point `i`.
    pub fn element(self, points: &ShadingPoints, i: usize) -> u64 {
        match self {
            Self::Point => i as u64,
            Self::Pixel => {
                let earlier =
                    points.pixel[..i].iter().rev().take_while(|&&p| p == points.pixel[i]).count();
                u64::from(points.pixel[i]) << 16 | earlier as u64
            }
            Self::World => {
                let level = (points.footprint[i].max(f32::MIN_POSITIVE) * BOX).log2().floor();
                let at = (points.p[i].as_dvec3() / f64::from(level.exp2())).floor();
                let facing = (points.ns[i] * 2.0).round().as_i64vec3();
                let words = [
                    at.x as i64,
                    at.y as i64,
                    at.z as i64,
                    level as i64,
                    facing.x,
                    facing.y,
                    facing.z,
                ]
                .map(|w| w as u64);
                words.into_iter().fold(0, |h, w| hash64(h ^ w).wrapping_add(0x9e37_79b9_7f4a_7c15))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn noise_sticks_to_what_it_should() {
        let points = |shift: usize, p: Vec3| ShadingPoints {
            p: vec![Vec3::X * 5.0; shift].into_iter().chain([p, p]).collect(),
            ns: vec![Vec3::Z; shift].into_iter().chain([Vec3::Z, -Vec3::Z]).collect(),
            pixel: vec![3; shift].into_iter().chain([7, 7]).collect(),
            footprint: vec![0.1; shift + 2],
            ..ShadingPoints::default()
        };
        let (a, b) =
            (points(0, Vec3::new(1.01, 2.01, 3.01)), points(4, Vec3::new(1.011, 2.012, 3.013)));
        let same = |noise: NearNoise| noise.element(&a, 0) == noise.element(&b, 4);
        assert!(!same(NearNoise::Point) && same(NearNoise::Pixel) && same(NearNoise::World));
        for noise in [NearNoise::Point, NearNoise::Pixel, NearNoise::World] {
            assert_ne!(
                noise.element(&a, 0),
                noise.element(&a, 1),
                "{noise:?}: two sides of a sheet"
            );
        }
        let aside = points(0, Vec3::new(1.11, 2.01, 3.01));
        assert_ne!(NearNoise::World.element(&a, 0), NearNoise::World.element(&aside, 0));
    }
}
