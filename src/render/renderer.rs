//! A scene made ready for rays, and the pictures that are made of it.

use super::dispatch::picture;
use super::header;
use super::kept::Kept;
use super::statistics::{OfPicture, Statistics};
use super::view::{CAMERA_INSIDE_WALL, camera_inside_wall};
use crate::config::RenderConfig;
use crate::denoise::{Parts, denoise};
use crate::error::{Error, Result};
use crate::ffi::oidn::Denoiser;
use crate::film::Film;
use crate::memory;
use crate::method::converge::ConvergeStatistics;
use crate::method::locations::Locations;
use crate::method::path::{self, PathSettings};
use crate::method::{self, Method, converge};
use crate::run::Run;
use crate::sampling::{Stream, sub_seed};
use crate::scene::Scene;
use crate::shading::World;

/// A finished picture.
#[derive(Debug)]
pub struct Rendered {
    /// All layers, and a header that says how they were made.
    pub film: Film,
    /// What is told of the render.
    pub statistics: Statistics,
    /// Where indirect light was sampled; empty for methods without such places.
    pub locations: Locations,
}

/// Scene, settings and run with the world built from them.
#[derive(Debug)]
pub struct Renderer<'a> {
    scene: &'a Scene,
    config: &'a RenderConfig,
    run: &'a Run,
    world: World,
    denoiser: Option<Denoiser>,
}

impl<'a> Renderer<'a> {
    /// Builds triangles, ray structure and lights, opens the denoiser if the settings ask for one,
    /// and warns of a camera that sees nothing.
    ///
    /// # Errors
    /// A backend or a denoiser that cannot be had; settings out of range.
    pub fn new(scene: &'a Scene, config: &'a RenderConfig, run: &'a Run) -> Result<Self> {
        config.validate()?;
        let (width, height) = (scene.camera.width, scene.camera.height);
        let bytes = memory::of_picture(u64::from(width) * u64::from(height));
        memory::claim(bytes, &format!("a picture of {width}×{height} pixels"), "make it smaller")?;
        let denoiser = config.denoise.open(run)?;
        let world = World::new(scene, config.backend, run)?;
        if run.install(|| camera_inside_wall(&world)) {
            run.warn(CAMERA_INSIDE_WALL);
        }
        Ok(Self { scene, config, run, world, denoiser })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        self.scene
    }
    /// The settings.
    pub fn config(&self) -> &RenderConfig {
        self.config
    }
    /// The run.
    pub fn run(&self) -> &Run {
        self.run
    }
    /// Triangles, rays, lights and the view.
    pub fn world(&self) -> &World {
        &self.world
    }
    /// The view may be turned between pictures.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    /// The picture by a method.
    ///
    /// # Errors
    /// As [`super::render`].
    pub fn render(&self, method: Method) -> Result<Rendered> {
        self.render_keeping(method, &Kept::default())
    }

    /// As [`Self::render`], from and to files of kept work.
    ///
    /// # Errors
    /// As [`super::render`]; [`Error::Setting`] for a method that keeps nothing; files of other
    /// scenes, settings or versions, and those that cannot be read or written.
    pub fn render_keeping(&self, method: Method, kept: &Kept) -> Result<Rendered> {
        let converging = self.config.converge.enabled;
        if converging && matches!(method, Method::Path | Method::PhotonMap) {
            let message = format!(
                "method {} has no picture to start from; choose another, or path trace with a \
                 target error",
                method.name()
            );
            return Err(Error::setting("converge.enabled", message));
        }
        let config = self.config.clone().for_method(method, self.world.extent)?;
        let mut found = picture(self, &config, method, kept)?;
        let mut converge = None;
        if converging {
            let (picture, figures) = self.converged(found)?;
            (found, converge) = (picture, Some(figures));
        }
        self.finished(method, &config, found, converge)
    }

    /// The ground truth: path tracing in two independent halves, going on from `earlier` as if it
    /// had never stopped, with its running sums unless `keep_state` is false.
    ///
    /// # Errors
    /// As [`super::render`]; [`Error::Usage`] when `earlier` belongs to another render.
    pub fn reference(&self, earlier: Option<&Film>, keep_state: bool) -> Result<Rendered> {
        let Self { config, run, world, .. } = self;
        let found = path::reference(world, &config.path, config.seed, run, earlier, keep_state)?;
        self.finished(Method::Path, config, found, None)
    }

    /// Path-traced halves of independent seeds bring the method's picture towards the truth.
    fn converged(&self, model: method::Rendered) -> Result<(method::Rendered, ConvergeStatistics)> {
        let Self { config, run, world, .. } = self;
        let mut sample = |half: usize, earlier: Option<&Film>, spp: u32| {
            let settings = PathSettings { spp, target_error: 0.0, ..config.path.clone() };
            let seed = sub_seed(config.seed, Stream::Converge, half as u64);
            path::reference(world, &settings, seed, run, earlier, true).map(|r| r.film)
        };
        converge::render(model, &config.converge, &mut sample, run)
    }

    /// Denoises, describes and counts.
    fn finished(
        &self,
        method: Method,
        config: &RenderConfig,
        found: method::Rendered,
        converge: Option<ConvergeStatistics>,
    ) -> Result<Rendered> {
        let method::Rendered { mut film, statistics, locations } = found;
        let denoiser = match &self.denoiser {
            Some(denoiser) => {
                let parts = if method == Method::Path { Parts::Apart } else { Parts::Together };
                denoise(&mut film, denoiser, parts, self.run)?;
                Some(format!("Open Image Denoise {}", denoiser.dotted()))
            }
            None => None,
        };
        header::describe(&mut film, method.name(), config, self.run)?;
        if let Some(denoiser) = &denoiser {
            film.header.insert("nearfar.denoiser".into(), denoiser.clone());
        }
        let statistics =
            Statistics::new(self, method, OfPicture { of_method: statistics, converge, denoiser });
        Ok(Rendered { film, statistics, locations })
    }
}
