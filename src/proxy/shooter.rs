//! Rays between cells: where they start, what they meet, and the first of them, by which the proxy
//! learns what a picture can see.

use glam::Vec2;
use rayon::prelude::*;

use super::cell_side::CellSide;
use super::making::Making;
use super::{Landing, Need};
use crate::math::{Frame, Ray, offset_origin};
use crate::radiometry::Rgb;
use crate::run::RayKind;
use crate::sampling::{Sobol, Stream, sample_cosine_hemisphere};
use crate::scene::Camera;

/// Pixels that round 0 looks through, about, and cosine rays from each.
const LATTICE_PIXELS: f32 = 16_384.0;
const LATTICE_RAYS: u32 = 16;

/// A point on a cell side, as a ray met it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival {
    /// Where it arrived.
    pub at: CellSide,
    /// Triangle of the cell.
    pub triangle: u32,
    /// Barycentrics.
    pub u: f32,
    /// Barycentrics.
    pub v: f32,
}

/// What a ray between cells met.
#[derive(Clone, Copy, Debug)]
pub(super) enum Met {
    /// A side.
    Surface(Arrival),
    /// The sky, with the radiance of its map there.
    Sky(Rgb),
    /// Nothing, for its direction lies below the horizon of the face: no light.
    Nothing,
}

impl Making<'_> {
    fn arrival(&self, landing: &Landing) -> Arrival {
        let Landing { triangle, u, v, side, .. } = *landing;
        Arrival { at: CellSide::new(self.cells.find(triangle, u, v), side), triangle, u, v }
    }

    fn land(&self, ray: &Ray) -> Option<Arrival> {
        let hit = self.world.rays.closest(ray)?;
        Some(self.arrival(&Landing::new(self.world, ray, &hit)))
    }

    /// Tells what `rays` cosine rays from one side meet, starting in turn at `starts`.
    pub fn shoot(&self, starts: &[Arrival], rays: u32, sobol: &Sobol, mut met: impl FnMut(Met)) {
        let geometry = &self.world.geometry;
        for i in 0..rays {
            let start = starts[i as usize % starts.len()];
            let sign = start.at.side().sign();
            let s = geometry.surface(start.triangle, start.u, start.v);
            let wi = Frame::from_normal(s.ns * sign)
                .world_from_local(sample_cosine_hemisphere(sobol.sample_2d(i, 0)));
            if wi.dot(s.ng) * sign <= 0.0 {
                met(Met::Nothing);
                continue;
            }
            let origin = offset_origin(s.p, s.ng * sign, self.world.diagonal);
            met(match self.land(&Ray::new(origin, wi)) {
                Some(arrival) => Met::Surface(arrival),
                None => Met::Sky(self.world.lights.sky.from_map(wi)),
            });
        }
    }

    /// Round 0: where light is asked for. For views that is what lattices of their pixels see and
    /// what lies around there; many views share √views times the pixels of one.
    pub fn first_arrivals(&self, need: Need<'_>) -> Vec<Arrival> {
        match need {
            Need::Landings(landings) => landings.iter().map(|l| self.arrival(l)).collect(),
            Need::Views(views) => {
                let pixels = LATTICE_PIXELS / (views.len() as f32).sqrt();
                let look = |(i, view)| self.look(view, pixels, i);
                (0..).zip(views).flat_map(look).collect()
            }
        }
    }

    /// What view number `number` sees through a lattice of about so many `pixels`.
    fn look(&self, camera: &Camera, pixels: f32, number: u64) -> Vec<Arrival> {
        let step =
            ((camera.width as f32 * camera.height as f32 / pixels).sqrt().ceil() as u32).max(1);
        let rows = camera.height.div_ceil(step);
        let row = |j: u32| {
            let mut out = Vec::new();
            let y = (j * step + step / 2).min(camera.height - 1);
            let mut rays = 0;
            for x in (step / 2..camera.width.max(step / 2 + 1)).step_by(step as usize) {
                let pixel = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                rays += 1;
                let Some(seen) = self.land(&Ray::new(camera.eye, camera.direction(pixel))) else {
                    continue;
                };
                out.push(seen);
                let key = pixel_key(number, y * camera.width + x);
                let sobol = Sobol::new(self.seed, Stream::Link, key);
                rays += u64::from(LATTICE_RAYS);
                self.shoot(&[seen], LATTICE_RAYS, &sobol, |met| {
                    if let Met::Surface(arrival) = met {
                        out.push(arrival);
                    }
                });
            }
            self.run.rays.add(RayKind::Sample, rays);
            out
        };
        let rows: Vec<Vec<Arrival>> =
            self.run.install(|| (0..rows).into_par_iter().map(row).collect());
        rows.into_iter().flatten().collect()
    }
}

/// Keys the rays from a pixel apart from those of cell sides, whose keys are below 2³².
fn pixel_key(view: u64, pixel: u32) -> u64 {
    view << 41 | 1 << 40 | u64::from(pixel)
}
