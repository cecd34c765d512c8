//! Even dicing: every triangle, seen or hidden, cut into pieces of the same area.
//!
//! With N elements wanted the pieces have the area a = Σ A_t / N, or 1 / density. Triangle t gets
//! as many pieces as there are values (j + ½) a in its stretch of the running sum of areas. A
//! triangle of k pieces is laid in rows between its shortest edge and the corner across, about as
//! high as a piece is wide; rows hold whole numbers of pieces and are cut evenly, so k pieces of
//! exactly A/k have neither gaps nor overlaps and are the strata of whatever is sampled on them.
//! Triangles smaller than a piece are taken by systematic sampling along the order of triangles;
//! such a piece also carries the area of those that were passed over.
//!
//! Input is a [`Geometry`] and a [`Density`]; output are [`Piece`]s in the order of triangles,
//! exactly ⌊N⌉ up to one, whose areas sum to the surface's up to rounding. The result depends on
//! nothing else. Pieces of one triangle form a regular pattern, not blue noise. The cost is
//! O(triangles + pieces) and 32 bytes a piece.

use glam::Vec2;
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::memory;
use crate::tessellate::Geometry;

/// How fine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Density {
    /// This many elements in all.
    Elements(u64),
    /// Elements per unit of area (scene units squared).
    PerArea(f64),
}

/// A part of a triangle: between two lines parallel to its shortest edge, and two through the
/// corner across.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// The triangle.
    pub triangle: u32,
    /// Its corner across the shortest edge, 0 to 2.
    pub apex: u8,
    /// Share of the triangle's area on the corner's side of the two lines.
    pub along: [f32; 2],
    /// Share of the shortest edge at which the lines through the corner end.
    pub across: [f32; 2],
    /// Area, scene units squared, with that of neighbours that have no piece of their own.
    pub area: f32,
}

/// Bytes of an element while its light is computed.
const ELEMENT: f64 = 300.0;

/// Most elements of a cloud.
pub const MAX_ELEMENTS: u64 = 400_000_000;

impl Piece {
    /// Barycentrics (u, v) of the triangle at a point of the unit square; keeps areas.
    pub fn at(&self, unit: Vec2) -> Vec2 {
        let reach = (self.along[0] + (self.along[1] - self.along[0]) * unit.x).sqrt();
        let turn = self.across[0] + (self.across[1] - self.across[0]) * unit.y;
        let corners = [Vec2::ZERO, Vec2::X, Vec2::Y];
        let [a, b, c] = [0, 1, 2].map(|i| corners[(usize::from(self.apex) + i) % 3]);
        a + (b - a) * (reach * (1.0 - turn)) + (c - a) * (reach * turn)
    }
}

/// Cuts every triangle.
///
/// # Errors
/// [`Error::Setting`] when there would be no elements or too many.
pub fn dice(geometry: &Geometry, density: Density) -> Result<Vec<Piece>> {
    let total: f64 = (0..geometry.len() as u32).map(|t| f64::from(geometry.area(t))).sum();
    let (key, count) = match density {
        Density::Elements(n) => ("point_based.elements", n as f64),
        Density::PerArea(d) => ("point_based.density", d * total),
    };
    if !(count >= 1.0 && count <= MAX_ELEMENTS as f64) {
        return Err(Error::setting(
            key,
            format!("asks for {count:.0} elements; between 1 and {MAX_ELEMENTS} are possible"),
        ));
    }
    memory::claim(count * ELEMENT, &format!("a cloud of {count:.0} elements"), "ask for fewer")?;
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
        None => {
            return Err(Error::setting(
                key,
                format!(
                    "asks for {count:.0} elements, which the surface is too small for; ask for more"
                ),
            ));
        }
    }
    let blocks: Vec<Vec<Piece>> = plan
        .par_chunks(256)
        .map(|chunk| {
            let mut out = Vec::with_capacity(chunk.iter().map(|c| c.1 as usize).sum());
            for &(triangle, k, area) in chunk {
                let c = geometry.corners(triangle);
                let length = |i: usize| c[i].distance(c[(i + 1) % 3]);
                let shortest =
                    (1..3).fold(0, |best, i| if length(i) < length(best) { i } else { best });
                let own = geometry.area(triangle);
                let rows = 2.0 * own / length(shortest) / (own / k as f32).sqrt();
                rows_of(k, rows.round().clamp(1.0, k as f32) as u32, &mut |along, across| {
                    out.push(Piece {
                        triangle,
                        apex: (shortest as u8 + 2) % 3,
                        along,
                        across,
                        area: area as f32,
                    });
                });
            }
            out
        })
        .collect();
    Ok(blocks.concat())
}

/// `k` parts of equal area in about `rows` rows.
fn rows_of(k: u32, rows: u32, emit: &mut impl FnMut([f32; 2], [f32; 2])) {
    let mut before = 0;
    for row in 1..=rows {
        let share = f64::from(row) / f64::from(rows);
        let after = (f64::from(k) * share * share).round() as u32;
        let here = after - before;
        for i in 0..here {
            let [low, high] = [before, after].map(|c| (f64::from(c) / f64::from(k)) as f32);
            emit([low, high], [i as f32 / here as f32, (i + 1) as f32 / here as f32]);
        }
        before = after;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Mesh, Scene};
    use glam::Vec3;
    use proptest::prelude::*;

    fn geometry(positions: Vec<Vec3>) -> Geometry {
        let n = positions.len() as u32 / 3;
        let mesh = Mesh {
            positions,
            triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            materials: vec![0; n as usize],
            ..Mesh::default()
        };
        Geometry::new(&Scene {
            meshes: vec![mesh],
            materials: vec![Material::default()],
            ..Scene::default()
        })
    }

    fn corners(g: &Geometry, piece: &Piece) -> [Vec3; 4] {
        [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]
            .map(|u| piece.at(u))
            .map(|b| g.surface(piece.triangle, b.x, b.y).p)
    }

    fn area(g: &Geometry, piece: &Piece) -> f32 {
        let [a, b, c, d] = corners(g, piece);
        ((b - a).cross(c - a).length() + (c - a).cross(d - a).length()) * 0.5
    }

    proptest! {
        #[test]
        fn pieces_are_equal_and_make_up_the_surface(
            raw in prop::collection::vec((-1f32..1.0, -1f32..1.0, -1f32..1.0), 3..60),
            count in 1u64..3000,
        ) {
            let mut points: Vec<Vec3> = raw.iter().map(|&(x, y, z)| Vec3::new(x, y, z)).collect();
            points.truncate(points.len() / 3 * 3);
            let g = geometry(points);
            prop_assume!(!g.is_empty());
            let pieces = dice(&g, Density::Elements(count)).unwrap();
            prop_assert!((pieces.len() as i64 - count as i64).abs() <= 1);
            let whole: f64 = (0..g.len() as u32).map(|t| f64::from(g.area(t))).sum();
            let sum: f64 = pieces.iter().map(|p| f64::from(p.area)).sum();
            prop_assert!((sum / whole - 1.0).abs() < 1e-4, "{} {}", sum, whole);
            // Where the pieces of a triangle tile it, they are equal; more than one triangle may be
            // carried only by one piece.
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
        // A strip of 1000 small triangles and one large one of the same area in all: half of the
        // elements each.
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
        assert!(
            dice(&g, Density::Elements(0)).is_err()
                && dice(&g, Density::PerArea(f64::NAN)).is_err()
        );
        assert_eq!(dice(&g, Density::PerArea(50.0)).unwrap().len(), 100);
    }

    #[test]
    fn pieces_are_compact() {
        let g = geometry(vec![Vec3::ZERO, Vec3::X * 20.0, Vec3::new(0.0, 1.0, 0.0)]);
        let pieces = dice(&g, Density::Elements(777)).unwrap();
        let slenderness = |piece: &Piece| {
            let c = corners(&g, piece);
            (0..4).map(|i| c[i].distance_squared(c[(i + 1) % 4])).fold(0.0, f32::max) / piece.area
        };
        // 1 for a square; only those in the sharp corner, narrower than a piece is wide, must be
        // long.
        let mean = pieces.iter().map(slenderness).sum::<f32>() / pieces.len() as f32;
        let most = pieces.iter().map(slenderness).fold(0.0, f32::max);
        assert!(mean < 1.6 && most < 60.0, "mean {mean}, most {most}");
    }
}
