//! The SH over a near facet by random points on it: the course's own integral, for any number of
//! bands.

use glam::Vec3;

use super::block::F;
use crate::radiometry::Rgb;
use crate::sampling::{Rng, sample_triangle};
use crate::sh::ShRgb;

/// Eight facets and what they weigh.
pub(super) struct Lanes<'a> {
    pub(super) corners: &'a [[F; 3]; 3],
    /// Lanes that take part.
    pub(super) active: F,
    /// Membership times cosine-weighted solid angle.
    pub(super) weighted_g: F,
}

/// Σ over lanes of (m G) · mean of the field over `samples` random points of the facet, weighted by
/// their share of G, at a point with its unit normal.
pub(super) fn covered(
    lanes: &Lanes<'_>,
    (x, n): (Vec3, Vec3),
    field: &ShRgb,
    samples: u32,
    rng: &mut Rng,
) -> Rgb {
    let corners = lanes.corners.map(|c| c.map(|k| k.to_array()));
    let g = lanes.weighted_g.to_array();
    let active = lanes.active.to_bitmask();
    let mut sum = Rgb::ZERO;
    for i in (0..8).filter(|i| active >> i & 1 == 1) {
        let [a, b, c] = corners.map(|k| Vec3::new(k[0][i], k[1][i], k[2][i]));
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
            sum += mean * (g[i] / total);
        }
    }
    sum
}
