//! `World` → [`PhotonMap`] → [`CellRadiosity`]: the proxy that far hits and the near sum look up.
//!
//! ```text
//! B(cell, side) = ⟨ρ · E_direct⟩ + ⟨ρ⟩ · E_indirect          ⟨·⟩: mean over the cell, B radiosity, W·m⁻²
//! ```
//!
//! `E_direct` (sun, lamps, emitters; not the sky) is computed by shadow rays at stratified points of the cell; `E_indirect` (everything
//! else, the sky's own light included) comes from photons. So photons of the sky are stored from their first hit on, those of other
//! lights from their second. Emission counts zero `[Jensen96]`.
//!
//! | File | Job |
//! |---|---|
//! | `settings` | [`PhotonSettings`] |
//! | `trace` | photons from all lights, bounced to their end |
//! | `kdtree` | points in a balanced tree: k nearest, all within a radius |
//! | `overlap` | area of a triangle inside a sphere: the boundary correction |
//! | `surface_index` | cells around a point that face the same way, their counts, flux and area |
//! | `patches` | cell sides summed into patches of doubling size |
//! | `map` | [`PhotonMap`]: density estimation |
//! | `radiosity` | [`solve`]: both estimates, direct light, albedo |
//!
//! Guarantees: bit-identical for any thread count; unbiased in energy: flux is always divided by the area that exists where it was
//! counted. Not guaranteed: sharp indirect shadows (blurred over the region of about k photons).

mod gather;
mod kdtree;
mod map;
mod overlap;
mod patches;
mod radiosity;
mod settings;
mod surface_index;
mod trace;

pub use kdtree::KdTree;
pub use map::PhotonMap;
pub use radiosity::{CellRadiosity, ProxyStats, solve};
pub use settings::{Estimate, PhotonSettings};
pub use surface_index::SurfaceIndex;
pub use trace::{Photon, Traced, trace};
