//! Warps from uniform points of \[0, 1)² to directions and surfaces. Local frames: +z is the
//! normal. Densities are named by measure.

use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Unit disc, concentric map (area-preserving, keeps strata compact).
pub fn sample_disc(u: Vec2) -> Vec2 {
    let p = u * 2.0 - Vec2::ONE;
    if p.x == 0.0 && p.y == 0.0 {
        return Vec2::ZERO;
    }
    let (r, phi) = if p.x.abs() > p.y.abs() {
        (p.x, PI / 4.0 * (p.y / p.x))
    } else {
        (p.y, PI / 2.0 - PI / 4.0 * (p.x / p.y))
    };
    Vec2::new(r * phi.cos(), r * phi.sin())
}

/// Direction with density cos θ / π over the upper hemisphere.
pub fn sample_cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = sample_disc(u);
    Vec3::new(d.x, d.y, (1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Density of [`sample_cosine_hemisphere`], per steradian.
pub fn pdf_cosine_hemisphere(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) / PI
}

/// Direction uniform over the upper hemisphere, density 1 / 2π.
pub fn sample_uniform_hemisphere(u: Vec2) -> Vec3 {
    let d = sample_disc(u);
    let r2 = d.length_squared();
    let s = (2.0 - r2).max(0.0).sqrt();
    Vec3::new(d.x * s, d.y * s, 1.0 - r2)
}

/// Direction uniform over the sphere, density 1 / 4π.
pub fn sample_uniform_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (s, c) = (TAU * u.y).sin_cos();
    Vec3::new(r * c, r * s, z)
}

/// Direction uniform in the cone cos θ ≥ `cos_max` around +z; precise for narrow cones.
pub fn sample_uniform_cone(u: Vec2, one_minus_cos_max: f32) -> Vec3 {
    let h = u.x * one_minus_cos_max;
    let r = (h * (2.0 - h)).max(0.0).sqrt();
    let (s, c) = (TAU * u.y).sin_cos();
    Vec3::new(r * c, r * s, 1.0 - h)
}

/// Density of [`sample_uniform_cone`], per steradian.
pub fn pdf_uniform_cone(one_minus_cos_max: f32) -> f32 {
    1.0 / (TAU * one_minus_cos_max)
}

/// Barycentric weights (of vertices 1 and 2), uniform over a triangle's area.
pub fn sample_triangle(u: Vec2) -> Vec2 {
    if u.y > u.x {
        let x = u.x * 0.5;
        Vec2::new(x, u.y - x)
    } else {
        let y = u.y * 0.5;
        Vec2::new(u.x - y, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream};

    /// Chi² over a grid of (z, φ): `expected` is the probability of z ≤ x.
    fn chi2(sample: impl Fn(Vec2) -> Vec3, cdf_z: impl Fn(f32) -> f32) -> f64 {
        let (nz, np, n) = (20usize, 20usize, 400_000);
        let mut rng = Rng::new(11, Stream::Test, 0, 0);
        let mut count = vec![0.0f64; nz * np];
        for _ in 0..n {
            let d = sample(rng.next_2d());
            assert!((d.length() - 1.0).abs() < 1e-4);
            let z = ((d.z + 1.0) * 0.5 * nz as f32).clamp(0.0, nz as f32 - 1.0) as usize;
            let p = ((d.y.atan2(d.x) + PI) / TAU * np as f32).clamp(0.0, np as f32 - 1.0) as usize;
            count[z * np + p] += 1.0;
        }
        let (mut x2, mut dof) = (0.0, -1.0);
        for z in 0..nz {
            let lo = z as f32 / nz as f32 * 2.0 - 1.0;
            let e = f64::from(cdf_z(lo + 2.0 / nz as f32) - cdf_z(lo)) / np as f64 * f64::from(n);
            for p in 0..np {
                if e > 5.0 {
                    x2 += (count[z * np + p] - e).powi(2) / e;
                    dof += 1.0;
                } else {
                    assert!(count[z * np + p] <= 30.0);
                }
            }
        }
        (x2 - dof) / (2.0f64 * dof).sqrt()
    }

    #[test]
    fn chi2_of_direction_warps() {
        assert!(chi2(sample_cosine_hemisphere, |z| z.max(0.0).powi(2)).abs() < 4.0);
        assert!(chi2(sample_uniform_hemisphere, |z| z.max(0.0)).abs() < 4.0);
        assert!(chi2(sample_uniform_sphere, |z| (z + 1.0) * 0.5).abs() < 4.0);
        assert!(
            chi2(|u| sample_uniform_cone(u, 0.4), |z| ((z - 0.6) / 0.4).clamp(0.0, 1.0)).abs()
                < 4.0
        );
    }

    #[test]
    fn triangle_is_uniform() {
        let mut rng = Rng::new(11, Stream::Test, 1, 0);
        let n = 200_000;
        let (mut m, mut inside) = (Vec2::ZERO, 0);
        for _ in 0..n {
            let b = sample_triangle(rng.next_2d());
            assert!(b.x >= 0.0 && b.y >= 0.0 && b.x + b.y <= 1.0 + 1e-6);
            m += b / n as f32;
            inside += i32::from(b.x < 0.5 && b.y < 0.5 && b.x + b.y > 0.5);
        }
        assert!((m - Vec2::splat(1.0 / 3.0)).length() < 3e-3);
        assert!((f64::from(inside) / f64::from(n) - 0.25).abs() < 5e-3);
    }
}
