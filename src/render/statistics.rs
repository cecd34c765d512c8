//! What is told of a render, as one typed value that is serialised once.
//!
//! The JSON of a [`Statistics`] is flat but for `rays` and `seconds`; which of a method's own
//! figures are there is decided by the method ([`MethodStatistics`]). Seconds are wall clock;
//! `cpu_seconds` and `peak_rss_bytes` are those of the whole process.

use serde::Serialize;
use serde_json::{Map, Value};

use super::renderer::Renderer;
use crate::accel::Backend;
use crate::method::converge::ConvergeStatistics;
use crate::method::{Method, MethodStatistics};
use crate::process;
use crate::run::{RayKind, Run};

/// Everything that is told of one picture.
#[derive(Clone, Debug, Serialize)]
pub struct Statistics {
    /// How light was computed.
    pub method: Method,
    /// Who answered ray queries.
    pub backend: Backend,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Seed of every random number.
    pub seed: u64,
    /// Triangles that rays see.
    pub triangles: usize,
    /// What belongs to the picture.
    #[serde(flatten)]
    pub of_picture: OfPicture,
    /// Rays, seconds and memory.
    #[serde(flatten)]
    pub of_run: RunStatistics,
}

/// What the steps that made the picture tell.
#[derive(Clone, Debug, Serialize)]
pub struct OfPicture {
    /// Figures of the method.
    #[serde(flatten)]
    pub of_method: MethodStatistics,
    /// Samples that brought the picture towards the truth, if any did.
    #[serde(flatten)]
    pub converge: Option<ConvergeStatistics>,
    /// What removed noise from the picture, if anything did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub denoiser: Option<String>,
}

/// Rays, seconds, memory and warnings of a run, of whatever it did.
#[derive(Clone, Debug, Serialize)]
pub struct RunStatistics {
    /// Worker threads.
    pub threads: usize,
    /// Rays shot, by kind.
    pub rays: Map<String, Value>,
    /// Wall-clock seconds by phase, and `total` since the run began.
    pub seconds: Map<String, Value>,
    /// User and system seconds of the process.
    pub cpu_seconds: f64,
    /// Largest resident set of the process.
    pub peak_rss_bytes: u64,
    /// What was odd.
    pub warnings: Vec<String>,
}

impl RunStatistics {
    /// As of now.
    pub fn new(run: &Run) -> Self {
        let rays = RayKind::ALL.map(|(kind, name)| (name.to_owned(), run.rays.get(kind).into()));
        let phases = run.seconds().into_iter().map(|(name, s)| (name, s.into()));
        let total = ("total".to_owned(), run.started.elapsed().as_secs_f64().into());
        Self {
            threads: run.threads(),
            rays: rays.into_iter().collect(),
            seconds: phases.chain([total]).collect(),
            cpu_seconds: process::cpu_seconds(),
            peak_rss_bytes: process::peak_rss_bytes(),
            warnings: run.warnings(),
        }
    }
}

impl Statistics {
    pub(super) fn new(renderer: &Renderer<'_>, method: Method, of_picture: OfPicture) -> Self {
        let (world, config) = (renderer.world(), renderer.config());
        Self {
            method,
            backend: config.backend,
            width: world.camera.width,
            height: world.camera.height,
            seed: config.seed,
            triangles: world.geometry.len(),
            of_picture,
            of_run: RunStatistics::new(renderer.run()),
        }
    }

    /// The figures of the run brought up to now: call after the files are written.
    pub fn refresh(&mut self, run: &Run) {
        self.of_run = RunStatistics::new(run);
    }
}
