//! What the functions of passes 2 and 3 are given besides their points: one [`Context`] for all.
//!
//! Lengths are resolved here, once; a caller that wants another alpha, seed or number of rays
//! changes a copy of the context.

use glam::Vec3;

use super::{DecomposeSettings, Lengths};
use crate::proxy::{Incident, Proxy};
use crate::record::ShadingPoints;
use crate::run::Run;
use crate::shading::World;

/// World, proxy, settings with their lengths in this world, seed, run.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// What rays are shot at.
    pub world: &'a World,
    /// What their hits are looked up in.
    pub proxy: &'a Proxy,
    /// Settings; lengths are read from the next field, never from here.
    pub settings: &'a DecomposeSettings,
    /// Lengths in scene units.
    pub lengths: Lengths,
    /// Seed of every random number.
    pub seed: u64,
    /// Progress, cancel, threads.
    pub run: &'a Run,
}

impl<'a> Context<'a> {
    /// With the lengths that `settings` have in `world`.
    pub fn new(
        world: &'a World,
        proxy: &'a Proxy,
        settings: &'a DecomposeSettings,
        seed: u64,
        run: &'a Run,
    ) -> Self {
        let lengths = settings.lengths(world.around.extent);
        Self { world, proxy, settings, lengths, seed, run }
    }

    /// Side of the pieces of surface that the proxy tells apart, scene units: a hit is up to so far
    /// from the place it counts for.
    pub fn place_size(&self) -> f32 {
        self.proxy.piece_size()
    }

    /// Membership of the surface that a ray from `p` met in the near ball of radius `alpha` around
    /// `p`: that of the place which stands for it. `None` for the sky.
    pub fn membership_of(&self, incident: &Incident, p: Vec3, alpha: f32) -> Option<f32> {
        let distance = incident.stands_at?.distance(p);
        Some(self.settings.near_hits.membership(distance, alpha))
    }
}

/// One shading point.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// Position, lifted off the surface, world space.
    pub p: Vec3,
    /// Unit geometric normal.
    pub ng: Vec3,
    /// Unit shading normal.
    pub ns: Vec3,
    /// Side of a pixel there, scene units.
    pub footprint: f32,
}

impl Receiver {
    /// Point `i` of `points`.
    pub fn of(points: &ShadingPoints, i: usize) -> Self {
        Self { p: points.p[i], ng: points.ng[i], ns: points.ns[i], footprint: points.footprint[i] }
    }
}
