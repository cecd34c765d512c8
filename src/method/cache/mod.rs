//! Irradiance caching: irradiance and its derivatives at few places, extrapolated and blended
//! everywhere else.
//!
//! ```text
//! E(p, n) = Σ_i w_i(p, n) · [ E_i + (n_i × n) · g_r,i + (p − p_i) · g_t,i ] / Σ_i w_i(p, n)
//! ```
//! Three ways to say how far a record reaches ([`Mode`]): `hessian` (occlusion-aware Hessian
//! `[Schwarzhaupt12]`), `production-2006` (smallest distance `[Tabellion04]`, neighbour clamping
//! `[Krivanek06]`, gradients `[Ward92]`), `split-sphere` `[Ward88]`.
//!
//! | File | Job |
//! |---|---|
//! | `settings` | [`CacheSettings`] |
//! | `hemisphere`, `ward`, `edges`, `hessian`, `measure` | one record |
//! | `validity` | how far a record reaches, its weight, who leaks |
//! | `record` | [`CacheRecord`]: what is kept of a measurement |
//! | `octree` | spheres around a point |
//! | `fill` | coarse-to-fine overture: every shading point within reach of a record |
//! | `interpolate` | the read-only final pass |
//! | `store` | records in a file |
//! | `render` | all in a row |
//!
//! Guarantees: bit-identical for any thread count; after the fill every shading point is within
//! reach of a record; weights are continuous. Not guaranteed: that no feature smaller than the
//! distance between records is missed.

pub mod edges;
pub mod fill;
pub mod hemisphere;
pub mod hessian;
pub mod interpolate;
pub mod measure;
pub mod octree;
pub mod record;
mod render;
mod settings;
pub mod store;
pub mod validity;
pub mod ward;

pub use fill::Cache;
pub use record::CacheRecord;
pub use render::{CacheStatistics, LAYERS, fill_and_interpolate, render};
pub use settings::{Allocation, CacheSettings, Mode};
