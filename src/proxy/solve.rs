//! Radiosity of every cell side, solved once and extended by need.
//!
//! Direct light and albedo come from [`CellPoints::reflected`]. Indirect irradiance depends on the
//! estimate:
//!
//! * `cells`: photons on the side over its existing area; with fewer than `neighbours` photons the
//!   region is the smallest of doubling radii around the patch of the cell (patches of agreeing
//!   cell sides, weight 1 − d²/r² on flux and area alike) that has enough, at most `max_radius`.
//!   Flux is only ever divided by the area of the same cells, so no energy is lost where surface
//!   ends or is finely broken.
//! * `gather`: as `cells` first; then, on every side that is needed, by [`super::links`].
//! * `density`: [`PhotonMap::irradiance`] at the centroid.
//!
//! [`extend`] gathers what is needed besides; nothing that was gathered before changes.
//!
//! Back sides of one-sided cells and black cells are skipped: zero. Values are per existing area:
//! a masked cell's mean over its polygon is its value times its coverage. The cost is
//! `direct_samples` shadow rays and one region query per cell side, in fixed blocks in parallel.

use rayon::prelude::*;

use super::cell_side::CellSide;
use super::cells::CellId;
use super::density::PhotonMap;
use super::links::{Links, System};
use super::making::Making;
use super::patches::Patches;
use super::radiosity::CellRadiosity;
use super::reflected::CellPoints;
use super::surface_index::SurfaceIndex;
use super::trace::{Photon, trace};
use super::{Added, Estimate, Need, ProxyStats};
use crate::error::Result;
use crate::radiometry::Rgb;
use crate::run::RayKind;
use crate::tessellate::Side;

const BLOCK: usize = 256;
/// First radius as a fraction of that which would hold the wanted photons if they were spread
/// evenly.
const FIRST_RADIUS: f32 = 0.35;

#[derive(Clone, Copy, Default)]
struct Solved {
    /// ⟨ρ E_direct⟩.
    direct: [Rgb; 2],
    /// ⟨ρ⟩.
    albedo: [Rgb; 2],
    indirect: [Rgb; 2],
    sides: u32,
    starved: u32,
    rays: u64,
}

/// Irradiance that the photons tell of.
struct FromPhotons<'a> {
    making: Making<'a>,
    index: SurfaceIndex<'a>,
    /// Largest radius, scene units.
    cap: f32,
    /// Only for the density estimate.
    map: Option<PhotonMap>,
    /// Irradiance of the finest patches and whether it rests on enough photons.
    estimates: Vec<(Rgb, bool)>,
    /// Patch by [`CellSide::index`].
    estimate_of: Vec<u32>,
}

impl<'a> FromPhotons<'a> {
    /// Call inside the thread pool.
    fn new(making: Making<'a>, photons: Vec<Photon>, coverage: &[f32]) -> Self {
        let Making { world, cells, settings, .. } = making;
        let area: Vec<f32> = (0..cells.len() as u32)
            .map(|c| cells.area(c) * coverage.get(c as usize).unwrap_or(&1.0))
            .collect();
        let whole: f64 = area.iter().map(|&a| f64::from(a)).sum();
        let cap = settings.max_radius.resolve(world.around.extent);
        let even = (whole * f64::from(settings.neighbours)
            / (std::f64::consts::PI * photons.len().max(1) as f64))
            .sqrt() as f32;
        let first_radius = (even * FIRST_RADIUS).clamp(cap / 32.0, cap);
        let agreement = settings.normal_agreement;
        let index = SurfaceIndex::new(&world.geometry, cells, area, &photons, agreement);
        let (mut estimates, mut estimate_of) = (Vec::new(), Vec::new());
        let map = match settings.estimate() {
            Estimate::Density => Some(PhotonMap::new(photons)),
            Estimate::Cells | Estimate::Gather | Estimate::Places => {
                let (sides, side_index) = index.sides();
                let patches = Patches::new(&sides, first_radius, cap);
                estimates = patches
                    .finest()
                    .par_iter()
                    .map(|p| patches.irradiance(p, settings.neighbours, agreement))
                    .collect();
                estimate_of = vec![0; 2 * cells.len()];
                for (side, &patch) in side_index.iter().zip(&patches.patch_of_side) {
                    estimate_of[side.index()] = patch;
                }
                None
            }
        };
        Self { making, index, cap, map, estimates, estimate_of }
    }

    /// Indirect irradiance of a side, and whether it rests on too few photons.
    fn irradiance(&self, at: CellSide, scratch: &mut Vec<(f32, u32)>) -> (Rgb, bool) {
        let Making { cells, settings, .. } = self.making;
        if let Some(map) = &self.map {
            let (p, n) = (cells.centroids[at.cell() as usize], self.index.normal(at));
            return (map.irradiance(&self.index, p, n, settings, self.cap, scratch), false);
        }
        let own = self.index.own(at);
        if own.photons >= settings.neighbours && own.area > 0.0 {
            return (own.flux / own.area, false);
        }
        // Surfaces without area have no patches.
        let estimate = self.estimates.get(self.estimate_of[at.index()] as usize);
        let (e, enough) = estimate.copied().unwrap_or_default();
        (e, !enough)
    }

    /// Both sides of a cell; direct light where `links` says that rays arrived.
    fn cell(
        &self,
        cell: CellId,
        points: &CellPoints<'_>,
        links: Option<&Links>,
        scratch: &mut Vec<(f32, u32)>,
    ) -> Solved {
        let mut out = Solved::default();
        for side in Side::BOTH {
            let at = CellSide::new(cell, side);
            if !self.making.reflects(at) {
                continue;
            }
            let arrivals = links.map(|l| l.arrivals(at));
            let unseen = arrivals.is_some_and(<[_]>::is_empty);
            let count = if unseen { 1 } else { self.making.settings.direct_samples };
            let (reflected, rays) = points.reflected(at, arrivals.unwrap_or_default(), count);
            out.rays += rays;
            let Some(reflected) = reflected else { continue };
            let (indirect, starved) = self.irradiance(at, scratch);
            out.direct[side as usize] = reflected.direct;
            out.albedo[side as usize] = reflected.albedo;
            out.indirect[side as usize] = indirect;
            out.sides += 1;
            out.starved += u32::from(starved);
        }
        out
    }
}

/// Traces photons (phase `photons`), shoots the links that `need` asks for (phase `gather`) and
/// computes the radiosity of every cell (phase `cells`).
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub(super) fn solve(making: Making<'_>, need: Need<'_>) -> Result<(CellRadiosity, ProxyStats)> {
    let Making { world, cells, settings, run, .. } = making;
    let traced = trace(&making)?;
    let links = match settings.estimate() {
        Estimate::Gather => Some(Links::new(&making, need, vec![false; 2 * cells.len()])?),
        Estimate::Cells | Estimate::Density | Estimate::Places => None,
    };
    let phase = run.phase("cells", cells.len() as u64);
    let stored = traced.photons.iter().map(|p| p.flux.as_dvec3()).sum::<glam::DVec3>();
    let mut stats = ProxyStats {
        paths: settings.photons,
        photons: traced.photons.len(),
        emitted_flux: traced.emitted_flux,
        stored_flux: stored.as_vec3(),
        cells: cells.len(),
        ..ProxyStats::default()
    };
    let points = CellPoints::new(&making);
    let coverage = run.install(|| points.coverage());
    let photons = run.install(|| FromPhotons::new(making, traced.photons, &coverage));
    let solved: Vec<Vec<Solved>> = run.install(|| {
        (0..cells.len().div_ceil(BLOCK))
            .into_par_iter()
            .map(|block| {
                if run.cancelled() {
                    return Vec::new();
                }
                let range = block * BLOCK..cells.len().min((block + 1) * BLOCK);
                let n = range.len() as u64;
                let mut scratch = Vec::new();
                let out: Vec<Solved> = range
                    .map(|c| photons.cell(c as CellId, &points, links.as_ref(), &mut scratch))
                    .collect();
                run.rays.add(RayKind::Shadow, out.iter().map(|s| s.rays).sum());
                phase.advance(n);
                out
            })
            .collect()
    });
    run.check()?;
    drop(phase);
    let flat = |pick: &dyn Fn(&Solved) -> [Rgb; 2]| -> Vec<Rgb> {
        solved.iter().flatten().flat_map(pick).collect()
    };
    let mut system = System {
        direct: flat(&|s| s.direct),
        albedo: flat(&|s| s.albedo),
        indirect: flat(&|s| s.indirect),
    };
    for s in solved.iter().flatten() {
        stats.sides += s.sides as usize;
        stats.starved += s.starved as usize;
    }
    if let Some(links) = &links {
        let _phase = run.phase("gather", 1);
        let sky = world.lights.sky.constant;
        let swept = links.solve(&mut system, sky, settings.gather_sweeps, run)?;
        (stats.gathered, stats.sweeps, stats.residual) =
            (links.sides().len(), swept.sweeps, swept.residual);
    }
    let light = CellRadiosity {
        leaving: (0..2 * cells.len()).map(|i| system.leaving(i)).collect(),
        indirect: system.indirect,
        coverage,
        gathered: links.map_or_else(Vec::new, |links| links.reached()),
    };
    Ok((light, stats))
}

/// Gathers the sides that `need` reaches and no need before did (phase `gather`). What was gathered
/// stays as it is, bit for bit, and lights the new sides; radiosity by other estimates than
/// `gather` is whole already.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub(super) fn extend(
    making: Making<'_>,
    light: &mut CellRadiosity,
    need: Need<'_>,
) -> Result<Added> {
    let Making { world, cells, settings, run, .. } = making;
    if settings.estimate() != Estimate::Gather || light.gathered.len() != 2 * cells.len() {
        return Ok(Added::default());
    }
    let links = Links::new(&making, need, light.gathered.clone())?;
    if links.sides().is_empty() {
        return Ok(Added::default());
    }
    let points = CellPoints::new(&making);
    let reflected: Vec<_> = run.install(|| {
        links
            .sides()
            .par_iter()
            .with_min_len(BLOCK)
            .map(|&at| points.reflected(at, links.arrivals(at), settings.direct_samples))
            .collect()
    });
    run.check()?;
    run.rays.add(RayKind::Shadow, reflected.iter().map(|r| r.1).sum());
    // Sides of before are sources of fixed radiosity: they reflect nothing more.
    let mut system = System {
        direct: light.leaving.clone(),
        albedo: vec![Rgb::ZERO; light.leaving.len()],
        indirect: light.indirect.clone(),
    };
    for (side, (found, _)) in links.sides().iter().zip(reflected) {
        let (direct, albedo) = found.map_or_else(Default::default, |r| (r.direct, r.albedo));
        (system.direct[side.index()], system.albedo[side.index()]) = (direct, albedo);
    }
    let sky = world.lights.sky.constant;
    let swept = links.solve(&mut system, sky, settings.gather_sweeps, run)?;
    for side in links.sides() {
        let i = side.index();
        light.indirect[i] = system.indirect[i];
        light.leaving[i] = system.leaving(i);
    }
    light.gathered = links.reached();
    Ok(Added { sides: links.sides().len(), sweeps: swept.sweeps, residual: swept.residual })
}
