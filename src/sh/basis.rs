//! The basis up to l = 4 as polynomials of the unit direction, and the clamped cosine's band
//! factors `[RH01]`.

use glam::Vec3;
use std::f32::consts::PI;

/// Most bands (l ≤ 4).
pub const MAX_BANDS: usize = 5;
/// Coefficients of the most bands.
pub const COEFFICIENTS: usize = MAX_BANDS * MAX_BANDS;

/// All basis functions at the unit direction `w`, index l² + l + m.
pub fn basis(w: Vec3) -> [f32; COEFFICIENTS] {
    let Vec3 { x, y, z } = w;
    let (x2, y2, z2) = (x * x, y * y, z * z);
    [
        0.282_094_79,
        0.488_602_51 * y,
        0.488_602_51 * z,
        0.488_602_51 * x,
        1.092_548_4 * x * y,
        1.092_548_4 * y * z,
        0.315_391_57 * (3.0 * z2 - 1.0),
        1.092_548_4 * x * z,
        0.546_274_2 * (x2 - y2),
        0.590_043_6 * y * (3.0 * x2 - y2),
        2.890_611_4 * x * y * z,
        0.457_045_8 * y * (5.0 * z2 - 1.0),
        0.373_176_33 * z * (5.0 * z2 - 3.0),
        0.457_045_8 * x * (5.0 * z2 - 1.0),
        1.445_305_7 * z * (x2 - y2),
        0.590_043_6 * x * (x2 - 3.0 * y2),
        2.503_342_9 * x * y * (x2 - y2),
        1.770_130_8 * y * z * (3.0 * x2 - y2),
        0.946_174_7 * x * y * (7.0 * z2 - 1.0),
        0.669_046_5 * y * z * (7.0 * z2 - 3.0),
        0.105_785_55 * (35.0 * z2 * z2 - 30.0 * z2 + 3.0),
        0.669_046_5 * x * z * (7.0 * z2 - 3.0),
        0.473_087_35 * (x2 - y2) * (7.0 * z2 - 1.0),
        1.770_130_8 * x * z * (x2 - 3.0 * y2),
        0.625_835_74 * (x2 * x2 - 6.0 * x2 * y2 + y2 * y2),
    ]
}

/// A_l: the clamped cosine's factor of band l.
pub fn cosine_band(l: usize) -> f32 {
    match l {
        0 => PI,
        1 => 2.0 * PI / 3.0,
        2 => PI / 4.0,
        4 => -PI / 24.0,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::sample_uniform_sphere;
    use crate::sh::ShRgb;
    use glam::Vec2;

    /// Gauss-like product quadrature: midpoint in z and φ over many points.
    fn quadrature(mut f: impl FnMut(Vec3, f64)) {
        let n = 400;
        for i in 0..n {
            for j in 0..n {
                let w = sample_uniform_sphere(Vec2::new(
                    (i as f32 + 0.5) / n as f32,
                    (j as f32 + 0.5) / n as f32,
                ));
                f(w, 4.0 * std::f64::consts::PI / f64::from(n * n));
            }
        }
    }

    #[test]
    fn orthonormal() {
        let mut gram = vec![[0.0f64; COEFFICIENTS]; COEFFICIENTS];
        quadrature(|w, dw| {
            let y = basis(w);
            for i in 0..COEFFICIENTS {
                for j in 0..COEFFICIENTS {
                    gram[i][j] += f64::from(y[i] * y[j]) * dw;
                }
            }
        });
        for (i, row) in gram.iter().enumerate() {
            for (j, &g) in row.iter().enumerate() {
                assert!((g - f64::from(u8::from(i == j))).abs() < 1e-3, "{i} {j} {g}");
            }
        }
    }

    #[test]
    fn addition_theorem() {
        for w in
            [Vec3::X, Vec3::new(0.3, -0.5, 0.9).normalize(), Vec3::new(-0.6, 0.2, -0.4).normalize()]
        {
            let y = basis(w);
            for l in 0..MAX_BANDS {
                let s: f32 = (l * l..(l + 1) * (l + 1)).map(|i| y[i] * y[i]).sum();
                assert!((s / ((2 * l + 1) as f32 / (4.0 * PI)) - 1.0).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn irradiance_of_constant_delta_and_random_field() {
        let mut constant = ShRgb::default();
        constant.0[0] = Vec3::splat((4.0 * PI).sqrt());
        assert!((constant.irradiance(Vec3::Y).x - PI).abs() < 1e-5);
        // A delta light of irradiance 1 projected on three bands: 17/16 facing it, 3/32 at right
        // angles, 1/16 from behind.
        let mut delta = ShRgb::default();
        for (c, y) in delta.0.iter_mut().zip(basis(Vec3::Z)).take(9) {
            *c = Vec3::splat(y);
        }
        for (n, expected) in [(Vec3::Z, 17.0 / 16.0), (Vec3::X, 3.0 / 32.0), (-Vec3::Z, 1.0 / 16.0)]
        {
            assert!((delta.irradiance(n).x - expected).abs() < 1e-5);
        }
        let mut field = ShRgb::default();
        for (i, c) in field.0.iter_mut().enumerate() {
            *c = Vec3::splat(((i * 7919) % 13) as f32 - 6.0);
        }
        let n = Vec3::new(0.3, 0.4, -0.7).normalize();
        let mut e = 0.0;
        quadrature(|w, dw| e += f64::from(field.radiance(w).x * n.dot(w).max(0.0)) * dw);
        assert!(
            (e - f64::from(field.irradiance(n).x)).abs() < 5e-3 * e.abs().max(1.0),
            "{e} {}",
            field.irradiance(n).x
        );
    }
}
