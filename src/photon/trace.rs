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
//! Inputs  [`World`], count, seed. Output  photons in the order of their paths, flux for the whole
//!         count (already divided by it).
//! Guarantee  bit-identical for any thread count: fixed blocks, ordered. Path i uses Sobol sample i
//!            of one sequence, so any power-of-two prefix of paths is stratified over lights,
//!            places and directions. Cost  about 1/(1 − ρ) rays a path.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::error::Result;
use crate::math::Frame;
use crate::radiometry::Rgb;
use crate::run::{RayKind, Run};
use crate::sampling::{Rng, Sobol, Stream, sample_cosine_hemisphere};
use crate::shading::World;
use crate::tessellate::{CellId, Cells, Side};

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
    /// 2 · cell + side.
    cell_side: u32,
}

impl Photon {
    /// A photon on `side` of `cell`.
    pub fn new(position: Vec3, flux: Rgb, incident: Vec3, cell: CellId, side: Side) -> Self {
        Self { position, flux, incident, cell_side: 2 * cell + side as u32 }
    }
    /// Cell it lies in.
    pub fn cell(&self) -> CellId {
        self.cell_side / 2
    }
    /// Side that was hit.
    pub fn side(&self) -> Side {
        if self.cell_side & 1 == 0 { Side::Front } else { Side::Back }
    }
    /// 2 · cell + side.
    pub fn cell_side(&self) -> usize {
        self.cell_side as usize
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

/// Traces `count` paths (phase `photons`).
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn trace(world: &World, cells: &Cells, count: u32, seed: u64, run: &Run) -> Result<Traced> {
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
                    follow(world, cells, path, count, seed, &mut out);
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

fn follow(world: &World, cells: &Cells, path: u32, count: u32, seed: u64, out: &mut Traced) {
    let sobol = Sobol::new(seed, Stream::Photon, 0);
    let mut rng = Rng::new(seed, Stream::Photon, u64::from(path), 1);
    let Some(emission) = world.lights.emit_photon(
        sobol.sample_1d(path, 0),
        sobol.sample_2d(path, 1),
        sobol.sample_2d(path, 2),
    ) else {
        return;
    };
    let mut flux = emission.flux / count as f32;
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
            out.photons.push(Photon::new(
                s.p,
                flux,
                incident,
                cells.find(s.triangle, s.u, s.v),
                s.side,
            ));
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
