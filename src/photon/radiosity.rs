//! Radiosity of every cell and side.
//!
//! * direct: `direct_samples` stratified points of the cell, one shadow ray each, albedo looked up
//!   at each point.
//! * indirect, `estimate = "cells"`: photons on the side over its existing area; with fewer than
//!   `neighbours` photons the region is the smallest of doubling radii around the patch of the cell
//!   (patches of agreeing cell sides, weight 1 − d²/r² on flux and area alike) that has enough, at
//!   most `max_radius`. Flux is only ever divided by the area of the same cells, so no energy is
//!   lost where surface ends or is finely broken.
//! * indirect, `estimate = "gather"`: as `cells` first; then, on every side the picture can see,
//!   see [`super::gather`].
//! * indirect, `estimate = "density"`: [`PhotonMap::irradiance`] at the centroid.
//!
//! For a new view [`extend`] gathers what only that view reaches; nothing that was gathered before
//! changes.
//!
//! Back sides of `one_sided` cells and black cells are skipped: zero. Values are per existing area:
//! a masked cell's mean over its polygon is value · coverage.
//! Cost  `direct_samples` shadow rays and one region query per cell side; fixed blocks in parallel.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::gather::{Landing, Links};
use super::patches::Patches;
use super::surface_index::SurfaceIndex;
use super::{Estimate, PhotonMap, ProxySettings, trace};
use crate::error::Result;
use crate::radiometry::Rgb;
use crate::run::{RayKind, Run};
use crate::sampling::{Sobol, Stream, sample_triangle};
use crate::scene::Camera;
use crate::shading::{World, direct_irradiance};
use crate::tessellate::{CellId, Cells, Masks, Side};

const BLOCK: usize = 256;
/// First radius as a fraction of that which would hold the wanted photons if they were spread
/// evenly.
const FIRST_RADIUS: f32 = 0.35;

/// Light leaving every cell, emission left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellRadiosity {
    /// Radiosity of the fronts, W·m⁻², per existing area.
    pub front: Vec<Rgb>,
    /// Radiosity of the backs.
    pub back: Vec<Rgb>,
    /// Indirect irradiance of the fronts, W·m⁻² (zero where skipped).
    pub indirect_front: Vec<Rgb>,
    /// Indirect irradiance of the backs.
    pub indirect_back: Vec<Rgb>,
    /// Fraction of every cell that exists; empty when nothing is masked.
    pub coverage: Vec<f32>,
    /// Sides whose irradiance was gathered, by 2 · cell + side; the others were never seen. Empty
    /// for other estimates than `gather`.
    pub gathered: Vec<bool>,
}

impl CellRadiosity {
    /// Radiosity of a side, W·m⁻² per existing area; radiance is this / π.
    pub fn get(&self, cell: CellId, side: Side) -> Rgb {
        match side {
            Side::Front => self.front[cell as usize],
            Side::Back => self.back[cell as usize],
        }
    }
    /// Indirect irradiance of a side, W·m⁻².
    pub fn indirect(&self, cell: CellId, side: Side) -> Rgb {
        match side {
            Side::Front => self.indirect_front[cell as usize],
            Side::Back => self.indirect_back[cell as usize],
        }
    }
    /// Fraction of a cell that exists.
    pub fn coverage(&self, cell: CellId) -> f32 {
        self.coverage.get(cell as usize).copied().unwrap_or(1.0)
    }
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.front.len()
    }
    /// True without cells.
    pub fn is_empty(&self) -> bool {
        self.front.is_empty()
    }
}

/// What the proxy was made of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProxyStats {
    /// Emitted paths.
    pub paths: u32,
    /// Stored photons.
    pub photons: usize,
    /// Emitted flux, W.
    pub emitted_flux: Rgb,
    /// Stored flux, W.
    pub stored_flux: Rgb,
    /// Cells.
    pub cells: usize,
    /// Cell sides that were computed.
    pub sides: usize,
    /// Cell sides whose estimate rests on fewer photons than asked for (`cells` only).
    pub starved: usize,
    /// Cell sides whose irradiance was gathered (`gather` only).
    pub gathered: usize,
    /// Sweeps over them.
    pub sweeps: u32,
    /// Relative change of irradiance in the last sweep.
    pub residual: f32,
}

/// Points of a cell that serve direct light, albedo and coverage.
const COVERAGE_POINTS: u32 = 16;

struct Points<'a> {
    world: &'a World,
    cells: &'a Cells,
    masks: Option<Masks<'a>>,
    seed: u64,
}

impl Points<'_> {
    fn sobol(&self, cell: CellId) -> Sobol {
        Sobol::new(self.seed, Stream::Cell, u64::from(cell))
    }
    /// Point `i` of a cell as barycentrics (u, v) of its triangle.
    fn barycentrics(&self, cell: CellId, sobol: &Sobol, i: u32) -> Vec2 {
        let b = sample_triangle(sobol.sample_2d(i, 0));
        let [p, q, r] = self.cells.corners[cell as usize];
        let x = p * (1.0 - b.x - b.y) + q * b.x + r * b.y;
        let [v0, v1, v2] =
            self.world.geometry.corners(self.cells.triangle_of[cell as usize]).map(Vec3::as_dvec3);
        let n = (v1 - v0).cross(v2 - v0);
        let d = x.as_dvec3() - v0;
        let (u, v) = (
            d.cross(v2 - v0).dot(n) / n.length_squared(),
            (v1 - v0).cross(d).dot(n) / n.length_squared(),
        );
        Vec2::new(u.clamp(0.0, 1.0) as f32, v.clamp(0.0, 1.0) as f32)
    }
    fn exists(&self, cell: CellId, b: Vec2) -> bool {
        self.masks
            .as_ref()
            .is_none_or(|m| m.exists(self.cells.triangle_of[cell as usize], b.x, b.y))
    }
    /// ⟨ρ E_direct⟩ and ⟨ρ⟩ of a side by `count` points, `landings` in turn or, without any,
    /// stratified over the cell; and the shadow rays shot. None where no point exists.
    fn reflected(
        &self,
        cell: CellId,
        side: Side,
        landings: &[Landing],
        count: u32,
    ) -> (Option<[Rgb; 2]>, u64) {
        let triangle = self.cells.triangle_of[cell as usize];
        let sobol = self.sobol(cell);
        let sign = if side == Side::Front { 1.0 } else { -1.0 };
        let (mut direct, mut albedo, mut found, mut shot) = (Rgb::ZERO, Rgb::ZERO, 0, 0);
        for i in 0..count {
            let b = match landings {
                [] => self.barycentrics(cell, &sobol, i),
                _ => Vec2::new(
                    landings[i as usize % landings.len()].u,
                    landings[i as usize % landings.len()].v,
                ),
            };
            if !self.exists(cell, b) {
                continue;
            }
            let s = self.world.geometry.surface(triangle, b.x, b.y);
            let pairs = 1 + 2 * side as u32;
            let mut sample = |_: u32| (sobol.sample_1d(i, pairs), sobol.sample_2d(i, pairs + 1));
            let (e, rays) =
                direct_irradiance(self.world, s.p, s.ng * sign, s.ns * sign, 1, &mut sample);
            direct += e * s.albedo;
            albedo += s.albedo;
            found += 1;
            shot += rays;
        }
        ((found > 0).then(|| [direct / found as f32, albedo / found as f32]), shot)
    }
    fn coverage(&self, cell: CellId) -> f32 {
        let sobol = self.sobol(cell);
        (0..COVERAGE_POINTS)
            .filter(|&i| self.exists(cell, self.barycentrics(cell, &sobol, i)))
            .count() as f32
            / COVERAGE_POINTS as f32
    }
}

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

struct Solver<'a> {
    points: Points<'a>,
    settings: &'a ProxySettings,
    index: SurfaceIndex<'a>,
    /// Only for the density estimate.
    map: Option<PhotonMap>,
    /// Irradiance of the finest patches and whether it rests on enough photons.
    estimates: Vec<(Rgb, bool)>,
    /// Patch by 2 · cell + side.
    estimate_of: Vec<u32>,
    /// Largest radius, scene units.
    cap: f32,
    /// Sides that the picture can see; only for the gather.
    links: Option<Links>,
}

impl Solver<'_> {
    fn indirect(&self, cell: CellId, side: Side, scratch: &mut Vec<(f32, u32)>) -> (Rgb, bool) {
        let (p, n) = (self.points.cells.centroids[cell as usize], self.index.normal(cell, side));
        if let Some(map) = &self.map {
            return (map.irradiance(&self.index, p, n, self.settings, self.cap, scratch), false);
        }
        let k = self.settings.neighbours;
        let own = self.index.own(cell, side);
        if own.photons >= k && own.area > 0.0 {
            return (own.flux / own.area, false);
        }
        let (e, enough) =
            self.estimates[self.estimate_of[2 * cell as usize + side as usize] as usize];
        (e, !enough)
    }

    fn cell(&self, cell: CellId, scratch: &mut Vec<(f32, u32)>) -> Solved {
        let mut out = Solved::default();
        let Points { world, cells, .. } = self.points;
        let triangle = cells.triangle_of[cell as usize];
        let material = world.geometry.material(triangle);
        if material.albedo.max_element() <= 0.0 {
            return out;
        }
        for side in [Side::Front, Side::Back] {
            if side == Side::Back && cells.one_sided[cell as usize] {
                continue;
            }
            let landings = self.links.as_ref().map(|l| l.landings(2 * cell + side as u32));
            let count = if landings.is_some_and(<[_]>::is_empty) {
                1
            } else {
                self.settings.direct_samples
            };
            let (reflected, rays) =
                self.points.reflected(cell, side, landings.unwrap_or_default(), count);
            out.rays += rays;
            let Some([direct, albedo]) = reflected else { continue };
            let (indirect, starved) = self.indirect(cell, side, scratch);
            out.direct[side as usize] = direct;
            out.albedo[side as usize] = albedo;
            out.indirect[side as usize] = indirect;
            out.sides += 1;
            out.starved += u32::from(starved);
        }
        out
    }
}

/// What reflects and can be seen, by 2 · cell + side.
fn live<'a>(world: &'a World, cells: &'a Cells) -> impl Fn(u32) -> bool + Sync + 'a {
    move |side: u32| {
        let cell = side / 2;
        let albedo = world.geometry.material(cells.triangle_of[cell as usize]).albedo;
        albedo.max_element() > 0.0 && (side & 1 == 0 || !cells.one_sided[cell as usize])
    }
}

/// What an extension added.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extended {
    /// Sides gathered.
    pub sides: usize,
    /// Sweeps over them.
    pub sweeps: u32,
    /// Relative change of irradiance in the last sweep.
    pub residual: f32,
}

/// Gathers the sides that only `views` reach (phase `gather`). What was gathered before stays as it
/// is, bit for bit, and lights the new sides; radiosity by other estimates than `gather` is whole
/// already.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn extend(
    world: &World,
    cells: &Cells,
    radiosity: &mut CellRadiosity,
    settings: &ProxySettings,
    views: &[Camera],
    seed: u64,
    run: &Run,
) -> Result<Extended> {
    if settings.estimate != Estimate::Gather || radiosity.gathered.len() != 2 * cells.len() {
        return Ok(Extended::default());
    }
    let phase = run.phase("gather", 2 * cells.len() as u64);
    let links = Links::new(
        world,
        cells,
        settings,
        views,
        radiosity.gathered.clone(),
        &live(world, cells),
        seed,
        run,
        &phase,
    )?;
    if links.len() == 0 {
        return Ok(Extended::default());
    }
    let points = Points { world, cells, masks: world.geometry.masks(), seed };
    let place = |side: u32| (side / 2, if side & 1 == 0 { Side::Front } else { Side::Back });
    // Sides of before as sources of fixed radiosity: they reflect nothing more.
    let every = |of: &dyn Fn(u32, Side) -> Rgb| -> Vec<Rgb> {
        (0..2 * cells.len() as u32).map(place).map(|(cell, side)| of(cell, side)).collect()
    };
    let (mut direct, mut indirect) =
        (every(&|c, s| radiosity.get(c, s)), every(&|c, s| radiosity.indirect(c, s)));
    let mut albedo = vec![Rgb::ZERO; direct.len()];
    let reflected: Vec<_> = run.install(|| {
        links
            .sides()
            .par_iter()
            .with_min_len(BLOCK)
            .map(|&side| {
                let (cell, face) = place(side);
                points.reflected(cell, face, links.landings(side), settings.direct_samples)
            })
            .collect()
    });
    run.check()?;
    run.rays.add(RayKind::Shadow, reflected.iter().map(|r| r.1).sum());
    for (&side, (found, _)) in links.sides().iter().zip(&reflected) {
        [direct[side as usize], albedo[side as usize]] = found.unwrap_or_default();
    }
    let swept = links.solve(
        &direct,
        &albedo,
        &mut indirect,
        world.lights.sky.constant,
        settings.gather_sweeps,
        run,
    )?;
    for &side in links.sides() {
        let (cell, face) = place(side);
        let (b, e) = match face {
            Side::Front => (&mut radiosity.front, &mut radiosity.indirect_front),
            Side::Back => (&mut radiosity.back, &mut radiosity.indirect_back),
        };
        e[cell as usize] = indirect[side as usize];
        b[cell as usize] = direct[side as usize] + albedo[side as usize] * indirect[side as usize];
    }
    let sides = links.len();
    radiosity.gathered = links.reached();
    Ok(Extended { sides, sweeps: swept.sweeps, residual: swept.residual })
}

/// Traces photons (phase `photons`) and computes the radiosity of every cell (phase `cells`), as
/// the world's camera needs it.
///
/// # Errors
/// [`crate::error::Error::Setting`] for settings out of range,
/// [`crate::error::Error::Interrupted`].
pub fn solve(
    world: &World,
    cells: &Cells,
    settings: &ProxySettings,
    seed: u64,
    run: &Run,
) -> Result<(CellRadiosity, ProxyStats)> {
    solve_for(world, cells, settings, std::slice::from_ref(&world.camera), seed, run)
}

/// As [`solve`], for all of `views` at once.
///
/// # Errors
/// As [`solve`].
pub fn solve_for(
    world: &World,
    cells: &Cells,
    settings: &ProxySettings,
    views: &[Camera],
    seed: u64,
    run: &Run,
) -> Result<(CellRadiosity, ProxyStats)> {
    settings.validate()?;
    let traced = trace(world, cells, settings.photons, seed, run)?;
    let links = if settings.estimate == Estimate::Gather {
        let phase = run.phase("gather", 2 * cells.len() as u64);
        Some(Links::new(
            world,
            cells,
            settings,
            views,
            vec![false; 2 * cells.len()],
            &live(world, cells),
            seed,
            run,
            &phase,
        )?)
    } else {
        None
    };
    let phase = run.phase("cells", cells.len() as u64);
    let mut stats = ProxyStats {
        paths: settings.photons,
        photons: traced.photons.len(),
        emitted_flux: traced.emitted_flux,
        stored_flux: traced
            .photons
            .iter()
            .map(|p| p.flux.as_dvec3())
            .sum::<glam::DVec3>()
            .as_vec3(),
        cells: cells.len(),
        ..ProxyStats::default()
    };
    let masks = world.geometry.masks();
    let points = Points { world, cells, masks, seed };
    let coverage: Vec<f32> = if masks.is_some() {
        run.install(|| {
            (0..cells.len() as u32).into_par_iter().map(|c| points.coverage(c)).collect()
        })
    } else {
        Vec::new()
    };
    let area: Vec<f32> = (0..cells.len() as u32)
        .map(|c| cells.area(c) * coverage.get(c as usize).unwrap_or(&1.0))
        .collect();
    let whole: f64 = area.iter().map(|&a| f64::from(a)).sum();
    let cap = settings.max_radius.resolve(world.diagonal);
    let even = (whole * f64::from(settings.neighbours)
        / (std::f64::consts::PI * traced.photons.len().max(1) as f64))
        .sqrt() as f32;
    let first_radius = (even * FIRST_RADIUS).clamp(cap / 32.0, cap);
    let solver = run.install(|| {
        let index = SurfaceIndex::new(
            &world.geometry,
            cells,
            area,
            &traced.photons,
            settings.normal_agreement,
        );
        let density = settings.estimate == Estimate::Density;
        let (mut estimates, mut estimate_of) = (Vec::new(), Vec::new());
        if !density {
            let (sides, side_index) = index.sides();
            let patches = Patches::new(&sides, first_radius, cap);
            estimates = patches
                .finest()
                .par_iter()
                .map(|p| patches.irradiance(p, settings.neighbours, settings.normal_agreement))
                .collect();
            estimate_of = vec![0; 2 * cells.len()];
            for (&side, &patch) in side_index.iter().zip(&patches.patch_of_side) {
                estimate_of[side] = patch;
            }
        }
        Solver {
            index,
            map: density.then(|| PhotonMap::new(traced.photons)),
            estimates,
            estimate_of,
            points,
            settings,
            cap,
            links,
        }
    });
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
                let out: Vec<Solved> =
                    range.map(|c| solver.cell(c as CellId, &mut scratch)).collect();
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
    let (direct, albedo, mut indirect) =
        (flat(&|s| s.direct), flat(&|s| s.albedo), flat(&|s| s.indirect));
    for s in solved.iter().flatten() {
        stats.sides += s.sides as usize;
        stats.starved += s.starved as usize;
    }
    if let Some(links) = &solver.links {
        let _phase = run.phase("gather", 1);
        let swept = links.solve(
            &direct,
            &albedo,
            &mut indirect,
            world.lights.sky.constant,
            settings.gather_sweeps,
            run,
        )?;
        (stats.gathered, stats.sweeps, stats.residual) =
            (links.len(), swept.sweeps, swept.residual);
    }
    let every = |side: usize, of: &dyn Fn(usize) -> Rgb| {
        (side..2 * cells.len()).step_by(2).map(of).collect::<Vec<_>>()
    };
    let leaving = |i: usize| direct[i] + albedo[i] * indirect[i];
    let radiosity = CellRadiosity {
        front: every(0, &leaving),
        back: every(1, &leaving),
        indirect_front: every(0, &|i| indirect[i]),
        indirect_back: every(1, &|i| indirect[i]),
        coverage,
        gathered: solver.links.map_or_else(Vec::new, |links| links.reached()),
    };
    Ok((radiosity, stats))
}
