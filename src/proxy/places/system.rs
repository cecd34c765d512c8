//! The linear system of new parts.
//!
//! ```text
//! E_i = 1/n_i · (known_i + Σ_j weight_ij · (E_direct + E_indirect)(part ij))
//! ```
//!
//! Ray hits do not depend on light, so the system is swept after all rays are shot (Jacobi,
//! `[CohenWallace93]` §5.3) at the price of a look-up per ray and sweep. Weights that sum to more
//! than the rays, as those of aimed rays may by chance, are scaled down to them: no row of the
//! matrix expands.

use rayon::prelude::*;

use super::Light;
use super::light::{Gathered, Link};
use crate::error::Result;
use crate::proxy::Landing;
use crate::radiometry::{Rgb, luminance};
use crate::run::Run;

/// Most sweeps; they end when one changes the irradiance by less than [`TOLERANCE`].
const SWEEPS: u32 = 32;
const TOLERANCE: f64 = 1e-3;

/// What gather rays found, for all new parts.
#[derive(Debug, Default)]
pub(super) struct System {
    /// Where the links of each end.
    ends: Vec<u32>,
    links: Vec<Link>,
    /// Gather rays of each.
    pub rays: Vec<u32>,
    /// Direct irradiance by shadow rays, and the sum of what gather rays found of it, W·m⁻².
    direct: Vec<(Rgb, Rgb)>,
    /// Sum of irradiance that does not come by links, W·m⁻².
    known: Vec<Rgb>,
    /// Sum of squared luminance of what the sky sent.
    pub sky_squared: Vec<f32>,
}

/// Links that have no end yet: the landing, the part that it lights, and the link.
#[derive(Debug, Default)]
pub(super) struct Open {
    pub landings: Vec<Landing>,
    at: Vec<(u32, u32)>,
}

impl Open {
    /// Landings that were asked for from outside: they light no part.
    pub fn asked(landings: Vec<Landing>) -> Self {
        Self { landings, at: Vec::new() }
    }
    /// How many links.
    pub fn len(&self) -> usize {
        self.at.len()
    }
}

/// How the sweeps ended.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Swept {
    pub sweeps: u32,
    /// Last change of irradiance, relative.
    pub residual: f32,
}

impl System {
    /// Adds the next part, of which shadow rays found `direct`; what it leaves open goes to `open`.
    pub fn push(&mut self, direct: Rgb, found: Gathered, open: &mut Open) {
        self.direct.push((direct, found.emitted));
        let part = self.known.len() as u32;
        self.rays.push(found.count);
        self.known.push(found.sky);
        self.sky_squared.push(found.sky_squared);
        self.links.extend(found.links);
        for (landing, weight) in found.open {
            open.at.push((part, self.links.len() as u32));
            open.landings.push(landing);
            self.links.push(Link { to: 0, weight });
        }
        self.ends.push(self.links.len() as u32);
    }

    /// Closes open links, in order: each has light of its own, and goes on to a part.
    pub fn close(&mut self, open: &Open, ends: impl Iterator<Item = (Light, Link)>) {
        for (&(part, link), (light, end)) in open.at.iter().zip(ends) {
            let link = &mut self.links[link as usize];
            self.known[part as usize] += link.weight * light.total();
            *link = Link { to: end.to, weight: link.weight * end.weight };
        }
    }

    /// Links of the `i`-th part.
    pub fn links_of(&self, i: usize) -> &[Link] {
        let start = if i == 0 { 0 } else { self.ends[i - 1] };
        &self.links[start as usize..self.ends[i] as usize]
    }

    /// Takes over direct irradiance that is better known, where there is some.
    pub fn refine(&mut self, direct: Vec<Option<Rgb>>) {
        for ((shadow, _), better) in self.direct.iter_mut().zip(direct) {
            *shadow = better.unwrap_or(*shadow);
        }
    }

    /// Adds rays of the same parts.
    pub fn join(self, more: &Self) -> Self {
        let mut out = Self::default();
        out.links.reserve(self.links.len() + more.links.len());
        for i in 0..self.known.len() {
            out.links.extend(self.links_of(i));
            out.links.extend(more.links_of(i));
            out.ends.push(out.links.len() as u32);
            out.rays.push(self.rays[i] + more.rays[i]);
            let (shadow, emitted) = self.direct[i];
            out.direct.push((shadow, emitted + more.direct[i].1));
            out.known.push(self.known[i] + more.known[i]);
            out.sky_squared.push(self.sky_squared[i] + more.sky_squared[i]);
        }
        out
    }

    /// Direct light of the last parts, which are those of the system; then sweeps until their
    /// indirect irradiance rests.
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    pub fn sweep(&self, lights: &mut [Light], run: &Run) -> Result<Swept> {
        let from = lights.len() - self.known.len();
        for (i, &(shadow, emitted)) in self.direct.iter().enumerate() {
            let light = &mut lights[from + i];
            light.direct = shadow;
            light.emitted = emitted / self.rays[i].max(1) as f32;
        }
        let scale = |i: usize| {
            let sum = self.links_of(i).iter().fold(Rgb::ZERO, |sum, l| sum + l.weight);
            (self.rays[i] as f32 / sum.max_element()).min(1.0)
        };
        let scales: Vec<f32> = (0..self.known.len()).map(scale).collect();
        let mut total: Vec<Rgb> = lights.iter().map(|l| l.total()).collect();
        let mut swept = Swept::default();
        while swept.sweeps < SWEEPS {
            run.check()?;
            let gather = |i: usize| {
                let add = |e: Rgb, l: &Link| e + l.weight * total[l.to as usize];
                let linked = self.links_of(i).iter().fold(Rgb::ZERO, add);
                (self.known[i] + scales[i] * linked) / self.rays[i].max(1) as f32
            };
            let irradiance: Vec<Rgb> = run.install(|| {
                (0..self.known.len()).into_par_iter().with_min_len(1024).map(gather).collect()
            });
            let (mut change, mut whole) = (0.0f64, 0.0f64);
            for (i, e) in irradiance.into_iter().enumerate() {
                let light = &mut lights[from + i];
                change += f64::from(luminance((e - light.indirect).abs()));
                whole += f64::from(luminance(e));
                light.indirect = e;
                total[from + i] = light.total();
            }
            swept.sweeps += 1;
            swept.residual = if whole > 0.0 { (change / whole) as f32 } else { 0.0 };
            if f64::from(swept.residual) < TOLERANCE {
                break;
            }
        }
        Ok(swept)
    }
}
