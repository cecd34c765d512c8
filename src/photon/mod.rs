//! (skeleton)
#![allow(missing_docs, reason = "skeleton")]
use crate::radiometry::Rgb;
use crate::tessellate::{CellId, Cells, Side};
#[derive(Debug, Default, Clone)]
pub struct CellRadiosity {
    pub front: Vec<Rgb>,
    pub back: Vec<Rgb>,
    pub coverage: Vec<f32>,
}
impl CellRadiosity {
    pub fn get(&self, cell: CellId, side: Side) -> Rgb {
        match side {
            Side::Front => self.front[cell as usize],
            Side::Back => self.back[cell as usize],
        }
    }
}
#[derive(Debug, Default)]
pub struct ProxyStats {
    pub photons: usize,
}
#[derive(Debug, Default, Clone, serde::Serialize, serde::Deserialize)]
pub struct PhotonSettings {}
pub fn solve(_w: &crate::shading::World, cells: &Cells, _s: &PhotonSettings, _seed: u64, _run: &crate::run::Run) -> crate::error::Result<(CellRadiosity, ProxyStats)> {
    Ok((CellRadiosity { front: vec![Rgb::ZERO; cells.len()], back: vec![Rgb::ZERO; cells.len()], coverage: vec![] }, ProxyStats::default()))
}
