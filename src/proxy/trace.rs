//! Photons: flux leaves the lights in proportion to power and is followed until it dies.
//!
//! At every hit the flux Φ that arrives is stored (for the sky from the first hit, for other lights
//! from the second: their first is direct light). The photon goes on with probability `q = max(ρ Φ)
//! / max(Φ)`, at most [`crate::radiometry::MAX_ALBEDO`] on surfaces without shading normals, and
//! with flux `ρ Φ / q`: unbiased per channel while the largest channel never changes. It leaves by
//! the cosine law on the side that was hit. Where shading and geometric normals differ, arriving
//! flux is weighted by `(wi·ns) / (wi·ng)`, clamped to 4 (particles see the adjoint of the
//! shading-normal surface `[Veach97]`).
//!
//! The input is [`Making`]; the output are photons in the order of their paths, with flux for the
//! whole count (already divided by it). Blocks are fixed and ordered, so it is bit-identical for
//! any thread count. Path i uses Sobol sample i of one sequence, so any power-of-two prefix of
//! paths is stratified over lights, places and directions. A path costs about 1/(1 − ρ) rays.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::cell_side::CellSide;
use super::cells::{Cells, Fineness};
use super::making::Making;
use super::{Piece, ProxyInputs};
use crate::error::Result;
use crate::math::Frame;
use crate::radiometry::Rgb;
use crate::run::{RayKind, Run};
use crate::sampling::{Rng, Sobol, Stream, sample_cosine_hemisphere};
use crate::shading::World;
use crate::tessellate::Side;

const BLOCK: u32 = 4096;
/// Bounces whose directions are stratified; later ones are random.
const STRATIFIED_BOUNCES: u32 = 4;
const MAX_ADJOINT_WEIGHT: f32 = 4.0;

/// Flux that arrived on one side of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Photon {
    /// Where, world space.
    pub position: Vec3,
    /// Flux, W per channel, its share of the whole count.
    pub flux: Rgb,
    /// Unit direction it travelled in.
    pub incident: Vec3,
    /// What it arrived on.
    on: CellSide,
}

impl Photon {
    /// A photon that arrived on a side.
    pub(super) fn new(position: Vec3, flux: Rgb, incident: Vec3, on: CellSide) -> Self {
        Self { position, flux, incident, on }
    }
    /// What it arrived on.
    pub(super) fn on(&self) -> CellSide {
        self.on
    }
    /// Piece of surface that it lies in: the facet of this number.
    pub fn piece(&self) -> Piece {
        Piece(self.on.cell())
    }
    /// Side that was hit.
    pub fn side(&self) -> Side {
        self.on.side()
    }
}

/// All stored photons and what they came from.
#[derive(Clone, Debug, Default)]
pub struct Traced {
    /// Stored photons.
    pub photons: Vec<Photon>,
    /// Flux of all emitted paths, W.
    pub emitted_flux: Rgb,
    /// Rays shot.
    pub rays: u64,
}

/// The photons that the proxy of these inputs starts from (phase `photons`).
///
/// # Errors
/// [`crate::error::Error::Setting`] for pieces that would not fit memory,
/// [`crate::error::Error::Interrupted`].
pub fn photons(world: &World, inputs: ProxyInputs<'_>, run: &Run) -> Result<Traced> {
    let ProxyInputs { near_cell, settings, seed } = inputs;
    let cells = run.install(|| Cells::new(&world.geometry, &Fineness::of(world, near_cell)))?;
    trace(&Making { world, cells: &cells, settings, seed, run })
}

/// Traces all paths (phase `photons`).
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub(super) fn trace(making: &Making<'_>) -> Result<Traced> {
    let (run, count) = (making.run, making.settings.photons);
    let phase = run.phase("photons", u64::from(count));
    let blocks: Vec<Traced> = run.install(|| {
        (0..count.div_ceil(BLOCK))
            .into_par_iter()
            .map(|block| {
                let mut out = Traced::default();
                if run.cancelled() {
                    return out;
                }
                let range = block * BLOCK..count.min(block.saturating_add(1).saturating_mul(BLOCK));
                let n = range.len() as u64;
                for path in range {
                    follow(making, path, &mut out);
                }
                run.rays.add(RayKind::Photon, out.rays);
                phase.advance(n);
                out
            })
            .collect()
    });
    run.check()?;
    let mut all = Traced {
        photons: Vec::with_capacity(blocks.iter().map(|b| b.photons.len()).sum()),
        ..Traced::default()
    };
    for block in blocks {
        all.photons.extend(block.photons);
        all.emitted_flux += block.emitted_flux;
        all.rays += block.rays;
    }
    Ok(all)
}

fn follow(making: &Making<'_>, path: u32, out: &mut Traced) {
    let Making { world, cells, settings, seed, .. } = *making;
    let sobol = Sobol::new(seed, Stream::Photon, 0);
    let mut rng = Rng::new(seed, Stream::Photon, u64::from(path), 1);
    let Some(emission) = world.lights.emit_photon(
        sobol.sample_1d(path, 0),
        sobol.sample_2d(path, 1),
        sobol.sample_2d(path, 2),
    ) else {
        return;
    };
    let mut flux = emission.flux / settings.photons as f32;
    out.emitted_flux += flux;
    let mut ray = emission.ray;
    let mut stores = emission.from_sky;
    for bounce in 0.. {
        out.rays += 1;
        let Some(s) = world.closest(&ray) else { return };
        let incident = ray.dir.normalize();
        let weight = if s.ns == s.ng {
            1.0
        } else {
            (-incident.dot(s.ns)).max(0.0) / (-incident.dot(s.ng)).max(1e-4)
        };
        flux *= weight.min(MAX_ADJOINT_WEIGHT);
        let before = flux.max_element();
        if before <= 0.0 || !before.is_finite() {
            return;
        }
        if stores {
            let on = CellSide::new(cells.find(s.triangle, s.u, s.v), s.side);
            out.photons.push(Photon::new(s.p, flux, incident, on));
        }
        stores = true;
        let (roulette, direction) = if bounce < STRATIFIED_BOUNCES {
            (sobol.sample_1d(path, 3 + 2 * bounce), sobol.sample_2d(path, 4 + 2 * bounce))
        } else {
            (rng.next_f32(), Vec2::new(rng.next_f32(), rng.next_f32()))
        };
        let survival = ((flux * s.albedo).max_element() / before).min(1.0);
        if roulette >= survival {
            return;
        }
        flux *= s.albedo / survival;
        ray = s.ray(
            Frame::from_normal(s.ng).world_from_local(sample_cosine_hemisphere(direction)),
            world.diagonal,
        );
    }
}
