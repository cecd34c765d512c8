//! How noisy the indirect light of parts is, and the rays they should have for it.

use std::collections::HashMap;

use rayon::prelude::*;

use super::Light;
use super::cover::NewPart;
use super::light::Link;
use super::system::System;
use crate::radiometry::luminance;

/// Parts darker than this share of the mean count as so bright, where noise is relative.
const DARKEST: f32 = 0.1;

/// Samples of some parts: how many, Σ x, Σ x², by luminance of irradiance.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Moments(pub [f64; 3]);

impl Moments {
    /// One more sample.
    pub fn add(&mut self, x: f32) {
        let x = f64::from(x);
        *self = self.plus(Self([1.0, x, x * x]), 1.0);
    }
    pub fn plus(self, other: Self, sign: f64) -> Self {
        Self([0, 1, 2].map(|i| self.0[i] + sign * other.0[i]))
    }
    /// Mean and standard deviation of a sample.
    pub fn spread(self) -> (f32, f32) {
        let [n, sum, squares] = self.0;
        let mean = sum / n.max(1.0);
        (mean as f32, (squares / n.max(1.0) - mean * mean).max(0.0).sqrt() as f32)
    }
    /// Σ (x − mean)².
    pub fn scatter(self) -> f64 {
        let [n, sum, squares] = self.0;
        (squares - sum * sum / n.max(1.0)).max(0.0)
    }
}

impl System {
    /// The samples of every new part, `lights` being those of all parts.
    pub fn moments(&self, lights: &[Light]) -> Vec<Moments> {
        let from = lights.len() - self.rays.len();
        let of = |i: usize| {
            let indirect = f64::from(luminance(lights[from + i].indirect));
            let square = |l: &Link| {
                let x = luminance(l.weight * lights[l.to as usize].total());
                f64::from(x) * f64::from(x)
            };
            let squares = self.links_of(i).iter().map(square).sum::<f64>();
            let n = f64::from(self.rays[i]);
            Moments([n, indirect * n, squares + f64::from(self.sky_squared[i])])
        };
        (0..self.rays.len()).into_par_iter().map(of).collect()
    }

    /// How many gather rays every part should have: `scale` for each landing, times the relative
    /// standard deviation of the samples around the part, its own left out. So a part does not
    /// decide for itself when to stop: one that met a bright patch by luck would be corrected and
    /// one that missed it would not, and all would come out too dark.
    pub fn wanted(&self, lights: &[Light], new: &[NewPart], scale: f32) -> Vec<f32> {
        let own = self.moments(lights);
        let mut around: HashMap<u64, Moments> = HashMap::new();
        let (mut whole, mut landings) = (0.0, 0.0);
        for (new, &m) in new.iter().zip(&own) {
            let sum = around.entry(new.around).or_default();
            *sum = sum.plus(m, 1.0);
            whole += new.landings as f32 * m.spread().0;
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
