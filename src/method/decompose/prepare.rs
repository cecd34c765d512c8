//! Everything before pass 3, from nothing or from what is known of the scene.

use super::far::SampledClusters;
use super::far::extend::extend;
use super::store::Known;
use super::{Context, DecomposeSettings, Lengths};
use crate::error::Result;
use crate::method::stage::{Inputs, Stage};
use crate::proxy::{Need, Proxy};
use crate::record::{CameraSamples, camera_samples};
use crate::run::Run;
use crate::shading::World;

/// Everything before pass 3; budgets and other callers swap single parts of it.
#[derive(Debug)]
pub struct Prepared {
    /// Lengths in scene units.
    pub lengths: Lengths,
    /// Proxy and pass 1.
    pub stage: Stage,
    /// Pass 2.
    pub sampled: SampledClusters,
    /// CPU seconds of pass 2b for the last view, summed over threads.
    pub sample_seconds: f64,
    /// Clusters from before the last view: from a file, or from other cameras.
    pub earlier: usize,
    /// Cell sides that were gathered for the last view alone.
    pub sides_added: usize,
}

/// Proxy, pass 1 and pass 2.
///
/// # Errors
/// As [`Stage::new`].
pub fn prepare(
    world: &World,
    settings: &DecomposeSettings,
    inputs: Inputs<'_>,
    run: &Run,
) -> Result<Prepared> {
    settings.validate()?;
    settings.suits(inputs.photon)?;
    let stage = Stage::new(world, inputs, run)?;
    let mut prepared = Prepared { stage, ..Prepared::empty(settings.lengths(world.around.extent)) };
    prepared.cover(world, settings, inputs.seed, run)?;
    Ok(prepared)
}

/// As [`prepare`], but from what is known: only what this camera sees and nothing covers is
/// computed.
///
/// # Errors
/// As [`prepare`]; as [`Proxy::restore`] for what is known.
pub fn resume(
    world: &World,
    settings: &DecomposeSettings,
    inputs: Inputs<'_>,
    known: Known,
    run: &Run,
) -> Result<Prepared> {
    let mut prepared = Prepared::known(world, settings, inputs, known, run)?;
    prepared.look(world, settings, inputs, true, run)?;
    Ok(prepared)
}

impl Prepared {
    pub(super) fn empty(lengths: Lengths) -> Self {
        let stage = Stage::default();
        Self {
            lengths,
            stage,
            sampled: SampledClusters::default(),
            sample_seconds: 0.0,
            earlier: 0,
            sides_added: 0,
        }
    }

    /// What the passes are given.
    pub fn context<'a>(
        &'a self,
        world: &'a World,
        settings: &'a DecomposeSettings,
        seed: u64,
        run: &'a Run,
    ) -> Context<'a> {
        let (proxy, lengths) = (&self.stage.proxy, self.lengths);
        Context { world, proxy, settings, lengths, seed, run }
    }

    /// What is known, without a view; [`Prepared::look`] gives it one.
    ///
    /// # Errors
    /// As [`resume`].
    pub fn known(
        world: &World,
        settings: &DecomposeSettings,
        inputs: Inputs<'_>,
        known: Known,
        run: &Run,
    ) -> Result<Self> {
        settings.validate()?;
        inputs.validate()?;
        settings.suits(inputs.photon)?;
        let proxy = Proxy::restore(world, inputs.proxy(), known.proxy, run)?;
        let stage = Stage { proxy, samples: CameraSamples::default() };
        let sampled = known.sampled;
        Ok(Self { stage, sampled, ..Self::empty(settings.lengths(world.around.extent)) })
    }

    /// Turns to the world's present camera; with `extend`, proxy and clusters are extended to all
    /// it sees, else they stay.
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    pub fn look(
        &mut self,
        world: &World,
        settings: &DecomposeSettings,
        inputs: Inputs<'_>,
        extend: bool,
        run: &Run,
    ) -> Result<()> {
        self.sides_added = 0;
        self.sample_seconds = 0.0;
        if extend {
            let views = std::slice::from_ref(&world.camera);
            let more = self.stage.proxy.need(world, Need::Views(views), run)?;
            self.sides_added = more.sides;
        }
        self.stage.samples = camera_samples(world, inputs.record, inputs.direct, inputs.seed, run)?;
        if extend {
            return self.cover(world, settings, inputs.seed, run);
        }
        self.earlier = self.sampled.clusters.len();
        self.sampled.clusters.forget_members();
        Ok(())
    }

    /// Clusters for every recorded point that has none.
    fn cover(
        &mut self,
        world: &World,
        settings: &DecomposeSettings,
        seed: u64,
        run: &Run,
    ) -> Result<()> {
        self.earlier = self.sampled.clusters.len();
        let (proxy, lengths) = (&self.stage.proxy, self.lengths);
        let context = Context { world, proxy, settings, lengths, seed, run };
        let samples = &self.stage.samples;
        let points = &samples.points;
        let stride = settings.record_stride;
        let chosen = |&i: &u32| {
            let pixel = points.pixel[i as usize];
            let (x, y) = (pixel % samples.width, pixel / samples.width);
            x.is_multiple_of(stride) && y.is_multiple_of(stride)
        };
        let chosen: Vec<u32> = (0..points.len() as u32).filter(chosen).collect();
        self.sample_seconds = extend(&context, points, chosen, &mut self.sampled)?;
        Ok(())
    }
}
