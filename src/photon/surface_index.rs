//! Cells around a point that face the same way, with what lies on them.
//!
//! Distances are *squashed* along the normal N of the query: `d² = |D|² + 16 (D·N)²`, so a region
//! is a flat disc-like ellipsoid that reaches a neighbouring parallel surface only when that is
//! nearer than a quarter of its radius. Cell sides whose normal makes more than the agreed angle
//! with N do not belong. With the side test exact (a photon knows the side it hit) these are the
//! leak guards.
//!
//! Inputs  [`Geometry`], [`Cells`], photons. Cost  17 B per cell of tree and 24 B of counts; a
//!         query visits the cells of its ball.

use glam::Vec3;

use super::Photon;
use super::kdtree::KdTree;
use super::overlap::triangle_in_sphere;
use super::patches::Patch;
use crate::radiometry::Rgb;
use crate::tessellate::{CellId, Cells, Geometry, Side};

/// Weight of the squared distance along the normal in addition to the Euclidean one.
const SQUASH: f32 = 16.0;

/// Squashed squared length of `offset` for a region of unit normal `n`.
pub(super) fn squashed(offset: Vec3, n: Vec3) -> f32 {
    offset.length_squared() + SQUASH * offset.dot(n).powi(2)
}

/// Cells in a tree by centroid, with existing area and photons per side.
#[derive(Debug)]
pub struct SurfaceIndex<'a> {
    geometry: &'a Geometry,
    cells: &'a Cells,
    tree: KdTree,
    /// Existing area of every cell (masked-out parts left out).
    area: Vec<f32>,
    /// Stored flux by 2 · cell + side, W.
    flux: Vec<Rgb>,
    /// Stored photons by 2 · cell + side.
    count: Vec<u32>,
    normal_agreement: f32,
}

/// Sums over a region.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Region {
    pub flux: Rgb,
    pub area: f32,
    pub photons: u32,
}

impl<'a> SurfaceIndex<'a> {
    /// Sorts cells and photons. `area` is the existing area per cell; `normal_agreement` the least
    /// cosine between normals that share.
    pub fn new(
        geometry: &'a Geometry,
        cells: &'a Cells,
        area: Vec<f32>,
        photons: &[Photon],
        normal_agreement: f32,
    ) -> Self {
        let mut flux = vec![Rgb::ZERO; 2 * cells.len()];
        let mut count = vec![0; 2 * cells.len()];
        for p in photons {
            flux[p.cell_side()] += p.flux;
            count[p.cell_side()] += 1;
        }
        Self {
            geometry,
            cells,
            tree: KdTree::new(cells.centroids.iter().copied()),
            area,
            flux,
            count,
            normal_agreement,
        }
    }

    /// Unit normal that a side of a cell faces.
    pub fn normal(&self, cell: CellId, side: Side) -> Vec3 {
        let n = self.cells.normal(self.geometry, cell);
        if side == Side::Front { n } else { -n }
    }

    /// Existing area of a cell.
    pub fn area(&self, cell: CellId) -> f32 {
        self.area[cell as usize]
    }

    /// What lies on one cell side alone.
    pub(super) fn own(&self, cell: CellId, side: Side) -> Region {
        let i = 2 * cell as usize + side as usize;
        Region { flux: self.flux[i], area: self.area[cell as usize], photons: self.count[i] }
    }

    /// The side of a cell that agrees with normal `n`, if any.
    pub(super) fn agreeing(&self, cell: CellId, n: Vec3) -> Option<Side> {
        let cos = self.cells.normal(self.geometry, cell).dot(n);
        if cos >= self.normal_agreement {
            Some(Side::Front)
        } else if -cos >= self.normal_agreement && !self.cells.one_sided[cell as usize] {
            Some(Side::Back)
        } else {
            None
        }
    }

    /// Every side that can be seen and has area, as a patch; with the index 2 · cell + side of
    /// each.
    pub(super) fn sides(&self) -> (Vec<Patch>, Vec<usize>) {
        let (mut out, mut index) =
            (Vec::with_capacity(self.count.len()), Vec::with_capacity(self.count.len()));
        for cell in 0..self.cells.len() as CellId {
            let back = !self.cells.one_sided[cell as usize];
            for side in [Side::Front, Side::Back].into_iter().take(1 + usize::from(back)) {
                let sums = self.own(cell, side);
                if sums.area > 0.0 {
                    out.push(Patch {
                        center: self.cells.centroids[cell as usize],
                        normal: self.normal(cell, side),
                        sums,
                    });
                    index.push(2 * cell as usize + side as usize);
                }
            }
        }
        (out, index)
    }

    /// Area of agreeing surface inside the squashed ball, exact for surface without masks.
    pub(super) fn area_within(&self, center: Vec3, n: Vec3, radius: f32) -> f32 {
        let stretch = (1.0 + SQUASH).sqrt() - 1.0;
        let mut sum = 0.0;
        // A corner lies at most 2/3 of the longest edge from the centroid.
        self.tree.within(center, radius + self.cells.near_cell * 0.667, |cell, _| {
            if self.agreeing(cell, n).is_none() {
                return;
            }
            let whole = self.cells.area(cell);
            let corners = self.cells.corners[cell as usize].map(|c| {
                let d = c - center;
                d + n * (stretch * d.dot(n))
            });
            let stretched = (corners[1] - corners[0]).cross(corners[2] - corners[0]).length() * 0.5;
            if whole > 0.0 && stretched > 0.0 {
                let coverage = self.area[cell as usize] / whole;
                sum +=
                    triangle_in_sphere(corners, radius) * f64::from(coverage * whole / stretched);
            }
        });
        sum as f32
    }
}
