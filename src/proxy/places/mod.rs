//! Light by need: irradiance at places, small patches of surface that come to be where rays land.
//!
//! ```text
//! B(landing) = ρ(landing) · (E_direct + E_indirect)(place that holds the landing)
//! size of a place = size · 2^level,   2^level ≈ max(1, reach · t / size),   t: length of the ray
//! E_indirect(place) = mean over cosine rays of B where they land, π L of the sky elsewhere
//! ```
//!
//! A place is a function of its key alone: where its points lie, which rays leave them, and so its
//! light. Who asks first, on how many threads, from which camera, decides nothing; what was found
//! is remembered. A key is a shape and a generation:
//!
//! * a piece of a large triangle, found by bisecting its longest edge until none is longer than the
//!   size (`patch`);
//! * the surface that faces one way in a cube of space, where triangles are smaller than a place;
//! * what a place gathers comes from places of the next generation, twice as large and with half
//!   the rays; beyond [`GENERATIONS`] it comes from paths (`light`).
//!
//! A place that a surface divides, such as a wall that stands on it, is not used as a whole: in the
//! first generation its halves are, and where these are divided too, each landing is told the light
//! of those points that its own point sees.
//!
//! Guarantees  the same bits for any number of threads and any order of reading. Both sides of a
//!             sheet, both faces of a slab and all triangles larger than a place are apart by key.
//! Not         a bound on the error of a place: its light is a mean over at most eight points. Two
//!             layers that face the same way in one cube share a place where nothing hides one from
//!             the other.
//! Cost        some 40 rays and 100 B a place; reading takes one look-up, and the rays of what is
//!             not known yet. Not cheaper than cells so far where a scene is finely broken: see
//!             `docs/records/2026-11-places.md`.
//! Knobs       `proxy.place_size`, `proxy.place_reach`, `proxy.direct_samples`,
//!             `proxy.gather_rays`.

mod light;
mod patch;

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, RwLock};

use super::{Landing, Piece, PlaceStats, ProxySettings, Reading};
use crate::radiometry::Rgb;
use crate::sampling::hash64;
use crate::shading::World;
use patch::{LIFT, Point, Shape, Walk, sees};

/// Generations of places; the rays of the last are followed as paths.
const GENERATIONS: u32 = 2;
/// A divided place is cut down to this part of the size.
const SMALLEST: f32 = 0.125;
/// Parts of the memory that are locked apart.
const SHARDS: usize = 256;

/// Which place, of which generation, as seen from which of its points (0: from all).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key {
    shape: Shape,
    generation: u8,
    point: u8,
}

impl Key {
    fn hash(&self) -> u64 {
        let of = |h: u64, word: u64| hash64(h ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let h = self.shape.words().into_iter().fold(0x70_6c61_6365, of);
        of(h, u64::from(self.generation) << 8 | u64::from(self.point))
    }
}

/// Irradiance of a place, W·m⁻².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Light {
    direct: Rgb,
    indirect: Rgb,
}

/// What is remembered of a key.
#[derive(Clone, Debug)]
enum Known {
    /// Something stands between its points, or it has none: its parts are to be used.
    Divided(Arc<[Point]>),
    /// Its light, and the heights over the middle of a cube between which its points lie.
    Lit(Light, [f32; 2]),
}

/// Hashes of keys are good already.
#[derive(Default)]
struct Ready(u64);

impl Hasher for Ready {
    fn finish(&self) -> u64 {
        self.0
    }
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&b| self.write_u64(u64::from(b)));
    }
    fn write_u64(&mut self, word: u64) {
        self.0 = hash64(self.0 ^ word);
    }
}

type Shard = RwLock<HashMap<Key, Known, BuildHasherDefault<Ready>>>;

/// All places that were needed so far.
#[derive(Debug)]
pub(super) struct Places {
    /// Size of the smallest undivided place, scene units.
    size: f32,
    /// Size of a place over the length of the ray that landed.
    reach: f32,
    direct_samples: u32,
    gather_rays: u32,
    seed: u64,
    rays: [AtomicU64; 3],
    shards: Vec<Shard>,
}

impl Places {
    pub fn new(size: f32, settings: &ProxySettings, seed: u64) -> Self {
        Self {
            size,
            reach: settings.place_reach,
            direct_samples: settings.direct_samples,
            gather_rays: settings.gather_rays,
            seed,
            rays: Default::default(),
            shards: (0..SHARDS).map(|_| Shard::default()).collect(),
        }
    }

    /// Light where a ray landed.
    pub fn read(&self, world: &World, landing: &Landing) -> Reading {
        let (light, key) = self.irradiance(world, landing, 0);
        let albedo = world.geometry.albedo(landing.triangle, landing.u, landing.v);
        let number = (key.hash() >> 40) as u32;
        Reading {
            radiosity: albedo * (light.direct + light.indirect),
            indirect: light.indirect,
            piece: Piece(number),
        }
    }

    /// Size of the place for a landing: between two powers the landing itself decides, so that no
    /// seam shows where sizes change.
    fn size_for(&self, landing: &Landing, generation: u32) -> f32 {
        let least = self.size * (generation as f32).exp2();
        let wanted = (self.reach * landing.reach / least).max(1.0);
        if wanted.is_nan() || wanted == 1.0 {
            return least;
        }
        let bits = u64::from(landing.u.to_bits()) << 32 | u64::from(landing.v.to_bits());
        let dither = (hash64(bits ^ u64::from(landing.triangle)) >> 40) as f32 / 16_777_216.0;
        least * (wanted.log2() + dither).floor().clamp(0.0, 24.0).exp2()
    }

    fn irradiance(&self, world: &World, landing: &Landing, generation: u32) -> (Light, Key) {
        let mut size = self.size_for(landing, generation);
        let mut walk = Walk::new(world, landing, self.smallest());
        let least = if generation == 0 { 0.5 * self.size } else { f32::INFINITY };
        loop {
            let shape = walk.shape(size);
            let key = Key { shape, generation: generation as u8, point: 0 };
            match self.known(world, key) {
                Known::Lit(light, heights) if walk.within(shape, heights) => return (light, key),
                Known::Divided(points) if size <= least => {
                    if let Some(point) = self.first_seen(world, &walk, &points) {
                        return self.seen_from(world, key, point);
                    }
                }
                _ => {}
            }
            if size <= self.smallest() {
                return self.alone(world, &walk, generation);
            }
            size *= 0.5;
        }
    }

    /// The first point of a divided place that a landing sees.
    fn first_seen(&self, world: &World, walk: &Walk, points: &[Point]) -> Option<usize> {
        let lift = LIFT * self.smallest();
        points.iter().position(|to| sees(world, walk.at(), (to.p, to.ng), lift))
    }

    /// The light of the points that one point of a divided place sees.
    fn seen_from(&self, world: &World, key: Key, point: usize) -> (Light, Key) {
        let key = Key { point: point as u8 + 1, ..key };
        match self.known(world, key) {
            Known::Lit(light, _) => (light, key),
            Known::Divided(_) => (Light::default(), key),
        }
    }

    /// The light of a landing that no place of the smallest size holds: that of its triangle.
    fn alone(&self, world: &World, walk: &Walk, generation: u32) -> (Light, Key) {
        let key = Key { shape: walk.triangle(), generation: generation as u8, point: 0 };
        match self.known(world, key) {
            Known::Lit(light, _) => (light, key),
            Known::Divided(points) => match self.first_seen(world, walk, &points) {
                Some(point) => self.seen_from(world, key, point),
                None => (Light::default(), key),
            },
        }
    }

    fn known(&self, world: &World, key: Key) -> Known {
        let shard = &self.shards[(key.hash() >> 56) as usize % SHARDS];
        if let Some(known) = shard.read().ok().and_then(|map| map.get(&key).cloned()) {
            return known;
        }
        let (known, rays) = self.find(world, key);
        if let Ok(mut map) = shard.write()
            && map.insert(key, known.clone()).is_none()
        {
            let shot = [rays.shadow, rays.gather, rays.short];
            for (count, rays) in self.rays.iter().zip(shot) {
                count.fetch_add(rays, Ordering::Relaxed);
            }
        }
        known
    }

    /// Size of the parts that are not divided further.
    fn smallest(&self) -> f32 {
        self.size * SMALLEST
    }

    /// Places of all generations and rays shot for them so far.
    pub fn stats(&self) -> PlaceStats {
        let [shadow_rays, gather_rays, short_rays] =
            [0, 1, 2].map(|i| self.rays[i].load(Ordering::Relaxed));
        let places = self.shards.iter().map(|s| s.read().map_or(0, |map| map.len())).sum();
        PlaceStats { places, shadow_rays, gather_rays, short_rays }
    }
}
