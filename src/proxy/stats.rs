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

/// Light by need: what it took so far. Serialises to the names of the statistics file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PlaceStats {
    /// Places.
    pub places: usize,
    /// Their parts, each with light of its own.
    #[serde(rename = "place_parts")]
    pub parts: usize,
    /// Memory of all that, bytes.
    #[serde(rename = "place_bytes")]
    pub bytes: usize,
    /// Points that these are lit at.
    #[serde(rename = "place_points")]
    pub points: usize,
    /// Sweeps over them.
    #[serde(rename = "place_sweeps")]
    pub sweeps: u32,
    /// Relative change of irradiance in the last sweep: the energy that is left out.
    #[serde(rename = "place_residual")]
    pub residual: f32,
    /// Rays that lit them.
    #[serde(flatten)]
    pub rays: PlaceRays,
    /// Shadow rays at landings that no place holds.
    pub read_shadow_rays: u64,
    /// Steps of their paths.
    pub read_gather_rays: u64,
    /// Rays that told which part a landing sees.
    pub read_short_rays: u64,
}

/// Rays that lit places.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PlaceRays {
    /// Shadow rays.
    #[serde(rename = "place_shadow_rays")]
    pub shadow: u64,
    /// Cosine rays that gather.
    #[serde(rename = "place_gather_rays")]
    pub gather: u64,
    /// Short rays that told their points apart.
    #[serde(rename = "place_short_rays")]
    pub short: u64,
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
