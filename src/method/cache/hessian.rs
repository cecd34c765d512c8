//! Occlusion-aware gradient and Hessian of irradiance, from the triangles between the hits.
//!
//! The grid's hits are joined to triangles; each takes the radiance of its **farthest** corner, so that a near thing ends where its last
//! hit is and uncovers what lies behind. E is then a sum of polygon form factors `[Lambert60]`, and every edge between triangles of
//! radiance a and b adds (a − b) times its own derivative (Schwarzhaupt, Wann Jensen, Jarosz 2012; written anew here):
//! with unit directions u0, u1 to its ends, inverse distances k0, k1, u = (1−τ) u0 + τ u1, k = (1−τ) k0 + τ k1, n the normal,
//!
//! ```text
//! A = n × (k0 u1 − k1 u0)     m = n · (u0 × u1)
//! S = ∫ dτ/|u|²     Q = ∫ k u/|u|⁴ dτ     T = ∫ k²/|u|⁴ dτ     P = ∫ k² u uᵀ/|u|⁶ dτ          over 0 ≤ τ ≤ 1
//! ∇E = ½ S A + m Q        ∇²E = A Qᵀ + Q Aᵀ + m (4 P − T I)
//! ```
//! Derivation: on the edge r = w u with 1/w = k, and ds = w²/(r0 r1) dτ, so Lambert's ∫ ds/|r|² and its derivatives by the point become the
//! integrals above: no distance, no cross product of distant points and no difference of near equals is left, the sky is k = 0, and an
//! edge spans little of the hemisphere, so that three Gauss points in τ are exact to 1e-5.
//!
//! Input   [`Hemisphere`] on [`Grid::Square`]. Output  [`Derivatives`], local frame, tangent parts.
//! Horizon: the outermost hits are continued to it at their distance, and outside lies the mean radiance: a constant environment has
//! exactly zero derivatives. Edges of triangles with a corner below the geometric horizon are left out. Cost O(strata).

use glam::{Vec2, Vec3};

use super::hemisphere::{Grid, Hemisphere};
use crate::radiometry::Rgb;

/// First derivative of irradiance and second of relative irradiance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Derivatives {
    /// Per channel, W·m⁻² per unit length, local.
    pub gradient: [Vec3; 3],
    /// xx, xy, yy of the mean of the channels, in units of its irradiance; 1 / length².
    pub hessian: [f32; 3],
}

#[derive(Clone, Copy)]
struct Vertex {
    u: Vec3,
    k: f32,
    l: Rgb,
    above: bool,
}

/// What a triangle sends: none when it has a corner below the geometric horizon.
fn radiance(corners: [&Vertex; 3]) -> Option<Rgb> {
    if corners.iter().any(|v| !v.above) {
        return None;
    }
    let mut far = corners[0];
    for v in &corners[1..] {
        if v.k < far.k {
            far = v;
        }
    }
    Some(far.l)
}

/// Derivatives of ∫ cos over one side of the edge u0 → u1: gradient xy, Hessian xx, xy, yy.
pub fn edge(u0: Vec3, k0: f32, u1: Vec3, k1: f32) -> (Vec2, [f32; 3]) {
    const NODES: [f32; 3] = [0.112_701_665_4, 0.5, 0.887_298_334_6];
    const WEIGHTS: [f32; 3] = [5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0];
    let e = u1 * k0 - u0 * k1;
    let a = Vec2::new(-e.y, e.x);
    let m = u0.x * u1.y - u0.y * u1.x;
    let (mut s, mut q, mut t, mut p) = (0.0, Vec2::ZERO, 0.0, [0.0f32; 3]);
    for (tau, weight) in NODES.into_iter().zip(WEIGHTS) {
        let u = u0 + (u1 - u0) * tau;
        let k = k0 + (k1 - k0) * tau;
        let inverse = 1.0 / u.length_squared();
        let w1 = weight * inverse;
        let w2 = w1 * inverse * k;
        s += w1;
        q += Vec2::new(u.x, u.y) * w2;
        t += w2 * k;
        let w3 = w2 * inverse * k;
        p[0] += w3 * u.x * u.x;
        p[1] += w3 * u.x * u.y;
        p[2] += w3 * u.y * u.y;
    }
    let gradient = a * (0.5 * s) + q * m;
    let hessian = [2.0 * a.x * q.x + m * (4.0 * p[0] - t), a.x * q.y + a.y * q.x + m * 4.0 * p[1], 2.0 * a.y * q.y + m * (4.0 * p[2] - t)];
    (gradient, hessian)
}

/// Of a square grid; zero for other grids.
pub fn derivatives(hemisphere: &Hemisphere) -> Derivatives {
    let Grid::Square { side } = hemisphere.grid else {
        return Derivatives::default();
    };
    let mean = hemisphere.irradiance() * std::f32::consts::FRAC_1_PI;
    let scale = mean.element_sum();
    let relative = if scale > 0.0 { 1.0 / (scale * std::f32::consts::PI) } else { 0.0 };
    let vertex = |i: usize| Vertex { u: hemisphere.direction[i], k: hemisphere.inverse_distance[i], l: hemisphere.radiance[i], above: hemisphere.above[i] };
    let mut out = Derivatives::default();
    // `left` lies to the left of a → b seen from the point: counter-clockwise triangles have it inside.
    let mut add = |a: &Vertex, b: &Vertex, left: Option<Rgb>, right: Option<Rgb>| {
        let (Some(left), Some(right)) = (left, right) else { return };
        let change = left - right;
        if change == Rgb::ZERO || a.k + b.k == 0.0 {
            return;
        }
        let (g, h) = edge(a.u, a.k, b.u, b.k);
        for (out, change) in out.gradient.iter_mut().zip(change.to_array()) {
            *out += g.extend(0.0) * change;
        }
        for (out, h) in out.hessian.iter_mut().zip(h) {
            *out += h * change.element_sum() * relative;
        }
    };
    // Squares are cut from (0, 0) to (1, 1): `below` holds (1, 0), `above` holds (0, 1).
    let at = |x: usize, y: usize| vertex(y * side + x);
    let cut = |x: usize, y: usize| {
        let (v00, v10, v01, v11) = (at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1));
        [radiance([&v00, &v10, &v11]), radiance([&v00, &v11, &v01])]
    };
    let last = side - 1;
    let mut row_below: Vec<[Option<Rgb>; 2]> = Vec::new();
    for y in 0..last {
        let row: Vec<_> = (0..last).map(|x| cut(x, y)).collect();
        for x in 0..last {
            add(&at(x, y), &at(x + 1, y + 1), row[x][1], row[x][0]);
            if y > 0 {
                add(&at(x, y), &at(x + 1, y), row[x][0], row_below[x][1]);
            }
            if x > 0 {
                add(&at(x, y), &at(x, y + 1), row[x - 1][0], row[x][1]);
            }
        }
        row_below = row;
    }
    // The rim: from the outermost hits to the horizon, counter-clockwise.
    let rim: Vec<(usize, usize)> = (0..last)
        .map(|i| (i, 0))
        .chain((0..last).map(|i| (last, i)))
        .chain((0..last).map(|i| (last - i, last)))
        .chain((0..last).map(|i| (0, last - i)))
        .collect();
    let inside = |i: usize| match i / last {
        0 => cut(i % last, 0)[0],
        1 => cut(last - 1, i % last)[0],
        2 => cut(last - 1 - i % last, last - 1)[1],
        _ => cut(0, last - 1 - i % last)[1],
    };
    let fallen = |v: Vertex| Vertex { u: Vec3::new(v.u.x, v.u.y, 0.0).normalize_or(Vec3::X), ..v };
    let strip = |i: usize| {
        let (a, b) = (rim[i], rim[(i + 1) % rim.len()]);
        let (a, b) = (at(a.0, a.1), at(b.0, b.1));
        radiance([&a, &b, &b])
    };
    let mut before = strip(rim.len() - 1);
    for i in 0..rim.len() {
        let (a, b) = (rim[i], rim[(i + 1) % rim.len()]);
        let (a, b) = (at(a.0, a.1), at(b.0, b.1));
        let here = strip(i);
        add(&a, &b, inside(i), here);
        add(&a, &fallen(a), here, before);
        add(&fallen(a), &fallen(b), here, Some(mean));
        before = here;
    }
    out
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
