//! The methods' own figures: one typed struct each, declared by the method.

use serde::Serialize;

use super::{cache, decompose, final_gather, local_correction, path, photon_map, point_based};

/// What a method tells of its picture.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum MethodStatistics {
    /// Of the decomposition.
    Decomposition(decompose::DecomposeStatistics),
    /// Of the irradiance cache.
    IrradianceCache(cache::CacheStatistics),
    /// Of final gathering.
    Gather(final_gather::GatherStatistics),
    /// Of path tracing.
    Path(path::PathStatistics),
    /// Of surface elements.
    PointBased(point_based::PointStatistics),
    /// Of the local correction.
    LocalCorrection(local_correction::LocalStatistics),
    /// Of the proxy's own picture.
    PhotonMap(photon_map::PhotonMapStatistics),
    /// Of a method that counts nothing: direct light.
    Direct {},
}
