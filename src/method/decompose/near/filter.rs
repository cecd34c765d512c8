//! The noise that short near rays leave, filtered over irradiance (never over colour).
//!
//! ```text
//! near_i = Σ_j w_ij near_j / Σ_j w_ij
//! w_ij = exp(−|p_i − p_j|² / 2 r_i²) · max(0, n_i·n_j)^16 · (1 − h_ij / r_i)₊
//! r_i = near_filter_reach / c_i,    c_i: window mean of Σ_hits m / max(d, pixel), per ray
//! h_ij: distance of p_j from the plane of i
//! ```
//!
//! Irradiance from a surface at distance d changes over lengths of about d, so a point may average
//! over a fraction of the harmonic mean distance of what is near it: contact shadows stay, where
//! nothing is close the window decides. c is itself a mean over the window, for sixteen rays are
//! too few to know it. Only the near part is filtered; the far part has no noise of a single point.
//! Nothing counts as closer than a pixel: one hit at no distance in a window would keep all of it
//! unfiltered, which shows as dark specks.
//!
//! [`filter`] takes points in pixel order with their near part and closeness. It is deterministic,
//! a constant near part stays, and normals and planes keep the sides of an edge apart. It costs the
//! window times tens of nanoseconds a point. The knobs are `near_filter`, the window's radius in
//! pixels (0: off), and `near_filter_reach`, the fraction of the distance.

use glam::Vec3;
use rayon::prelude::*;

use crate::radiometry::Rgb;
use crate::record::ShadingPoints;

/// The near part and how close it is.
#[derive(Clone, Copy, Debug, Default)]
pub struct NearPart {
    /// Irradiance beyond the far field's, W/m²; may be negative.
    pub irradiance: Rgb,
    /// Mean over the rays of membership over distance, 1/length.
    pub closeness: f32,
}

/// Where the filter looks.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// Width of the image, pixels.
    pub width: u32,
    /// Radius of the window, pixels.
    pub radius: u32,
    /// Reach as a fraction of the distance of what is near.
    pub reach: f32,
}

/// Filters the near part over a window around each point. `apart(i, j)` names points that may not
/// share.
pub fn filter(
    points: &ShadingPoints,
    near: &[NearPart],
    window: Window,
    apart: impl Fn(usize, usize) -> bool + Sync,
) -> Vec<Rgb> {
    let Window { width, radius, reach } = window;
    let height = points.pixel.last().map_or(0, |&p| p / width + 1);
    let mut first = vec![0u32; (width * height) as usize + 1];
    points.pixel.iter().for_each(|&p| first[p as usize + 1] += 1);
    for i in 1..first.len() {
        first[i] += first[i - 1];
    }
    let each = |i: usize, visit: &mut dyn FnMut(usize)| {
        let (x, y) = (points.pixel[i] % width, points.pixel[i] / width);
        let (x0, x1) = (x.saturating_sub(radius), (x + radius).min(width - 1));
        for row in y.saturating_sub(radius)..=(y + radius).min(height - 1) {
            let range = first[(row * width + x0) as usize]..first[(row * width + x1) as usize + 1];
            range.for_each(|j| visit(j as usize));
        }
    };
    let kin = |i: usize, j: usize| {
        if i != j && apart(i, j) {
            return 0.0;
        }
        let c = points.ns[i].dot(points.ns[j]).max(0.0);
        let c = c * c;
        let c = c * c;
        let c = c * c;
        c * c
    };
    let one = |i: usize| {
        let (p, n): (Vec3, Vec3) = (points.p[i], points.ng[i]);
        let (mut closeness, mut count) = (0.0, 0.0);
        each(i, &mut |j| {
            let offset = points.p[j] - p;
            let near_plane = n.dot(offset).abs() <= 0.25 * offset.length() + points.footprint[i];
            let w = if near_plane { kin(i, j) } else { 0.0 };
            closeness += w * near[j].closeness;
            count += w;
        });
        if closeness <= 0.0 {
            return near[i].irradiance;
        }
        let r = reach * count / closeness;
        let (mut sum, mut weight) = (Rgb::ZERO, 0.0);
        each(i, &mut |j| {
            let offset = points.p[j] - p;
            let w = kin(i, j)
                * (-offset.length_squared() / (2.0 * r * r)).exp()
                * (1.0 - n.dot(offset).abs() / r).max(0.0);
            sum += near[j].irradiance * w;
            weight += w;
        });
        if weight > 0.0 { sum / weight } else { near[i].irradiance }
    };
    (0..points.len()).into_par_iter().with_min_len(256).map(one).collect()
}
