//! Pass 3b by short rays instead of by cells: what is near is whatever a ray of length alpha hits,
//! so visibility needs no assumption.
//!
//! ```text
//! E_near = π/M Σ_{rays that hit a near T} m_T (B_T/π − L_SH(ω))     ω cosine-distributed about N
//! ```
//!
//! This is the difference that the sum over cells has, as an estimate: rays that hit nothing add
//! nothing and no noise; the far field's rule for near hits ([`NearHits::membership`]) is shared.
//! The rays are stratified by Owen–Sobol points of the shading point.
//!
//! The estimate is unbiased for the near cells that are seen, whatever hides what, and any number
//! of SH bands will do. It is noisy. It costs M short rays a point.
//!
//! [`NearHits::membership`]: crate::method::decompose::NearHits::membership

use super::filter::NearPart;
use crate::math::{Frame, Ray};
use crate::method::decompose::{Context, Receiver};
use crate::radiometry::Rgb;
use crate::sampling::{Sobol, Stream, sample_cosine_hemisphere};
use crate::sh::ShRgb;

/// The short rays of one point.
#[derive(Clone, Copy, Debug)]
pub struct ShortRays {
    /// How many.
    pub count: u32,
    /// Near/far distance, scene units.
    pub alpha: f32,
    /// Keys their random numbers.
    pub element: u64,
}

impl ShortRays {
    /// What near surfaces add to the irradiance of the far field `sh` (may be negative), and the
    /// number of rays that hit something near. Nothing counts as closer than the footprint of the
    /// receiver: one hit at almost no distance would keep the filter from averaging a whole window.
    pub fn near(&self, context: &Context<'_>, sh: &ShRgb, at: &Receiver) -> (NearPart, u32) {
        let sobol = Sobol::new(context.seed, Stream::Near, self.element);
        let frame = Frame::from_normal(at.ns);
        // A piece of surface counts by its place, which may be closer than the hit.
        let reach = self.alpha + context.place_size();
        let (mut sum, mut closeness, mut hits) = (Rgb::ZERO, 0.0, 0);
        for r in 0..self.count {
            let wi = frame.world_from_local(sample_cosine_hemisphere(sobol.sample_2d(r, 0)));
            if wi.dot(at.ng) <= 0.0 {
                continue;
            }
            let ray = Ray { t_max: reach, ..Ray::new(at.p, wi) };
            let incident = context.proxy.incident(context.world, &ray);
            let Some(m) = context.membership_of(&incident, at.p, self.alpha) else { continue };
            if m > 0.0 {
                sum += (incident.radiance - sh.radiance(wi)) * m;
                closeness += m / incident.t.max(at.footprint);
                hits += 1;
            }
        }
        let rays = self.count as f32;
        let irradiance = sum * (std::f32::consts::PI / rays);
        (NearPart { irradiance, closeness: closeness / rays }, hits)
    }
}
