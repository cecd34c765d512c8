//! What the proxy tells of how it was made.

use serde::Serialize;

use crate::radiometry::Rgb;

/// What a proxy was made of. Serialises to the names of the statistics file.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ProxyStats {
    /// Emitted paths.
    #[serde(rename = "photon_paths")]
    pub paths: u32,
    /// Stored photons.
    pub photons: usize,
    /// Emitted flux, W.
    #[serde(skip)]
    pub emitted_flux: Rgb,
    /// Stored flux, W.
    #[serde(skip)]
    pub stored_flux: Rgb,
    /// Cells.
    pub cells: usize,
    /// Cell sides that were computed.
    #[serde(rename = "cell_sides")]
    pub sides: usize,
    /// Cell sides whose estimate rests on fewer photons than asked for (`cells` only).
    #[serde(rename = "starved_cell_sides")]
    pub starved: usize,
    /// Cell sides whose irradiance was gathered (`gather` only).
    #[serde(rename = "gathered_sides")]
    pub gathered: usize,
    /// Sweeps over them.
    pub sweeps: u32,
    /// Relative change of irradiance in the last sweep.
    #[serde(rename = "sweep_residual")]
    pub residual: f32,
}

/// Light by need: what it took so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PlaceStats {
    /// Places that were found, divided ones too.
    pub places: usize,
    /// Shadow rays.
    pub shadow_rays: u64,
    /// Cosine rays that gather.
    pub gather_rays: u64,
    /// Short rays that tell what a place covers.
    pub short_rays: u64,
}

/// What [`super::Proxy::need`] added to a proxy.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Added {
    /// Sides of pieces whose light was not known before.
    pub sides: usize,
    /// Sweeps over them.
    pub sweeps: u32,
    /// Relative change of irradiance in the last sweep.
    pub residual: f32,
}
