//! Pass 2, and the far half of pass 3: the distant light, sampled sparsely and interpolated.
//!
//! [`cluster`](mod@cluster) groups the shading points, [`adaptive_alpha`] at a size of their own
//! where that is asked for. [`sight`] keeps clusters on one side of a wall. `sample` shoots the
//! rays of each cluster and [`pool`] fits spherical harmonics to them and to those of its
//! neighbours. [`extend`] does all of this for the points that no cluster covers yet. [`blend`]
//! interpolates the result.

pub mod adaptive_alpha;
pub mod blend;
pub mod cluster;
pub mod extend;
pub mod pool;
pub mod sample;
pub mod sight;

pub use blend::{Blend, FarField};
pub use cluster::Clusters;
pub use sample::{Bundle, sample};
pub use sight::Sight;

use crate::sh::ShRgb;

/// Clusters and the distant light of each: what is known of the scene between views.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampledClusters {
    /// The clusters.
    pub clusters: Clusters,
    /// Distant incident radiance, one a cluster.
    pub sh: Vec<ShRgb>,
}
