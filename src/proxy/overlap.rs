//! Area of a triangle inside a sphere: the surface that a density estimate really covered.
//!
//! The sphere cuts the triangle's plane in a disc; the disc's overlap with the triangle is the sum
//! over the edges of the signed overlap of the disc with the triangle (disc centre, edge start,
//! edge end): a triangle where the edge runs inside, sectors where it runs outside. Exact up to
//! rounding, in f64.

use glam::{DVec2, DVec3, Vec3};

/// Area of triangle `corners` (relative to the sphere's centre) inside the sphere of radius
/// `radius`.
pub(super) fn triangle_in_sphere(corners: [Vec3; 3], radius: f32) -> f64 {
    let c = corners.map(Vec3::as_dvec3);
    let n = (c[1] - c[0]).cross(c[2] - c[0]);
    let length = n.length();
    if length == 0.0 {
        return 0.0;
    }
    let n = n / length;
    let height = n.dot(c[0]);
    let r2 = f64::from(radius).powi(2) - height * height;
    if r2 <= 0.0 {
        return 0.0;
    }
    let s = n.any_orthonormal_vector();
    let t = n.cross(s);
    let flat = c.map(|p: DVec3| DVec2::new(p.dot(s), p.dot(t)));
    (0..3).map(|i| edge(flat[i], flat[(i + 1) % 3], r2)).sum::<f64>().max(0.0)
}

fn sector(a: DVec2, b: DVec2, r2: f64) -> f64 {
    0.5 * r2 * a.perp_dot(b).atan2(a.dot(b))
}

/// Signed area of the disc of squared radius `r2` around the origin inside the triangle (origin, a,
/// b).
fn edge(a: DVec2, b: DVec2, r2: f64) -> f64 {
    let d = b - a;
    let dd = d.length_squared();
    if dd == 0.0 {
        return 0.0;
    }
    let middle = -a.dot(d) / dd;
    let discriminant = middle * middle - (a.length_squared() - r2) / dd;
    if discriminant <= 0.0 {
        return sector(a, b, r2);
    }
    let half = discriminant.sqrt();
    let (t0, t1) = ((middle - half).clamp(0.0, 1.0), (middle + half).clamp(0.0, 1.0));
    if t0 >= t1 {
        return sector(a, b, r2);
    }
    let (p, q) = (a + d * t0, a + d * t1);
    sector(a, p, r2) + 0.5 * p.perp_dot(q) + sector(q, b, r2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream, sample_triangle};
    use std::f64::consts::PI;

    #[test]
    fn whole_half_and_quarter_disc() {
        let z = 0.3f32;
        let (r, area) = (0.5f32, PI * (0.25 - 0.09));
        let around = [Vec3::new(-9.0, -9.0, z), Vec3::new(9.0, -9.0, z), Vec3::new(0.0, 20.0, z)];
        assert!((triangle_in_sphere(around, r) / area - 1.0).abs() < 1e-6);
        let half = [Vec3::new(-9.0, 0.0, z), Vec3::new(9.0, 0.0, z), Vec3::new(0.0, 20.0, z)];
        assert!((triangle_in_sphere(half, r) / area - 0.5).abs() < 1e-6);
        let quarter = [Vec3::new(0.0, 0.0, z), Vec3::new(9.0, 0.0, z), Vec3::new(0.0, 9.0, z)];
        assert!((triangle_in_sphere(quarter, r) / area - 0.25).abs() < 1e-6);
        assert_eq!(triangle_in_sphere(around, 0.29), 0.0);
        let inside = [Vec3::new(0.0, 0.0, 0.1), Vec3::new(0.1, 0.0, 0.1), Vec3::new(0.0, 0.1, 0.1)];
        assert!((triangle_in_sphere(inside, r) - 0.005).abs() < 1e-8);
    }

    #[test]
    fn equals_monte_carlo() {
        let mut rng = Rng::new(5, Stream::Test, 0, 0);
        for _ in 0..50 {
            let mut point =
                || Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - Vec3::ONE;
            let [a, b, c] = [point(), point(), point()];
            let r = 0.2 + rng.next_f32();
            let n = 20_000;
            let inside = (0..n)
                .filter(|_| {
                    let w = sample_triangle(rng.next_2d());
                    (a * (1.0 - w.x - w.y) + b * w.x + c * w.y).length() < r
                })
                .count();
            let area = f64::from((b - a).cross(c - a).length() * 0.5);
            let fraction = inside as f64 / f64::from(n);
            let deviation = (fraction * (1.0 - fraction) / f64::from(n)).sqrt() + 1e-4;
            assert!((triangle_in_sphere([a, b, c], r) / area - fraction).abs() < 5.0 * deviation);
        }
    }
}
