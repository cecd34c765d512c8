//! The watertight ray–triangle test of Woop, Benthin and Wald, "Watertight ray/triangle
//! intersection", JCGT 2(1), 2013.
//!
//! Computes   the ray is sheared to the z axis; the signs of the three edge functions of the
//!            sheared corners decide, with double precision where one is zero. Guarantees two
//!            triangles that share an edge (same corner positions, any winding) never both miss a
//!            ray that passes between them: the edge functions of the shared edge are exact
//!            negatives of each other. Points on an edge belong to both. Both faces are hit.
//! Not        a hit for triangles seen exactly from the side, or without area.
//! Cost       about 30 multiplications and one division for a hit.

use glam::Vec3;

use crate::math::Ray;

/// A ray prepared for the test.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheared {
    origin: Vec3,
    axes: [usize; 3],
    shear: Vec3,
    t_min: f32,
}

/// Where a triangle is met: ray parameter and weights of corners 1 and 2.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    pub t: f32,
    pub u: f32,
    pub v: f32,
}

impl Sheared {
    /// `None` for a ray that cannot hit anything: no direction, a NaN, an empty interval.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Option<Self> {
        let d = ray.dir.to_array();
        let z = ray.dir.abs().max_position();
        let valid =
            d[z] != 0.0 && ray.dir.is_finite() && ray.origin.is_finite() && ray.t_min < ray.t_max;
        if !valid {
            return None;
        }
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if d[z] < 0.0 {
            std::mem::swap(&mut x, &mut y);
        }
        Some(Self {
            origin: ray.origin,
            axes: [x, y, z],
            shear: Vec3::new(d[x] / d[z], d[y] / d[z], 1.0 / d[z]),
            t_min: ray.t_min,
        })
    }

    /// The triangle's hit with t in (`t_min`, `t_max`).
    #[inline(always)]
    pub fn touch(&self, corners: &[Vec3; 3], t_max: f32) -> Option<Touch> {
        let [x, y, z] = self.axes;
        let [a, b, c] = corners.map(|p| {
            let p = p - self.origin;
            let p = [p.x, p.y, p.z];
            Vec3::new(p[x] - self.shear.x * p[z], p[y] - self.shear.y * p[z], p[z])
        });
        let mut e = [c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x];
        if e[0] == 0.0 || e[1] == 0.0 || e[2] == 0.0 {
            let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
            e = [c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x]
                .map(|w| w as f32);
        }
        if (e[0] < 0.0 || e[1] < 0.0 || e[2] < 0.0) && (e[0] > 0.0 || e[1] > 0.0 || e[2] > 0.0) {
            return None;
        }
        let det = e[0] + e[1] + e[2];
        if det == 0.0 {
            return None;
        }
        let inverse = 1.0 / det;
        let t = (e[0] * a.z + e[1] * b.z + e[2] * c.z) * self.shear.z * inverse;
        (t > self.t_min && t < t_max).then(|| Touch { t, u: e[1] * inverse, v: e[2] * inverse })
    }
}
