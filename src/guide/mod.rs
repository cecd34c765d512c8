//! Where light comes from, learned: densities by which rays are sent where they find much.
//!
//! ```text
//! p_guide(wi) = cos θ / π · h(bin of wi) / mean(h)
//! h(bin)² = mean of (luminance of L)² over the rays of the bin
//! ```
//!
//! The second moment makes the density one that lowers variance where a bin holds bright and dark
//! together (Rath et al. 2020, "Variance-aware path guiding"). A [`Guide`] is made of **cells**, cubes of
//! surface points that face one way; each shoots cosine rays from some of its points through the
//! proxy, and takes those of the cells around it as well, seen from its own centre. Whoever gathers
//! light at a point of the cell draws a part of its rays by [`Directions::sample`] and weighs all of
//! them by the balance heuristic, so that what a guide does not know costs noise and no light.
//!
//! Input   what a lattice of pixels sees, and the proxy. Output  [`Guide`]; [`Guide::at`] finds the
//!         directions for a point.
//! Guarantees  any guide leaves an estimate unbiased, since its rays are not those that it weighs;
//!         the same bits for any number of threads.
//! Not     a guide for emitters: they are direct light, for which [`LampGuide`] chooses.
//! Cost    rays of the cells, some 300 each; 3 kB a cell.

mod cells;
mod directions;
mod lamps;

use glam::Vec3;
use rayon::prelude::*;

use crate::error::Result;
use crate::proxy::Proxy;
use crate::run::Run;
use crate::shading::World;
use cells::{Grid, Seen, lattice};
pub use directions::Directions;
use directions::Found;
pub use lamps::LampGuide;

/// Rays of a cell.
const RAYS: u32 = 256;
/// Share that the rays of a cell beside have.
const BESIDE: f32 = 0.5;

/// Directions of all cells.
#[derive(Debug, Default)]
pub struct Guide {
    grid: Grid,
    cells: Vec<Directions>,
}

impl Guide {
    /// A guide for what the world's camera sees, of cells as large as `size` (phase `guide`).
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    pub fn new(world: &World, proxy: &Proxy, size: f32, seed: u64, run: &Run) -> Result<Self> {
        let (grid, members) = lattice(world, size, seed, run);
        let phase = run.phase("guide", 2 * members.len() as u64);
        let shoot = |c: usize| {
            let found = if run.cancelled() {
                Vec::new()
            } else {
                directions::shoot(world, proxy, &members[c], (RAYS, seed, c as u64))
            };
            run.rays.add(crate::run::RayKind::Sample, u64::from(RAYS));
            phase.advance(1);
            found
        };
        let found: Vec<Vec<Found>> =
            run.install(|| (0..members.len()).into_par_iter().map(shoot).collect());
        run.check()?;
        let learn = |c: usize| {
            let around = grid.around(c).map(|beside| (found[beside].as_slice(), BESIDE));
            phase.advance(1);
            let own = (found[c].as_slice(), 1.0);
            Directions::learn(&Seen::mean(&members[c]), std::iter::once(own).chain(around))
        };
        let cells = run.install(|| (0..members.len()).into_par_iter().map(learn).collect());
        run.check()?;
        Ok(Self { grid, cells })
    }

    /// The directions for the surface point `p` with unit normal `n`; none where the lattice met no
    /// surface nearby.
    pub fn at(&self, p: Vec3, n: Vec3) -> Option<&Directions> {
        self.grid.find(p, n).map(|c| &self.cells[c])
    }

    /// How many cells there are.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// True without cells.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }
}
