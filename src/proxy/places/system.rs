//! The linear system of new parts, and what it tells of its own noise.
//!
//! ```text
//! E_i = 1/n_i · (known_i + Σ_j weight_ij · (E_direct + E_indirect)(part ij))
//! ```
//!
//! Ray hits do not depend on light, so the system is swept after all rays are shot (Jacobi,
//! `[CohenWallace93]` §5.3) at the price of a look-up per ray and sweep.

use std::collections::HashMap;

use rayon::prelude::*;

use super::Light;
use super::cover::NewPart;
use super::light::{Gathered, Link};
use crate::error::Result;
use crate::proxy::Landing;
use crate::radiometry::{Rgb, luminance};
use crate::run::Run;

/// Most sweeps; they end when one changes the irradiance by less than [`TOLERANCE`].
const SWEEPS: u32 = 32;
const TOLERANCE: f64 = 1e-3;
/// Parts darker than this share of the mean count as so bright, where noise is relative.
const DARKEST: f32 = 0.1;

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
    sky_squared: Vec<f32>,
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

/// Samples of some parts: how many, Σ x, Σ x², by luminance of irradiance.
#[derive(Clone, Copy, Debug, Default)]
struct Moments([f64; 3]);

impl Moments {
    fn plus(self, other: Self, sign: f64) -> Self {
        Self([0, 1, 2].map(|i| self.0[i] + sign * other.0[i]))
    }
    /// Mean and standard deviation of a sample.
    fn spread(self) -> (f32, f32) {
        let [n, sum, squares] = self.0;
        let mean = sum / n.max(1.0);
        (mean as f32, (squares / n.max(1.0) - mean * mean).max(0.0).sqrt() as f32)
    }
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

    fn links_of(&self, i: usize) -> &[Link] {
        let start = if i == 0 { 0 } else { self.ends[i - 1] };
        &self.links[start as usize..self.ends[i] as usize]
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
            lights[from + i].direct = shadow + emitted / self.rays[i].max(1) as f32;
        }
        let mut total: Vec<Rgb> = lights.iter().map(|l| l.total()).collect();
        let mut swept = Swept::default();
        while swept.sweeps < SWEEPS {
            run.check()?;
            let gather = |i: usize| {
                let add = |e: Rgb, l: &Link| e + l.weight * total[l.to as usize];
                self.links_of(i).iter().fold(self.known[i], add) / self.rays[i].max(1) as f32
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

    /// How many gather rays every part should have: `scale` for each landing, times the relative
    /// standard deviation of the samples around the part, its own left out. So a part does not
    /// decide for itself when to stop: one that met a bright patch by luck would be corrected and
    /// one that missed it would not, and all would come out too dark.
    pub fn wanted(&self, lights: &[Light], new: &[NewPart], scale: f32) -> Vec<f32> {
        let from = lights.len() - self.known.len();
        let own = |i: usize| {
            let indirect = f64::from(luminance(lights[from + i].indirect));
            let square = |l: &Link| {
                let x = luminance(l.weight * lights[l.to as usize].total());
                f64::from(x) * f64::from(x)
            };
            let squares = self.links_of(i).iter().map(square).sum::<f64>();
            let n = f64::from(self.rays[i]);
            Moments([n, indirect * n, squares + f64::from(self.sky_squared[i])])
        };
        let own: Vec<Moments> = (0..new.len()).into_par_iter().map(own).collect();
        let mut around: HashMap<u64, Moments> = HashMap::new();
        let (mut whole, mut landings) = (0.0, 0.0);
        for ((new, &m), light) in new.iter().zip(&own).zip(&lights[from..]) {
            let sum = around.entry(new.around).or_default();
            *sum = sum.plus(m, 1.0);
            whole += new.landings as f32 * luminance(light.indirect);
            landings += new.landings as f32;
        }
        let darkest = DARKEST * whole / f32::max(landings, 1.0);
        let wanted = |(new, own): (&NewPart, &Moments)| {
            let (mean, deviation) = around[&new.around].plus(*own, -1.0).spread();
            let relative = deviation / (mean.max(0.0) + darkest).max(f32::MIN_POSITIVE);
            scale * new.landings as f32 * relative
        };
        new.iter().zip(&own).map(wanted).collect()
    }

    /// Further rays for each part: up to what is wanted and at most `most`, all together within a
    /// budget for all rays.
    pub fn further(&self, wanted: &[f32], most: f32, budget: f32) -> Vec<u32> {
        let lacking = |(&wanted, &rays): (&f32, &u32)| (wanted.min(most) - rays as f32).max(0.0);
        let lacking: Vec<f32> = wanted.iter().zip(&self.rays).map(lacking).collect();
        let shot: f32 = self.rays.iter().map(|&rays| rays as f32).sum();
        let whole: f32 = lacking.iter().sum();
        let share = ((budget - shot) / whole.max(1.0)).clamp(0.0, 1.0);
        lacking.into_iter().map(|rays| (rays * share) as u32).collect()
    }
}
