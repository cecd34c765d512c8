//! The proxy as the rest of the program sees it: made, extended by need, read where rays land.
//!
//! ```text
//! L(ray) = B(piece, side) / π,  the sky where nothing is met
//! emission counts zero: it is direct light
//! ```
//!
//! [`Proxy::new`] makes what a [`Need`] asks for, [`Proxy::need`] adds what another asks for and
//! keeps all that was there, bit for bit; [`Proxy::incident`] shoots and reads, [`Proxy::read`]
//! reads where a ray has landed already. That the light lies on cells is known inside this room
//! only; [`Proxy::facets`] gives the triangles that the near sum of the course runs over.

use glam::Vec3;

use super::cell_side::CellSide;
use super::cells::{Cells, Fineness};
use super::making::Making;
use super::places::Places;
use super::radiosity::CellRadiosity;
use super::saved::Saved;
use super::solve::{extend, solve};
use super::{
    Added, Estimate, Facet, Incident, Landing, Piece, PlaceStats, ProxySettings, ProxyStats,
    Reading, SavedProxy, ShownPlace,
};
use crate::error::{Error, Result};
use crate::math::Ray;
use crate::radiometry::Rgb;
use crate::run::Run;
use crate::scene::Camera;
use crate::shading::World;
use crate::tessellate::{Geometry, Side};

/// Size of a place over that of a cell, where no size is set.
const PLACE_OF_CELL: f32 = 0.4;

/// What a proxy is made with.
#[derive(Clone, Copy, Debug)]
pub struct ProxyInputs<'a> {
    /// Longest edge of a piece of surface, scene units.
    pub near_cell: f32,
    /// How its light is found.
    pub settings: &'a ProxySettings,
    /// Seed of every random number.
    pub seed: u64,
}

/// Where light has to be known.
#[derive(Clone, Copy, Debug)]
pub enum Need<'a> {
    /// Where rays land that start at what these cameras see.
    Views(&'a [Camera]),
    /// Where rays have landed.
    Landings(&'a [Landing]),
}

/// Light of the scene's surfaces.
#[derive(Debug, Default)]
pub struct Proxy {
    /// Light by need, in place of cells.
    places: Option<Places>,
    cells: Cells,
    light: CellRadiosity,
    settings: ProxySettings,
    seed: u64,
    stats: ProxyStats,
}

/// The scene's surfaces in pieces (phase `cells`).
fn cut(world: &World, near_cell: f32, run: &Run) -> Result<Cells> {
    let _phase = run.phase("cells", 1);
    run.install(|| Cells::new(&world.geometry, &Fineness::of(world, near_cell)))
}

impl Proxy {
    /// Light where it is needed (phases `cells`, `photons`, `gather`). What is not needed has a
    /// coarse estimate.
    ///
    /// # Errors
    /// [`Error::Setting`] for settings out of range and pieces that would not fit memory,
    /// [`Error::Interrupted`].
    pub fn new(world: &World, inputs: ProxyInputs<'_>, need: Need<'_>, run: &Run) -> Result<Self> {
        let ProxyInputs { near_cell, settings, seed } = inputs;
        settings.validate()?;
        if settings.estimate() == Estimate::Places {
            let mut proxy = Self::of_places(world, inputs);
            proxy.need(world, need, run)?;
            return Ok(proxy);
        }
        let cells = cut(world, near_cell, run)?;
        let (light, stats) = solve(Making { world, cells: &cells, settings, seed, run }, need)?;
        Ok(Self { cells, light, settings: settings.clone(), seed, stats, places: None })
    }

    fn of_places(world: &World, inputs: ProxyInputs<'_>) -> Self {
        let ProxyInputs { near_cell, settings, seed } = inputs;
        let size = settings
            .place_size
            .map_or(PLACE_OF_CELL * near_cell, |l| l.resolve(world.around.extent));
        let places = Some(Places::new(world, size, settings, seed));
        Self { places, settings: settings.clone(), seed, ..Self::default() }
    }

    /// A proxy that was kept, in the same scene with the same inputs.
    ///
    /// # Errors
    /// As [`Proxy::new`]; [`Error::Render`] when it is not of this scene's pieces.
    pub fn restore(
        world: &World,
        inputs: ProxyInputs<'_>,
        saved: SavedProxy,
        run: &Run,
    ) -> Result<Self> {
        let saved = match saved.0 {
            Saved::Places(saved) => {
                let mut proxy = Self::of_places(world, inputs);
                proxy.places.iter_mut().for_each(|places| places.restore(&saved));
                return Ok(proxy);
            }
            Saved::Cells(saved) => saved,
        };
        let cells = cut(world, inputs.near_cell, run)?;
        if cells.len() != saved.cells() {
            return Err(Error::Render(format!(
                "the loaded proxy has {} cells, the scene {}: it was saved from another scene",
                saved.cells(),
                cells.len()
            )));
        }
        let stats = ProxyStats { cells: cells.len(), ..ProxyStats::default() };
        let (light, settings) = (saved, inputs.settings.clone());
        Ok(Self { cells, light, settings, seed: inputs.seed, stats, places: None })
    }

    /// A proxy whose light is given: `radiosity` (W·m⁻²) by the centroid of a piece and the unit
    /// normal of its side. [`Proxy::need`] adds nothing to it.
    ///
    /// # Errors
    /// [`Error::Setting`] for a length that is not positive or pieces that would not fit memory.
    pub fn given(
        geometry: &Geometry,
        near_cell: f32,
        mut radiosity: impl FnMut(Vec3, Vec3) -> Rgb,
    ) -> Result<Self> {
        let cells = Cells::new(geometry, &Fineness::even(near_cell))?;
        let leaving: Vec<Rgb> = CellSide::all(cells.len())
            .map(|at| {
                let normal = cells.normal(geometry, at.cell()) * at.side().sign();
                radiosity(cells.centroids[at.cell() as usize], normal)
            })
            .collect();
        let indirect = vec![Rgb::ZERO; leaving.len()];
        let light = CellRadiosity { leaving, indirect, ..CellRadiosity::default() };
        let stats = ProxyStats { cells: cells.len(), ..ProxyStats::default() };
        Ok(Self { cells, light, stats, ..Self::default() })
    }

    /// Adds light where it is needed and not known yet (phase `gather`). What was known stays as
    /// it is, bit for bit, and lights what is new.
    ///
    /// # Errors
    /// [`Error::Interrupted`].
    pub fn need(&mut self, world: &World, need: Need<'_>, run: &Run) -> Result<Added> {
        if let Some(places) = &mut self.places {
            return places.extend(world, need, run);
        }
        let Self { cells, light, settings, seed, .. } = self;
        extend(Making { world, cells, settings, seed: *seed, run }, light, need)
    }

    /// Shoots a ray and tells the light that arrives along it.
    pub fn incident(&self, world: &World, ray: &Ray) -> Incident {
        match world.rays.closest(ray) {
            None => Incident {
                radiance: world.lights.sky.radiance(ray.dir.normalize_or_zero()),
                t: f32::INFINITY,
                stands_at: None,
                normal: Vec3::ZERO,
            },
            Some(hit) => {
                let landing = Landing::new(world, ray, &hit);
                let Reading { radiosity, piece, .. } = self.read(world, &landing);
                let normal = world.geometry.face_normals[hit.triangle as usize];
                Incident {
                    radiance: radiosity * std::f32::consts::FRAC_1_PI,
                    t: hit.t,
                    stands_at: Some(self.center(piece).unwrap_or_else(|| ray.at(hit.t))),
                    normal: normal * landing.side.sign(),
                }
            }
        }
    }

    /// Radiance that arrives along a ray, as [`Proxy::incident`] tells it but for bright edges of
    /// direct light: there a shadow ray from the hit tells what it has, where a place has a mean.
    /// For sums of many rays, to which it brings noise in place of an error that all of them share;
    /// of few rays it makes fireflies.
    pub fn radiance(&self, world: &World, ray: &Ray) -> Rgb {
        let Some(places) = &self.places else { return self.incident(world, ray).radiance };
        match world.rays.closest(ray) {
            None => world.lights.sky.radiance(ray.dir.normalize_or_zero()),
            Some(hit) => {
                let landing = Landing::new(world, ray, &hit);
                places.read_sharp(world, &landing).radiosity * std::f32::consts::FRAC_1_PI
            }
        }
    }

    /// The light where a ray has landed.
    pub fn read(&self, world: &World, landing: &Landing) -> Reading {
        if let Some(places) = &self.places {
            return places.read(world, landing);
        }
        let cell = self.cells.find(landing.triangle, landing.u, landing.v);
        let at = CellSide::new(cell, landing.side).index();
        Reading {
            radiosity: self.light.leaving[at],
            indirect: self.light.indirect[at],
            piece: Piece(cell),
        }
    }

    /// The place that a reading comes from; none for a proxy of cells, and where none holds the
    /// landing.
    pub fn shown(&self, piece: Piece) -> Option<ShownPlace> {
        self.places.as_ref()?.shown(piece)
    }

    /// The point that stands for a piece: how near the piece is, is the distance of this point.
    /// None for places, each hit of which stands for itself.
    fn center(&self, piece: Piece) -> Option<Vec3> {
        self.places.is_none().then(|| self.cells.centroids[piece.0 as usize])
    }

    /// Longest edge of a piece, scene units: a landing is never farther than this from the point
    /// that stands for its piece.
    pub fn piece_size(&self) -> f32 {
        self.cells.near_cell
    }

    /// Number of facets.
    pub fn facet_count(&self) -> usize {
        self.cells.len()
    }

    /// Facet `i` of [`Proxy::facet_count`].
    pub fn facet(&self, i: u32) -> Facet {
        let cells = &self.cells;
        let at = Side::BOTH.map(|side| CellSide::new(i, side).index());
        Facet {
            corners: cells.corners[i as usize],
            centroid: cells.centroids[i as usize],
            triangle: cells.triangle_of[i as usize],
            radiosity: at.map(|at| self.light.leaving[at]),
            indirect: at.map(|at| self.light.indirect[at]),
            one_sided: cells.one_sided[i as usize],
            coverage: self.light.coverage(i),
        }
    }

    /// All facets.
    pub fn facets(&self) -> impl ExactSizeIterator<Item = Facet> + '_ {
        (0..self.facet_count() as u32).map(|i| self.facet(i))
    }

    /// How it was made; [`Proxy::need`] leaves this as it is.
    pub fn stats(&self) -> &ProxyStats {
        &self.stats
    }

    /// What light by need took so far; none for a proxy of cells.
    pub fn place_stats(&self) -> Option<PlaceStats> {
        self.places.as_ref().map(Places::stats)
    }

    /// What is worth keeping for later renders of the scene.
    pub fn saved(&self) -> SavedProxy {
        SavedProxy(match &self.places {
            Some(places) => Saved::Places(places.saved()),
            None => Saved::Cells(self.light.clone()),
        })
    }
}
