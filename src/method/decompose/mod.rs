//! Irradiance decomposition in three passes `[Course07]`, `[AFO05]`.
//!
//! ```text
//! E(x) = Σ A_l c_lm Y_lm(N)                                   far: interpolated SH
//!      + Σ_{cells T near x} m_T (B_T G_T / π − S_T)            near: what T sends, less what the SH had claimed for T's directions
//! ```
//! with G the cosine-weighted solid angle of T above the horizon, S the SH radiance integrated over
//! the same directions, B the radiosity of the side of T that faces x, and m a soft membership in
//! the ball of radius alpha. The course assumes near cells visible and sums all of them
//! (`near_visibility = "assumed"`); the default finds what is seen by short rays instead and
//! estimates the same difference, whose noise [`filter`] takes away.
//!
//! | Pass | File | In → out |
//! |---|---|---|
//! | 1 | [`crate::record`] | camera → `CameraSamples`, `ShadingPoints` |
//! | 2 | [`cluster`] | points → [`cluster::Clusters`]; [`far`]: clusters → SH of each |
//! | 2 | [`alpha`], [`validity`] | clusters of their own size; clusters and points on one side of a wall |
//! | 3 | [`interpolate`], [`near_rays`] and [`filter`], or [`near`] and [`near_sets`]; [`reconstruct`] | SH, cells → irradiance at every point |
//!
//! Proxy, clusters and SH belong to the scene, not to the view: [`store`] keeps them in a file,
//! [`extend`] adds what another camera sees, and `plan` makes them for all frames of a camera path;
//! [`NearNoise`] says what the noise of pass 3 sticks to, [`near_boxes`] keeps it there.
//!
//! Guarantees  bit-identical for any thread count; alpha = 0 is a plain SH gather; alpha = ∞ with
//!             `near_hits = "ignore"` is the sum over all cells. Not: visibility among near cells
//!             with `assumed` (`traced` and `triangles+rays` test it at a price).
//! Cost        clusters · rays + points · (near cells · tens of ns).

pub mod alpha;
pub mod cluster;
pub mod extend;
pub mod far;
pub mod filter;
pub mod interpolate;
pub mod near;
pub mod near_boxes;
mod near_noise;
pub mod near_rays;
pub mod near_sets;
mod plan;
pub mod pool;
pub mod reconstruct;
mod render;
mod settings;
pub mod store;
pub mod validity;

pub use near_noise::NearNoise;
pub use plan::plan;
pub use render::{
    DecomposeStatistics, LAYERS, Prepared, picture, picture_with, prepare, render, resume,
};
pub use settings::{
    AlphaMode, DecomposeSettings, Length, Lengths, NearHits, NearIntegral, NearVisibility, Overlap,
};

/// Membership of a cell at distance `d` in the near ball: 1 up to ¾ alpha, smoothstep to 0 at
/// alpha. The one function that the ray rule of [`far`] and the sum of [`near`] share: what one
/// leaves out the other adds.
pub fn membership(d: f32, alpha: f32) -> f32 {
    if alpha == f32::INFINITY {
        return 1.0;
    }
    let t = ((alpha - d) / (0.25 * alpha).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
