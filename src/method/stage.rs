//! What every method that looks up the proxy starts from: the proxy, and the camera's samples.
//!
//! The same scene, settings and seed give the same [`Stage`] to every method: what differs between
//! their pictures is the method alone. Phases `places` (or `cells`, `photons`,
//! `gather`), `record`.

use crate::error::Result;
use crate::proxy::{Need, PlaceStats, Proxy, ProxyInputs, ProxySettings};
use crate::record::{CameraSamples, RecordSettings, camera_samples};
use crate::run::Run;
use crate::shading::{DirectSettings, World};

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

impl<'a> Inputs<'a> {
    /// What the proxy is made with.
    pub fn proxy(&self) -> ProxyInputs<'a> {
        ProxyInputs { near_cell: self.near_cell, settings: self.photon, seed: self.seed }
    }

    /// Whether these settings are in their ranges.
    ///
    /// # Errors
    /// [`crate::error::Error::Setting`] for the first that is not.
    pub fn validate(&self) -> Result<()> {
        self.photon.validate()?;
        self.record.validate()?;
        self.direct.validate()
    }
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
    /// Places of light by need.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub places: Option<PlaceStats>,
    /// Points that need indirect light.
    pub shading_points: usize,
}

/// Proxy and camera samples.
#[derive(Debug, Default)]
pub struct Stage {
    /// Light where rays land.
    pub proxy: Proxy,
    /// What the camera sees, and the points that need indirect light.
    pub samples: CameraSamples,
}

impl Stage {
    /// The proxy that the world's camera needs, and its samples.
    ///
    /// # Errors
    /// Settings out of range, a proxy that does not fit memory,
    /// [`crate::error::Error::Interrupted`].
    pub fn new(world: &World, inputs: Inputs<'_>, run: &Run) -> Result<Self> {
        inputs.validate()?;
        let views = std::slice::from_ref(&world.camera);
        let proxy = Proxy::new(world, inputs.proxy(), Need::Views(views), run)?;
        let samples = camera_samples(world, inputs.record, inputs.direct, inputs.seed, run)?;
        Ok(Self { proxy, samples })
    }

    /// Statistics that all these methods share.
    pub fn statistics(&self) -> StageStatistics {
        let proxy = self.proxy.stats();
        StageStatistics {
            cells: proxy.cells,
            photons: proxy.photons,
            gathered_sides: proxy.gathered,
            sweeps: proxy.sweeps,
            sweep_residual: proxy.residual,
            places: self.proxy.place_stats(),
            shading_points: self.samples.points.len(),
        }
    }
}
