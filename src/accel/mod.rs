//! Visibility against a fixed set of triangles: one trait, three backends.
//!
//! | Backend | For |
//! |---|---|
//! | `embree` (feature) | speed; single rays and packets of 8 and 16 |
//! | [`bvh`] | pure Rust (`obvhs`), the peer in timing comparisons, and the portable build |
//! | [`brute`] | tests |
//!
//! World space; `t` in lengths of the ray's direction, open interval (`t_min`, `t_max`). Both faces
//! of a triangle are hit. Masked-out points do not exist. Every backend passes the same conformance
//! suite (`tests/conformance`). Ties: exact duplicates are removed in `tessellate`; among other
//! equal distances (shared edges) a backend may return either triangle, but the same one in every
//! run and for every thread count.

pub mod brute;
pub mod bvh;
#[cfg(feature = "embree")]
pub mod embree;
mod watertight;

use std::sync::Arc;

use crate::error::Result;
use crate::math::{Aabb, Hit, Ray};
use crate::tessellate::Geometry;

/// Closest hit and any hit. `Sync`: passes run in parallel.
pub trait RayQuery: Send + Sync + std::fmt::Debug {
    /// Closest hit.
    fn closest(&self, ray: &Ray) -> Option<Hit>;
    /// True when anything is hit.
    fn occluded(&self, ray: &Ray) -> bool;
    /// Box around the triangles.
    fn bounds(&self) -> Aabb;
    /// Closest hits of many rays, in packets of up to `width` (1, 8, 16) where the backend has
    /// them. Slices have equal length.
    fn closest_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], width: usize) {
        let _ = width;
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.closest(ray);
        }
    }
    /// Any hits of many rays; as [`RayQuery::closest_batch`].
    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool], width: usize) {
        let _ = width;
        for (ray, hit) in rays.iter().zip(occluded) {
            *hit = self.occluded(ray);
        }
    }
}

/// Which backend answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Backend {
    /// Embree 4.3 or later.
    Embree,
    /// The pure-Rust BVH.
    Bvh,
    /// Brute force: tests only.
    #[cfg_attr(feature = "cli", value(skip))]
    Brute,
}

impl Default for Backend {
    fn default() -> Self {
        if cfg!(feature = "embree") { Self::Embree } else { Self::Bvh }
    }
}

impl crate::settings::Value for Backend {
    const KIND: &'static str = "choice";
    fn read(value: &toml::Value) -> Option<Self> {
        match value.as_str()? {
            "embree" => Some(Self::Embree),
            "bvh" => Some(Self::Bvh),
            "brute" => Some(Self::Brute),
            _ => None,
        }
    }
    fn show(&self) -> String {
        match self {
            Self::Embree => "embree",
            Self::Bvh => "bvh",
            Self::Brute => "brute",
        }
        .to_owned()
    }
    fn choices() -> Vec<crate::settings::Choice> {
        vec![
            crate::settings::Choice { name: "embree", meaning: "Embree 4.3 or later." },
            crate::settings::Choice { name: "bvh", meaning: "The pure-Rust BVH." },
        ]
    }
}

/// Builds the backend over the geometry with `threads` threads (0 = all).
///
/// # Errors
/// [`crate::error::Error::Accel`] when Embree is missing, too old or out of memory, or not built
/// in.
pub fn build(
    backend: Backend,
    geometry: &Arc<Geometry>,
    threads: usize,
) -> Result<Box<dyn RayQuery>> {
    match backend {
        #[cfg(feature = "embree")]
        Backend::Embree => Ok(Box::new(embree::EmbreeScene::build(geometry, threads)?)),
        #[cfg(not(feature = "embree"))]
        Backend::Embree => Err(crate::error::Error::Accel(
            "this program was built without the feature `embree`; use the backend bvh, or rebuild \
             with it"
                .into(),
        )),
        Backend::Bvh => Ok(Box::new(bvh::BvhScene::build(geometry, threads)?)),
        Backend::Brute => Ok(Box::new(brute::BruteScene::build(geometry))),
    }
}
