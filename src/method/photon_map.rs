//! `--method photon-map`: the proxy itself, seen directly.
//!
//! Every pixel shows the mean over its samples of `L = Le + B / π` of the cell side hit, or the
//! background: what a far ray of the decomposition sees, emission added. Cells show as facets,
//! photon noise as blotches. Layers: beauty, `irradiance` (indirect, W·m⁻²), `albedo`, `cell.id`
//! (at the pixel centre, −1 for background). Radii are not chosen here: `proxy.max_radius` caps
//! them; `proxy/density.rs` takes that of the k-th photon, `proxy/solve.rs` doubles its own.

use std::path::Path;

use rayon::prelude::*;
use serde::Serialize;

use super::locations::Locations;
use super::stage::Inputs;
use super::{MethodStatistics, Rendered};
use crate::error::Result;
use crate::film::{Film, Layer, layer};
use crate::math::Ray;
use crate::ply::{self, Columns};
use crate::proxy::{Landing, Need, Proxy, ProxyInputs, photons};
use crate::radiometry::Rgb;
use crate::run::{RayKind, Run};
use crate::sampling::{Sobol, Stream};
use crate::shading::World;
use crate::tessellate::Side;

const CELL: Layer =
    Layer::one("cell", "id", "cell at the centre of the pixel; −1 where there is none");

/// Layers of the picture.
pub const LAYERS: [Layer; 3] = [layer::IRRADIANCE, layer::ALBEDO, CELL];

/// What is told of the proxy's picture.
#[derive(Clone, Debug, Serialize)]
pub struct PhotonMapStatistics {
    /// Pieces of surfaces.
    pub cells: usize,
    /// Stored photons.
    pub photons: usize,
    /// Emitted paths.
    pub photon_paths: u32,
    /// Sides of cells that were computed.
    pub cell_sides: usize,
    /// Those of them that rest on fewer photons than asked for.
    pub starved_cell_sides: usize,
}

/// Renders the proxy with the camera samples of `inputs`.
///
/// # Errors
/// For settings out of range, [`crate::error::Error::Interrupted`].
pub fn render(world: &World, inputs: Inputs<'_>, run: &Run) -> Result<Rendered> {
    let Inputs { record, seed, .. } = inputs;
    let views = std::slice::from_ref(&world.camera);
    let proxy = Proxy::new(world, inputs.proxy(), Need::Views(views), run)?;
    let (width, height) = (world.camera.width, world.camera.height);
    let (spp, filter) = (record.spp.max(1), record.pixel_filter());
    let phase = run.phase("reconstruct", u64::from(height));
    let rows: Vec<Vec<[Rgb; 3]>> = run.install(|| {
        (0..height)
            .into_par_iter()
            .map(|y| {
                if run.cancelled() {
                    return Vec::new();
                }
                let row = (0..width)
                    .map(|x| {
                        let sobol = Sobol::new(
                            seed,
                            Stream::Camera,
                            u64::from(y) * u64::from(width) + u64::from(x),
                        );
                        let mut sum = [Rgb::ZERO; 3];
                        for i in 0..spp {
                            let pixel = glam::Vec2::new(x as f32, y as f32)
                                + filter.position(sobol.sample_2d(i, 0));
                            let dir = world.camera.direction(pixel);
                            let Some(s) = world.closest(&Ray::new(world.camera.eye, dir)) else {
                                sum[0] += world.lights.background(dir);
                                continue;
                            };
                            let light = proxy.read(world, &Landing::from(&s));
                            sum[0] += s.le + light.radiosity / std::f32::consts::PI;
                            sum[1] += light.indirect;
                            sum[2] += s.albedo;
                        }
                        sum.map(|c| c / spp as f32)
                    })
                    .collect();
                run.rays.add(RayKind::Primary, u64::from(width * spp));
                phase.advance(1);
                row
            })
            .collect()
    });
    run.check()?;
    let pixels: Vec<[Rgb; 3]> = rows.into_iter().flatten().collect();
    let mut film = Film::new(width, height);
    for (i, layer) in ["", "irradiance", "albedo"].into_iter().enumerate() {
        film.set_rgb(layer, &pixels.iter().map(|p| p[i]).collect::<Vec<_>>());
    }
    let ids = run.install(|| {
        (0..width * height)
            .into_par_iter()
            .map(|i| {
                let pixel = glam::Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
                let ray = Ray::new(world.camera.eye, world.camera.direction(pixel));
                let piece = |s| proxy.read(world, &Landing::from(&s)).piece;
                world.closest(&ray).map_or(-1.0, |s| piece(s).number() as f32)
            })
            .collect()
    });
    film.set("cell.id", ids);
    let stats = proxy.stats();
    let statistics = MethodStatistics::PhotonMap(PhotonMapStatistics {
        cells: stats.cells,
        photons: stats.photons,
        photon_paths: stats.paths,
        cell_sides: stats.sides,
        starved_cell_sides: stats.starved,
    });
    Ok(Rendered { film, statistics, locations: Locations::default() })
}

/// Traces the photons of [`render`] again, the same for the same seed, and writes them as binary
/// PLY: `x y z`, the direction they travelled in (`incident_x incident_y incident_z`), their share
/// of the flux in W (`flux_r flux_g flux_b`), `cell` and `back` (1 where they hit the back of it),
/// and `red green blue` for viewers.
///
/// # Errors
/// [`crate::error::Error::Io`] when the system refuses, [`crate::error::Error::Interrupted`], cells
/// that do not fit memory.
pub fn write_photons(world: &World, inputs: ProxyInputs<'_>, path: &Path, run: &Run) -> Result<()> {
    let photons = photons(world, inputs, run)?.photons;
    let scale = ply::colour_scale(photons.iter().map(|p| p.flux));
    let columns = Columns::new("vertex")
        .floats(["x", "y", "z", "incident_x", "incident_y", "incident_z"])
        .floats(["flux_r", "flux_g", "flux_b"])
        .integers(["cell"])
        .bytes(["back", "red", "green", "blue"]);
    let comments = ["nearfar photons", "flux in W, its share of all paths"].map(str::to_owned);
    ply::write(path, &comments, &[(columns, photons.len())], |out| {
        for p in &photons {
            out.floats(p.position.to_array())?;
            out.floats(p.incident.to_array())?;
            out.floats(p.flux.to_array())?;
            out.integer(p.piece().number())?;
            out.bytes(&[u8::from(p.side() == Side::Back)])?;
            out.bytes(&ply::colour(p.flux, scale))?;
        }
        Ok(())
    })
}
