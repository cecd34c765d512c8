//! `nearfar render` and `nearfar reference`: options to settings, the library's render, files.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;
use toml::Value;

use super::check_png;
use super::keep::KeepOptions;
use super::options::{Job, SceneOptions, value_name};
use super::picture::OutputOptions;
use super::show::mark;
use super::{keep, stop};
use crate::atomic_file;
use crate::config::parse_value;
use crate::denoise::Denoise;
use crate::error::{Error, Result};
use crate::film::{self, Film};
use crate::method::locations::Locations;
use crate::method::{Method, photon_map};
use crate::render::{Rendered, Renderer, Statistics};
use crate::sampling::ENDLESS;

/// Options of `nearfar render`.
#[derive(Debug, Args)]
pub(super) struct RenderArgs {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    output: OutputOptions,
    #[command(flatten)]
    keep: KeepOptions,
    /// How light is computed; default: gather where the picture is denoised, else decomposition.
    #[arg(long, value_enum)]
    method: Option<Method>,
    /// Remove noise from the finished picture; it stays as it was in the layer "noisy". Default:
    /// auto for gather, decomposition, irradiance-cache and direct, none for the others and with
    /// --converge.
    #[arg(long, value_enum)]
    denoise: Option<Denoise>,
    /// Go on from this method's picture towards the ground truth, until --spp, --time-limit or
    /// --target-error.
    #[arg(long)]
    converge: bool,
    /// With --converge: stop once the certified relMSE is below this.
    #[arg(long, value_name = "RELMSE", requires = "converge")]
    target_error: Option<f64>,
    /// Near/far distance: a length, or a share of the scene's extent such as "2%".
    #[arg(long, value_name = "LENGTH")]
    alpha: Option<String>,
    /// Start from the proxy and clusters, or from the cache records, of this file, whatever camera
    /// it was made for; what it does not cover is computed. A file of another scene, other
    /// settings or another version is refused.
    #[arg(long, value_name = "FILE.ply")]
    load_cache: Option<PathBuf>,
    /// Write proxy and clusters, or the irradiance cache's records, for later renders of the scene
    /// from any camera.
    #[arg(long, value_name = "FILE.ply")]
    save_cache: Option<PathBuf>,
    /// Write where indirect light was sampled, as PLY points.
    #[arg(long, value_name = "FILE.ply")]
    locations: Option<PathBuf>,
    /// With --method photon-map: write the photons, as PLY points.
    #[arg(long, value_name = "FILE.ply")]
    photons: Option<PathBuf>,
    /// Write the picture, darkened, with a dot at every sample of indirect light.
    #[arg(long, value_name = "FILE.png")]
    locations_png: Option<PathBuf>,
}

/// Options of `nearfar reference`.
#[derive(Debug, Args)]
pub(super) struct ReferenceArgs {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    output: OutputOptions,
    /// Stop once the estimated relMSE of the image's own noise is below this.
    #[arg(long, value_name = "RELMSE")]
    target_error: Option<f64>,
    #[command(flatten)]
    keep: KeepOptions,
    /// Leave out the running sums: a smaller file that cannot be resumed.
    #[arg(long)]
    no_state: bool,
}

/// The number of samples that the options ask for; none where the settings decide.
fn samples(output: &OutputOptions, target_error: Option<f64>) -> Option<Value> {
    let limited = output.time_limit.is_some() || target_error.is_some();
    output.spp.map(i64::from).or(limited.then_some(ENDLESS.into())).map(Value::Integer)
}

impl RenderArgs {
    /// The method that is asked for, or that other options ask for; none where the denoiser
    /// decides.
    fn method(&self) -> Option<Method> {
        let kept = [&self.load_cache, &self.save_cache, &self.locations, &self.locations_png];
        let of_decomposition =
            self.converge || self.alpha.is_some() || kept.iter().any(|file| file.is_some());
        self.method.or_else(|| of_decomposition.then_some(Method::Decomposition))
    }

    fn settings(&self) -> Vec<(&'static str, Value)> {
        let mut found = Vec::new();
        if self.converge {
            found.push(("converge.enabled", Value::Boolean(true)));
            found.extend(samples(&self.output, self.target_error).map(|spp| ("converge.spp", spp)));
        } else if self.method == Some(Method::Path) {
            found.extend(samples(&self.output, None).map(|spp| ("path.spp", spp)));
        } else if let Some(spp) = self.output.spp {
            found.push(("record.spp", Value::Integer(spp.into())));
        }
        if let Some(error) = self.target_error {
            found.push(("converge.target_error", Value::Float(error)));
        }
        if let Some(alpha) = &self.alpha {
            found.push(("decompose.alpha", parse_value(alpha)));
        }
        if let Some(denoise) = self.denoise {
            found.push(("denoise", Value::String(value_name(denoise))));
        }
        found
    }

    fn is_progressive(&self) -> bool {
        self.converge || self.method == Some(Method::Path)
    }

    /// Options that only some methods understand, and files that cannot be written.
    fn check(&self) -> Result<()> {
        let refuse = |option: &str, methods: &str| {
            let method = self.method().unwrap_or_default().name();
            Err(Error::Usage(format!("{option}: --method {method} has none; use {methods}")))
        };
        let of_keepers = [
            ("--load-cache", &self.load_cache),
            ("--save-cache", &self.save_cache),
            ("--locations", &self.locations),
            ("--locations-png", &self.locations_png),
        ];
        if let Some((option, _)) = of_keepers.iter().find(|(_, file)| file.is_some())
            && !self.method().unwrap_or_default().keeps()
        {
            return refuse(option, "--method decomposition or irradiance-cache");
        }
        if self.converge && matches!(self.method, Some(Method::Path | Method::PhotonMap)) {
            let others = "a method with a picture to start from, such as --method decomposition \
                          (nearfar reference converges by itself)";
            return refuse("--converge", others);
        }
        if self.photons.is_some() && self.method != Some(Method::PhotonMap) {
            return refuse("--photons", "--method photon-map");
        }
        let written = [&self.save_cache, &self.locations, &self.locations_png, &self.photons];
        let written: Vec<&PathBuf> = written.into_iter().flatten().collect();
        written.iter().try_for_each(|path| atomic_file::check(path))?;
        self.locations_png.as_deref().map_or(Ok(()), check_png)?;
        self.output.check_distinct(&self.scene.scene, &written)
    }
}

/// # Errors
/// Whatever stops a render; see [`Error`].
pub(super) fn render(args: &RenderArgs, cancel: &Arc<AtomicBool>) -> Result<()> {
    args.output.check()?;
    args.check()?;
    let mut kept = args.keep.begin(&args.output.output, args.scene.quiet)?;
    (kept.load, kept.save) = (args.load_cache.clone(), args.save_cache.clone());
    let mut job = args.scene.prepare(&args.settings(), args.output.time_limit, cancel)?;
    if !args.is_progressive() && args.method().is_none_or(Method::has_rays_of_pixels) {
        job.config.denoise.get_or_insert(Denoise::Auto);
    }
    if args.output.time_limit.is_some() && !args.is_progressive() {
        let method = args.method().map_or("gather", Method::name);
        job.run.warn(format!("--time-limit: method {method} cannot be stopped before it is done"));
    }
    job.plan(|expected| expected.picture(args.method().unwrap_or(Method::Gather), 0));
    let mut renderer = Renderer::new(&job.scene, &job.config, &job.run)?;
    stop::keeps();
    let method = args.method().unwrap_or_else(|| Method::of_pictures(renderer.denoises()));
    let rendered = renderer.render_keeping(method, &kept);
    let rendered = rendered.map_err(|error| args.keep.told(error, &args.output.output))?;
    if job.run.cancelled() {
        return Err(args.keep.stopped(&args.output, &job, rendered));
    }
    if let Some(converge) = &rendered.statistics.of_picture.converge
        && !job.quiet
    {
        eprintln!("note: {converge}");
    }
    // The picture first: nothing that cannot be written keeps it from its file.
    let marks = rendered.film.channels.get("location").cloned();
    let Rendered { mut film, mut statistics, locations } = rendered;
    args.output.image.write(&mut film, &args.output.output, &job)?;
    write_samples(args, &film, marks.as_deref(), &locations)?;
    if let Some(path) = &args.photons {
        let world = renderer.world();
        let inputs = job.config.inputs(world.around.extent).proxy();
        photon_map::write_photons(world, inputs, path, &job.run)?;
    }
    finish(&args.output, &job, &mut statistics)
}

/// # Errors
/// Whatever stops a render; see [`Error`].
pub(super) fn reference(args: &ReferenceArgs, cancel: &Arc<AtomicBool>) -> Result<()> {
    args.output.check()?;
    args.output.check_distinct(&args.scene.scene, &[])?;
    let mut settings: Vec<(&str, Value)> =
        samples(&args.output, args.target_error).map(|spp| ("path.spp", spp)).into_iter().collect();
    if let Some(error) = args.target_error {
        settings.push(("path.target_error", Value::Float(error)));
    }
    let kept = args.keep.begin(&args.output.output, args.scene.quiet)?;
    let job = args.scene.prepare(&settings, args.output.time_limit, cancel)?;
    job.plan(|expected| expected.picture(Method::Path, 0));
    let renderer = Renderer::new(&job.scene, &job.config, &job.run)?;
    stop::keeps();
    let rendered = renderer.reference(&kept, !args.no_state)?;
    if job.run.cancelled() {
        return Err(args.keep.stopped(&args.output, &job, rendered));
    }
    let Rendered { mut film, mut statistics, .. } = rendered;
    args.output.image.write(&mut film, &args.output.output, &job)?;
    finish(&args.output, &job, &mut statistics)
}

/// Writes statistics; what was kept of the picture while it was made goes.
fn finish(output: &OutputOptions, job: &Job, statistics: &mut Statistics) -> Result<()> {
    statistics.refresh(&job.run);
    output.finish(statistics, job)?;
    keep::forget(output);
    Ok(())
}

/// Stops by which the picture under the dots is darkened.
const BACKDROP_STOPS: f32 = -2.0;

fn write_samples(
    args: &RenderArgs,
    film: &Film,
    marks: Option<&[f32]>,
    locations: &Locations,
) -> Result<()> {
    if let Some(path) = &args.locations {
        locations.write_ply(path)?;
    }
    if let (Some(path), Some(marks)) = (&args.locations_png, marks) {
        let exposure = args.output.image.exposure + BACKDROP_STOPS;
        let mut pixels = film.rgb("").unwrap_or_default();
        mark(&mut pixels, marks, exposure);
        film::write_png_rgb(&pixels, film.width, film.height, path, exposure)?;
    }
    Ok(())
}
