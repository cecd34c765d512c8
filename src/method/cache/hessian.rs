//! Occlusion-aware gradient and Hessian of irradiance, from the triangles between the hits.
//!
//! The grid's hits are joined to triangles; each takes the radiance of its **farthest** corner, so that a near thing ends where its last
//! hit is and uncovers what lies behind (Schwarzhaupt, Wann Jensen, Jarosz 2012). Then E is a sum of polygons seen by the point, and its
//! derivatives are sums over the edges between triangles of unlike radiance: [`super::edges`].
//!
//! Input   [`Hemisphere`] on [`Grid::Square`]. Output  [`Derivatives`], local frame, tangent parts. Cost O(strata), about three edges each.
//! Horizon: the outermost hits are continued down to it at their distance, and outside of it lies the mean radiance. The sum must run
//! over closed polygons, for an edge's own term holds a part that only cancels around a polygon; and the mean outside makes the
//! derivatives of a constant environment exactly zero. Triangles with a corner below the geometric horizon send what their neighbours do.
//! Not seen: what is thinner than a stratum; a thing's outline lies up to one stratum inside the true one.

use glam::{Vec2, Vec3};

use super::edges::EdgeSum;
use super::hemisphere::{Grid, Hemisphere};
use crate::radiometry::Rgb;

/// First derivative of irradiance and second of relative irradiance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Derivatives {
    /// Per channel, W·m⁻² per unit length, local.
    pub gradient: [Vec3; 3],
    /// xx, xy, yy of the irradiance summed over channels, in units of that irradiance; 1 / length². Zero in the dark.
    pub hessian: [f32; 3],
}

#[derive(Clone, Copy)]
struct Vertex {
    u: Vec3,
    k: f32,
    l: Rgb,
    above: bool,
}

impl Vertex {
    /// The same thing at the horizon.
    fn fallen(self) -> Self {
        Self { u: Vec3::new(self.u.x, self.u.y, 0.0).normalize_or(Vec3::X), ..self }
    }
}

/// What a triangle sends: none when it has a corner below the geometric horizon.
fn radiance(a: Vertex, b: Vertex, c: Vertex) -> Option<Rgb> {
    if !(a.above && b.above && c.above) {
        return None;
    }
    let far = if b.k < a.k { b } else { a };
    Some(if c.k < far.k { c.l } else { far.l })
}

/// Adds the edge a → b with what lies to its left and right; nothing when one of them is unknown.
fn add(sum: &mut EdgeSum, a: Vertex, b: Vertex, left: Option<Rgb>, right: Option<Rgb>) {
    if let (Some(left), Some(right)) = (left, right) {
        sum.add(a.u, a.k, b.u, b.k, left - right);
    }
}

/// Of a square grid; zero for other grids.
pub fn derivatives(hemisphere: &Hemisphere) -> Derivatives {
    let Grid::Square { side } = hemisphere.grid else {
        return Derivatives::default();
    };
    let at = |x: usize, y: usize| {
        let i = y * side + x;
        Vertex { u: hemisphere.direction[i], k: hemisphere.inverse_distance[i], l: hemisphere.radiance[i], above: hemisphere.above[i] }
    };
    let last = side - 1;
    // Squares are cut along their diagonal from (x, y) to (x+1, y+1); [0] lies on the side of x, [1] on the side of y.
    let squares: Vec<[Option<Rgb>; 2]> = (0..last * last)
        .map(|i| {
            let (x, y) = (i % last, i / last);
            let (v00, v10, v01, v11) = (at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1));
            [radiance(v00, v10, v11), radiance(v00, v11, v01)]
        })
        .collect();
    let square = |x: usize, y: usize| squares[y * last + x];
    let mut sum = EdgeSum::default();
    for y in 0..last {
        for x in 0..last {
            let [right, left] = square(x, y);
            add(&mut sum, at(x, y), at(x + 1, y + 1), left, right);
            if y > 0 {
                add(&mut sum, at(x, y), at(x + 1, y), right, square(x, y - 1)[1]);
            }
            if x > 0 {
                add(&mut sum, at(x, y), at(x, y + 1), square(x - 1, y)[0], left);
            }
        }
    }
    let mean = hemisphere.mean_above();
    // Around the rim, counter-clockwise; the triangle inside of each of its edges.
    let rim = |i: usize| match i / last % 4 {
        0 => at(i % last, 0),
        1 => at(last, i % last),
        2 => at(last - i % last, last),
        _ => at(0, last - i % last),
    };
    let inside = |i: usize| match i / last {
        0 => square(i, 0)[0],
        1 => square(last - 1, i - last)[0],
        2 => square(last - 1 - i % last, last - 1)[1],
        _ => square(0, last - 1 - i % last)[1],
    };
    let strip = |i: usize| radiance(rim(i), rim(i + 1), rim(i + 1));
    let mut before = strip(4 * last - 1);
    for i in 0..4 * last {
        let (a, b, here) = (rim(i), rim(i + 1), strip(i));
        add(&mut sum, a, b, inside(i), here);
        add(&mut sum, a, a.fallen(), here, before);
        add(&mut sum, a.fallen(), b.fallen(), here, Some(mean));
        before = here;
    }
    let (gradient, hessian) = sum.finish();
    let irradiance = hemisphere.irradiance().element_sum();
    let relative = if irradiance > 0.0 { 1.0 / irradiance } else { 0.0 };
    Derivatives { gradient: gradient.map(|g| g.extend(0.0)), hessian: hessian.map(|h| h * relative) }
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
