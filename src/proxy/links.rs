//! Indirect irradiance of cell sides by gathering over the cells themselves.
//!
//! ```text
//! E_i = 1/n Σ_r B(h_ir),   B_j = ⟨ρ E_direct⟩_j + ⟨ρ⟩_j E_j
//! h_ir: side hit by cosine ray r of side i; the sky counts π·L
//! ```
//!
//! Ray hits do not depend on light, so every ray is shot once, its hit remembered, and the linear
//! system is swept to convergence afterwards at the price of one look-up per ray and sweep
//! `[CohenWallace93]` §5.3 (Jacobi). Photons give the first guess.
//!
//! Only what is needed is solved. Round 0 arrives where light is asked for
//! ([`Making::first_arrivals`]). Every side arrived at is gathered in round 1, the sides these rays
//! hit in round 2, and so on; what no ray reached keeps its photon estimate. Rays start at the
//! points where earlier rays arrived, so area buried in other surfaces, which nothing sees, does
//! not count.
//!
//! The input is [`Making`] and [`Need`]; the output [`Links`], which [`Links::solve`] turns into
//! irradiance per gathered side. It is bit-identical for any thread count: rounds are lists in
//! fixed order, and a sweep reads only the one before. It is not unbiased: the bias of noise is
//! zero only for sides whose light does not return to them; it falls with `gather_rays`. The cost
//! is `gather_rays` rays of 4 B each per reached side, and half of them from round 2 on.

use glam::Vec3;
use rayon::prelude::*;

use super::Need;
use super::cell_side::CellSide;
use super::making::Making;
use super::shooter::{Arrival, Met};
use crate::error::Result;
use crate::radiometry::{Rgb, luminance};
use crate::run::{Phase, RayKind, Run};
use crate::sampling::{Sobol, Stream};

const BLOCK: usize = 256;
/// Points a side remembers to start rays from.
const POINTS: usize = 16;
/// A ray that met the sky.
const SKY: u32 = u32::MAX;
/// A ray that met nothing.
const NOTHING: u32 = u32::MAX - 1;
/// No place among the gathered sides.
const NONE: u32 = u32::MAX;
/// Gathered by an earlier solve.
const EARLIER: u32 = u32::MAX - 1;
/// Sweeps end when they change the irradiance by less than this fraction.
const TOLERANCE: f64 = 1e-3;

/// Which side every ray of every gathered side hits.
#[derive(Debug, Default)]
pub(super) struct Links {
    /// Gathered sides, no two alike.
    sides: Vec<CellSide>,
    /// Where the hits of each begin; one more at the end.
    first: Vec<u32>,
    /// Index of a side, [`SKY`] or [`NOTHING`].
    hits: Vec<u32>,
    /// Σ π L over the rays of each that met the map of the sky; empty without one.
    from_map: Vec<Rgb>,
    /// Where rays arrived on the gathered sides, at most [`POINTS`] each, and where those of each
    /// begin; one more at the end.
    arrivals: Vec<Arrival>,
    first_arrival: Vec<u32>,
    /// Place in `sides` by [`CellSide::index`]; [`NONE`] where no ray arrived, [`EARLIER`].
    place: Vec<u32>,
}

/// What the sweeps solve, by [`CellSide::index`].
#[derive(Debug)]
pub(super) struct System {
    /// ⟨ρ E_direct⟩, W·m⁻².
    pub direct: Vec<Rgb>,
    /// ⟨ρ⟩.
    pub albedo: Vec<Rgb>,
    /// Indirect irradiance: the first guess, replaced where gathered. W·m⁻².
    pub indirect: Vec<Rgb>,
}

impl System {
    /// Radiosity of a side.
    pub fn leaving(&self, i: usize) -> Rgb {
        self.direct[i] + self.albedo[i] * self.indirect[i]
    }
}

/// How the sweeps ended.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Swept {
    pub sweeps: u32,
    /// Last change of irradiance, relative.
    pub residual: f32,
}

/// What the rays of some sides met.
#[derive(Default)]
struct Shot {
    hits: Vec<u32>,
    next: Vec<Arrival>,
    maps: Vec<Rgb>,
}

impl Links {
    /// Shoots all rays (phase `gather`) that `need` asks for, but from sides `reached` before.
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    pub fn new(making: &Making<'_>, need: Need<'_>, reached: Vec<bool>) -> Result<Self> {
        let phase = making.run.phase("gather", reached.len() as u64);
        let place = reached.into_iter().map(|r| if r { EARLIER } else { NONE }).collect();
        let mut links = Self { first: vec![0], place, ..Self::default() };
        let (mut arrivals, mut all) = (making.first_arrivals(need), Vec::new());
        for round in 1..=making.settings.gather_rounds {
            making.run.check()?;
            let rays = making.settings.gather_rays.div_ceil(if round == 1 { 1 } else { 2 });
            let next = links.round(making, &arrivals, rays, &phase)?;
            all.append(&mut arrivals);
            arrivals = next;
        }
        all.append(&mut arrivals);
        links.keep(&all);
        Ok(links)
    }

    /// Gathers every new side among `arrivals`; returns where its rays went.
    fn round(
        &mut self,
        making: &Making<'_>,
        arrivals: &[Arrival],
        rays: u32,
        phase: &Phase<'_>,
    ) -> Result<Vec<Arrival>> {
        let mut arrivals: Vec<Arrival> = arrivals
            .iter()
            .filter(|a| self.place[a.at.index()] == NONE && making.reflects(a.at))
            .copied()
            .collect();
        making.run.install(|| arrivals.par_sort_by_key(|a| a.at));
        let groups: Vec<&[Arrival]> = arrivals.chunk_by(|a, b| a.at == b.at).collect();
        let blocks: Vec<Shot> = making.run.install(|| {
            groups
                .par_chunks(BLOCK)
                .map(|groups| {
                    let mut shot = Shot::default();
                    if !making.run.cancelled() {
                        shot.hits.reserve(groups.len() * rays as usize);
                        groups.iter().for_each(|starts| shot.side(making, starts, rays));
                    }
                    making.run.rays.add(RayKind::Sample, shot.hits.len() as u64);
                    phase.advance(groups.len() as u64);
                    shot
                })
                .collect()
        });
        making.run.check()?;
        for group in &groups {
            let at = group[0].at;
            self.place[at.index()] = self.sides.len() as u32;
            self.sides.push(at);
            self.first.push(self.first[self.first.len() - 1] + rays);
        }
        let mut next = Vec::new();
        for shot in blocks {
            self.hits.extend(shot.hits);
            self.from_map.extend(shot.maps);
            next.extend(shot.next);
        }
        Ok(next)
    }

    /// Keeps the first [`POINTS`] of all arrivals on every gathered side.
    fn keep(&mut self, all: &[Arrival]) {
        let mut room = vec![0u32; self.sides.len() + 1];
        let gathered = |a: &&Arrival| self.place[a.at.index()] < EARLIER;
        for a in all.iter().filter(gathered) {
            let count = &mut room[self.place[a.at.index()] as usize + 1];
            *count = (*count + 1).min(POINTS as u32);
        }
        for i in 1..room.len() {
            room[i] += room[i - 1];
        }
        let mut kept: Vec<Option<Arrival>> = vec![None; room[self.sides.len()] as usize];
        let mut next = room.clone();
        for a in all.iter().filter(gathered) {
            let i = self.place[a.at.index()] as usize;
            if next[i] < room[i + 1] {
                kept[next[i] as usize] = Some(*a);
                next[i] += 1;
            }
        }
        self.arrivals = kept.into_iter().flatten().collect();
        self.first_arrival = room;
    }

    /// Points of a side that rays reached; none where it is not gathered.
    pub fn arrivals(&self, side: CellSide) -> &[Arrival] {
        match self.place[side.index()] {
            NONE | EARLIER => &[],
            i => {
                let i = i as usize;
                let (from, to) = (self.first_arrival[i], self.first_arrival[i + 1]);
                &self.arrivals[from as usize..to as usize]
            }
        }
    }

    /// Gathered sides.
    pub fn sides(&self) -> &[CellSide] {
        &self.sides
    }

    /// Sides gathered now or before, by [`CellSide::index`].
    pub fn reached(&self) -> Vec<bool> {
        self.place.iter().map(|&p| p != NONE).collect()
    }

    /// Sweeps until the irradiance rests, at most `sweeps` times. `sky` is the constant sky's
    /// radiance; a map's was found with the rays.
    pub fn solve(&self, system: &mut System, sky: Rgb, sweeps: u32, run: &Run) -> Result<Swept> {
        let mut swept = Swept::default();
        let sky = sky * std::f32::consts::PI;
        let mut radiosity: Vec<Rgb> = (0..system.direct.len()).map(|i| system.leaving(i)).collect();
        while swept.sweeps < sweeps {
            run.check()?;
            let blocks: Vec<Vec<Rgb>> = run.install(|| {
                (0..self.sides.len().div_ceil(BLOCK))
                    .into_par_iter()
                    .map(|block| {
                        (block * BLOCK..self.sides.len().min((block + 1) * BLOCK))
                            .map(|i| self.gather(i, &radiosity, sky))
                            .collect()
                    })
                    .collect()
            });
            let (mut change, mut whole) = (0.0, 0.0);
            for (&side, e) in self.sides.iter().zip(blocks.into_iter().flatten()) {
                let i = side.index();
                change += f64::from(luminance((e - system.indirect[i]).abs()));
                whole += f64::from(luminance(e));
                system.indirect[i] = e;
                radiosity[i] = system.leaving(i);
            }
            swept.sweeps += 1;
            swept.residual = if whole > 0.0 { (change / whole) as f32 } else { 0.0 };
            if f64::from(swept.residual) < TOLERANCE {
                break;
            }
        }
        Ok(swept)
    }

    fn gather(&self, i: usize, radiosity: &[Rgb], sky: Rgb) -> Rgb {
        let hits = &self.hits[self.first[i] as usize..self.first[i + 1] as usize];
        let sum: Vec3 = hits
            .iter()
            .map(|&h| match h {
                SKY => sky,
                NOTHING => Rgb::ZERO,
                side => radiosity[side as usize],
            })
            .sum();
        (sum + self.from_map.get(i).copied().unwrap_or_default()) / hits.len() as f32
    }
}

impl Shot {
    /// The rays of one side, whose arrivals are `starts`.
    fn side(&mut self, making: &Making<'_>, starts: &[Arrival], rays: u32) {
        let sobol = Sobol::new(making.seed, Stream::Link, starts[0].at.key());
        let mut from_map = Rgb::ZERO;
        making.shoot(&starts[..starts.len().min(POINTS)], rays, &sobol, |met| match met {
            Met::Surface(arrival) => {
                self.hits.push(arrival.at.index() as u32);
                self.next.push(arrival);
            }
            Met::Sky(radiance) => {
                self.hits.push(SKY);
                from_map += radiance * std::f32::consts::PI;
            }
            Met::Nothing => self.hits.push(NOTHING),
        });
        if making.world.lights.sky.has_map() {
            self.maps.push(from_map);
        }
    }
}
