//! Pass 3b: the near cells of a point, found by range search and summed analytically, eight at a
//! time.
//!
//! ```text
//! E_near = Σ_T m_T B_T G_T / π − ∫ L_SH d(Σ_T m_T · moments_T)
//! ```
//!
//! The second term applies the SH to the summed moments of the cells ([`crate::sh::Quadratic`]), or
//! is estimated by random points on each of them (`monte_carlo`).
//!
//! The cells lie in blocks of eight (`block`), leaves of a median-split tree of boxes (`tree`).
//! A query walks the boxes that touch the ball of radius alpha and reach above the tangent plane; a
//! block whose lanes are all too far, all below the horizon, or all in the point's own plane is
//! left early. The cells are the
//! facets of the proxy.
//!
//! A cell counts with the side that faces the point; the back of a one-sided cell does not exist.
//! Cells whose plane passes closer to the point than a thousandth of their size are its own plane
//! or touch it: they cover no solid angle that matters and are left out. A masked cell counts by
//! the fraction of it that exists.
//!
//! Sources: `[Course07]` "nearby geometry", `[Lambert60]`, `[Arvo95]`. The sum runs in tree order,
//! whatever the thread. A cell takes 72 B of memory, a near cell tens of nanoseconds.

mod block;
mod monte_carlo;
#[cfg(test)]
mod tests;
mod tree;

pub use tree::NearTree;

use crate::math::Ray;
use crate::method::decompose::{Context, NearHits, NearIntegral, Receiver};
use crate::radiometry::Rgb;
use crate::sampling::Rng;
use crate::sh::{MOMENTS, Quadratic, ShRgb};
use crate::shading::World;
use glam::Vec3;

/// What the near cells of one point add up to.
#[derive(Clone, Copy, Debug, Default)]
pub struct NearSum {
    /// Σ m B G / π: irradiance that the near cells send.
    pub sent: Rgb,
    /// Σ m · moments: what they cover.
    pub moments: [f32; MOMENTS],
    /// Σ m S by Monte Carlo, where that was asked for.
    pub covered: Rgb,
    /// Cells with a contribution.
    pub cells: u32,
    /// Visibility rays shot.
    pub rays: u32,
}

/// How near cells are summed at one point.
#[derive(Debug)]
pub struct NearQuery<'a> {
    /// Near/far distance.
    pub alpha: f32,
    /// What far rays do at near hits, which decides how membership ends at alpha.
    pub near_hits: NearHits,
    /// Tests the visibility of every cell's centroid when set.
    pub trace: Option<&'a World>,
    /// Monte Carlo integral of this field instead of the moments, with points per cell.
    pub monte_carlo: Option<(&'a ShRgb, u32)>,
}

impl NearQuery<'_> {
    /// The plain query: damped hits, visible, closed form.
    pub fn assumed(alpha: f32) -> Self {
        Self { alpha, near_hits: NearHits::Damp, trace: None, monte_carlo: None }
    }

    /// Whether nothing stands between `x` and a place.
    fn sees(&self, x: Vec3, place: Vec3) -> bool {
        let ray = Ray { t_max: 1.0 - 1e-3, ..Ray::new(x, place - x) };
        self.trace.is_none_or(|world| !world.rays.occluded(&ray))
    }
}

/// The near part of a point by the sum over cells.
#[derive(Clone, Copy, Debug)]
pub struct CellSum<'a> {
    /// The cells.
    pub tree: &'a NearTree,
    /// Whether a ray to each cell's centroid tests its visibility.
    pub traced: bool,
    /// Near/far distance, scene units.
    pub alpha: f32,
}

impl CellSum<'_> {
    /// What the near cells add to the irradiance of the far field `sh` (may be negative), and what
    /// they add up to; `rng` feeds the Monte Carlo integral.
    pub fn near(
        &self,
        context: &Context<'_>,
        sh: &ShRgb,
        at: &Receiver,
        rng: &mut Rng,
    ) -> (Rgb, NearSum) {
        let Context { world, settings, .. } = *context;
        let by_points = settings.near_integral == NearIntegral::MonteCarlo;
        let query = NearQuery {
            alpha: self.alpha,
            near_hits: settings.near_hits,
            trace: self.traced.then_some(world),
            monte_carlo: by_points.then_some((sh, settings.near_samples)),
        };
        let sum = self.tree.sum(at.p, at.ns, &query, rng);
        let covered =
            if by_points { sum.covered } else { Quadratic::new(sh, at.ns).integral(&sum.moments) };
        (sum.sent - covered, sum)
    }
}
