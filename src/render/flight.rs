//! The frames of a camera path, with proxy and clusters kept between them.
//!
//! Nothing moves but the camera, so what one frame computed serves the next. [`Reuse`] says how
//! much is shared; with [`Reuse::Plan`] everything that any frame needs is made before the first
//! one, so that nothing appears in the middle of a film.
//!
//! Input   scene, settings, one view a frame. Output  one [`Frame`] a call, in any order.
//! Guarantees  the same bits for any number of threads, for the same order of frames; also when the
//!             film goes on from `kept.resume`, what [`Flight::keep`] left of an earlier run.
//! Cost    `Plan`: one ray a pixel and frame beforehand.

use std::path::Path;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::checkpoint::Checkpoint;
use super::expected::Expected;
use super::film_state::{self, FilmState, Shots};
use super::kept::Kept;
use super::{Renderer, header};
use crate::config::RenderConfig;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::method::decompose::near::boxes::NearBoxes;
use crate::method::decompose::{self, NearNoise, Prepared, store};
use crate::method::key::{Key, surroundings_of};
use crate::method::{Method, MethodStatistics};
use crate::run::Run;
use crate::scene::Scene;

/// What frames share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "kebab-case")]
pub enum Reuse {
    /// Everything is made for all frames beforehand: nothing appears in the middle of the film.
    #[default]
    Plan,
    /// Every frame adds what it sees first: no look ahead, small pops where something comes into
    /// view.
    Extend,
    /// Nothing: every frame is made as a single picture would be.
    None,
}

/// One picture of a film.
#[derive(Debug)]
pub struct Frame {
    /// All layers, and a header that says how they were made.
    pub film: Film,
    /// The method's figures.
    pub statistics: MethodStatistics,
    /// Clusters that this frame added.
    pub clusters_added: usize,
    /// Sides of the proxy that this frame added.
    pub sides_added: usize,
    /// Clusters after it.
    pub clusters: usize,
}

/// A film in the making.
#[derive(Debug)]
pub struct Flight<'a> {
    renderer: Renderer<'a>,
    shots: Shots,
    known: Option<Prepared>,
    near: NearBoxes,
    /// What files of what frames share are known by.
    key: Key,
    checkpoint: Option<Checkpoint>,
    /// When the state is kept next.
    next: Option<Instant>,
    done: usize,
}

impl<'a> Flight<'a> {
    /// Makes what the frames share, from `kept.load` on where it is given.
    ///
    /// # Errors
    /// As [`Renderer::new`]; [`Error::Usage`] for kept files where frames share nothing.
    pub fn new(
        scene: &'a Scene,
        config: &'a RenderConfig,
        shots: Shots,
        kept: &Kept,
        run: &'a Run,
    ) -> Result<Self> {
        let reuse = shots.reuse;
        if reuse == Reuse::None && (kept.load.is_some() || kept.save.is_some()) {
            return Err(Error::Usage(
                "frames that share nothing start from no file and leave none".into(),
            ));
        }
        let mut renderer = Renderer::new(scene, config, run)?;
        match kept.load.as_deref().map(surroundings_of).transpose()?.flatten() {
            Some(of_file) => renderer.world_mut().around = of_file,
            None => renderer.world_mut().follow(&shots.views, run),
        }
        let world = renderer.world();
        let (settings, inputs) = (&config.decompose, config.inputs(world.around.extent));
        let key = store::key(shots.scene, &inputs, settings, world);
        let mut flight = Self {
            next: kept.checkpoint.as_ref().and_then(|c| Instant::now().checked_add(c.every)),
            checkpoint: kept.checkpoint.clone().filter(|_| reuse != Reuse::None),
            key,
            known: None,
            near: NearBoxes::default(),
            done: 0,
            shots,
            renderer,
        };
        let world = flight.renderer.world();
        if let Some(path) = &kept.resume {
            let state = film_state::load(path, &flight.key_of_film(), (&inputs, settings))?;
            flight.known = Some(Prepared::known(world, settings, inputs, state.known, run)?);
            (flight.near, flight.done) = (state.near, state.frames);
            flight.expect(flight.done);
            return Ok(flight);
        }
        flight.expect(0);
        let load = |path: &std::path::PathBuf| store::load(path, &flight.key, &inputs, settings);
        let loaded = kept.load.as_ref().map(load).transpose()?;
        flight.known = match (reuse, loaded) {
            (Reuse::Plan, loaded) => {
                Some(decompose::plan(world, settings, inputs, &flight.shots.views, loaded, run)?)
            }
            (_, Some(loaded)) => Some(Prepared::known(world, settings, inputs, loaded, run)?),
            (_, None) => None,
        };
        Ok(flight)
    }

    /// Tells the phases of all frames but the first `done`.
    fn expect(&self, done: usize) {
        let Self { renderer, shots, .. } = self;
        let (scene, config, run) = (renderer.scene(), renderer.config(), renderer.run());
        let expected = Expected::new(scene, config, run.threads(), false);
        run.plan(&expected.film(shots.views.len(), done, shots.reuse == Reuse::Plan));
    }

    /// What the state of this film is known by.
    fn key_of_film(&self) -> Key {
        self.key.clone().with_value("film", self.shots.mark())
    }

    /// Frames that an earlier run has made: go on with the one of this number.
    pub fn done(&self) -> usize {
        self.done
    }
    /// Keeps what frames share, when it is time or the run is cancelled: call before the first and
    /// after each, with the number that is done.
    ///
    /// # Errors
    /// [`Error::Write`] when the system refuses.
    pub fn keep(&mut self, done: usize) -> Result<()> {
        let (Some(checkpoint), Some(prepared)) = (&self.checkpoint, &self.known) else {
            return Ok(());
        };
        let due = self.next.is_some_and(|next| Instant::now() >= next);
        if !due && !self.renderer.run().cancelled() {
            return Ok(());
        }
        let (world, config) = (self.renderer.world(), self.renderer.config());
        let _phase = self.renderer.run().phase("checkpoint", 1);
        let near = std::mem::take(&mut self.near);
        let state = FilmState { known: store::Known::new(prepared), near, frames: done };
        let layout = (&config.inputs(world.around.extent), &config.decompose);
        let saved = film_state::save(&checkpoint.file, &self.key_of_film(), &state, layout);
        self.near = state.near;
        self.next = Instant::now().checked_add(checkpoint.every);
        saved
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.shots.views.len()
    }
    /// True without frames.
    pub fn is_empty(&self) -> bool {
        self.shots.views.is_empty()
    }

    /// The picture of one view, 0-based.
    ///
    /// # Errors
    /// [`Error::Interrupted`].
    ///
    /// # Panics
    /// When there is no such view.
    pub fn frame(&mut self, i: usize) -> Result<Frame> {
        self.renderer.world_mut().camera = self.shots.views[i].clone();
        let (world, run) = (self.renderer.world(), self.renderer.run());
        let config = self.renderer.config();
        let (settings, inputs) = (&config.decompose, config.inputs(world.around.extent));
        let now = match self.known.take() {
            Some(mut known) if self.shots.reuse != Reuse::None => {
                known.look(world, settings, inputs, self.shots.reuse == Reuse::Extend, run)?;
                known
            }
            _ => decompose::prepare(world, settings, inputs, run)?,
        };
        let keeps = self.shots.reuse != Reuse::None && settings.near_noise() == NearNoise::World;
        let near = keeps.then_some(&mut self.near);
        let found = decompose::picture_with(world, settings, &now, near, inputs.seed, run)?;
        let mut film = found.film;
        header::describe(&mut film, Method::Decomposition.name(), config, run)?;
        let frame = Frame {
            film,
            statistics: found.statistics,
            clusters_added: now.sampled.clusters.len() - now.earlier,
            sides_added: now.sides_added,
            clusters: now.sampled.clusters.len(),
        };
        self.known = Some(now);
        Ok(frame)
    }

    /// Writes proxy and clusters of all frames so far.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn save(&self, path: &Path) -> Result<()> {
        let Some(prepared) = &self.known else { return Ok(()) };
        let (world, config) = (self.renderer.world(), self.renderer.config());
        let inputs = config.inputs(world.around.extent);
        store::save(path, &self.key, &store::Known::new(prepared), &inputs, &config.decompose)
    }
}
