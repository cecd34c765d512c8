//! Even dicing: every triangle, seen or hidden, cut into pieces of the same area.
//!
//! ```text
//! a = Σ A_t / N (or 1 / density)        pieces of triangle t: the count of (j + ½) a in its stretch of the running sum of areas
//! ```
//! A triangle of k pieces is cut across its longest edge in the ratio ⌊k/2⌋ : k − ⌊k/2⌋, and both parts again: k pieces of exactly A/k,
//! as compact as the triangle allows, without gaps or overlaps, and the pieces are the strata of whatever is sampled on them. Triangles
//! smaller than a piece are taken by systematic sampling along the order of triangles; a piece then also carries the area of those
//! that were passed over.
//!
//! Input   [`Geometry`], [`Density`]. Output  [`Piece`]s in the order of triangles.
//! Guarantees  Σ areas is the surface's up to rounding; exactly ⌊N⌉ pieces up to one; the result depends on nothing else.
//! Not     blue noise: pieces of one triangle form a regular pattern. Cost  O(triangles + pieces), 32 B a piece.

use glam::Vec2;
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::tessellate::Geometry;

/// How fine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Density {
    /// This many elements in all.
    Elements(u64),
    /// Elements per unit of area (scene units squared).
    PerArea(f64),
}

/// A part of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// The triangle.
    pub triangle: u32,
    /// Corners as barycentrics (u, v) of the triangle.
    pub corners: [Vec2; 3],
    /// Area, scene units squared, with that of neighbours that have no piece of their own.
    pub area: f32,
}

/// Most elements of a cloud.
pub const MAX_ELEMENTS: u64 = 400_000_000;

impl Piece {
    /// Barycentrics of the triangle at barycentrics (u, v) of the piece.
    pub fn at(&self, u: f32, v: f32) -> Vec2 {
        let [a, b, c] = self.corners;
        a + (b - a) * u + (c - a) * v
    }
    /// Barycentrics of the triangle at the middle of stratum `i` of `count`, a square number.
    pub fn stratum(&self, i: usize, count: usize) -> Vec2 {
        let side = (count as f32).sqrt() as usize;
        let mut b = Vec2::new(((i % side) as f32 + 1.0 / 3.0) / side as f32, ((i / side) as f32 + 1.0 / 3.0) / side as f32);
        if b.x + b.y > 1.0 {
            b = Vec2::ONE - b;
        }
        self.at(b.x, b.y)
    }
}

/// Cuts every triangle.
///
/// # Errors
/// [`Error::Setting`] when there would be no elements or too many.
pub fn dice(geometry: &Geometry, density: Density) -> Result<Vec<Piece>> {
    let total: f64 = (0..geometry.len() as u32).map(|t| f64::from(geometry.area(t))).sum();
    let (key, count) = match density {
        Density::Elements(n) => ("points.elements", n as f64),
        Density::PerArea(d) => ("points.density", d * total),
    };
    if !(count >= 1.0 && count <= MAX_ELEMENTS as f64) {
        return Err(Error::setting(key, format!("asks for {count:.0} elements; between 1 and {MAX_ELEMENTS} are possible")));
    }
    let piece_area = total / count.round();
    let (mut run, mut carried, mut plan) = (0.0f64, 0.0f64, Vec::<(u32, u32, f64)>::new());
    for t in 0..geometry.len() as u32 {
        let area = f64::from(geometry.area(t));
        let before = (run / piece_area + 0.5).floor();
        run += area;
        let k = ((run / piece_area + 0.5).floor() - before) as u32;
        if k == 0 {
            carried += area;
        } else {
            plan.push((t, k, (area + carried) / f64::from(k)));
            carried = 0.0;
        }
    }
    match plan.last_mut() {
        Some((_, k, area)) => *area += carried / f64::from(*k),
        None => return Err(Error::setting(key, format!("asks for {count:.0} elements, which the surface is too small for; ask for more"))),
    }
    let blocks: Vec<Vec<Piece>> = plan
        .par_chunks(256)
        .map(|chunk| {
            let mut out = Vec::with_capacity(chunk.iter().map(|c| c.1 as usize).sum());
            for &(triangle, k, area) in chunk {
                // Lengths are those of the triangle laid flat.
                let [a, b, c] = geometry.corners(triangle);
                let (e1, e2) = (b - a, c - a);
                let metric = [e1.length_squared(), e1.dot(e2), e2.length_squared()];
                cut([Vec2::ZERO, Vec2::X, Vec2::Y], k, metric, &mut |corners| out.push(Piece { triangle, corners, area: area as f32 }));
            }
            out
        })
        .collect();
    Ok(blocks.concat())
}

/// Cuts into `k` parts of equal area; `metric` is the first fundamental form of (u, v).
fn cut(c: [Vec2; 3], k: u32, metric: [f32; 3], emit: &mut impl FnMut([Vec2; 3])) {
    if k == 1 {
        emit(c);
        return;
    }
    let length = |i: usize| {
        let d = c[(i + 1) % 3] - c[i];
        metric[0] * d.x * d.x + 2.0 * metric[1] * d.x * d.y + metric[2] * d.y * d.y
    };
    let edge = (0..3).fold(0, |best, i| if length(i) > length(best) { i } else { best });
    let (i, j) = (edge, (edge + 1) % 3);
    let first = k / 2;
    let middle = c[i] + (c[j] - c[i]) * (first as f32 / k as f32);
    let (mut near, mut far) = (c, c);
    near[j] = middle;
    far[i] = middle;
    cut(near, first, metric, emit);
    cut(far, k - first, metric, emit);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Mesh, Scene};
    use glam::Vec3;
    use proptest::prelude::*;

    fn geometry(positions: Vec<Vec3>) -> Geometry {
        let n = positions.len() as u32 / 3;
        let mesh = Mesh { positions, triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(), materials: vec![0; n as usize], ..Mesh::default() };
        Geometry::new(&Scene { meshes: vec![mesh], materials: vec![Material::default()], ..Scene::default() })
    }

    fn area(g: &Geometry, piece: &Piece) -> f32 {
        let [a, b, c] = piece.corners.map(|b| g.surface(piece.triangle, b.x, b.y).p);
        (b - a).cross(c - a).length() * 0.5
    }

    proptest! {
        #[test]
        fn pieces_are_equal_and_make_up_the_surface(raw in prop::collection::vec((-1f32..1.0, -1f32..1.0, -1f32..1.0), 3..60), count in 1u64..3000) {
            let mut points: Vec<Vec3> = raw.iter().map(|&(x, y, z)| Vec3::new(x, y, z)).collect();
            points.truncate(points.len() / 3 * 3);
            let g = geometry(points);
            prop_assume!(!g.is_empty());
            let pieces = dice(&g, Density::Elements(count)).unwrap();
            prop_assert!((pieces.len() as i64 - count as i64).abs() <= 1);
            let whole: f64 = (0..g.len() as u32).map(|t| f64::from(g.area(t))).sum();
            let sum: f64 = pieces.iter().map(|p| f64::from(p.area)).sum();
            prop_assert!((sum / whole - 1.0).abs() < 1e-4, "{} {}", sum, whole);
            // Where the pieces of a triangle tile it, they are equal; more than one triangle may be carried only by one piece.
            for t in 0..g.len() as u32 {
                let mine: Vec<&Piece> = pieces.iter().filter(|p| p.triangle == t).collect();
                let tiled: f32 = mine.iter().map(|p| area(&g, p)).sum();
                prop_assert!(mine.is_empty() || (tiled / g.area(t) - 1.0).abs() < 1e-3);
                for p in &mine {
                    prop_assert!((area(&g, p) * mine.len() as f32 / g.area(t) - 1.0).abs() < 2e-2);
                }
            }
        }
    }

    #[test]
    fn small_triangles_get_their_share() {
        // A strip of 1000 small triangles and one large one of the same area in all: half of the elements each.
        let mut points = Vec::new();
        for i in 0..1000 {
            let o = Vec3::new(i as f32 * 0.05, 0.0, 0.0);
            points.extend([o, o + Vec3::X * 0.04, o + Vec3::Y * 0.05]);
        }
        points.extend([Vec3::Z, Vec3::new(2.0, 0.0, 1.0), Vec3::new(0.0, 1.0, 1.0)]);
        let g = geometry(points);
        let pieces = dice(&g, Density::Elements(100)).unwrap();
        let large = pieces.iter().filter(|p| p.triangle == 1000).count();
        assert!(large.abs_diff(50) <= 1 && pieces.len() == 100, "{large} of {}", pieces.len());
        assert!(dice(&g, Density::Elements(0)).is_err() && dice(&g, Density::PerArea(f64::NAN)).is_err());
        assert_eq!(dice(&g, Density::PerArea(50.0)).unwrap().len(), 100);
    }

    #[test]
    fn pieces_are_compact() {
        let g = geometry(vec![Vec3::ZERO, Vec3::X * 20.0, Vec3::new(0.0, 1.0, 0.0)]);
        for piece in dice(&g, Density::Elements(777)).unwrap() {
            let c = piece.corners.map(|b| g.surface(0, b.x, b.y).p);
            let longest = (0..3).map(|i| c[i].distance(c[(i + 1) % 3])).fold(0.0, f32::max);
            assert!(longest * longest < 12.0 * piece.area, "{c:?}");
        }
    }
}
