//! The light of every cell side: what the proxy is, once it is solved.

use super::cell_side::CellSide;
use super::cells::CellId;
use crate::radiometry::Rgb;

/// Light leaving every cell side, emission left out. Arrays by [`CellSide::index`].
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct CellRadiosity {
    /// Radiosity, W·m⁻², per existing area.
    pub leaving: Vec<Rgb>,
    /// Indirect irradiance, W·m⁻² (zero where skipped).
    pub indirect: Vec<Rgb>,
    /// Fraction of every cell that exists; empty when nothing is masked.
    pub coverage: Vec<f32>,
    /// Sides whose irradiance was gathered; the others were never seen. Empty for other estimates
    /// than `gather`.
    pub gathered: Vec<bool>,
}

impl CellRadiosity {
    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.leaving.len() / 2
    }
    /// Fraction of a cell that exists.
    pub fn coverage(&self, cell: CellId) -> f32 {
        self.coverage.get(cell as usize).copied().unwrap_or(1.0)
    }
    /// Whether the irradiance of a side was gathered.
    pub fn gathered(&self, side: CellSide) -> bool {
        self.gathered.get(side.index()).is_some_and(|&g| g)
    }
}
