//! Bright edges of direct light: where a few shadow rays say too little.
//!
//! ```text
//! a part is at an edge   if  s > BRIGHT · mean over landings of the irradiance of their parts
//! s: standard deviation of direct irradiance around it: from part to part, or of the shadow rays
//!    where they all go to one light
//! ```
//!
//! A part knows its direct light by a few shadow rays from the points where rays landed. Where a
//! patch of sun ends, or a spot shines on less than a place, they say little about how much of the
//! place is lit; and what they say wrong all rays that land there repeat, which shows as clouds on
//! walls that are lit by the patch. There a part is lit by [`RAYS`] shadow rays from all over its
//! place. Final gathering, which has many rays, asks by one shadow ray more at each landing
//! instead of reading the mean: what is left of the error differs from landing to landing.
//!
//! Guarantees  which parts are at an edge is decided by their neighbours alone: a part that asked
//!             its own samples would miss the patches that they missed, and light would be lost.
//! Not         patches smaller than a place whose every neighbour is dark: they stay the mean of
//!             their points, right on average.
//! Cost        where light has no bright edges, none.

use std::collections::HashMap;

use rayon::prelude::*;

use super::cover::{NewPart, Point, sees};
use super::light::shadow;
use super::noise::Moments;
use super::{Part, Places};
use crate::radiometry::{Rgb, luminance};
use crate::run::{RayKind, Run};
use crate::sampling::{BuildReady, Sobol, Stream};
use crate::shading::World;

/// Standard deviation from part to part that makes an edge, over the mean irradiance.
const BRIGHT: f32 = 1.0;
/// Levels above a part at which it takes part in what is around.
const AROUND: [i32; 4] = [0, 1, 2, 3];
/// That at which it looks around.
const LOOK: i32 = 1;
/// Shadow rays of a part at an edge.
const RAYS: u32 = 32;

/// Direct light of the parts around.
#[derive(Clone, Copy, Debug, Default)]
struct Around {
    /// Shadow rays, Σ of what they found, Σ over parts of rays · mean².
    sums: [f64; 3],
    /// Σ (x − mean of its part)², and its degrees of freedom.
    within: [f64; 2],
    parts: f64,
}

impl Around {
    fn of(samples: &Moments) -> Self {
        let [n, sum, _] = samples.0;
        Self {
            sums: [n, sum, sum * sum / n.max(1.0)],
            within: [samples.scatter(), (n - 1.0).max(0.0)],
            parts: 1.0,
        }
    }

    fn plus(self, other: Self, sign: f64) -> Self {
        Self {
            sums: [0, 1, 2].map(|i| self.sums[i] + sign * other.sums[i]),
            within: [0, 1].map(|i| self.within[i] + sign * other.within[i]),
            parts: self.parts + sign * other.parts,
        }
    }

    /// Standard deviation of the irradiance: from part to part, the noise of their rays left out;
    /// of one light that of the rays, which all ask for the same.
    fn spread(self, one_light: bool) -> f32 {
        let [n, sum, squares] = self.sums;
        let [scatter, freedom] = self.within;
        let between = squares - sum * sum / n.max(1.0);
        let rays =
            if one_light { scatter } else { -scatter / freedom.max(1.0) * (self.parts - 1.0) };
        ((between + rays) / n.max(1.0)).max(0.0).sqrt() as f32
    }
}

impl Places {
    /// Marks those of the last parts, which are `new`, that are at an edge, by the `samples` of
    /// direct light of each.
    pub(super) fn mark_edges(&mut self, world: &World, new: &[NewPart], samples: &[Moments]) {
        let one_light = world.lights.is_one();
        let from = self.parts.len() - new.len();
        let lights = &self.lights[from..];
        let sum = |of: &dyn Fn(usize) -> f32| (0..new.len()).map(of).map(f64::from).sum::<f64>();
        let landings = sum(&|i| new[i].landings as f32);
        let whole = sum(&|i| new[i].landings as f32 * luminance(lights[i].total()));
        let bright = BRIGHT * (whole / landings.max(1.0)) as f32;
        let mut around: HashMap<u64, Around, BuildReady> = HashMap::default();
        for (new, samples) in new.iter().zip(samples) {
            for up in AROUND {
                let sum = around.entry(self.grids.cube(&new.spot, new.level + up)).or_default();
                *sum = sum.plus(Around::of(samples), 1.0);
            }
        }
        for ((part, new), samples) in self.parts[from..].iter_mut().zip(new).zip(samples) {
            let keys = self.grids.cubes(&new.spot, new.level + LOOK);
            let there = keys.filter_map(|key| around.get(&key));
            let all = there.fold(Around::default(), |sum, &a| sum.plus(a, 1.0));
            part.edge = all.plus(Around::of(samples), -1.0).spread(one_light) > bright;
        }
    }

    /// Direct light of those of the last parts that are at an edge, by many shadow rays from all
    /// over the place; none for the others.
    pub(super) fn refined(&self, world: &World, new: &[NewPart], run: &Run) -> Vec<Option<Rgb>> {
        let from = self.parts.len() - new.len();
        let refine = |(part, new): (&Part, &NewPart)| {
            let (e, rays) = match part.edge && !part.is_shared() && !run.cancelled() {
                true => self.refine(world, part, new),
                false => (None, 0),
            };
            run.rays.add(RayKind::Shadow, rays);
            e
        };
        run.install(|| self.parts[from..].par_iter().zip(new).map(refine).collect())
    }

    fn refine(&self, world: &World, part: &Part, new: &NewPart) -> (Option<Rgb>, u64) {
        let place = self.index.get(&self.grids.key(&new.spot, new.level));
        let clear = place.is_some_and(|place| place.clear);
        let [corner, b, a, _] = self.grids.corners(&new.spot, new.level);
        let sobol = Sobol::new(self.seed, Stream::PlaceEdge, new.element);
        let (mut sum, mut count, mut rays) = (Rgb::ZERO, 0, 0);
        for i in 0..RAYS {
            let at = sobol.sample_2d(i, 0);
            let p = corner + (a - corner) * at.x + (b - corner) * at.y;
            let Some(landing) = new.spot.landing(world, p) else { continue };
            let point = Point::new(world, &landing);
            if !clear && !sees(world, (part.p, part.ng), (point.p, point.ng), part.lift()) {
                continue;
            }
            let (e, shot) = shadow(world, &point, sobol.sample_1d(i, 1), sobol.sample_2d(i, 2));
            (sum, count, rays) = (sum + e, count + 1, rays + shot);
        }
        ((count > 0).then(|| sum / count as f32), rays)
    }
}
