//! Light where it is needed: rounds of places, then more rays where light is noisy.
//!
//! The landings of round 1 are asked for; those of the next are where the gather rays of the round
//! before landed without a place. What the last round leaves open is followed by paths to a part or
//! to their end, so no energy is dropped. The first solution tells where direct light has bright
//! edges, and is refined, and where samples scatter; there further rays are shot, and the system is
//! solved again. Parts of earlier needs stay as they are and light the new ones.
//!
//! Of `gather_rays` n, a part has n/8 at first, or as many as landings up to n, half as many in
//! each further round; at the end up to 4 n by how much it is needed and how noisy it is, but all
//! parts together no more than 3/8 n for each landing that was asked for.

use rayon::prelude::*;

use super::Places;
use super::bright::Bright;
use super::cover::NewPart;
use super::light::{Gathered, Link, Rays};
use super::noise::Moments;
use super::system::{Open, System};
use crate::error::Result;
use crate::proxy::{Added, Landing};
use crate::radiometry::Rgb;
use crate::run::{RayKind, Run};
use crate::shading::World;

/// Rounds of places.
const ROUNDS: u32 = 3;
/// Parts that are lit at a time.
const BLOCK: usize = 64;

impl Places {
    /// Adds light for `landings` (phase `places`).
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    pub(super) fn need(&mut self, world: &World, landings: &[Landing], run: &Run) -> Result<Added> {
        let phase = run.phase("places", u64::from(ROUNDS) + 2);
        let from = self.parts.len();
        let shot = || [RayKind::Sample, RayKind::Shadow].map(|kind| run.rays.get(kind));
        let (before, short_before) = (shot(), self.made.rays.short);
        let (mut system, mut new, mut samples) = (System::default(), Vec::new(), Vec::new());
        let mut bright = Bright::default();
        let unknown = |l: &&Landing| self.find(world, l).is_none();
        let unknown = run.install(|| landings.par_iter().filter(unknown).copied().collect());
        let mut open = Open::asked(unknown);
        let asked = open.landings.len();
        phase.advance(1);
        for round in 0..ROUNDS {
            let (more, short) = run.install(|| self.cover(world, &open.landings));
            run.rays.add(RayKind::Shadow, short);
            self.made.rays.short += short;
            self.close(world, &open, &mut system, run);
            let direct = self.shine(world, &more, round, run)?;
            let fewest = self.gather_rays.div_ceil(8);
            let most = (self.gather_rays >> round).max(fewest);
            open = Open::default();
            let count = |_: usize, part: &NewPart| 0..part.landings.clamp(fewest, most);
            if round == 0 {
                let lit = more.iter().zip(direct.iter().map(|d| d.0));
                bright = Bright::new(&self.grids, lit);
            }
            let found = self.shoot(world, &bright, &more, count, run)?;
            for ((e, own), found) in direct.into_iter().zip(found) {
                samples.push(own);
                system.push(e, found, &mut open);
            }
            new.extend(more);
            phase.advance(1);
        }
        self.close(world, &open, &mut system, run);
        let first = system.sweep(&mut self.lights, run)?;
        self.mark_edges(world, &new, &samples);
        system.refine(self.refined(world, &new, run));
        let n = self.gather_rays as f32;
        let wanted = system.wanted(&self.lights, &new, n / 4.0);
        let further = system.further(&wanted, 4.0 * n, 0.375 * n * asked as f32);
        let further = |i: usize, _: &NewPart| system.rays[i]..system.rays[i] + further[i];
        let found = self.shoot(world, &bright, &new, further, run)?;
        let mut more = System::default();
        open = Open::default();
        found.into_iter().for_each(|found| more.push(Rgb::ZERO, found, &mut open));
        self.close(world, &open, &mut more, run);
        system = system.join(&more);
        let again = system.sweep(&mut self.lights, run)?;
        let own = run.install(|| system.moments(&self.lights));
        let pairs = run.install(|| self.pairs(world, &new, run));
        self.smooth(&new, &own, &pairs, run);
        phase.advance(1);
        let made = &mut self.made;
        let [gather, shadow] = [0, 1].map(|i| shot()[i] - before[i]);
        self.needs += 1;
        made.rays.gather += gather;
        made.rays.shadow += shadow - (made.rays.short - short_before);
        made.points += new.iter().map(|part| part.points.len()).sum::<usize>();
        let sweeps = first.sweeps + again.sweeps;
        (made.sweeps, made.residual) = (made.sweeps + sweeps, again.residual);
        Ok(Added { sides: self.parts.len() - from, sweeps, residual: again.residual })
    }

    /// Direct light of parts by shadow rays.
    fn shine(
        &self,
        world: &World,
        new: &[NewPart],
        round: u32,
        run: &Run,
    ) -> Result<Vec<(Rgb, Moments)>> {
        let most = (self.direct_samples >> round).max(self.direct_samples.min(4));
        let direct = |part: &NewPart| match run.cancelled() {
            true => (Rgb::ZERO, Moments::default(), 0),
            false => self.direct(world, part, most),
        };
        let found: Vec<(Rgb, Moments, u64)> =
            run.install(|| new.par_iter().with_min_len(BLOCK).map(direct).collect());
        run.check()?;
        run.rays.add(RayKind::Shadow, found.iter().map(|f| f.2).sum());
        Ok(found.into_iter().map(|f| (f.0, f.1)).collect())
    }

    /// Gather rays of parts, of each those that `which` tells.
    fn shoot(
        &self,
        world: &World,
        bright: &Bright,
        parts: &[NewPart],
        which: impl Fn(usize, &NewPart) -> std::ops::Range<u32> + Sync,
        run: &Run,
    ) -> Result<Vec<Gathered>> {
        let gather = |(i, part): (usize, &NewPart)| match run.cancelled() {
            true => Gathered::default(),
            false => self.gather(world, bright, part, which(i, part)),
        };
        let found: Vec<Gathered> =
            run.install(|| parts.par_iter().enumerate().with_min_len(BLOCK).map(gather).collect());
        run.check()?;
        run.rays.add(RayKind::Sample, found.iter().map(|f| f.rays).sum());
        Ok(found)
    }

    /// Ends open links: each at the part of its landing, or by a path.
    fn close(&self, world: &World, open: &Open, system: &mut System, run: &Run) {
        let end = |landing: &Landing| {
            let mut rays = Rays::default();
            let end = match self.find(world, landing) {
                Some(to) => (Default::default(), Link { to, weight: Rgb::ONE }),
                None => self.walk(world, landing, &mut rays),
            };
            (end, rays)
        };
        let ends: Vec<_> = run.install(|| {
            let landings = &open.landings[..open.len()];
            landings.par_iter().with_min_len(BLOCK).map(end).collect()
        });
        let mut rays = Rays::default();
        ends.iter().for_each(|&(_, shot)| rays += shot);
        run.rays.add(RayKind::Sample, rays.gather);
        run.rays.add(RayKind::Shadow, rays.shadow);
        system.close(open, ends.into_iter().map(|(end, _)| end));
    }
}
