//! How a render runs, apart from what it computes: threads, progress, cancelling, deadline,
//! warnings, ray counts.
//!
//! A [`Run`] is the one handle that passes take. The library side is silent: what is shown is up to
//! the [`Reporter`]. Guarantee: nothing here influences a pixel, except that a cancelled or
//! timed-out progressive render stops early.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::forecast::Part;
use crate::journal::{Journal, Stored};

/// Shows progress; called from many threads.
pub trait Reporter: Send + Sync + std::fmt::Debug {
    /// A phase of `total` steps begins.
    fn begin(&self, phase: &str, total: u64);
    /// `steps` more are done.
    fn advance(&self, steps: u64);
    /// The phase is over.
    fn end(&self);
    /// Something is odd about the input; told once, as soon as it is known.
    fn warn(&self, text: &str);
    /// These phases are to come, those that are limited until the deadline.
    fn plan(&self, _parts: &[Part], _deadline: Option<Instant>) {}
    /// A phase that was planned in steps will have so many more.
    fn expect(&self, _phase: &str, _more: u64) {}
    /// So many steps of the running phase need not be done.
    fn skip(&self, _steps: u64) {}
}

#[derive(Debug)]
struct Silent;
impl Reporter for Silent {
    fn begin(&self, _: &str, _: u64) {}
    fn advance(&self, _: u64) {}
    fn end(&self) {}
    fn warn(&self, _: &str) {}
}

/// What a ray was shot for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayKind {
    /// Camera rays.
    Primary,
    /// Rays to lights.
    Shadow,
    /// Photon paths.
    Photon,
    /// Gather rays: far field samples and path continuation.
    Sample,
    /// Near visibility tests.
    Visibility,
}

impl RayKind {
    /// All kinds with their names in the statistics.
    pub const ALL: [(Self, &'static str); 5] = [
        (Self::Primary, "primary"),
        (Self::Shadow, "shadow"),
        (Self::Photon, "photon"),
        (Self::Sample, "sample"),
        (Self::Visibility, "visibility"),
    ];
}

/// Rays shot, by kind.
#[derive(Debug, Default)]
pub struct RayCounts([AtomicU64; 5]);

impl RayCounts {
    /// Adds `n` rays; call once per block of work, not per ray.
    pub fn add(&self, kind: RayKind, n: u64) {
        self.0[kind as usize].fetch_add(n, Ordering::Relaxed);
    }
    /// Rays shot so far.
    pub fn get(&self, kind: RayKind) -> u64 {
        self.0[kind as usize].load(Ordering::Relaxed)
    }
}

/// Why a progressive render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ended {
    /// All samples that were asked for are taken.
    Samples,
    /// The error is as small as was asked for.
    TargetError,
    /// The deadline came before.
    TimeLimit,
    /// The user asked to stop.
    Interrupted,
    /// Its caller wanted to have what is done so far.
    Paused,
}

impl Ended {
    /// Whether more was asked for; where nothing else limits a render (`limited`), the time limit
    /// is what was asked for.
    pub fn is_short(self, limited: bool) -> bool {
        match self {
            Self::Samples | Self::TargetError => false,
            Self::TimeLimit => limited,
            Self::Interrupted | Self::Paused => true,
        }
    }
}

/// Most threads of a run.
pub const MAX_THREADS: usize = 1024;

/// Threads, progress, cancel flag, deadline, warnings and counters of one program run.
#[derive(Debug)]
pub struct Run {
    pool: rayon::ThreadPool,
    cancel: Arc<AtomicBool>,
    reporter: Box<dyn Reporter>,
    warnings: Mutex<Vec<String>>,
    seconds: Mutex<Vec<(String, f64)>>,
    journal: Mutex<Option<Arc<Journal>>>,
    /// Rays shot so far.
    pub rays: RayCounts,
    /// When the run began.
    pub started: Instant,
    /// When a progressive method should stop.
    pub deadline: Option<Instant>,
}

impl Run {
    /// A silent run on `threads` threads (0 = all).
    ///
    /// # Errors
    /// [`Error::Usage`] for more than [`MAX_THREADS`]; when the system cannot start the threads.
    pub fn new(threads: usize) -> Result<Self> {
        if threads > MAX_THREADS {
            return Err(Error::Usage(format!(
                "{threads} threads are more than any machine has; at most {MAX_THREADS}, 0 for all \
                 cores"
            )));
        }
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| Error::Render(format!("cannot start {threads} threads: {e}")))?;
        Ok(Self {
            pool,
            cancel: Arc::default(),
            reporter: Box::new(Silent),
            warnings: Mutex::default(),
            seconds: Mutex::default(),
            journal: Mutex::default(),
            rays: RayCounts::default(),
            started: Instant::now(),
            deadline: None,
        })
    }

    /// The same run, reporting to `reporter` and stopping when `cancel` is set.
    pub fn with_reporter(mut self, reporter: Box<dyn Reporter>, cancel: Arc<AtomicBool>) -> Self {
        self.reporter = reporter;
        self.cancel = cancel;
        self
    }

    /// Worker threads.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Runs `work` inside the thread pool: parallel iterators in it use this run's threads.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    /// True once the user asked to stop.
    pub fn cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    /// The flag behind [`Run::cancelled`].
    pub fn cancel_flag(&self) -> &AtomicBool {
        &self.cancel
    }

    /// Why a progressive render is to end now, if it is.
    pub fn stops(&self) -> Option<Ended> {
        let late = || self.deadline.is_some_and(|deadline| Instant::now() >= deadline);
        if self.cancelled() { Some(Ended::Interrupted) } else { late().then_some(Ended::TimeLimit) }
    }

    /// # Errors
    /// [`Error::Interrupted`] once the user asked to stop.
    pub fn check(&self) -> Result<()> {
        if self.cancelled() { Err(Error::Interrupted) } else { Ok(()) }
    }

    /// Keeps what [`Self::blocks`] makes from now on, or no more; gives what was kept with until
    /// now.
    pub fn keep(&self, journal: Option<Arc<Journal>>) -> Option<Arc<Journal>> {
        let mut own = self.journal.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::replace(&mut own, journal)
    }

    /// Whether what is made is kept.
    pub fn keeps(&self) -> bool {
        self.journal.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    /// The values of `0..count`, made in parallel by blocks of `size`; blocks that the journal has
    /// are not made. `make` gives the values of a range that depend on nothing but their number; it
    /// has a `scratch` of its own.
    ///
    /// # Errors
    /// [`Error::Interrupted`].
    pub fn blocks<T: Stored + Send, S: Clone + Send + Sync>(
        &self,
        name: &str,
        (count, size): (usize, usize),
        scratch: S,
        make: impl Fn(&mut S, Range<usize>) -> Vec<T> + Sync,
    ) -> Result<Vec<T>> {
        self.blocks_told(name, (count, size), scratch, make, &|_, _| {})
    }

    /// As [`Self::blocks`]; `done` is told of every block, and whether it was made before.
    fn blocks_told<T: Stored + Send, S: Clone + Send + Sync>(
        &self,
        name: &str,
        (count, size): (usize, usize),
        scratch: S,
        make: impl Fn(&mut S, Range<usize>) -> Vec<T> + Sync,
        done: &(dyn Fn(u64, bool) + Sync),
    ) -> Result<Vec<T>> {
        let journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let before = journal.as_ref().map_or(0, |journal| journal.begin(name));
        let range = |block: usize| block * size..((block + 1) * size).min(count);
        let blocks = 0..count.div_ceil(size);
        let mut found: Vec<Option<Vec<T>>> = match &journal {
            Some(journal) => blocks.map(|b| journal.find(name, before, b as u32)).collect(),
            None => blocks.map(|_| None).collect(),
        };
        let fits = |(block, values): (usize, &mut Option<Vec<T>>)| {
            if values.as_ref().is_some_and(|v| v.len() != range(block).len()) {
                *values = None;
            }
            if values.is_some() {
                done(range(block).len() as u64, true);
            }
        };
        found.iter_mut().enumerate().for_each(fits);
        let fill = |scratch: &mut S, (block, values): (usize, &mut Option<Vec<T>>)| {
            if values.is_some() || self.cancelled() {
                return;
            }
            let made = make(scratch, range(block));
            done(range(block).len() as u64, false);
            // What was made while the run was cancelled may be cut short.
            if let Some(journal) = journal.as_ref().filter(|_| !self.cancelled())
                && let Err(message) = journal.keep((name, before, block as u32), &made)
            {
                self.warn(format!("what is done so far is not kept: {message}"));
            }
            *values = Some(made);
        };
        self.install(|| found.par_iter_mut().enumerate().for_each_with(scratch, fill));
        self.check()?;
        Ok(found.into_iter().flatten().flatten().collect())
    }

    /// Values that are made all together, and kept when they are there.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn once<T: Stored>(
        &self,
        name: &str,
        make: impl FnOnce() -> Result<Vec<T>>,
    ) -> Result<(Vec<T>, bool)> {
        let journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let Some(journal) = journal else { return Ok((make()?, false)) };
        let before = journal.begin(name);
        if let Some(found) = journal.find(name, before, 0) {
            return Ok((found, true));
        }
        let made = make()?;
        if !self.cancelled()
            && let Err(message) = journal.keep((name, before, 0), &made)
        {
            self.warn(format!("what is done so far is not kept: {message}"));
        }
        Ok((made, false))
    }

    /// Begins a timed phase of `total` steps; it ends when the value is dropped.
    pub fn phase(&self, name: &'static str, total: u64) -> Phase<'_> {
        self.reporter.begin(name, total);
        Phase { run: self, name, start: Instant::now() }
    }

    /// Tells what phases are to come, in place of what was planned before and has not begun.
    pub fn plan(&self, parts: &[Part]) {
        self.reporter.plan(parts, self.deadline);
    }

    /// Tells how many more steps a phase will have that was planned in steps.
    pub fn expect(&self, phase: &str, more: u64) {
        self.reporter.expect(phase, more);
    }

    /// Records and reports a warning (equal texts once).
    pub fn warn(&self, text: impl Into<String>) {
        let text = text.into();
        let mut list = self.warnings.lock().unwrap_or_else(PoisonError::into_inner);
        if !list.contains(&text) {
            self.reporter.warn(&text);
            list.push(text);
        }
    }

    /// Warnings so far, in order.
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Wall-clock seconds of every ended phase, summed by name, in order of first appearance.
    pub fn seconds(&self) -> Vec<(String, f64)> {
        self.seconds.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// A running phase; dropping it ends it.
#[derive(Debug)]
pub struct Phase<'a> {
    run: &'a Run,
    name: &'static str,
    start: Instant,
}

impl Phase<'_> {
    /// `steps` more are done.
    pub fn advance(&self, steps: u64) {
        self.run.reporter.advance(steps);
    }

    /// As [`Run::blocks`], under the phase's name; every value is a step.
    ///
    /// # Errors
    /// As [`Run::blocks`].
    pub fn blocks<T: Stored + Send, S: Clone + Send + Sync>(
        &self,
        sizes: (usize, usize),
        scratch: S,
        make: impl Fn(&mut S, Range<usize>) -> Vec<T> + Sync,
    ) -> Result<Vec<T>> {
        let done = |steps: u64, before: bool| match before {
            true => self.run.reporter.skip(steps),
            false => self.advance(steps),
        };
        self.run.blocks_told(self.name, sizes, scratch, make, &done)
    }
}

impl Drop for Phase<'_> {
    fn drop(&mut self) {
        self.run.reporter.end();
        let elapsed = self.start.elapsed().as_secs_f64();
        let mut list = self.run.seconds.lock().unwrap_or_else(PoisonError::into_inner);
        match list.iter_mut().find(|(n, _)| n == self.name) {
            Some((_, s)) => *s += elapsed,
            None => list.push((self.name.to_owned(), elapsed)),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::journal::Blocks;

    #[test]
    fn blocks_that_are_kept_are_not_made_again() {
        let run = Run::new(2).unwrap();
        let made = AtomicU64::new(0);
        let squares = |run: &Run| {
            let square = |_: &mut (), range: Range<usize>| {
                made.fetch_add(range.len() as u64, Ordering::Relaxed);
                range.map(|i| (i * i) as u32).collect()
            };
            run.blocks("squares", (10, 4), (), square).unwrap()
        };
        let expected: Vec<u32> = (0..10).map(|i| i * i).collect();
        assert_eq!((squares(&run), made.swap(0, Ordering::Relaxed)), (expected.clone(), 10));
        let kept = Arc::new(Mutex::new(Vec::new()));
        let file = Arc::clone(&kept);
        let write = move |blocks: &Blocks| {
            file.lock().unwrap().push(blocks.bytes());
            Ok(())
        };
        run.keep(Some(Arc::new(Journal::new(Blocks::default(), Duration::ZERO, Box::new(write)))));
        assert_eq!((squares(&run), made.swap(0, Ordering::Relaxed)), (expected.clone(), 10));
        // Killed after any of its writes, a run goes on to the same values.
        for bytes in kept.lock().unwrap().iter() {
            let blocks = Blocks::from_bytes(bytes).unwrap();
            let journal = Journal::new(blocks, Duration::MAX, Box::new(|_| Ok(())));
            run.keep(Some(Arc::new(journal)));
            assert_eq!(squares(&run), expected);
            assert!(made.swap(0, Ordering::Relaxed) <= 6, "nothing of it was used");
            assert_eq!(run.once("other", || Ok(vec![7u32])).unwrap(), (vec![7], false));
        }
    }

    #[test]
    fn blocks_that_were_cut_short_are_not_kept() {
        let run = Run::new(1).unwrap();
        let write = Box::new(|_: &Blocks| Ok(()));
        let journal = Arc::new(Journal::new(Blocks::default(), Duration::MAX, write));
        run.keep(Some(Arc::clone(&journal)));
        let cut = |_: &mut (), range: Range<usize>| {
            run.cancel_flag().store(true, Ordering::Relaxed);
            range.map(|_| 0u32).collect::<Vec<_>>()
        };
        assert!(matches!(run.blocks("cut", (8, 2), (), cut), Err(Error::Interrupted)));
        assert!(journal.is_empty());
    }
}
