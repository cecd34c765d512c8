//! The methods, siblings that never import one another (but for [`course`], which is
//! [`decompose`] under settings of its own), and what they share: [`stage`] before them,
//! [`Rendered`] after.

pub mod cache;
pub mod converge;
pub mod course;
pub mod decompose;
pub mod direct;
pub mod final_gather;
pub mod key;
pub mod local_correction;
pub mod locations;
pub mod path;
pub mod photon_map;
pub mod point_based;
pub mod stage;
mod statistics;

pub use statistics::MethodStatistics;

use serde::{Deserialize, Serialize};

use crate::film::{Film, Layer};
use crate::record;

/// How light is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Irradiance decomposition in three passes.
    #[default]
    Decomposition,
    /// Irradiance decomposition as the course of 2007 has it, every step.
    Course,
    /// Irradiance caching: few records, extrapolated and blended.
    IrradianceCache,
    /// Final gathering through the proxy at every point: what decomposition and caching can at
    /// best reach.
    Gather,
    /// Unidirectional path tracing: the ground truth.
    Path,
    /// Gathered from surface elements: no ray for occlusion or indirect light.
    PointBased,
    /// Hand-placed lights without shadows and a flat ambient term, corrected by the near
    /// surfaces: no ray but the camera's.
    LocalCorrection,
    /// Direct light only.
    Direct,
    /// The proxy itself, seen directly.
    PhotonMap,
}

impl Method {
    /// What makes the best picture in its time: rays of every pixel where a denoiser takes their
    /// noise, which it cannot do for noise that neighbours share; else what has least noise.
    pub fn of_pictures(denoised: bool) -> Self {
        if denoised { Self::Gather } else { Self::Decomposition }
    }

    /// Whether single rays of pixels leave noise that a denoiser is there for; ground truths keep
    /// theirs.
    pub fn has_rays_of_pixels(self) -> bool {
        matches!(self, Self::Decomposition | Self::Gather | Self::IrradianceCache | Self::Direct)
    }

    /// All methods.
    pub const ALL: [Self; 9] = [
        Self::Decomposition,
        Self::Course,
        Self::IrradianceCache,
        Self::Gather,
        Self::Path,
        Self::PointBased,
        Self::LocalCorrection,
        Self::Direct,
        Self::PhotonMap,
    ];

    /// Its name on the command line, in files and in statistics.
    pub fn name(self) -> &'static str {
        match self {
            Self::Decomposition => "decomposition",
            Self::Course => "course",
            Self::IrradianceCache => "irradiance-cache",
            Self::Gather => "gather",
            Self::Path => "path",
            Self::PointBased => "point-based",
            Self::LocalCorrection => "local-correction",
            Self::Direct => "direct",
            Self::PhotonMap => "photon-map",
        }
    }

    /// Whether its work can be kept for later renders of the scene.
    pub fn keeps(self) -> bool {
        matches!(self, Self::Decomposition | Self::Course | Self::IrradianceCache)
    }

    /// The layers of its picture, beside the beauty.
    pub fn layers(self) -> Vec<Layer> {
        let with = |own: &[Layer]| record::LAYERS.iter().chain(own).copied().collect();
        match self {
            Self::Decomposition | Self::Course => with(&decompose::LAYERS),
            Self::IrradianceCache => with(&cache::LAYERS),
            Self::PointBased => with(&point_based::LAYERS),
            Self::Path => path::LAYERS.to_vec(),
            Self::PhotonMap => photon_map::LAYERS.to_vec(),
            Self::Gather | Self::LocalCorrection | Self::Direct => with(&[]),
        }
    }
}

/// A method's picture and what it tells of it.
#[derive(Debug)]
pub struct Rendered {
    /// All layers.
    pub film: Film,
    /// The method's own figures.
    pub statistics: MethodStatistics,
    /// Where indirect light was sampled; empty for methods without such places.
    pub locations: locations::Locations,
}
