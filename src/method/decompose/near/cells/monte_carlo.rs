//! The SH over a near facet by random points on it: the course's own integral, for any number of
//! bands.

use glam::Vec3;

use super::block::lane;
use crate::ffi::lanes::Eight;
use crate::radiometry::Rgb;
use crate::sampling::{Rng, sample_triangle};
use crate::sh::ShRgb;

/// Eight facets and what they weigh.
pub(super) struct Covering<'a> {
    pub(super) corners: &'a [[Eight; 3]; 3],
    /// Lanes that take part, as bits.
    pub(super) active: u32,
    /// Membership times cosine-weighted solid angle.
    pub(super) weighted_g: &'a Eight,
}

/// Σ over lanes of (m G) · mean of the field over `samples` random points of the facet, weighted by
/// their share of G, at a point with its unit normal.
pub(super) fn covered(
    lanes: &Covering<'_>,
    (x, n): (Vec3, Vec3),
    field: &ShRgb,
    samples: u32,
    rng: &mut Rng,
) -> Rgb {
    let mut sum = Rgb::ZERO;
    for i in (0..8).filter(|i| lanes.active >> i & 1 == 1) {
        let [a, b, c] = lanes.corners.each_ref().map(|corner| lane(corner, i));
        let normal = (b - a).cross(c - a);
        let (mut mean, mut total) = (Rgb::ZERO, 0.0);
        for _ in 0..samples {
            let uv = sample_triangle(rng.next_2d());
            let d = a + (b - a) * uv.x + (c - a) * uv.y - x;
            let r2 = d.length_squared().max(1e-20);
            let w = d / r2.sqrt();
            let share = n.dot(w).max(0.0) * normal.dot(w).abs() / r2;
            mean += field.radiance(w) * share;
            total += share;
        }
        if total > 0.0 {
            sum += mean * (lanes.weighted_g.0[i] / total);
        }
    }
    sum
}
