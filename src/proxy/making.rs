//! What every step of making the proxy is given.

use super::ProxySettings;
use super::cell_side::CellSide;
use super::cells::Cells;
use crate::run::Run;
use crate::shading::World;
use crate::tessellate::Side;

/// The scene, its cells, and how their light is found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Making<'a> {
    pub world: &'a World,
    pub cells: &'a Cells,
    pub settings: &'a ProxySettings,
    pub seed: u64,
    pub run: &'a Run,
}

impl Making<'_> {
    /// Whether a side reflects and can be seen.
    pub fn reflects(&self, at: CellSide) -> bool {
        let cell = at.cell() as usize;
        let albedo = self.world.geometry.material(self.cells.triangle_of[cell]).albedo;
        albedo.max_element() > 0.0 && (at.side() == Side::Front || !self.cells.one_sided[cell])
    }
}
