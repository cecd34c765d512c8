//! A scene made ready for rays, and the pictures that are made of it.

use super::checkpoint::{Tracer, add_sums, late};
use super::dispatch::picture;
use super::expected::Expected;
use super::header;
use super::kept::Kept;
use super::statistics::{OfPicture, Statistics};
use super::unfinished::{job_key, keeping};
use super::view::{CAMERA_INSIDE_WALL, camera_inside_wall};
use crate::config::RenderConfig;
use crate::denoise::{Denoise, Parts, denoise};
use crate::error::{Error, Result};
use crate::ffi::oidn::Denoiser;
use crate::film::{Film, read_whole_exr};
use crate::memory;
use crate::method::converge::{ConvergeStatistics, Halves};
use crate::method::key::surroundings_of;
use crate::method::locations::Locations;
use crate::method::{self, Method, converge};
use crate::run::{Ended, Run};
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
        let denoiser = config.denoise.unwrap_or_default().open(run)?;
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
    /// Whether finished pictures are denoised.
    pub fn denoises(&self) -> bool {
        self.denoiser.is_some()
    }
    /// The view may be turned between pictures.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    /// The picture by a method.
    ///
    /// # Errors
    /// As [`super::render`].
    pub fn render(&mut self, method: Method) -> Result<Rendered> {
        self.render_keeping(method, &Kept::default())
    }

    /// As [`Self::render`], from and to files of kept work. Lengths follow the view that a loaded
    /// file was made for.
    ///
    /// # Errors
    /// As [`super::render`]; [`Error::Usage`] for a method that keeps nothing; files of other
    /// scenes, settings or versions, and those that cannot be read or written.
    pub fn render_keeping(&mut self, method: Method, kept: &Kept) -> Result<Rendered> {
        if let Some(file) = kept.load.as_deref().filter(|_| method.keeps())
            && let Some(of_file) = surroundings_of(file)?
        {
            self.world.around = of_file;
        }
        let converging = self.config.converge.enabled;
        if converging && matches!(method, Method::Path | Method::PhotonMap) {
            let message = format!(
                "method {} has no picture to start from; choose another, or path trace with a \
                 target error",
                method.name()
            );
            return Err(Error::setting("converge.enabled", message));
        }
        let mut config = self.config.clone();
        config.denoise = Some(if self.denoises() { Denoise::Oidn } else { Denoise::None });
        let config = config.for_method(method, self.world.around.extent)?;
        let earlier = match &kept.resume {
            Some(file) if converging => Some(read_whole_exr(file)?),
            _ => None,
        };
        self.plan(&config, method, earlier.as_ref());
        if !converging && method == Method::Path {
            return self.finished(method, &config, picture(self, &config, method, kept)?, None);
        }
        if !converging {
            let key = || job_key(method.name(), self.scene, &config, kept);
            let found = keeping(self.run, kept, key, || picture(self, &config, method, kept))?;
            return self.finished(method, &config, found, None);
        }
        let mut tracer = Tracer::new((&self.world, self.config, self.run), method, kept);
        let mut halves = match &earlier {
            Some(film) => tracer.halves(film)?,
            None => Halves::default(),
        };
        let model = picture(self, &config, method, kept)?;
        let (mut found, figures) = converge::render(
            model,
            &mut halves,
            &self.config.converge,
            &mut |half, halves, spp| tracer.half(half, halves, spp),
            self.run,
        )?;
        if self.run.cancelled() {
            add_sums(&mut found.film, halves.each_ref().map(Option::as_ref));
        }
        if figures.ended == Some(Ended::TimeLimit) {
            let settings = &self.config.converge;
            late(self.run, figures.spp, settings.spp, settings.target_error);
        }
        self.finished(method, &config, found, Some(figures))
    }

    /// The ground truth: path tracing in two independent halves, going on from `kept.resume` as if
    /// it had never stopped, with its running sums where they are asked for, and where it was
    /// interrupted.
    ///
    /// # Errors
    /// As [`super::render`]; [`Error::Usage`] when `kept.resume` belongs to another render.
    pub fn reference(&self, kept: &Kept, keep_sums: bool) -> Result<Rendered> {
        let earlier = kept.resume.as_deref().map(read_whole_exr).transpose()?;
        self.plan(self.config, Method::Path, earlier.as_ref());
        let mut tracer = Tracer::new((&self.world, self.config, self.run), Method::Path, kept);
        let found = tracer.picture(earlier, keep_sums)?;
        self.finished(Method::Path, self.config, found, None)
    }

    /// Tells the phases that the picture will take, with what a film of earlier work has.
    fn plan(&self, config: &RenderConfig, method: Method, earlier: Option<&Film>) {
        let counts = earlier.into_iter().flat_map(|film| &film.channels);
        let counts = counts.filter(|(name, _)| name.rsplit('.').next() == Some("samples"));
        let taken = counts.flat_map(|(_, n)| n).map(|&n| n as u64).sum();
        let expected = Expected::new(self.scene, config, self.run.threads(), self.denoises());
        self.run.plan(&expected.picture(method, taken));
    }

    /// Denoises what was not interrupted, describes and counts.
    fn finished(
        &self,
        method: Method,
        config: &RenderConfig,
        found: method::Rendered,
        converge: Option<ConvergeStatistics>,
    ) -> Result<Rendered> {
        let method::Rendered { mut film, statistics, locations } = found;
        let denoiser = match &self.denoiser {
            Some(denoiser) if !self.run.cancelled() => {
                let parts = if method == Method::Path { Parts::Apart } else { Parts::Together };
                denoise(&mut film, denoiser, parts, self.run)?;
                Some(format!("Open Image Denoise {}", denoiser.dotted()))
            }
            _ => None,
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
