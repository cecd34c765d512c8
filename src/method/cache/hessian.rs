//! Occlusion-aware gradient and Hessian of irradiance, from the borders between strata.
//!
//! ```text
//! ∇E  = Σ_b (L_left − L_right) k_b ∇e_b
//! ∇²E = Σ_b (L_left − L_right) k_b² ∇²e_b          b over all borders, e_b: [`super::edges`]
//! ```
//! Every stratum is read as a polygon of its sample's radiance. A border moves with the nearer of
//! what lies on its two sides (k_b, the inverse distance), so that a near thing covers and uncovers
//! what is behind it: Ward and Heckbert's idea, carried to second derivatives.
//!
//! The aim is that of Schwarzhaupt, Wann Jensen, Jarosz (2012). There the hits are joined to
//! triangles that take the radiance of their farthest corner, which draws every outline half a
//! stratum too far in (18 % error of the gradient under an occluding half-plane at 24 × 24 rays, 4
//! % here; `tests/cache_record.rs` holds it), and edges run from occluders to what lies behind
//! them, which is noise where near things are small.
//!
//! Input   [`Hemisphere`]. Output  [`Derivatives`], local frame, tangent parts. Cost O(strata), two
//!         borders each; the borders of a grid are computed once.
//! Guarantees  exactly zero where all radiance is equal, or infinitely far. Nothing moves at the
//!             horizon, nor at the geometric horizon. Not seen: what is thinner than a stratum; the
//!             light that appears where one border slides along another.

use glam::{Vec2, Vec3};

use super::edges::borders;
use super::hemisphere::Hemisphere;

/// First derivative of irradiance and second of relative irradiance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Derivatives {
    /// Per channel, W·m⁻² per unit length, local.
    pub gradient: [Vec3; 3],
    /// xx, xy, yy of the irradiance summed over channels, in units of that irradiance; 1 / length².
    /// Zero in the dark.
    pub hessian: [f32; 3],
}

/// Two sides of a border are one surface when their distances differ by less than this factor; then
/// it moves with their mean inverse distance, else with the nearer. Chosen: an occluder that close
/// to its background uncovers little.
const SAME_SURFACE: f32 = 1.5;

/// Of one hemisphere.
pub fn derivatives(hemisphere: &Hemisphere) -> Derivatives {
    let (mut gradient, mut hessian) = ([Vec2::ZERO; 3], [0.0f32; 3]);
    for border in borders(hemisphere.grid).iter() {
        let (left, right) = (border.left as usize, border.right as usize);
        if !(hemisphere.above[left] && hemisphere.above[right]) {
            continue;
        }
        let change = hemisphere.radiance[left] - hemisphere.radiance[right];
        let (a, b) = (hemisphere.inverse_distance[left], hemisphere.inverse_distance[right]);
        let (far, near) = (a.min(b), a.max(b));
        let k = if far * SAME_SURFACE > near { 0.5 * (far + near) } else { near };
        let along = Vec2::from_array(border.gradient) * k;
        for (sum, change) in gradient.iter_mut().zip(change.to_array()) {
            *sum += along * change;
        }
        let weight = change.element_sum() * k * k;
        for (sum, h) in hessian.iter_mut().zip(border.hessian) {
            *sum += h * weight;
        }
    }
    let irradiance = hemisphere.irradiance().element_sum();
    let relative = if irradiance > 0.0 { 1.0 / irradiance } else { 0.0 };
    Derivatives {
        gradient: gradient.map(|g| g.extend(0.0)),
        hessian: hessian.map(|h| h * relative),
    }
}

/// Eigenvalues of xx, xy, yy, the larger magnitude first, and the unit direction of the first.
pub fn eigen([xx, xy, yy]: [f32; 3]) -> ([f32; 2], Vec2) {
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let root = half.hypot(xy);
    let first = if mean >= 0.0 { mean + root } else { mean - root };
    let second = 2.0 * mean - first;
    // The angle of the eigenvalue mean + root; the other one is at a right angle.
    let angle = 0.5 * xy.atan2(half) + if mean >= 0.0 { 0.0 } else { std::f32::consts::FRAC_PI_2 };
    ([first, second], Vec2::from_angle(angle))
}
