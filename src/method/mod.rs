//! The methods, siblings that never import one another, and what they share: [`stage`] before them,
//! [`Rendered`] after.

pub mod cache;
pub mod converge;
pub mod decompose;
pub mod direct;
pub mod gather;
pub mod key;
pub mod local_correction;
pub mod locations;
pub mod path;
pub mod photon_map;
pub mod point_based;
pub mod stage;

use serde::{Deserialize, Serialize};

use crate::film::Film;

/// How light is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Irradiance decomposition in three passes.
    #[default]
    Decomposition,
    /// Irradiance caching: few records, extrapolated and blended.
    IrradianceCache,
    /// Final gathering through the proxy at every point: what decomposition and caching can at best
    /// reach.
    Gather,
    /// Unidirectional path tracing: the ground truth.
    Path,
    /// Gathered from surface elements: no ray for occlusion or indirect light.
    PointBased,
    /// Hand-placed lights without shadows and a flat ambient term, corrected by the near surfaces:
    /// no ray but the camera's.
    LocalCorrection,
    /// Direct light only.
    Direct,
    /// The proxy itself, seen directly.
    PhotonMap,
}

/// A finished image and what is told of it.
#[derive(Debug, Default)]
pub struct Rendered {
    /// All layers.
    pub film: Film,
    /// Statistics of the method (cells, photons, clusters, …), by the names of the statistics
    /// contract.
    pub stats: serde_json::Map<String, serde_json::Value>,
    /// Where indirect light was sampled; empty for methods without such places.
    pub locations: locations::Locations,
}
