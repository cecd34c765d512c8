//! A latitude-longitude map of the light from far away, and its split into bright texels and a
//! smooth rest.
//!
//! ```text
//! L(ω) = smooth(ω) + bright(ω)
//!        smooth: min(L, T), bilinear;  bright: L − min(L, T), constant over a texel
//! T    = 8 · mean over the sphere of min(lum L, T),  the largest solution
//! ```
//!
//! T follows from the map alone: the smooth part never exceeds eight times its own mean, so rays
//! that find it by chance have little noise, and the bright part covers at most an eighth of the
//! sphere, so that it is sampled like a sun. A constant map has no bright part; one bright texel on
//! black is all bright (T = 0). Texels above T keep their hue in both parts. Directions: the
//! picture's middle looks along +z of the map, its top to +y, and its right is on the right seen
//! from inside (towards −x).
//! Cost  a pass over the texels for each step of T, at most 200.

use glam::{Mat3, Quat, Vec2, Vec3};

use crate::radiometry::{Rgb, luminance};

/// How many times its mean the smooth part may reach.
const CONTRAST: f64 = 8.0;

/// Radiance from every direction that no surface covers.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// File it came from, for messages.
    pub name: String,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance, row by row from the top, finite and not negative.
    pub texels: Vec<Rgb>,
    /// Rotation from the map's axes to the world's.
    pub world_from_map: Mat3,
}

impl Environment {
    /// Turns the map's +y to the unit vector `up` on the shortest way, then by `degrees` about it,
    /// counter-clockwise seen from above.
    pub fn rotation(up: Vec3, degrees: f32) -> Mat3 {
        Mat3::from_quat(
            Quat::from_axis_angle(up, degrees.to_radians()) * Quat::from_rotation_arc(Vec3::Y, up),
        )
    }

    /// Picture position of a unit world direction, in texels: x in \[0, width), y in \[0, height\].
    pub fn position(&self, dir: Vec3) -> Vec2 {
        let d = self.world_from_map.transpose() * dir;
        let turn = d.x.atan2(-d.z) * std::f32::consts::FRAC_1_PI * 0.5;
        // By the angle to the nearer pole's axis: precise at the poles, where acos is not.
        let v = d.x.hypot(d.z).atan2(d.y) * std::f32::consts::FRAC_1_PI;
        Vec2::new(
            (turn - turn.floor()).min(0.999_999_94) * self.width as f32,
            v * self.height as f32,
        )
    }

    /// Column and row of the texel around a unit world direction.
    pub fn texel(&self, dir: Vec3) -> (usize, usize) {
        let at = self.position(dir);
        (
            (at.x as usize).min(self.width as usize - 1),
            (at.y as usize).min(self.height as usize - 1),
        )
    }

    /// Unit world direction of the place `at` in \[0, 1)² of a texel; uniform places give uniform
    /// directions.
    pub fn direction(&self, x: usize, y: usize, at: Vec2) -> Vec3 {
        let polar = |row: usize| std::f32::consts::PI * row as f32 / self.height as f32;
        let half = |row: usize| (0.5 * polar(row)).sin().powi(2);
        // sin²(θ/2) = (1 − cos θ) / 2 is uniform, without cancellation at the upper pole.
        let s = half(y) + (half(y + 1) - half(y)) * at.y;
        let (cos, sin) = (1.0 - 2.0 * s, 2.0 * (s * (1.0 - s)).max(0.0).sqrt());
        let (sin_turn, cos_turn) =
            (std::f32::consts::TAU * (x as f32 + at.x) / self.width as f32).sin_cos();
        self.world_from_map * Vec3::new(sin * sin_turn, cos, -sin * cos_turn)
    }

    /// Solid angle of a texel of row `y`, steradian.
    pub fn solid_angle(&self, y: usize) -> f64 {
        let polar = |row: usize| std::f64::consts::PI * row as f64 / f64::from(self.height);
        std::f64::consts::TAU / f64::from(self.width) * (polar(y).cos() - polar(y + 1).cos())
    }

    /// Σ radiance · solid angle over the texels: 4π times the mean.
    pub fn integral(&self) -> Rgb {
        let mut sum = glam::DVec3::ZERO;
        for (y, row) in self.texels.chunks(self.width as usize).enumerate() {
            sum += row.iter().map(|c| c.as_dvec3()).sum::<glam::DVec3>() * self.solid_angle(y);
        }
        sum.as_vec3()
    }

    /// Luminance T that divides the smooth part from the bright one.
    pub fn threshold(&self) -> f32 {
        let values: Vec<f32> = self.texels.iter().map(|&c| luminance(c)).collect();
        let largest = f64::from(values.iter().copied().fold(0.0, f32::max));
        let mut t = largest;
        for _ in 0..200 {
            let clipped = |row: &[f32]| row.iter().map(|&v| f64::from(v).min(t)).sum::<f64>();
            let sum: f64 = values
                .chunks(self.width as usize)
                .enumerate()
                .map(|(y, row)| clipped(row) * self.solid_angle(y))
                .sum();
            let next = (CONTRAST * sum / (4.0 * std::f64::consts::PI)).min(t);
            let rests = t - next <= 1e-4 * t;
            t = next;
            if t < 1e-5 * largest {
                return 0.0;
            }
            if rests {
                break;
            }
        }
        t as f32
    }

    /// The smooth part's texels and the bright part's. They add up to the map.
    pub fn split(&self) -> (Vec<Rgb>, Vec<Rgb>) {
        let t = self.threshold();
        let smooth: Vec<Rgb> = self
            .texels
            .iter()
            .map(|&c| if luminance(c) > t { c * (t / luminance(c)) } else { c })
            .collect();
        let bright =
            self.texels.iter().zip(&smooth).map(|(&c, &s)| (c - s).max(Rgb::ZERO)).collect();
        (smooth, bright)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(texels: impl Fn(usize, usize) -> f32) -> Environment {
        let texels = (0..32)
            .flat_map(|y| (0..64).map(move |x| (x, y)))
            .map(|(x, y)| Rgb::splat(texels(x, y)))
            .collect();
        Environment {
            name: String::new(),
            width: 64,
            height: 32,
            texels,
            world_from_map: Environment::rotation(Vec3::Y, 0.0),
        }
    }

    #[test]
    fn directions_and_positions_are_inverse() {
        let mut e = map(|_, _| 1.0);
        assert!(
            e.direction(32, 16, Vec2::ZERO).distance(Vec3::Z) < 1e-6,
            "the middle looks along +z"
        );
        assert!(
            e.direction(48, 16, Vec2::ZERO).distance(-Vec3::X) < 1e-6,
            "the right is on the right"
        );
        e.world_from_map = Environment::rotation(Vec3::Y, 90.0);
        assert!(
            e.direction(32, 16, Vec2::ZERO).distance(Vec3::X) < 1e-6,
            "counter-clockwise seen from above"
        );
        e.world_from_map = Environment::rotation(Vec3::Z, 33.0);
        assert!(e.direction(3, 0, Vec2::ZERO).distance(Vec3::Z) < 1e-6, "up");
        for (x, y) in (0..32).flat_map(|y| (0..64).map(move |x| (x, y))) {
            let d = e.direction(x, y, Vec2::new(0.5, 0.5));
            assert!((d.length() - 1.0).abs() < 1e-5);
            assert_eq!(e.texel(d), (x, y));
        }
        let sphere: f64 = (0..32).map(|y| 64.0 * e.solid_angle(y)).sum();
        assert!((sphere - 4.0 * std::f64::consts::PI).abs() < 1e-9);
        assert!((f64::from(e.integral().x) - sphere).abs() < 1e-4);
    }

    #[test]
    fn threshold_is_a_fixed_point_of_its_rule() {
        assert!(
            map(|_, _| 3.0).threshold() >= 3.0
                && map(|_, y| f32::from(u8::from(y < 16))).threshold() >= 1.0,
            "nothing is bright"
        );
        assert_eq!(
            map(|x, y| if (x, y) == (9, 8) { 5.0 } else { 0.0 }).threshold(),
            0.0,
            "all is bright"
        );
        let sunny = map(|x, y| if (x, y) == (9, 8) { 5000.0 } else { 0.5 });
        let f = sunny.solid_angle(8) / (4.0 * std::f64::consts::PI);
        let expected = CONTRAST * 0.5 * (1.0 - f) / (1.0 - CONTRAST * f);
        assert!((f64::from(sunny.threshold()) / expected - 1.0).abs() < 1e-3);
        let (smooth, bright) = sunny.split();
        for ((s, b), c) in smooth.iter().zip(&bright).zip(&sunny.texels) {
            assert!((*s + *b - *c).abs().max_element() < 1e-3 && b.min_element() >= 0.0);
        }
        assert_eq!(bright.iter().filter(|b| b.x > 0.0).count(), 1);
    }
}
