//! What phases a picture is made of, and about how long each takes: what its time left is foretold
//! from ([`crate::forecast`]).
//!
//! ```text
//! seconds = how many (pixels, points, rays, triangles)  ·  measured cost of one  /  threads
//! ```
//! Costs are core seconds on a machine of middling speed, the geometric mean of Cornell box, atrium
//! and interior at 640×360; a scene of leaves takes three times as long, an open one a third. What
//! has run corrects what is to come, so that the ratios between phases matter, not the machine.
//!
//! Input   scene, settings of the method, threads. Output  [`Part`]s in the order of their phases,
//!         with building before and writing after them.
//! Not     how many records a cache will need, and how hard surface elements hide each other: such
//!         phases are foretold by what a scene of middling clutter takes, until they run.

use crate::config::RenderConfig;
use crate::forecast::Part;
use crate::method::Method;
use crate::proxy::Estimate;
use crate::scene::Scene;

/// Shading points of a pixel.
const POINTS: f64 = 1.25;
/// Core seconds: a camera sample with its direct light, a gather ray, a path, a short ray.
const CAMERA_SAMPLE: f64 = 0.7e-6;
const GATHER_RAY: f64 = 0.7e-6;
const PATH: f64 = 3.0e-6;
const SHORT_RAY: f64 = 0.4e-6;
/// Core seconds of a pixel: denoised, written, brought together from bands.
const DENOISED: f64 = 9e-6;
const WRITTEN: f64 = 1.2e-6;
const COMBINED: f64 = 6e-6;
/// Core seconds of a gather from the elements around a point.
const ELEMENT_GATHER: f64 = 70e-6;
/// Core seconds of a gather without a ray, and how many there are over the root of all points.
const POINT_GATHER: f64 = 420e-6;
const GATHERS: f64 = 140.0;
/// Clusters, and records of a cache, that a picture has, whatever its size.
const CLUSTERS: f64 = 12_500.0;
const RECORDS: f64 = 20_000.0;

/// What the phases of a picture are told from.
#[derive(Clone, Copy, Debug)]
pub struct Expected<'a> {
    scene: &'a Scene,
    config: &'a RenderConfig,
    threads: f64,
    denoised: bool,
}

impl<'a> Expected<'a> {
    /// Of a scene's pictures on so many threads.
    pub fn new(scene: &'a Scene, config: &'a RenderConfig, threads: usize, denoised: bool) -> Self {
        Self { scene, config, threads: threads.max(1) as f64, denoised }
    }

    fn pixels(&self) -> f64 {
        f64::from(self.scene.camera.width) * f64::from(self.scene.camera.height)
    }

    fn rays(&self, phase: &str, core_seconds: f64) -> Part {
        Part::rays(phase, core_seconds / self.threads)
    }

    /// From a scene to its world.
    pub fn build(&self) -> Vec<Part> {
        let triangles: usize = self.scene.meshes.iter().map(|m| m.triangles.len()).sum();
        vec![Part::data("build", 0.7e-6 * triangles as f64)]
    }

    /// The proxy of so many views.
    fn proxy(&self, views: f64) -> Vec<Part> {
        let estimate = self.config.proxy.estimate();
        if estimate == Estimate::Places {
            let size = (self.pixels() / 230_400.0).sqrt();
            return vec![self.rays("places", 1.6 * size * views.sqrt())];
        }
        let photons = f64::from(self.config.proxy.photons) * 1e-6;
        let gathered = estimate == Estimate::Gather;
        let mut parts = vec![Part::data("cells", 1.0), self.rays("photons", photons)];
        if gathered {
            parts.push(self.rays("gather", 1.0));
        }
        parts.push(self.rays("cells", 0.5));
        if gathered {
            parts.push(self.rays("gather", 0.5));
        }
        parts
    }

    /// Camera samples.
    fn record(&self) -> Vec<Part> {
        let samples = self.pixels() * f64::from(self.config.record.spp);
        vec![self.rays("guide", 0.1), self.rays("record", samples * CAMERA_SAMPLE)]
    }

    fn points(&self) -> f64 {
        self.pixels() * POINTS
    }

    /// Pass 3 of the decomposition.
    fn reconstruct(&self) -> Part {
        let rays = f64::from(self.config.decompose.near_rays);
        self.rays("reconstruct", self.points() * (rays * SHORT_RAY + 2e-6))
    }

    fn clusters(&self, more: f64) -> [Part; 2] {
        let rays = f64::from(self.config.decompose.rays);
        [Part::data("cluster", 0.1), self.rays("sample", CLUSTERS * more * rays * 1.3 * GATHER_RAY)]
    }

    /// The method's own phases.
    fn method(&self, method: Method) -> Vec<Part> {
        let mut parts = match method {
            Method::Path | Method::Direct | Method::PointBased | Method::LocalCorrection => {
                Vec::new()
            }
            _ => self.proxy(1.0),
        };
        let points = self.points();
        match method {
            Method::Decomposition | Method::Course => {
                parts.extend(self.record());
                parts.extend(self.clusters(1.0));
                parts.push(self.reconstruct());
            }
            Method::IrradianceCache => {
                parts.extend(self.record());
                let rays = f64::from(self.config.cache.rays);
                let fill = self.rays("fill", RECORDS * rays * 1.3 * GATHER_RAY);
                parts.push(fill.in_steps(RECORDS as u64));
                parts.push(self.rays("interpolate", points * 1.5e-6));
            }
            Method::Gather => {
                parts.extend(self.record());
                if self.config.gather.guided > 0.0 {
                    parts.push(self.rays("guide", 0.8));
                }
                let rays = f64::from(self.config.gather.rays());
                parts.push(self.rays("sample", points * rays * GATHER_RAY));
            }
            Method::Path => {}
            Method::PointBased => {
                parts.extend(self.bake());
                parts.push(Part::data("tree", 0.05));
                parts.extend(self.record());
                // In rounds; the other points are interpolated, most of them in large pictures.
                let gathers = (GATHERS * points.sqrt()).min(points);
                let gather = self.rays("gather", gathers * POINT_GATHER);
                parts.push(gather.in_steps(gathers as u64));
            }
            Method::LocalCorrection => {
                parts.extend(self.record().pop());
                parts.push(Part::data("tree", 0.5));
                parts.push(self.rays("gather", points * ELEMENT_GATHER));
            }
            Method::Direct => parts.extend(self.record()),
            Method::PhotonMap => {
                let samples = self.pixels() * f64::from(self.config.record.spp);
                parts.push(self.rays("reconstruct", samples * 0.3e-6));
            }
        }
        parts
    }

    /// A cloud of surface elements with their light.
    pub fn bake(&self) -> Vec<Part> {
        let settings = &self.config.point_based;
        let elements = settings.elements as f64;
        let samples = f64::from(settings.direct_samples);
        let mut parts = vec![
            Part::data("dice", 1e-6 * elements),
            self.rays("direct", elements * samples * CAMERA_SAMPLE),
        ];
        let bounce = self.rays("bounce", 5.0 * (elements / 1e5).sqrt());
        parts.extend((0..settings.bounces).map(|_| bounce.clone()));
        parts.push(Part::data("write", 1e-6 * elements));
        parts
    }

    /// Samples that are taken until their number or the error is there; `taken` are there already.
    fn samples(&self, spp: u32, target: f64, taken: u64) -> Part {
        // Until the error is looked at, it is about 0.3 of one sample.
        let guessed = if target > 0.0 { 0.3 / target } else { f64::INFINITY };
        let spp = f64::from(spp).min(guessed.max(8.0));
        let steps = (spp * self.pixels()) as u64;
        let steps = steps.saturating_sub(taken).max(1);
        self.rays("sample", steps as f64 * PATH).in_steps(steps).limited()
    }

    /// A picture by a method, brought towards the truth where the settings say so; `taken`: samples
    /// that a file of earlier work has.
    pub fn picture(&self, method: Method, taken: u64) -> Vec<Part> {
        let (path, converge) = (&self.config.path, &self.config.converge);
        let mut parts = self.method(method);
        if converge.enabled {
            parts.push(self.samples(converge.spp, converge.target_error, taken));
            parts.push(self.rays("converge", self.pixels() * COMBINED));
        } else if method == Method::Path {
            parts.push(self.samples(path.spp, path.target_error, taken));
        }
        if self.denoised {
            let filters = if method == Method::Path { 2.0 } else { 1.0 };
            parts.push(self.rays("denoise", self.pixels() * DENOISED * filters));
        }
        parts.push(Part::data("write", self.pixels() * WRITTEN));
        parts
    }

    /// The frames of a film; `plan`: what they share is made for all beforehand.
    pub fn film(&self, frames: usize, done: usize, plan: bool) -> Vec<Part> {
        let views = frames as f64;
        let mut parts = Vec::new();
        if plan && done == 0 {
            parts.extend(self.proxy(views));
            parts.push(self.rays("plan", views * self.pixels() * 0.2e-6));
            parts.extend(self.clusters(views.sqrt()));
        }
        for _ in done..frames {
            if !plan {
                parts.extend(self.proxy(1.0));
            }
            parts.extend(self.record());
            if !plan {
                parts.extend(self.clusters(1.0));
            }
            parts.push(self.rays("near", 0.5 * self.points() * SHORT_RAY));
            parts.push(self.reconstruct());
            parts.push(Part::data("write", self.pixels() * WRITTEN));
        }
        parts
    }
}
