//! Light by need: irradiance at places, patches of surface that come to be where rays land.
//!
//! ```text
//! B(landing) = ρ(landing) · (E_direct + E_indirect)(part of a place that holds the landing)
//! size of a place ≈ max(size, reach · t), t: length of the ray
//! ```
//!
//! A need names landings: for views, some 280,000 of rays from what a lattice of pixels sees. They
//! are gathered into places (`cover`), each on one side of one triangle, or on small triangles that
//! face one way (`key`); what surfaces divide has a part for each set of points that see each
//! other. Parts are lit by rays from the points where rays landed (`light`), as many as landings
//! ask for, and what these rays land on is lit in the next round; sweeps over the links solve for
//! all of it (`solve`). A part of the rays is aimed at what is bright (`bright`). At the end
//! neighbours share what they know (`smooth`). Where direct light has bright edges, parts are lit
//! by more shadow rays, and a reader of many rays may ask for each landing's own (`edge`).
//!
//! Reading looks up the place of a landing, of the size that suits it or next to that, and asks by
//! a ray which part it sees where something divides the place. A landing that has none is lit by a
//! path of its own, one shadow ray at each of its points, to the next part (`light`).
//!
//! Guarantees  the same bits for any number of threads and any order of reading: nothing changes
//!             between two needs, and what a need adds depends on its landings alone. The cost of a
//!             need is bounded by its landings, whatever the scene. Both sides of a sheet, both
//!             faces of a slab and all triangles larger than a place are apart by key.
//! Not         a bound on the error of a place: away from bright edges its direct light is a mean
//!             over at most eight points.
//! Cost        some 20 rays a part; reading takes one to five look-ups, and a short ray in up to a
//!             quarter of all cases.
//! Knobs       `proxy.place_size`, `proxy.place_reach`, `proxy.direct_samples`,
//!             `proxy.gather_rays`.

mod bright;
mod cover;
mod edge;
mod key;
mod light;
mod need;
mod noise;
mod saved;
mod smooth;
mod solve;
mod system;

use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;

use super::{Added, Landing, Need, Piece, PlaceStats, ProxySettings, Reading, ShownPlace};
use crate::error::Result;
use crate::radiometry::Rgb;
use crate::run::Run;
use crate::sampling::BuildReady;
use crate::shading::World;
use cover::sees;
use key::Grids;
use light::Rays;
pub(super) use saved::{SavedPlaces, bytes as saved_bytes, floats as saved_floats};

/// Levels that a landing asks for in turn, relative to the one that suits it.
const STEPS: [i32; 5] = [0, 1, -1, 2, -2];

/// Height over the surface, in sizes, at which points are asked whether they see each other: on
/// places of one triangle, and on shared ones, where surfaces may bend.
const LIFT: [f32; 2] = [0.02, 0.06];

/// Of more landings that are asked for at once, every second, third, … is heeded.
const MOST_LANDINGS: usize = 1 << 19;

/// Irradiance of a part, W·m⁻².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Light {
    /// What shadow rays found of direct light, and what gather rays found.
    direct: Rgb,
    emitted: Rgb,
    indirect: Rgb,
}

impl Light {
    fn total(self) -> Rgb {
        self.direct + self.emitted + self.indirect
    }
}

/// A set of points of a place that see each other.
#[derive(Clone, Copy, Debug)]
struct Part {
    /// One of its points, and the unit geometric normal of the side there.
    p: Vec3,
    ng: Vec3,
    /// Size of its place, scene units.
    size: f32,
    /// Heights over that point between which it lies; all of them where no triangles share the
    /// place.
    heights: [f32; 2],
    /// The need that it was made for, counted from 0.
    need: u32,
    /// A bright edge of direct light runs through it or near it.
    edge: bool,
}

impl Part {
    fn is_shared(&self) -> bool {
        self.heights[1].is_finite()
    }

    /// Height over the surface at which sight is asked for, scene units.
    fn lift(&self) -> f32 {
        LIFT[usize::from(self.is_shared())] * self.size
    }
}

/// A place.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Its first part.
    first: u32,
    /// Number of parts.
    parts: u16,
    /// One part, and nothing hides the corners from it.
    clear: bool,
    /// Clear, and holds all landings with the key.
    whole: bool,
}

/// All places that were needed so far.
#[derive(Debug)]
pub(super) struct Places {
    grids: Grids,
    direct_samples: u32,
    gather_rays: u32,
    seed: u64,
    /// By key.
    index: HashMap<u64, Place, BuildReady>,
    parts: Vec<Part>,
    /// Of each part.
    lights: Vec<Light>,
    /// Needs so far.
    needs: u32,
    /// How they were made.
    made: PlaceStats,
    /// Rays shot by reading: shadow, gather, short.
    rays: [AtomicU64; 3],
}

impl Places {
    pub fn new(world: &World, size: f32, settings: &ProxySettings, seed: u64) -> Self {
        Self {
            grids: Grids::new(world, size, settings.place_reach),
            direct_samples: settings.direct_samples,
            gather_rays: settings.gather_rays,
            seed,
            index: HashMap::default(),
            parts: Vec::new(),
            lights: Vec::new(),
            needs: 0,
            made: PlaceStats::default(),
            rays: Default::default(),
        }
    }

    /// Adds light for a need (phase `places`).
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    pub fn extend(&mut self, world: &World, need: Need<'_>, run: &Run) -> Result<Added> {
        match need {
            Need::Landings(landings) => {
                let stride = landings.len().div_ceil(MOST_LANDINGS).max(1);
                let some: Vec<Landing> = landings.iter().step_by(stride).copied().collect();
                self.need(world, &some, run)
            }
            Need::Views(views) => {
                let landings = need::landings(world, views, self.seed, run);
                self.need(world, &landings, run)
            }
        }
    }

    /// Light where a ray has landed.
    pub fn read(&self, world: &World, landing: &Landing) -> Reading {
        self.reading(world, landing, false)
    }

    /// The same, at bright edges with direct light of its own.
    pub fn read_sharp(&self, world: &World, landing: &Landing) -> Reading {
        self.reading(world, landing, true)
    }

    fn reading(&self, world: &World, landing: &Landing, sharp: bool) -> Reading {
        let albedo = world.geometry.albedo(landing.triangle, landing.u, landing.v);
        if albedo == Rgb::ZERO {
            return Reading { radiosity: Rgb::ZERO, indirect: Rgb::ZERO, piece: Piece::NONE };
        }
        let (light, piece) = match self.find(world, landing) {
            Some(part) if sharp => (self.light_at(world, landing, part), Piece(part)),
            Some(part) => (self.lights[part as usize], Piece(part)),
            None => (self.alone(world, landing), Piece::NONE),
        };
        Reading { radiosity: albedo * light.total(), indirect: light.indirect, piece }
    }

    /// The part that holds a landing.
    fn find(&self, world: &World, landing: &Landing) -> Option<u32> {
        let spot = self.grids.spot(world, landing);
        let level = self.grids.level(landing);
        for step in STEPS {
            let key = self.grids.key(&spot, level + step);
            let Some(&place) = self.index.get(&key) else { continue };
            if place.whole {
                return Some(place.first);
            }
            let inside = |&i: &u32| {
                let part = &self.parts[i as usize];
                let height = (landing.p - part.p).dot(part.ng);
                height >= part.heights[0] && height <= part.heights[1]
            };
            let parts = place.first..place.first + u32::from(place.parts);
            let mut inside = parts.filter(inside);
            if place.clear {
                return inside.next();
            }
            return inside.find(|&i| {
                self.rays[2].fetch_add(1, Ordering::Relaxed);
                let part = &self.parts[i as usize];
                sees(world, (landing.p, spot.normal), (part.p, part.ng), part.lift())
            });
        }
        None
    }

    /// Light of a part, at a landing on it.
    fn light_at(&self, world: &World, landing: &Landing, part: u32) -> Light {
        let light = self.lights[part as usize];
        if !self.parts[part as usize].edge {
            return light;
        }
        let (direct, rays) = self.direct_at(world, landing);
        self.rays[0].fetch_add(rays, Ordering::Relaxed);
        Light { direct, ..light }
    }

    /// Light of a landing that no part holds.
    fn alone(&self, world: &World, landing: &Landing) -> Light {
        let mut rays = Rays::default();
        let (mut light, link) = self.walk(world, landing, &mut rays);
        self.rays[0].fetch_add(rays.shadow, Ordering::Relaxed);
        self.rays[1].fetch_add(rays.gather, Ordering::Relaxed);
        if let Some(at_end) = self.lights.get(link.to as usize) {
            light.indirect += link.weight * at_end.total();
        }
        light
    }

    /// What they hold of memory.
    fn bytes(&self) -> usize {
        self.index.capacity() * size_of::<(u64, Place)>()
            + self.parts.capacity() * size_of::<Part>()
            + self.lights.capacity() * size_of::<Light>()
            + self.grids.bytes()
    }

    /// A place as pictures show it.
    pub fn shown(&self, piece: Piece) -> Option<ShownPlace> {
        let part = self.parts.get(piece.0 as usize)?;
        let Light { direct, emitted, indirect } = self.lights[piece.0 as usize];
        let direct = direct + emitted;
        Some(ShownPlace { size: part.size, direct, indirect, need: part.need })
    }

    /// How they were made, and what reading them took so far.
    pub fn stats(&self) -> PlaceStats {
        let [shadow, gather, short] = [0, 1, 2].map(|i| self.rays[i].load(Ordering::Relaxed));
        PlaceStats {
            places: self.index.len(),
            parts: self.parts.len(),
            bytes: self.bytes(),
            read_shadow_rays: shadow,
            read_gather_rays: gather,
            read_short_rays: short,
            ..self.made
        }
    }
}
