//! `World` → [`Proxy`]: the light that leaves surfaces, looked up where rays land.
//!
//! ```text
//! B(landing) = ρ · (E_direct + E_indirect)    B: radiosity, W·m⁻²
//! ```
//!
//! Far and near rays do not recurse: where they land they are told a radiosity. The proxy is made
//! for what a [`Need`] asks for, grows when another need comes, and is read by hit; [`Proxy`] is
//! the whole of what other rooms know of it. By default the light lies at places, which come to be
//! where rays land and take the albedo of each hit (`places`, where the page goes on). For the
//! course, and where its sum over near triangles is asked for, it lies on cells instead, cut from
//! all triangles, each with one radiosity a side: B = ⟨ρ · E_direct⟩ + ⟨ρ⟩ · E_indirect, ⟨·⟩ the
//! mean over the cell.
//!
//! On cells `E_direct` (sun, lamps, emitters; not the sky) is computed by shadow rays at points of
//! the cell; `E_indirect` (everything else, the sky's own light included) comes from rays between
//! the cells, started from photons, or from photons alone. So photons of the sky are stored from
//! their first hit on, those of other lights from their second. Emission counts zero `[Jensen96]`.
//!
//! | File | Job |
//! |---|---|
//! | `proxy` | [`Proxy`], [`Need`]: the interface |
//! | `landing`, `facet` | where rays land and what they are told; the triangles of the near sum |
//! | `saved`, `stats` | what a file keeps of a proxy; what it tells of itself |
//! | `settings` | [`ProxySettings`] |
//! | `cells`, `cell_side` | pieces of triangles, found from a hit; the key of one side |
//! | `making` | world, cells, settings, seed, run: what every step below is given |
//! | `trace` | photons from all lights, bounced to their end |
//! | `overlap` | area of a triangle inside a sphere: the boundary correction |
//! | `surface_index` | cells around a point that face the same way, their counts, flux and area |
//! | `patches` | cell sides summed into patches of doubling size |
//! | `density` | density estimation from photons |
//! | `reflected` | direct light and albedo of a cell side |
//! | `shooter`, `links` | rays between the cells that are needed, solved as a linear system |
//! | `places` | in place of cells, by default: light where rays land |
//! | `solve`, `radiosity` | all of it in a row; the light of all cell sides |
//!
//! The result is bit-identical for any thread count. On cells, photon estimates divide flux by the
//! area it was counted on, so no energy is lost as a whole. That the part which is seen gets its
//! share is not guaranteed: area buried in other surfaces takes part in the mean of `cells` and
//! `density` and darkens the rest, and both blur over about k photons; `gather` starts its rays
//! where others arrived and has neither fault, but in every estimate a cell has one value a side,
//! its direct light a mean over all of the cell.

mod cell_side;
mod cells;
mod density;
mod facet;
mod landing;
mod links;
mod making;
mod overlap;
mod patches;
mod places;
#[expect(clippy::module_inception, reason = "the room's one type, beside its parts")]
mod proxy;
mod radiosity;
mod reflected;
mod saved;
mod settings;
mod shooter;
mod solve;
mod stats;
mod surface_index;
mod trace;

pub use facet::Facet;
pub use landing::{Incident, Landing, Piece, Reading, ShownPlace};
pub use proxy::{Need, Proxy, ProxyInputs};
pub use saved::SavedProxy;
pub use settings::{Estimate, ProxySettings};
pub use stats::{Added, PlaceRays, PlaceStats, ProxyStats};
pub use trace::{Photon, Traced, photons};
