//! Irradiance decomposition in three passes `[Course07]`, `[AFO05]`.
//!
//! ```text
//! E(x) = Σ A_l c_lm Y_lm(N)                            far: interpolated SH
//!      + Σ_{pieces T near x} m_T (B_T G_T / π − S_T)   near: what T sends,
//!                                                      less what the SH had claimed there
//! ```
//!
//! G is the cosine-weighted solid angle of T above the horizon, S the SH radiance integrated over
//! the same directions, B the radiosity of the side of T that faces x, and m a soft membership in
//! the ball of radius alpha.
//!
//! Pass 1 ([`crate::record`]) turns the camera into shading points. Pass 2 ([`far`]) clusters them
//! and fits spherical harmonics to the distant light of each cluster. Pass 3 ([`pass3`]) blends
//! these at every point and adds the near part ([`near`]). `prepare` runs passes 1 and 2; proxy,
//! clusters and SH belong to the scene and not to the view, so [`store`] keeps them in a file, what
//! is known is extended for another camera, and [`plan()`] makes them for all frames of a film.
//!
//! The course assumes that near pieces are visible and sums all of them; the default finds what is
//! near and seen by short rays, an estimate of the same difference without the assumption.
//! [`crate::method::course`] lists what the course does otherwise, slide by slide, and renders it.
//!
//! Everything is given a [`Context`]: world, proxy, settings, lengths, seed, run.
//!
//! The result has the same bits for any number of threads. With alpha = 0 the method is a plain SH
//! gather; with alpha = ∞ and `near_hits = "ignore"` it is the sum over all facing cells. Neither
//! is visibility among near cells tested with `assumed`. It costs clusters times rays, and points
//! times what is near them.

mod context;
pub mod far;
pub mod near;
pub mod pass3;
mod plan;
mod prepare;
mod settings;
pub mod store;

pub use context::{Context, Receiver};
pub use near::noise::NearNoise;
pub use pass3::picture::{DecomposeStatistics, LAYERS, picture, picture_with, render};
pub use plan::plan;
pub use prepare::{Prepared, prepare, resume};
pub use settings::{AlphaMode, DecomposeSettings, Lengths, NearHits, NearIntegral, NearVisibility};

impl NearHits {
    /// Membership of a piece of surface at distance `d` in the near ball: what far rays leave out
    /// the near part adds. With `Damp` 1 up to ¾ alpha and a smoothstep to 0 at alpha, with
    /// `Ignore` a step at alpha, where the rays begin.
    pub fn membership(self, d: f32, alpha: f32) -> f32 {
        if alpha == f32::INFINITY {
            return 1.0;
        }
        match self {
            Self::Damp => {
                let t = ((alpha - d) / (0.25 * alpha).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
                t * t * (3.0 - 2.0 * t)
            }
            Self::Ignore => f32::from(u8::from(d < alpha)),
        }
    }
}
