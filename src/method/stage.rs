//! What every method that looks up the proxy starts from: cells, their radiosity, and the camera's
//! samples.
//!
//! The same scene, settings and seed give the same [`Stage`] to every method: what differs between
//! their pictures is the method alone. Phases `cells`, `photons`, `gather`, `record`.

use crate::error::Result;
use crate::photon::{CellRadiosity, Proxy, ProxySettings, ProxyStats, solve};
use crate::record::{CameraSamples, RecordSettings, camera_samples};
use crate::run::Run;
use crate::shading::{DirectSettings, World};
use crate::tessellate::Cells;

/// Settings of the rooms before the method.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// Longest edge of a cell, scene units.
    pub near_cell: f32,
    /// The proxy.
    pub photon: &'a ProxySettings,
    /// Camera samples and shading points.
    pub record: &'a RecordSettings,
    /// Direct light of the camera samples.
    pub direct: &'a DirectSettings,
    /// Seed of every random number.
    pub seed: u64,
}

/// The scene's cells (phase `cells`).
///
/// # Errors
/// Cells that do not fit memory.
pub fn cells(world: &World, inputs: Inputs<'_>, run: &Run) -> Result<Cells> {
    let _phase = run.phase("cells", 1);
    run.install(|| Cells::new(&world.geometry, inputs.near_cell))
}

/// What is told of proxy and camera samples.
#[derive(Clone, Debug, serde::Serialize)]
pub struct StageStatistics {
    /// Pieces of surfaces.
    pub cells: usize,
    /// Stored photons.
    pub photons: usize,
    /// Sides of cells whose irradiance was gathered.
    pub gathered_sides: usize,
    /// Sweeps over them.
    pub sweeps: u32,
    /// Relative change of irradiance in the last sweep.
    pub sweep_residual: f32,
    /// Points that need indirect light.
    pub shading_points: usize,
}

/// Proxy and camera samples.
#[derive(Debug, Default)]
pub struct Stage {
    /// Pieces of surfaces.
    pub cells: Cells,
    /// Radiosity of their sides.
    pub radiosity: CellRadiosity,
    /// What the proxy tells of itself.
    pub proxy_stats: ProxyStats,
    /// What the camera sees, and the points that need indirect light.
    pub samples: CameraSamples,
}

impl Stage {
    /// Cells, proxy, camera samples.
    ///
    /// # Errors
    /// Settings out of range, cells that do not fit memory, [`crate::error::Error::Interrupted`].
    pub fn new(world: &World, inputs: Inputs<'_>, run: &Run) -> Result<Self> {
        inputs.record.validate()?;
        let cells = cells(world, inputs, run)?;
        let (radiosity, proxy_stats) = solve(world, &cells, inputs.photon, inputs.seed, run)?;
        let samples = camera_samples(world, inputs.record, inputs.direct, inputs.seed, run)?;
        Ok(Self { cells, radiosity, proxy_stats, samples })
    }

    /// The proxy, borrowed.
    pub fn proxy(&self) -> Proxy<'_> {
        Proxy { cells: &self.cells, radiosity: &self.radiosity }
    }

    /// Statistics that all these methods share.
    pub fn statistics(&self) -> StageStatistics {
        let proxy = &self.proxy_stats;
        StageStatistics {
            cells: self.cells.len(),
            photons: proxy.photons,
            gathered_sides: proxy.gathered,
            sweeps: proxy.sweeps,
            sweep_residual: proxy.residual,
            shading_points: self.samples.points.len(),
        }
    }
}
