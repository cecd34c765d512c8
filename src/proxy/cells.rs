//! Cells: pieces of triangles no larger than `near_cell`, what the proxy keeps its light on.
//!
//! Each triangle is bisected at the middle of its longest edge until no edge is longer than
//!
//! ```text
//! near_cell · max(1, d / extent)      d: distance of the piece's centroid from Surroundings::midst
//! ```
//! so that a ground of kilometres around a house costs little more than the house. The bisections
//! form a binary tree per triangle; [`Cells::find`] walks it with the barycentrics of a hit, so a
//! hit's cell follows from (triangle, u, v) alone.
//!
//! Cells stand in the order of their triangles. Those of a triangle tile it, and `find` returns the
//! cell that holds the point. No vertex is shared or welded, so ray geometry never changes. The
//! aspect ratio is not bounded beyond that of the triangle. A cell costs 48 B and a bisection 8 B;
//! `find` takes O(log(cells of the triangle)).

use glam::Vec3;
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::memory;
use crate::scene::Sides;
use crate::shading::{Surroundings, World};
use crate::tessellate::{Geometry, analyze_topology};

/// Index of a cell.
pub(super) type CellId = u32;

/// A cell or a bisection: the high bit marks a cell, else bits 29–30 name the edge that is cut and
/// the rest is the first of two children.
type Node = u32;
const LEAF: u32 = 1 << 31;
const MAX_CELLS: usize = 400_000_000;
/// Bytes of a cell, its light and the rays that link it.
const CELL: f64 = 200.0;

/// How long edges of cells may be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fineness {
    /// Longest edge in the midst of what is seen.
    near_cell: f32,
    around: Surroundings,
}

impl Fineness {
    /// That of a world.
    pub(super) fn of(world: &World, near_cell: f32) -> Self {
        Self { near_cell, around: world.around }
    }

    /// The same everywhere.
    pub(super) fn even(near_cell: f32) -> Self {
        let around = Surroundings { extent: f32::INFINITY, midst: Vec3::ZERO };
        Self { near_cell, around }
    }

    fn at(&self, c: &[Vec3; 3]) -> f32 {
        let distance = ((c[0] + c[1] + c[2]) / 3.0).distance(self.around.midst);
        self.near_cell * (distance / self.around.extent).max(1.0)
    }

    /// About how many cells a triangle of this area becomes.
    fn count(&self, c: &[Vec3; 3], area: f32) -> f64 {
        let centroid = (c[0] + c[1] + c[2]) / 3.0;
        let size = c.iter().fold(0.0f32, |r, p| r.max(p.distance(centroid)));
        let nearest = (centroid.distance(self.around.midst) - size).max(0.0);
        let coarseness = (nearest / self.around.extent).max(1.0);
        // A plane through the midst: a disc of even cells, then as many in each doubling.
        let [size, extent] = [size, self.around.extent].map(f64::from);
        let plane = std::f64::consts::PI * extent.powi(2) * (1.0 + 2.0 * (size / extent).ln_1p());
        let fine = f64::from(area).min(plane) / f64::from(self.near_cell * coarseness).powi(2);
        1.0 + 4.0 * fine
    }
}

/// Small pieces of triangles.
#[derive(Debug, Default)]
pub(super) struct Cells {
    /// Root node of every triangle.
    roots: Vec<Node>,
    /// Children pairs.
    nodes: Vec<Node>,
    /// Corners of every cell; wound like their triangle.
    pub(super) corners: Vec<[Vec3; 3]>,
    /// Centroid of every cell.
    pub(super) centroids: Vec<Vec3>,
    /// Triangle of every cell.
    pub(super) triangle_of: Vec<u32>,
    /// Per cell: only the front exists (closed, consistently wound part, or `sides = "one"`).
    pub(super) one_sided: Vec<bool>,
    /// Longest allowed edge in the midst of what is seen, scene units.
    pub(super) near_cell: f32,
}

#[derive(Default)]
struct Pieces {
    nodes: Vec<Node>,
    corners: Vec<[Vec3; 3]>,
}

impl Pieces {
    /// Cuts `c` until its edges are short; returns its node, with indices local to these pieces.
    fn cut(&mut self, c: [Vec3; 3], fineness: &Fineness) -> Node {
        let limit = fineness.at(&c);
        let lengths =
            [c[0].distance_squared(c[1]), c[1].distance_squared(c[2]), c[2].distance_squared(c[0])];
        let edge = if lengths[0] >= lengths[1] && lengths[0] >= lengths[2] {
            0
        } else if lengths[1] >= lengths[2] {
            1
        } else {
            2
        };
        if lengths[edge] <= limit * limit {
            self.corners.push(c);
            return LEAF | (self.corners.len() as u32 - 1);
        }
        let (i, j) = (edge, (edge + 1) % 3);
        let middle = (c[i] + c[j]) * 0.5;
        let at = self.nodes.len();
        self.nodes.extend([0, 0]);
        let (mut first, mut second) = (c, c);
        first[j] = middle;
        second[i] = middle;
        self.nodes[at] = self.cut(first, fineness);
        self.nodes[at + 1] = self.cut(second, fineness);
        (edge as u32) << 29 | at as u32
    }
}

impl Cells {
    /// Cuts every triangle of `geometry`.
    ///
    /// # Errors
    /// [`Error::Setting`] when `near_cell` is not positive or so small that the cells would not fit
    /// memory.
    pub(super) fn new(geometry: &Geometry, fineness: &Fineness) -> Result<Self> {
        let near_cell = fineness.near_cell;
        if near_cell.is_nan() || near_cell <= 0.0 {
            return Err(Error::setting(
                "decompose.near_cell",
                format!("{near_cell} is not a positive length"),
            ));
        }
        let expected: f64 = (0..geometry.len() as u32)
            .map(|t| fineness.count(&geometry.corners(t), geometry.area(t)))
            .sum();
        if expected > MAX_CELLS as f64 || !memory::fits(expected * CELL) {
            return Err(Error::setting(
                "decompose.near_cell",
                format!(
                    "{near_cell} would cut the scene into about {expected:.0} cells; \
                     use a larger length"
                ),
            ));
        }
        let topology =
            geometry.sides_of_mesh.contains(&Sides::Auto).then(|| analyze_topology(geometry));
        let blocks: Vec<(Vec<Node>, Vec<u32>, Pieces)> = (0..geometry.len().div_ceil(1024))
            .into_par_iter()
            .map(|block| {
                let (mut roots, mut triangles, mut pieces) =
                    (Vec::new(), Vec::new(), Pieces::default());
                for t in block * 1024..((block + 1) * 1024).min(geometry.len()) {
                    roots.push(pieces.cut(geometry.corners(t as u32), fineness));
                    triangles.resize(pieces.corners.len(), t as u32);
                }
                (roots, triangles, pieces)
            })
            .collect();
        let mut cells = Self { near_cell, ..Self::default() };
        for (roots, triangles, pieces) in blocks {
            let (node_base, cell_base) = (cells.nodes.len() as u32, cells.corners.len() as u32);
            let shift = |n: Node| if n & LEAF != 0 { n + cell_base } else { n + node_base };
            cells.roots.extend(roots.into_iter().map(shift));
            cells.nodes.extend(pieces.nodes.into_iter().map(shift));
            cells.corners.extend(pieces.corners);
            cells.triangle_of.extend(triangles);
        }
        if cells.nodes.len() >= 1 << 29 || cells.corners.len() >= LEAF as usize {
            return Err(Error::setting(
                "decompose.near_cell",
                format!("{near_cell} cuts the scene into too many cells; use a larger length"),
            ));
        }
        cells.centroids = cells.corners.iter().map(|c| (c[0] + c[1] + c[2]) / 3.0).collect();
        cells.one_sided = cells
            .triangle_of
            .iter()
            .map(|&t| match geometry.sides_of_mesh[geometry.mesh_of[t as usize] as usize] {
                Sides::One => true,
                Sides::Two => false,
                Sides::Auto => topology.as_ref().is_some_and(|a| a.closed_of_triangle[t as usize]),
            })
            .collect();
        Ok(cells)
    }

    /// Number of cells.
    pub(super) fn len(&self) -> usize {
        self.corners.len()
    }
    /// The cell at barycentrics (u, v) of a triangle.
    pub(super) fn find(&self, triangle: u32, u: f32, v: f32) -> CellId {
        let mut node = self.roots[triangle as usize];
        let mut b = [1.0 - u - v, u, v];
        while node & LEAF == 0 {
            let (edge, first) = ((node >> 29) as usize, (node & 0x1fff_ffff) as usize);
            let (i, j) = (edge, (edge + 1) % 3);
            // The point is bᵢ·cᵢ + bⱼ·cⱼ + …, with the middle m = (cᵢ + cⱼ)/2 taking the place of
            // the corner it lies away from.
            if b[i] >= b[j] {
                b[i] -= b[j];
                b[j] *= 2.0;
                node = self.nodes[first];
            } else {
                b[j] -= b[i];
                b[i] *= 2.0;
                node = self.nodes[first + 1];
            }
        }
        node & !LEAF
    }
    /// Unit normal of a cell's front.
    pub(super) fn normal(&self, geometry: &Geometry, cell: CellId) -> Vec3 {
        geometry.face_normals[self.triangle_of[cell as usize] as usize]
    }
    /// Area of a cell.
    pub(super) fn area(&self, cell: CellId) -> f32 {
        let [a, b, c] = self.corners[cell as usize];
        (b - a).cross(c - a).length() * 0.5
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream, sample_triangle};
    use crate::scene::{Mesh, Scene};

    fn triangles(positions: Vec<Vec3>) -> Geometry {
        let n = positions.len() as u32 / 3;
        let mesh = Mesh {
            positions,
            triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            materials: vec![0; n as usize],
            ..Mesh::default()
        };
        Geometry::new(&Scene {
            meshes: vec![mesh],
            materials: vec![crate::scene::Material::default()],
            ..Scene::default()
        })
    }

    #[test]
    fn cells_tile_their_triangle_and_are_found() {
        let g = triangles(vec![
            Vec3::ZERO,
            Vec3::new(4.0, 0.1, 0.0),
            Vec3::new(1.0, 0.0, 0.6),
            Vec3::ONE,
            Vec3::new(1.2, 1.0, 1.0),
            Vec3::new(1.0, 1.2, 1.0),
        ]);
        let cells = Cells::new(&g, &Fineness::even(0.31)).unwrap();
        for t in 0..2u32 {
            let mine: Vec<u32> =
                (0..cells.len() as u32).filter(|&c| cells.triangle_of[c as usize] == t).collect();
            let area: f32 = mine.iter().map(|&c| cells.area(c)).sum();
            assert!((area / g.area(t) - 1.0).abs() < 1e-4);
        }
        for c in &cells.corners {
            for i in 0..3 {
                assert!(c[i].distance(c[(i + 1) % 3]) <= 0.31);
            }
        }
        let mut rng = Rng::new(1, Stream::Test, 0, 0);
        for _ in 0..10_000 {
            let b = sample_triangle(rng.next_2d());
            let p = g.surface(0, b.x, b.y).p;
            let cell = cells.find(0, b.x, b.y);
            let [a, b, c] = cells.corners[cell as usize];
            let n = (b - a).cross(c - a);
            for (i, j) in [(a, b), (b, c), (c, a)] {
                assert!((j - i).cross(p - i).dot(n) >= -1e-6, "point outside its cell");
            }
        }
    }

    #[test]
    fn refuses_absurd_lengths() {
        let g = triangles(vec![Vec3::ZERO, Vec3::X * 100.0, Vec3::Y * 100.0]);
        assert!(
            Cells::new(&g, &Fineness::even(0.0)).is_err()
                && Cells::new(&g, &Fineness::even(f32::NAN)).is_err()
                && Cells::new(&g, &Fineness::even(1e-4)).is_err()
        );
    }
}
