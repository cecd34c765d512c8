//! `World` → [`PhotonMap`] → [`CellRadiosity`]: the proxy that far hits and the near sum look up.
//!
//! ```text
//! B(cell, side) = ⟨ρ · E_direct⟩ + ⟨ρ⟩ · E_indirect          ⟨·⟩: mean over the cell, B radiosity, W·m⁻²
//! ```
//!
//! `E_direct` (sun, lamps, emitters; not the sky) is computed by shadow rays at stratified points
//! of the cell; `E_indirect` (everything else, the sky's own light included) comes from rays
//! between the cells, started from photons, or from photons alone. So photons of the sky are stored
//! from their first hit on, those of other lights from their second. Emission counts zero
//! `[Jensen96]`.
//!
//! | File | Job |
//! |---|---|
//! | `settings` | [`ProxySettings`] |
//! | `trace` | photons from all lights, bounced to their end |
//! | `kdtree` | points in a balanced tree: k nearest, all within a radius |
//! | `overlap` | area of a triangle inside a sphere: the boundary correction |
//! | `surface_index` | cells around a point that face the same way, their counts, flux and area |
//! | `patches` | cell sides summed into patches of doubling size |
//! | `map` | [`PhotonMap`]: density estimation |
//! | `gather` | rays between the cells that the picture can see, solved as a linear system |
//! | `radiosity` | [`solve`]: the estimates, direct light, albedo |
//! | `proxy` | [`Proxy`]: what a ray is told |
//!
//! Guarantees: bit-identical for any thread count. Photon estimates divide flux by the area it was
//! counted on, so no energy is lost as a whole. Not guaranteed: that the part which is seen gets
//! its share. Area buried in other surfaces takes part in the mean of `cells` and `density` and
//! darkens the rest, and both blur over about k photons; `gather` starts its rays where others
//! arrived and has neither fault, but in every estimate a cell has one value a side, its direct
//! light a mean over all of the cell.

mod gather;
mod kdtree;
mod map;
mod overlap;
mod patches;
mod proxy;
mod radiosity;
mod settings;
mod surface_index;
mod trace;

pub use kdtree::KdTree;
pub use map::PhotonMap;
pub use proxy::{Incident, Proxy};
pub use radiosity::{CellRadiosity, Extended, ProxyStats, extend, solve, solve_for};
pub use settings::{Estimate, ProxySettings};
pub use surface_index::SurfaceIndex;
pub use trace::{Photon, Traced, trace};
