//! Which lamps are seen from where: a choice of lamps for every cell.
//!
//! ```text
//! p(group) ∝ I(group) · √V(group)
//! I: mean unoccluded irradiance at points of the cell; V: share of its shadow rays that arrive
//! ```
//!
//! One sample of a group has the second moment I² V, so the square root is what lowers variance
//! (Vévoda, Kondapaneni, Křivánek 2018, "Bayesian online regression for adaptive direct illumination
//! sampling", with counts in place of a regression). Cells around share their counts. Groups of which no ray
//! was shot are taken to be half seen, and every group keeps a share by its power: light that was
//! not found costs noise, and is not lost.

use glam::Vec3;
use rayon::prelude::*;

use super::BESIDE;
use super::cells::{Grid, Seen, lattice};
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
    grid: Grid,
    cells: Vec<Discrete>,
}

/// Shadow rays of a cell by group: shot, arrived.
type Counts = Vec<[f32; 2]>;

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
        let (grid, members) = lattice(world, size, seed, run);
        let phase = run.phase("guide", 2 * members.len() as u64);
        let shoot = |c: usize| {
            phase.advance(1);
            if run.cancelled() {
                Default::default()
            } else {
                shoot(world, &members[c], seed, c, run)
            }
        };
        let shot: Vec<(Vec<f32>, Counts)> =
            run.install(|| (0..members.len()).into_par_iter().map(shoot).collect());
        run.check()?;
        let learn = |c: usize| {
            phase.advance(1);
            let around: Vec<usize> = grid.around(c).collect();
            choice(&shot[c], around.iter().map(|&beside| &shot[beside].1))
        };
        let cells = run.install(|| (0..members.len()).into_par_iter().map(learn).collect());
        run.check()?;
        Ok(Some(Self { grid, cells }))
    }

    /// The choice for the surface point `p` with unit normal `n`; none where the lattice met no
    /// surface nearby.
    pub fn at(&self, p: Vec3, n: Vec3) -> Option<&Discrete> {
        let choice = &self.cells[self.grid.find(p, n)?];
        (!choice.is_empty()).then_some(choice)
    }
}

/// Mean unoccluded irradiance of every group, and what became of the shadow rays.
fn shoot(world: &World, members: &[Seen], seed: u64, cell: usize, run: &Run) -> (Vec<f32>, Counts) {
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
    (importance, counts)
}

fn choice<'a>(
    (importance, own): &(Vec<f32>, Counts),
    around: impl Iterator<Item = &'a Counts>,
) -> Discrete {
    let mut counts = own.clone();
    for beside in around {
        for (sum, add) in counts.iter_mut().zip(beside) {
            sum[0] += BESIDE * add[0];
            sum[1] += BESIDE * add[1];
        }
    }
    let unoccluded: f32 = importance.iter().sum();
    let seen = |[shot, arrived]: [f32; 2]| (arrived + 0.5 * PRIOR) / (shot + PRIOR);
    let of_both = importance.iter().zip(&counts);
    let weights: Vec<f32> = of_both.map(|(&i, &c)| i * seen(c).sqrt()).collect();
    let whole: f32 = weights.iter().sum();
    if whole <= 0.0 || unoccluded <= 0.0 {
        return Discrete::default();
    }
    let each = 1.0 / weights.len() as f32;
    let shares = weights
        .iter()
        .zip(importance)
        .map(|(&w, &i)| w / whole + KEPT[0] * i / unoccluded + KEPT[1] * each);
    Discrete::new(shares.map(f64::from))
}
