//! Pass 3b by short rays instead of by cells: what is near is whatever a ray of length alpha hits,
//! so visibility needs no assumption.
//!
//! ```text
//! E_near = π/M Σ_{rays that hit a cell T} m_T (B_T/π − L_SH(ω))          ω cosine-distributed about N
//! ```
//! The same difference as the sum over cells, as an estimate: rays that hit nothing add nothing and
//! no noise; the far field's rule for near hits ([`super::membership`]) is shared. Stratified by
//! Owen–Sobol points of the shading point.
//!
//! Guarantees  unbiased for the visible near cells, whatever hides what; any number of SH bands.
//!             Not: noise-free. Cost  M short rays a point.

use super::filter::NearPart;
use super::{DecomposeSettings, membership};
use crate::math::{Frame, Ray};
use crate::proxy::Proxy;
use crate::radiometry::Rgb;
use crate::sampling::{Sobol, Stream, sample_cosine_hemisphere};
use crate::sh::ShRgb;
use crate::shading::World;
use glam::Vec3;

/// What near surfaces add to the far field's irradiance at `p` with unit geometric and shading
/// normals `ng`, `ns` (may be negative), and the number of rays that hit something near. Nothing
/// counts as closer than `footprint`, the side of a pixel (scene units): one hit at almost no
/// distance would keep the filter from averaging a whole window.
pub fn near_by_rays(
    world: &World,
    proxy: &Proxy,
    sh: &ShRgb,
    p: Vec3,
    ng: Vec3,
    ns: Vec3,
    footprint: f32,
    settings: &DecomposeSettings,
    alpha: f32,
    seed: u64,
    element: u64,
) -> (NearPart, u32) {
    let sobol = Sobol::new(seed, Stream::Near, element);
    let frame = Frame::from_normal(ns);
    let (mut sum, mut closeness, mut hits) = (Rgb::ZERO, 0.0, 0);
    for r in 0..settings.near_rays {
        let wi = frame.world_from_local(sample_cosine_hemisphere(sobol.sample_2d(r, 0)));
        if wi.dot(ng) <= 0.0 {
            continue;
        }
        // A cell counts by its centroid's distance, which may be closer than the hit by up to one
        // cell.
        let reach = alpha + proxy.piece_size();
        let incident = proxy.incident(world, &Ray { t_max: reach, ..Ray::new(p, wi) });
        let Some(piece) = incident.piece else { continue };
        let m = membership(proxy.center(piece).distance(p), alpha);
        if m > 0.0 {
            sum += (incident.radiance - sh.radiance(wi)) * m;
            closeness += m / incident.t.max(footprint);
            hits += 1;
        }
    }
    let rays = settings.near_rays as f32;
    (
        NearPart { irradiance: sum * (std::f32::consts::PI / rays), closeness: closeness / rays },
        hits,
    )
}
