//! How a render runs, apart from what it computes: threads, progress, cancelling, deadline,
//! warnings, ray counts.
//!
//! A [`Run`] is the one handle that passes take. The library side is silent: what is shown is up to
//! the [`Reporter`]. Guarantee: nothing here influences a pixel, except that a cancelled or
//! timed-out progressive render stops early.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use crate::error::{Error, Result};

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

    /// Begins a timed phase of `total` steps; it ends when the value is dropped.
    pub fn phase(&self, name: &'static str, total: u64) -> Phase<'_> {
        self.reporter.begin(name, total);
        Phase { run: self, name, start: Instant::now() }
    }

    /// Records and reports a warning (equal texts once).
    pub fn warn(&self, text: impl Into<String>) {
        let text = text.into();
        let mut list = self.warnings.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if !list.contains(&text) {
            self.reporter.warn(&text);
            list.push(text);
        }
    }

    /// Warnings so far, in order.
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone()
    }

    /// Wall-clock seconds of every ended phase, summed by name, in order of first appearance.
    pub fn seconds(&self) -> Vec<(String, f64)> {
        self.seconds.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone()
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
}

impl Drop for Phase<'_> {
    fn drop(&mut self) {
        self.run.reporter.end();
        let elapsed = self.start.elapsed().as_secs_f64();
        let mut list = self.run.seconds.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        match list.iter_mut().find(|(n, _)| n == self.name) {
            Some((_, s)) => *s += elapsed,
            None => list.push((self.name.to_owned(), elapsed)),
        }
    }
}
