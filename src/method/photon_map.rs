//! `--method photon-map`: the proxy itself, seen directly.
//!
//! Every pixel shows the mean over its samples of `L = Le + B / π` of the cell side hit, or the
//! background: what a far ray of the decomposition sees, emission added. Cells show as facets,
//! photon noise as blotches. Layers: beauty, `irradiance` (indirect, W·m⁻²), `albedo`, and what is
//! at the pixel's centre: `cell.id`, and of places (`proxy.estimate = "places"`) their size, direct
//! and indirect irradiance and age. Radii are not chosen here: `proxy.max_radius` caps
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
use crate::proxy::{Landing, Need, Piece, Proxy, ProxyInputs, ShownPlace, photons};
use crate::radiometry::Rgb;
use crate::run::{RayKind, Run};
use crate::sampling::{Sobol, Stream};
use crate::shading::World;
use crate::tessellate::Side;

const CELL: Layer =
    Layer::one("cell", "id", "cell, or part of a place, at the pixel's centre; −1 for none");
const PLACE_SIZE: Layer =
    Layer::alone("place_size", "size of the place at the pixel's centre; 0 where there is none");
const PLACE_AGE: Layer =
    Layer::alone("place_age", "needs since that place was made; −1 where there is none");
const PLACE_DIRECT: Layer = Layer::rgb("place_direct", "direct irradiance of that place, W/m²");
const PLACE_INDIRECT: Layer =
    Layer::rgb("place_indirect", "indirect irradiance of that place, W/m²");

/// Layers of the picture.
pub const LAYERS: [Layer; 7] =
    [layer::IRRADIANCE, layer::ALBEDO, CELL, PLACE_SIZE, PLACE_AGE, PLACE_DIRECT, PLACE_INDIRECT];

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
    let look = |x: u32, y: u32| {
        let element = u64::from(y) * u64::from(width) + u64::from(x);
        let sobol = Sobol::new(seed, Stream::Camera, element);
        let mut sum = [Rgb::ZERO; 3];
        for i in 0..spp {
            let pixel =
                glam::Vec2::new(x as f32, y as f32) + filter.position(sobol.sample_2d(i, 0));
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
    };
    let row = |y: usize| -> Vec<[Rgb; 3]> {
        run.rays.add(RayKind::Primary, u64::from(width * spp));
        (0..width).map(|x| look(x, y as u32)).collect()
    };
    let rows = phase.blocks((height as usize, 1), (), |(), rows| rows.map(row).collect())?;
    let pixels: Vec<[Rgb; 3]> = rows.concat();
    let mut film = Film::new(width, height);
    for (i, layer) in ["", "irradiance", "albedo"].into_iter().enumerate() {
        film.set_rgb(layer, &pixels.iter().map(|p| p[i]).collect::<Vec<_>>());
    }
    show_pieces(&mut film, world, &proxy, run);
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

/// The layers that tell of the piece at the centre of each pixel.
fn show_pieces(film: &mut Film, world: &World, proxy: &Proxy, run: &Run) {
    let (width, height) = (film.width, film.height);
    let piece = |i: u32| {
        let pixel = glam::Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        let ray = Ray::new(world.camera.eye, world.camera.direction(pixel));
        world.closest(&ray).map(|s| proxy.read(world, &Landing::from(&s)).piece)
    };
    let pieces: Vec<Option<Piece>> =
        run.install(|| (0..width * height).into_par_iter().map(piece).collect());
    let ids = pieces.iter().map(|piece| match piece {
        Some(piece) if *piece != Piece::NONE => piece.number() as f32,
        _ => -1.0,
    });
    film.set("cell.id", ids.collect());
    let places: Vec<Option<ShownPlace>> =
        pieces.iter().map(|piece| piece.and_then(|piece| proxy.shown(piece))).collect();
    let number = |f: fn(&ShownPlace) -> f32, none: f32| {
        places.iter().map(|place| place.as_ref().map_or(none, f)).collect::<Vec<f32>>()
    };
    let newest = places.iter().flatten().map(|place| place.need).max().unwrap_or(0);
    let age = |place: &Option<ShownPlace>| place.map_or(-1.0, |p| (newest - p.need) as f32);
    film.set("place_size", number(|place| place.size, 0.0));
    film.set("place_age", places.iter().map(age).collect());
    let colour = |f: fn(&ShownPlace) -> Rgb| {
        places.iter().map(|place| place.as_ref().map_or(Rgb::ZERO, f)).collect::<Vec<Rgb>>()
    };
    film.set_rgb("place_direct", &colour(|place| place.direct));
    film.set_rgb("place_indirect", &colour(|place| place.indirect));
}

/// Traces the photons of [`render`] again, the same for the same seed, and writes them as binary
/// PLY: `x y z`, the direction they travelled in (`incident_x incident_y incident_z`), their share
/// of the flux in W (`flux_r flux_g flux_b`), `cell` and `back` (1 where they hit the back of it),
/// and `red green blue` for viewers.
///
/// # Errors
/// [`crate::error::Error::Write`] when the system refuses, [`crate::error::Error::Interrupted`],
/// cells that do not fit memory.
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
