//! Indirect irradiance of cell sides by gathering over the cells themselves.
//!
//! ```text
//! E_i = 1/n Σ_r B(h_ir),   B_j = ⟨ρ E_direct⟩_j + ⟨ρ⟩_j E_j            h_ir: side hit by cosine ray r of side i; the sky counts π·L
//! ```
//!
//! Ray hits do not depend on light, so every ray is shot once, its hit remembered, and the linear
//! system is swept to convergence afterwards at the price of one look-up per ray and sweep
//! `[CohenWallace93]` §5.3 (Jacobi). Photons give the first guess.
//!
//! Only what the picture can see is solved. Round 0: rays from a lattice of pixels, and cosine rays
//! from where they land. Every side they hit is gathered in round 1, the sides these rays hit in
//! round 2, and so on; what no ray reached keeps its photon estimate. Rays start at the points
//! where earlier rays hit the side, so area buried in other surfaces, which nothing sees, does not
//! count.
//!
//! Inputs  [`World`], [`Cells`]. Output  [`Links`]; irradiance per gathered side.
//! Guarantee  bit-identical for any thread count: rounds are lists in fixed order, a sweep reads
//!            only the one before.
//! Not        unbiased: the bias of noise is zero only for sides whose light does not return to
//!            them; it falls with `gather_rays`.
//! Cost  `gather_rays` rays and 4 B each per reached side; half of them from round 2 on.

use glam::Vec3;
use rayon::prelude::*;

use super::ProxySettings;
use crate::error::Result;
use crate::math::{Frame, Ray};
use crate::radiometry::{Rgb, luminance};
use crate::run::{Phase, RayKind, Run};
use crate::sampling::{Sobol, Stream, sample_cosine_hemisphere};
use crate::scene::Camera;
use crate::shading::World;
use crate::tessellate::Cells;

const BLOCK: usize = 256;
/// Pixels that round 0 looks through, about, and cosine rays from each.
const LATTICE_PIXELS: f32 = 16_384.0;
const LATTICE_RAYS: u32 = 16;
/// Points a side remembers to start rays from.
const POINTS: usize = 16;
/// A ray that met the sky.
const SKY: u32 = u32::MAX;
/// A direction below the horizon of the face: no light.
const NOTHING: u32 = u32::MAX - 1;
/// No place among the gathered sides.
const NONE: u32 = u32::MAX;
/// Gathered by an earlier solve.
const EARLIER: u32 = u32::MAX - 1;
/// Sweeps end when they change the irradiance by less than this fraction.
const TOLERANCE: f64 = 1e-3;

/// A point on a side, as a ray met it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Landing {
    /// 2 · cell + side.
    side: u32,
    /// Triangle of the cell.
    pub triangle: u32,
    /// Barycentrics.
    pub u: f32,
    /// Barycentrics.
    pub v: f32,
}

/// Which side every ray of every gathered side hits.
#[derive(Debug, Default)]
pub(super) struct Links {
    /// Gathered sides as 2 · cell + side, no two alike.
    sides: Vec<u32>,
    /// Where the hits of each begin; one more at the end.
    first: Vec<u32>,
    /// 2 · cell + side, [`SKY`] or [`NOTHING`].
    hits: Vec<u32>,
    /// Σ π L over the rays of each that met the map of the sky; empty without one.
    from_map: Vec<Rgb>,
    /// Where rays met the gathered sides, at most [`POINTS`] each, and where those of each begin;
    /// one more at the end.
    landings: Vec<Landing>,
    first_landing: Vec<u32>,
    /// Place in `sides` by 2 · cell + side; [`NONE`] where no ray arrived, [`EARLIER`].
    place: Vec<u32>,
}

/// How the sweeps ended.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Swept {
    pub sweeps: u32,
    /// Last change of irradiance, relative.
    pub residual: f32,
}

struct Shooter<'a> {
    world: &'a World,
    cells: &'a Cells,
    /// Sides that reflect and can be seen.
    live: &'a (dyn Fn(u32) -> bool + Sync),
    seed: u64,
    run: &'a Run,
}

impl Shooter<'_> {
    /// Hits of `rays` cosine rays from one side, starting in turn at `starts`, and what a map of
    /// the sky sends along them.
    fn shoot(
        &self,
        starts: &[Landing],
        rays: u32,
        sobol: &Sobol,
        mut put: impl FnMut(u32, Option<Landing>, Rgb),
    ) {
        let geometry = &self.world.geometry;
        for i in 0..rays {
            let at = starts[i as usize % starts.len()];
            let sign = if at.side & 1 == 0 { 1.0 } else { -1.0 };
            let s = geometry.surface(at.triangle, at.u, at.v);
            let wi = Frame::from_normal(s.ns * sign)
                .world_from_local(sample_cosine_hemisphere(sobol.sample_2d(i, 0)));
            if wi.dot(s.ng) * sign <= 0.0 {
                put(NOTHING, None, Rgb::ZERO);
                continue;
            }
            let origin = crate::math::offset_origin(s.p, s.ng * sign, self.world.diagonal);
            match self.land(&Ray::new(origin, wi)) {
                Some(l) => put(l.side, Some(l), Rgb::ZERO),
                None => put(SKY, None, self.world.lights.sky.from_map(wi)),
            }
        }
    }

    fn land(&self, ray: &Ray) -> Option<Landing> {
        let hit = self.world.rays.closest(ray)?;
        let back = self.world.geometry.face_normals[hit.triangle as usize].dot(ray.dir) > 0.0;
        Some(Landing {
            side: 2 * self.cells.find(hit.triangle, hit.u, hit.v) + u32::from(back),
            triangle: hit.triangle,
            u: hit.u,
            v: hit.v,
        })
    }

    /// What lattices of pixels see and what lies around there; many views share √views times the
    /// pixels of one.
    fn round_zero(&self, views: &[Camera]) -> Vec<Landing> {
        let pixels = LATTICE_PIXELS / (views.len() as f32).sqrt();
        views
            .iter()
            .enumerate()
            .flat_map(|(i, view)| self.look(view, pixels, (i as u64) << 41))
            .collect()
    }

    fn look(&self, camera: &Camera, pixels: f32, key: u64) -> Vec<Landing> {
        let step =
            ((camera.width as f32 * camera.height as f32 / pixels).sqrt().ceil() as u32).max(1);
        let rows = camera.height.div_ceil(step);
        let row = |j: u32| {
            let mut out = Vec::new();
            let y = (j * step + step / 2).min(camera.height - 1);
            let mut rays = 0;
            for x in (step / 2..camera.width.max(step / 2 + 1)).step_by(step as usize) {
                let pixel = glam::Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                rays += 1;
                let Some(seen) = self.land(&Ray::new(camera.eye, camera.direction(pixel))) else {
                    continue;
                };
                out.push(seen);
                let sobol = Sobol::new(
                    self.seed,
                    Stream::Link,
                    key | (1 << 40) | u64::from(y * camera.width + x),
                );
                rays += u64::from(LATTICE_RAYS);
                self.shoot(&[seen], LATTICE_RAYS, &sobol, |_, landing, _| out.extend(landing));
            }
            self.run.rays.add(RayKind::Sample, rays);
            out
        };
        let rows: Vec<Vec<Landing>> =
            self.run.install(|| (0..rows).into_par_iter().map(row).collect());
        rows.into_iter().flatten().collect()
    }
}

impl Links {
    /// Shoots all rays (phase `gather`) that `views` ask for, but from sides `reached` before.
    /// `live` tells by 2 · cell + side what reflects and can be seen.
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    pub fn new(
        world: &World,
        cells: &Cells,
        settings: &ProxySettings,
        views: &[Camera],
        reached: Vec<bool>,
        live: &(dyn Fn(u32) -> bool + Sync),
        seed: u64,
        run: &Run,
        phase: &Phase<'_>,
    ) -> Result<Self> {
        let shooter = Shooter { world, cells, live, seed, run };
        let place = reached.into_iter().map(|r| if r { EARLIER } else { NONE }).collect();
        let mut links = Self { first: vec![0], place, ..Self::default() };
        let (mut landings, mut arrived) = (shooter.round_zero(views), Vec::new());
        for round in 1..=settings.gather_rounds {
            run.check()?;
            let next = links.round(
                &shooter,
                &landings,
                settings.gather_rays.div_ceil(if round == 1 { 1 } else { 2 }),
                phase,
            )?;
            arrived.append(&mut landings);
            landings = next;
        }
        arrived.append(&mut landings);
        links.keep(&arrived);
        Ok(links)
    }

    /// Gathers every new side among `landings`; returns where its rays went.
    fn round(
        &mut self,
        shooter: &Shooter<'_>,
        landings: &[Landing],
        rays: u32,
        phase: &Phase<'_>,
    ) -> Result<Vec<Landing>> {
        let mut landings: Vec<Landing> = landings
            .iter()
            .filter(|l| self.place[l.side as usize] == NONE && (shooter.live)(l.side))
            .copied()
            .collect();
        shooter.run.install(|| landings.par_sort_by_key(|l| l.side));
        let groups: Vec<&[Landing]> = landings.chunk_by(|a, b| a.side == b.side).collect();
        let blocks: Vec<(Vec<u32>, Vec<Landing>, Vec<Rgb>)> = shooter.run.install(|| {
            groups
                .par_chunks(BLOCK)
                .map(|groups| {
                    let (mut hits, mut next, mut maps) =
                        (Vec::with_capacity(groups.len() * rays as usize), Vec::new(), Vec::new());
                    if shooter.run.cancelled() {
                        return (hits, next, maps);
                    }
                    for starts in groups {
                        let sobol =
                            Sobol::new(shooter.seed, Stream::Link, u64::from(starts[0].side));
                        let mut from_map = Rgb::ZERO;
                        shooter.shoot(
                            &starts[..starts.len().min(POINTS)],
                            rays,
                            &sobol,
                            |hit, landing, sky| {
                                hits.push(hit);
                                from_map += sky * std::f32::consts::PI;
                                next.extend(landing);
                            },
                        );
                        if shooter.world.lights.sky.has_map() {
                            maps.push(from_map);
                        }
                    }
                    shooter.run.rays.add(RayKind::Sample, hits.len() as u64);
                    phase.advance(groups.len() as u64);
                    (hits, next, maps)
                })
                .collect()
        });
        shooter.run.check()?;
        for group in &groups {
            self.place[group[0].side as usize] = self.sides.len() as u32;
            self.sides.push(group[0].side);
            self.first.push(self.first[self.first.len() - 1] + rays);
        }
        let mut next = Vec::new();
        for (hits, landings, maps) in blocks {
            self.hits.extend(hits);
            self.from_map.extend(maps);
            next.extend(landings);
        }
        Ok(next)
    }

    /// Keeps the first [`POINTS`] of all landings on every gathered side.
    fn keep(&mut self, arrived: &[Landing]) {
        let mut room = vec![0u32; self.sides.len() + 1];
        let gathered = |l: &&Landing| self.place[l.side as usize] < EARLIER;
        for l in arrived.iter().filter(gathered) {
            let count = &mut room[self.place[l.side as usize] as usize + 1];
            *count = (*count + 1).min(POINTS as u32);
        }
        for i in 1..room.len() {
            room[i] += room[i - 1];
        }
        self.landings = vec![
            Landing { side: NONE, triangle: 0, u: 0.0, v: 0.0 };
            room[self.sides.len()] as usize
        ];
        let mut next = room.clone();
        for l in arrived.iter().filter(gathered) {
            let i = self.place[l.side as usize] as usize;
            if next[i] < room[i + 1] {
                self.landings[next[i] as usize] = *l;
                next[i] += 1;
            }
        }
        self.first_landing = room;
    }

    /// Points of a side (2 · cell + side) that rays reached; none where it is not gathered.
    pub fn landings(&self, side: u32) -> &[Landing] {
        match self.place[side as usize] {
            NONE | EARLIER => &[],
            i => {
                &self.landings[self.first_landing[i as usize] as usize
                    ..self.first_landing[i as usize + 1] as usize]
            }
        }
    }

    /// Gathered sides as 2 · cell + side.
    pub fn sides(&self) -> &[u32] {
        &self.sides
    }

    /// Sides gathered now or before, by 2 · cell + side.
    pub fn reached(&self) -> Vec<bool> {
        self.place.iter().map(|&p| p != NONE).collect()
    }

    /// Number of gathered sides.
    pub fn len(&self) -> usize {
        self.sides.len()
    }

    /// Sweeps until the irradiance rests, at most `sweeps` times. By 2 · cell + side: `direct` is
    /// ⟨ρ E_direct⟩, `albedo` ⟨ρ⟩, `irradiance` the first guess, replaced where gathered. `sky` is
    /// the constant sky's radiance; a map's was found with the rays.
    pub fn solve(
        &self,
        direct: &[Rgb],
        albedo: &[Rgb],
        irradiance: &mut [Rgb],
        sky: Rgb,
        sweeps: u32,
        run: &Run,
    ) -> Result<Swept> {
        let mut swept = Swept::default();
        let sky = sky * std::f32::consts::PI;
        let mut radiosity: Vec<Rgb> =
            (0..direct.len()).map(|i| direct[i] + albedo[i] * irradiance[i]).collect();
        while swept.sweeps < sweeps {
            run.check()?;
            let blocks: Vec<Vec<Rgb>> = run.install(|| {
                (0..self.len().div_ceil(BLOCK))
                    .into_par_iter()
                    .map(|block| {
                        (block * BLOCK..self.len().min((block + 1) * BLOCK))
                            .map(|i| self.gather(i, &radiosity, sky))
                            .collect()
                    })
                    .collect()
            });
            let (mut change, mut whole) = (0.0, 0.0);
            for (&side, e) in self.sides.iter().zip(blocks.into_iter().flatten()) {
                let side = side as usize;
                change += f64::from(luminance((e - irradiance[side]).abs()));
                whole += f64::from(luminance(e));
                irradiance[side] = e;
                radiosity[side] = direct[side] + albedo[side] * e;
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
