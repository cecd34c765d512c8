//! Progressive pictures that outlive their process: what is done so far, as a picture beside the
//! finished one.
//!
//! ```text
//! samples  →  every `Checkpoint::every`: pause  →  film with running sums  →  `Checkpoint::file`
//! file     →  `Kept::resume`  →  the same samples, and on
//! ```
//! The file is an OpenEXR picture that can be looked at, with a checksum and the key of what it
//! shows in its header. Path tracing has its sums in layers `state.NAME`, a converging picture
//! those of its two halves in `state.0.NAME` and `state.1.NAME`. Files of one scene that differ
//! by their seeds alone are merged by adding sums and samples ([`crate::method::path::merge`]).
//!
//! Guarantees  a picture that was stopped and gone on with has the bits of one that never stopped,
//!             unless a clock ended it. A file that is damaged or of something else is refused.
//! Not         the model of a converging picture: it is made again. A file that cannot be written
//!             is a warning, and the render goes on.
//! Cost        one write of about 250 B a pixel, and as much memory.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::{Kept, header};
use crate::config::RenderConfig;
use crate::error::{Error, Result};
use crate::film::{self, Film, Precision, SUMS_OF, layer, layer_of};
use crate::method::converge::Halves;
use crate::method::path::{self, PathSettings, Progress};
use crate::method::{Method, MethodStatistics, Rendered};
use crate::radiometry::Rgb;
use crate::run::{Ended, Run};
use crate::sampling::{ENDLESS, Stream, sub_seed};
use crate::shading::World;

/// Where a job keeps what it has so far.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checkpoint {
    /// The partial picture.
    pub file: PathBuf,
    /// Time between two.
    pub every: Duration,
}

/// What path tracing needs of a renderer, and when it has to be kept next.
pub(super) struct Tracer<'a> {
    pub(super) world: &'a World,
    pub(super) config: &'a RenderConfig,
    pub(super) run: &'a Run,
    pub(super) method: Method,
    checkpoint: Option<&'a Checkpoint>,
    next: Option<Instant>,
}

impl<'a> Tracer<'a> {
    pub(super) fn new(
        (world, config, run): (&'a World, &'a RenderConfig, &'a Run),
        method: Method,
        kept: &'a Kept,
    ) -> Self {
        let checkpoint = kept.checkpoint.as_ref();
        let next = checkpoint.and_then(|c| Instant::now().checked_add(c.every));
        Self { world, config, run, method, checkpoint, next }
    }

    /// Keeps what is done so far.
    fn leave(&mut self, mut film: Film) -> Result<Film> {
        let Some(checkpoint) = self.checkpoint else { return Ok(film) };
        header::describe(&mut film, self.method.name(), self.config, self.run)?;
        let _phase = self.run.phase("checkpoint", 1);
        if let Err(error) = film::write_exr(&film, &checkpoint.file, Precision::Full) {
            self.run.warn(format!("what is done so far is not kept: {error}"));
        }
        self.next = Instant::now().checked_add(checkpoint.every);
        Ok(film)
    }

    /// The ground truth from `earlier` on, with its sums where they are asked for, and where it was
    /// interrupted.
    pub(super) fn picture(
        &mut self,
        mut earlier: Option<Film>,
        keep_sums: bool,
    ) -> Result<Rendered> {
        let settings = &self.config.path;
        let mut found = loop {
            let progress =
                Progress { earlier: earlier.as_ref(), keep_state: true, pause: self.next };
            let found =
                path::reference(self.world, settings, self.config.seed, self.run, progress)?;
            if ended(&found) != Some(Ended::Paused) {
                break found;
            }
            earlier = Some(self.leave(found.film)?);
        };
        if let (Some(Ended::TimeLimit), MethodStatistics::Path(figures)) =
            (ended(&found), &found.statistics)
        {
            late(self.run, f64::from(figures.spp), settings.spp, settings.target_error);
        }
        if !keep_sums && ended(&found) != Some(Ended::Interrupted) {
            found.film.forget_sums();
        }
        Ok(found)
    }

    /// One of two halves grown to `spp` samples a pixel.
    pub(super) fn half(&mut self, half: usize, halves: &Halves, spp: u32) -> Result<Film> {
        let settings = PathSettings { spp, target_error: 0.0, ..self.config.path.clone() };
        let seed = sub_seed(self.config.seed, Stream::Converge, half as u64);
        let mut own: Option<Film> = None;
        loop {
            let earlier = own.as_ref().or(halves[half].as_ref());
            let progress = Progress { earlier, keep_state: true, pause: self.next };
            let found = path::reference(self.world, &settings, seed, self.run, progress)?;
            if ended(&found) != Some(Ended::Paused) {
                return Ok(found.film);
            }
            let mut both = halves.each_ref().map(Option::as_ref);
            both[half] = Some(&found.film);
            let mut film = mean(both);
            add_sums(&mut film, both);
            self.leave(film)?;
            own = Some(found.film);
        }
    }

    /// The halves that a file has, with all their layers.
    pub(super) fn halves(&mut self, film: &Film) -> Result<Halves> {
        if film.header.get(SUMS_OF).map(String::as_str) != Some("converge") {
            return Err(Error::Usage(
                "cannot resume: the file was not left by a converging picture; start a new one"
                    .into(),
            ));
        }
        let mut halves = sums(film);
        for half in 0..2 {
            if halves[half].is_some() {
                halves[half] = Some(self.half(half, &halves, 1)?);
            }
        }
        Ok(halves)
    }
}

fn ended(found: &Rendered) -> Option<Ended> {
    match &found.statistics {
        MethodStatistics::Path(figures) => Some(figures.ended),
        _ => None,
    }
}

/// Warns of a time limit that came before what was asked for.
pub(super) fn late(run: &Run, done: f64, asked: u32, target_error: f64) {
    if asked < ENDLESS {
        run.warn(format!("the time limit came at {done:.1} of {asked} samples per pixel"));
    } else if target_error > 0.0 {
        run.warn(format!("the time limit came at {done:.1} samples per pixel, before the error"));
    }
}

/// Layer of the sums of a half.
fn prefix(half: usize) -> String {
    format!("state.{half}.")
}

/// A picture to look at: the mean of what halves there are.
fn mean(halves: [Option<&Film>; 2]) -> Film {
    let there: Vec<&Film> = halves.into_iter().flatten().collect();
    let mut film = there.first().map_or_else(Film::default, |f| Film::new(f.width, f.height));
    let mut sum = vec![Rgb::ZERO; film.width as usize * film.height as usize];
    for pixels in there.iter().filter_map(|half| half.rgb("")) {
        sum.iter_mut().zip(pixels).for_each(|(sum, c)| *sum += c / there.len() as f32);
    }
    film.set_rgb("", &sum);
    film
}

/// Adds the sums of both halves to a film.
pub(super) fn add_sums(film: &mut Film, halves: [Option<&Film>; 2]) {
    film.header.insert(SUMS_OF.into(), "converge".into());
    film.header.insert(film::COMPLETE.into(), false.to_string());
    for (i, half) in halves.into_iter().enumerate() {
        let Some(half) = half else { continue };
        for (name, values) in &half.channels {
            let sum = name.strip_prefix("state.").or((name == layer::SAMPLES.name).then_some(name));
            if let Some(sum) = sum {
                film.set(&(prefix(i) + sum), values.clone());
            }
        }
        if let Some(key) = half.header.get(path::KEY) {
            film.header.insert(format!("{}.{i}", path::KEY), key.clone());
        }
    }
}

/// What [`add_sums`] added.
fn sums(film: &Film) -> Halves {
    [0, 1].map(|i| {
        let key = film.header.get(&format!("{}.{i}", path::KEY))?;
        let mut half = Film::new(film.width, film.height);
        half.header.insert(path::KEY.into(), key.clone());
        for (name, values) in film.channels.iter().filter(|(name, _)| layer_of(name) == "state") {
            match name.strip_prefix(&prefix(i)) {
                Some(sum) if sum == layer::SAMPLES.name => half.set(sum, values.clone()),
                Some(sum) => half.set(&format!("state.{sum}"), values.clone()),
                None => {}
            }
        }
        Some(half)
    })
}
