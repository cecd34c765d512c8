//! Neighbouring parts share what they know of indirect light.
//!
//! ```text
//! x minimises Σ_i n_i/σ² · (x_i − E_i)² + Σ_ij (x_i − x_j)²/τ²
//! σ²: variance of one gather ray; τ²: mean square of E_i − E_j less σ²/n_i + σ²/n_j
//! ```
//!
//! A part knows its light by the mean of `n_i` rays, often four. Of two parts in neighbouring
//! squares of one grid that see each other, the light differs by little; by how much is seen from
//! all pairs around (`NewPart::around`), as the variance of a ray is. So bias is weighed against
//! variance: where light changes much from square to square nothing is shared, and no part decides
//! by its own samples, which would darken all of them. The system is that of a Gaussian random
//! field with nearest neighbours, solved by a few steps of Jacobi, which bound how far light is
//! carried. Direct light, which has edges, stays as it is.

use std::collections::HashMap;

use rayon::prelude::*;

use super::cover::NewPart;
use super::noise::Moments;
use super::{Places, sees};
use crate::radiometry::Rgb;
use crate::run::{RayKind, Run};
use crate::shading::World;

/// Steps, and so squares, that light is carried at most.
const STEPS: u32 = 8;
/// Levels from a part up to what is around it.
const AROUND: i32 = 3;
/// Light is taken to differ at least by this share of the mean around, from square to square.
const LEAST_CHANGE: f64 = 0.1;

/// Samples and differences around a part.
#[derive(Clone, Copy, Debug, Default)]
struct Around {
    /// Σ (x − mean)² within parts, its degrees of freedom, Σ x, rays.
    within: [f64; 4],
    /// Of pairs: how many, Σ (E_i − E_j)², Σ (1/n_i + 1/n_j).
    pairs: [f64; 3],
}

impl Around {
    /// σ²/τ².
    fn strength(&self) -> f64 {
        let [scatter, freedom, sum, rays] = self.within;
        let [pairs, squares, inverse] = self.pairs;
        let variance = scatter / freedom.max(1.0);
        let least = LEAST_CHANGE * sum / rays.max(1.0);
        let change = (squares - variance * inverse) / pairs.max(1.0);
        variance / change.max(least * least).max(f64::MIN_POSITIVE)
    }
}

impl Places {
    /// Shares indirect light between the last parts, which are `new`, by what their gather rays
    /// found.
    pub(super) fn smooth(
        &mut self,
        new: &[NewPart],
        own: &[Moments],
        pairs: &[(u32, u32)],
        run: &Run,
    ) {
        let from = self.parts.len() - new.len();
        let mean = |i: usize| own[i].0[1] / own[i].0[0].max(1.0);
        let keys: Vec<u64> =
            new.iter().map(|part| self.grids.key(&part.spot, part.level + AROUND)).collect();
        let mut around: HashMap<u64, Around> = HashMap::new();
        for (&key, m) in keys.iter().zip(own) {
            let [n, sum, _] = m.0;
            let add = [m.scatter(), (n - 1.0).max(0.0), sum, n];
            let within = &mut around.entry(key).or_default().within;
            within.iter_mut().zip(add).for_each(|(all, x)| *all += x);
        }
        for &(i, j) in pairs {
            let [a, b] = [i, j].map(|i| own[i as usize].0[0].max(1.0));
            let difference = mean(i as usize) - mean(j as usize);
            let add = [1.0, difference * difference, 1.0 / a + 1.0 / b];
            let pairs = &mut around.entry(keys[i as usize]).or_default().pairs;
            pairs.iter_mut().zip(add).for_each(|(all, x)| *all += x);
        }
        let mut edges: Vec<(u32, u32, f32)> = Vec::with_capacity(2 * pairs.len());
        for &(i, j) in pairs {
            let strength = around[&keys[i as usize]].strength() as f32;
            edges.extend([(i, j, strength), (j, i, strength)]);
        }
        edges.par_sort_unstable_by_key(|&(i, j, _)| (i, j));
        let ends: Vec<usize> =
            (0..new.len() as u32).map(|i| edges.partition_point(|e| e.0 <= i)).collect();
        let known: Vec<Rgb> = self.lights[from..].iter().map(|l| l.indirect).collect();
        let mut x = known.clone();
        for _ in 0..STEPS {
            let step = |i: usize| {
                let mine = &edges[if i == 0 { 0 } else { ends[i - 1] }..ends[i]];
                let n = own[i].0[0] as f32;
                let add = |(e, w): (Rgb, f32), &(_, j, strength): &(u32, u32, f32)| {
                    (e + strength * x[j as usize], w + strength)
                };
                let (e, w) = mine.iter().fold((n * known[i], n), add);
                if w > 0.0 { e / w } else { known[i] }
            };
            x = run
                .install(|| (0..new.len()).into_par_iter().with_min_len(1024).map(step).collect());
        }
        self.lights[from..].iter_mut().zip(x).for_each(|(light, x)| light.indirect = x);
    }

    /// Pairs of new parts in neighbouring squares that see each other.
    pub(super) fn pairs(&self, world: &World, new: &[NewPart], run: &Run) -> Vec<(u32, u32)> {
        let from = self.parts.len() - new.len();
        let of = |(i, part): (usize, &NewPart)| {
            let mut found = Vec::new();
            let mut rays = 0;
            let leader = &self.parts[from + i];
            let at = (leader.p, leader.ng);
            for key in self.grids.next(&part.spot, part.level) {
                let Some(place) = self.index.get(&key) else { continue };
                for j in place.first..place.first + u32::from(place.parts) {
                    if (j as usize) < from {
                        continue;
                    }
                    let other = &self.parts[j as usize];
                    rays += 1;
                    if sees(world, at, (other.p, other.ng), leader.lift()) {
                        found.push((i as u32, j - from as u32));
                    }
                }
            }
            run.rays.add(RayKind::Shadow, rays);
            found
        };
        let found: Vec<Vec<(u32, u32)>> =
            new.par_iter().enumerate().with_min_len(64).map(of).collect();
        found.into_iter().flatten().collect()
    }
}
