//! Which lamps are seen from where: a choice of lamps for every cell.
//!
//! ```text
//! p(group) ∝ I(group) · √V(group)
//! I: mean unoccluded irradiance at points of the cell; V: share of its shadow rays that arrive
//! ```
//!
//! One sample of a group has the second moment I² V, so the square root is what lowers variance
//! (Vévoda, Kondapaneni, Křivánek 2018, "Bayesian online regression for adaptive direct
//! illumination sampling", with counts in place of a regression). Cells around share their counts.
//! Groups of which no ray was shot are taken to be half seen, and every group keeps a share by its
//! power: light that was not found costs noise, and is not lost.

use glam::Vec3;
use rayon::prelude::*;

use super::cells::{Cells, Seen};
use crate::error::Result;
use crate::run::{RayKind, Run};
use crate::sampling::{Discrete, Sobol, Stream};
use crate::shading::{World, seen_irradiance};

/// Shadow rays of a cell.
const RAYS: u32 = 96;
/// Points of a cell whose irradiance is estimated.
const POINTS: usize = 6;
/// Rays that an assumption of half visibility stands for.
const PRIOR: f32 = 1.0;
/// Share of a cell's choice that goes by unoccluded irradiance alone, and by nothing but number.
const KEPT: [f32; 2] = [0.05, 0.005];

/// A choice of lamps for every cell.
#[derive(Debug, Default)]
pub struct LampGuide {
    cells: Cells,
    choices: Vec<Discrete>,
}

/// What a small cell tells of every group of lamps.
#[derive(Debug, Default)]
struct Told {
    /// Mean unoccluded irradiance.
    importance: Vec<f32>,
    /// Shadow rays: shot, arrived.
    counts: Vec<[f32; 2]>,
}

impl LampGuide {
    /// For what the world's camera sees, in cells as large as `size` (phase `guide`); none where
    /// there is nothing to choose.
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    pub fn new(world: &World, size: f32, seed: u64, run: &Run) -> Result<Option<Self>> {
        if world.lights.choices() < 2 {
            return Ok(None);
        }
        let cells = Cells::new(world, size, seed, run);
        let phase = run.phase("guide", (cells.members.len() + cells.len()) as u64);
        let shoot = |c: usize| {
            phase.advance(1);
            let members = &cells.members[c];
            if run.cancelled() { Told::default() } else { shoot(world, members, seed, c, run) }
        };
        let told: Vec<Told> =
            run.install(|| (0..cells.members.len()).into_par_iter().map(shoot).collect());
        run.check()?;
        let learn = |c: usize| {
            phase.advance(1);
            choice(cells.tellers(c).iter().map(|&(cell, weight)| (&told[cell], weight)))
        };
        let choices = run.install(|| (0..cells.len()).into_par_iter().map(learn).collect());
        run.check()?;
        Ok(Some(Self { cells, choices }))
    }

    /// The choice for the surface point `p` with unit normal `n`; none where the lattice met no
    /// surface nearby.
    pub fn at(&self, p: Vec3, n: Vec3) -> Option<&Discrete> {
        let choice = &self.choices[self.cells.find(p, n)?];
        (!choice.is_empty()).then_some(choice)
    }
}

fn shoot(world: &World, members: &[Seen], seed: u64, cell: usize, run: &Run) -> Told {
    let groups = world.lights.choices();
    let mut importance = vec![0.0f32; groups];
    let step = members.len().div_ceil(POINTS);
    for from in members.iter().step_by(step) {
        for (group, sum) in importance.iter_mut().enumerate() {
            *sum += world.lights.importance(group, from.p, from.ns);
        }
    }
    let table = Discrete::new(importance.iter().map(|&x| f64::from(x)));
    let mut counts = vec![[0.0; 2]; groups];
    let sobol = Sobol::new(seed, Stream::Guide, cell as u64);
    let mut rays = 0;
    for r in 0..RAYS {
        let pick = (sobol.sample_1d(r, 0) * members.len() as f32) as usize;
        let from = members[pick.min(members.len() - 1)];
        let of_group = (r as f32 + sobol.sample_1d(r, 1)) / RAYS as f32;
        let uv = sobol.sample_2d(r, 2);
        let (group, light) = world.lights.sample_by(&table, from.p, of_group.min(0.999_999_9), uv);
        let found = light.and_then(|light| seen_irradiance(world, &light, from.ng, from.ns));
        let Some(e) = found else { continue };
        rays += 1;
        counts[group][0] += 1.0;
        counts[group][1] += f32::from(u8::from(e != Vec3::ZERO));
    }
    run.rays.add(RayKind::Shadow, rays);
    Told { importance, counts }
}

/// The choice of a cell that others tell of with weights, the first of them most.
fn choice<'a>(tellers: impl Iterator<Item = (&'a Told, f32)>) -> Discrete {
    let (mut importance, mut counts) = (Vec::<f32>::new(), Vec::<[f32; 2]>::new());
    for (told, weight) in tellers {
        importance.resize(told.importance.len(), 0.0);
        counts.resize(told.counts.len(), [0.0; 2]);
        // Cells beside tell what is hidden; how near lamps are is the cell's own.
        if weight >= 1.0 {
            importance.iter_mut().zip(&told.importance).for_each(|(sum, add)| *sum += add);
        }
        for (sum, add) in counts.iter_mut().zip(&told.counts) {
            *sum = [sum[0] + weight * add[0], sum[1] + weight * add[1]];
        }
    }
    let seen = |[shot, arrived]: [f32; 2]| (arrived + 0.5 * PRIOR) / (shot + PRIOR);
    let unoccluded: f32 = importance.iter().sum();
    let of_both = importance.iter().zip(&counts);
    let weights: Vec<f32> = of_both.map(|(&i, &c)| i * seen(c).sqrt()).collect();
    let whole: f32 = weights.iter().sum();
    if whole <= 0.0 || unoccluded <= 0.0 {
        return Discrete::default();
    }
    let each = 1.0 / weights.len() as f32;
    let shares = weights
        .iter()
        .zip(&importance)
        .map(|(&w, &i)| w / whole + KEPT[0] * i / unoccluded + KEPT[1] * each);
    Discrete::new(shares.map(f64::from))
}
