//! Polygons seen from a point, in double precision: Lambert's form factor and the moments of
//! [`super::Quadratic`].
//!
//! ```text
//! G = ∫_P (N·w) dw = ½ Σ Θᵢ (N·nᵢ)          [Lambert60]      form factor F = G/π
//! per edge: s = vᵢ, nᵢ, Θ, t = nᵢ × s, S = sin Θ, C = cos Θ, w = N·nᵢ
//! v = Σ w (s S + t (1−C))     Q = Σ w [ s sᵀ (Θ+SC)/2 + t tᵀ (Θ−SC)/2 + (s tᵀ + t sᵀ)/2 · S² ]
//! T = ½ Σ Θᵢ nᵢ               Ω = solid angle
//! ```
//! Input   corners relative to the point; N unit. Output  moments of the part above the horizon,
//!         positive when the corners run clockwise seen from the point (det(v₀, v₁, v₂) > 0).
//! Guarantees  additive over subdivision; Σ over a closed surface equals Σ A_l c Y(N) for any
//!             three-band field. This is the readable form, used by tests and by Monte Carlo modes;
//!             [`super::moments8`] is the fast one.

use glam::{DVec3, Vec3};

use super::MOMENTS;

/// The part of a convex polygon above the plane through the origin with normal `n`, in order; empty
/// when all below.
pub fn clip_to_horizon(corners: &[DVec3], n: DVec3) -> Vec<DVec3> {
    let mut out = Vec::with_capacity(corners.len() + 1);
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        let (ha, hb) = (a.dot(n), b.dot(n));
        if ha >= 0.0 {
            out.push(a);
        }
        if (ha >= 0.0) != (hb >= 0.0) {
            out.push(a + (b - a) * (ha / (ha - hb)));
        }
    }
    out
}

/// The 14 moments of a polygon given relative to the point.
pub fn moments(corners: &[Vec3], n: Vec3) -> [f64; MOMENTS] {
    let normal = n.as_dvec3();
    let clipped =
        clip_to_horizon(&corners.iter().map(|c| c.as_dvec3()).collect::<Vec<_>>(), normal);
    let mut m = [0.0; MOMENTS];
    let unit: Vec<DVec3> =
        clipped.iter().filter(|v| v.length() > 0.0).map(|v| v.normalize()).collect();
    if unit.len() < 3 {
        return m;
    }
    for i in 0..unit.len() {
        let (s, e) = (unit[i], unit[(i + 1) % unit.len()]);
        let cross = s.cross(e);
        let (sin, cos) = (cross.length(), s.dot(e));
        if sin < 1e-12 {
            continue;
        }
        let (edge_n, theta) = (cross / sin, sin.atan2(cos));
        let t = edge_n.cross(s);
        let w = normal.dot(edge_n);
        m[0] += 0.5 * w * theta;
        let v = (s * sin + t * (1.0 - cos)) * w;
        let (qs, qt, qst) =
            ((theta + sin * cos) / 2.0 * w, (theta - sin * cos) / 2.0 * w, sin * sin / 2.0 * w);
        for k in 0..3 {
            m[1 + k] += v[k];
            m[4 + k] += s[k] * s[k] * qs + t[k] * t[k] * qt + 2.0 * s[k] * t[k] * qst;
            m[11 + k] += 0.5 * theta * edge_n[k];
        }
        for (slot, i, j) in [(7, 0, 1), (8, 1, 2), (9, 0, 2)] {
            m[slot] += s[i] * s[j] * qs + t[i] * t[j] * qt + (s[i] * t[j] + s[j] * t[i]) * qst;
        }
    }
    for i in 1..unit.len() - 1 {
        let (a, b, c) = (unit[0], unit[i], unit[i + 1]);
        m[10] += 2.0 * a.dot(b.cross(c)).atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
    }
    m
}

/// ∫ (N·w) dw of the part above the horizon: π times the form factor.
pub fn form_integral(corners: &[Vec3], n: Vec3) -> f64 {
    moments(corners, n)[0]
}
