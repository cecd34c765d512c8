//! Direct light and albedo of a cell side, from shadow rays at points of it.
//!
//! ```text
//! ⟨ρ E_direct⟩, ⟨ρ⟩      ⟨·⟩: mean over the points of the side that exist, one shadow ray each
//! ```
//! The points are those where rays arrived, so that area buried in other surfaces, which nothing
//! sees, does not count; sides that no ray reached are sampled by stratified points of the cell.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::cell_side::CellSide;
use super::cells::{CellId, Cells};
use super::making::Making;
use super::shooter::Arrival;
use crate::radiometry::Rgb;
use crate::sampling::{Sobol, Stream, sample_triangle};
use crate::shading::{World, direct_irradiance};
use crate::tessellate::Masks;

/// Points of a cell that tell how much of it exists.
const COVERAGE_POINTS: u32 = 16;

/// Points of cells.
pub(super) struct CellPoints<'a> {
    world: &'a World,
    cells: &'a Cells,
    masks: Option<Masks<'a>>,
    seed: u64,
}

/// What a side reflects, as [`CellPoints::reflected`] finds it.
pub(super) struct Reflected {
    /// ⟨ρ E_direct⟩.
    pub direct: Rgb,
    /// ⟨ρ⟩.
    pub albedo: Rgb,
}

impl<'a> CellPoints<'a> {
    pub fn new(making: &Making<'a>) -> Self {
        let Making { world, cells, seed, .. } = *making;
        Self { world, cells, masks: world.geometry.masks(), seed }
    }

    fn sobol(&self, cell: CellId) -> Sobol {
        Sobol::new(self.seed, Stream::Cell, u64::from(cell))
    }

    /// Point `i` of a cell as barycentrics (u, v) of its triangle.
    fn barycentrics(&self, cell: CellId, sobol: &Sobol, i: u32) -> Vec2 {
        let b = sample_triangle(sobol.sample_2d(i, 0));
        let [p, q, r] = self.cells.corners[cell as usize];
        let x = p * (1.0 - b.x - b.y) + q * b.x + r * b.y;
        let [v0, v1, v2] =
            self.world.geometry.corners(self.cells.triangle_of[cell as usize]).map(Vec3::as_dvec3);
        let n = (v1 - v0).cross(v2 - v0);
        let d = x.as_dvec3() - v0;
        let (u, v) = (
            d.cross(v2 - v0).dot(n) / n.length_squared(),
            (v1 - v0).cross(d).dot(n) / n.length_squared(),
        );
        Vec2::new(u.clamp(0.0, 1.0) as f32, v.clamp(0.0, 1.0) as f32)
    }

    fn exists(&self, cell: CellId, b: Vec2) -> bool {
        self.masks
            .as_ref()
            .is_none_or(|m| m.exists(self.cells.triangle_of[cell as usize], b.x, b.y))
    }

    /// What a side reflects at `count` points, `arrivals` in turn or, without any, stratified over
    /// the cell; and the shadow rays shot. None where no point exists.
    pub fn reflected(
        &self,
        at: CellSide,
        arrivals: &[Arrival],
        count: u32,
    ) -> (Option<Reflected>, u64) {
        let (cell, side) = (at.cell(), at.side());
        let triangle = self.cells.triangle_of[cell as usize];
        let sobol = self.sobol(cell);
        let sign = side.sign();
        let (mut direct, mut albedo, mut found, mut shot) = (Rgb::ZERO, Rgb::ZERO, 0, 0);
        for i in 0..count {
            let b = match arrivals {
                [] => self.barycentrics(cell, &sobol, i),
                _ => {
                    let arrival = arrivals[i as usize % arrivals.len()];
                    Vec2::new(arrival.u, arrival.v)
                }
            };
            if !self.exists(cell, b) {
                continue;
            }
            let s = self.world.geometry.surface(triangle, b.x, b.y);
            let pairs = 1 + 2 * side as u32;
            let mut sample = |_: u32| (sobol.sample_1d(i, pairs), sobol.sample_2d(i, pairs + 1));
            let (e, rays) = direct_irradiance(
                self.world,
                [s.p, s.ng * sign, s.ns * sign],
                None,
                1,
                &mut sample,
            );
            direct += e * s.albedo;
            albedo += s.albedo;
            found += 1;
            shot += rays;
        }
        let mean = || Reflected { direct: direct / found as f32, albedo: albedo / found as f32 };
        ((found > 0).then(mean), shot)
    }

    /// Fraction of every cell that exists, by its points; empty where nothing is masked. Call
    /// inside the thread pool.
    pub fn coverage(&self) -> Vec<f32> {
        let covered = |cell: CellId| {
            let sobol = self.sobol(cell);
            let exists = |&i: &u32| self.exists(cell, self.barycentrics(cell, &sobol, i));
            (0..COVERAGE_POINTS).filter(exists).count() as f32 / COVERAGE_POINTS as f32
        };
        match self.masks {
            Some(_) => (0..self.cells.len() as u32).into_par_iter().map(covered).collect(),
            None => Vec::new(),
        }
    }
}
