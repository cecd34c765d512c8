//! Where light comes from, learned: densities by which rays are sent where they find much.
//!
//! ```text
//! p_guide(wi) = cos θ / π · h(bin of wi) / mean(h)
//! h(bin)² = mean of (luminance of L)² over the rays of the bin
//! ```
//!
//! The second moment makes the density one that lowers variance where a bin holds bright and dark
//! together `[Rath20]`. A [`Guide`] is made of **cells**, cubes of surface points that face one
//! way; each shoots cosine rays from some of its points through the proxy, and takes those of the
//! cells around it as well, seen from its own centre. Larger cells, made of the rays of small ones,
//! serve points that no small cell holds. The brightest places that any cell met are made known to
//! all: they may be hidden from most of a cell and not from the point. Whoever gathers light draws
//! a part of its rays by [`Directions::sample`] and weighs all of them by the balance heuristic, so
//! that what a guide does not know costs noise and no light.
//!
//! Input   what a lattice of pixels sees, and the proxy. Output  [`Guide`]; [`Guide::at`] finds the
//!         directions for a point.
//! Guarantees  any guide leaves an estimate unbiased, since its rays are not those that it weighs;
//!         the same bits for any number of threads.
//! Not     a guide for emitters: they are direct light, for which [`LampGuide`] chooses.
//! Cost    some 600,000 rays, whatever the size of the picture; 3 kB a cell.

mod cells;
mod directions;
mod lamps;

use glam::Vec3;
use rayon::prelude::*;

use crate::error::Result;
use crate::proxy::Proxy;
use crate::run::Run;
use crate::shading::World;
use cells::Cells;
pub use directions::Directions;
use directions::Found;
pub use lamps::LampGuide;

/// Rays of a small cell: at most, and at least; between these so many that all have [`ALL_RAYS`].
const RAYS: [usize; 2] = [32, 256];
const ALL_RAYS: usize = 600_000;

/// Directions of all cells.
#[derive(Debug, Default)]
pub struct Guide {
    cells: Cells,
    directions: Vec<Directions>,
}

impl Guide {
    /// A guide for what the world's camera sees, of cells as large as `size` (phase `guide`).
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    pub fn new(world: &World, proxy: &Proxy, size: f32, seed: u64, run: &Run) -> Result<Self> {
        let cells = Cells::new(world, size, seed, run);
        let phase = run.phase("guide", (cells.members.len() + cells.len()) as u64);
        let rays = (ALL_RAYS / cells.members.len().max(1)).clamp(RAYS[0], RAYS[1]) as u32;
        let shoot = |c: usize| {
            let found = if run.cancelled() {
                Vec::new()
            } else {
                directions::shoot(world, proxy, &cells.members[c], (rays, seed, c as u64))
            };
            run.rays.add(crate::run::RayKind::Sample, u64::from(rays));
            phase.advance(1);
            found
        };
        let found: Vec<Vec<Found>> =
            run.install(|| (0..cells.members.len()).into_par_iter().map(shoot).collect());
        run.check()?;
        let bright = directions::bright(&found);
        let learn = |c: usize| {
            phase.advance(1);
            let tellers = cells.tellers(c);
            let sets = tellers.iter().map(|&(cell, weight)| (found[cell].as_slice(), weight));
            Directions::learn(&cells.middle(c), sets, &bright)
        };
        let directions = run.install(|| (0..cells.len()).into_par_iter().map(learn).collect());
        run.check()?;
        Ok(Self { cells, directions })
    }

    /// The directions for the surface point `p` with unit normal `n`; none where the lattice met no
    /// surface nearby.
    pub fn at(&self, p: Vec3, n: Vec3) -> Option<&Directions> {
        self.cells.find(p, n).map(|c| &self.directions[c])
    }

    /// How many cells there are.
    pub fn len(&self) -> usize {
        self.directions.len()
    }

    /// True without cells.
    pub fn is_empty(&self) -> bool {
        self.directions.is_empty()
    }
}
