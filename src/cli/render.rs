//! `nearfar render` and `nearfar reference`.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;
use serde_json::json;
use toml::Value;

use super::options::{Job, OutputOptions, SceneOptions};
use super::show::mark;
use super::{check_writable, statistics};
use crate::config::RenderConfig;
use crate::denoise::{Denoise, Parts, denoise};
use crate::error::{Error, Result};
use crate::ffi::oidn::Denoiser;
use crate::film::{self, Film, Precision};
use crate::info::{CAMERA_INSIDE_WALL, camera_inside_wall};
use crate::method::cache::{CacheSettings, store};
use crate::method::decompose::DecomposeSettings;
use crate::method::path::PathSettings;
use crate::method::stage::Inputs;
use crate::method::{
    Method, Rendered, cache, converge, decompose, direct, gather, local_correction, path,
    photon_map, point_based,
};
use crate::run::Run;
use crate::sampling::hash64;
use crate::scene::{Fingerprint, Scene};
use crate::shading::World;

/// Options of `nearfar render`.
#[derive(Debug, Args)]
pub(super) struct RenderArgs {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    output: OutputOptions,
    /// How light is computed.
    #[arg(long, default_value_t, value_enum)]
    method: Method,
    /// Remove noise from the finished picture; it stays as it was in the layer "noisy".
    #[arg(long, value_enum)]
    denoise: Option<Denoise>,
    /// Go on from this method's picture towards the ground truth, until --spp, --time-limit or
    /// --target-error.
    #[arg(long)]
    converge: bool,
    /// With --converge: stop once the certified relMSE is below this.
    #[arg(long, value_name = "RELMSE", requires = "converge")]
    target_error: Option<f64>,
    /// Near/far distance: a length, or a share of the scene's diagonal such as "2%".
    #[arg(long, value_name = "LENGTH")]
    alpha: Option<String>,
    /// Start from the proxy and clusters, or from the cache records, of this file, whatever camera
    /// it was made for; what it does not cover is computed. A file of another scene, other settings
    /// or another version is refused.
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
    /// Go on from an earlier file as if it had never stopped.
    #[arg(long, value_name = "FILE.exr")]
    resume: Option<std::path::PathBuf>,
    /// Leave out the running sums: a smaller file that cannot be resumed.
    #[arg(long)]
    no_state: bool,
}

/// The method's key for samples per pixel.
fn spp_key(method: Method) -> &'static str {
    match method {
        Method::Path => "path.spp",
        _ => "record.spp",
    }
}

/// Without a number of samples, a limit on time or error alone decides.
fn endless(output: &OutputOptions, target_error: Option<f64>) -> bool {
    output.spp.is_none() && (output.time_limit.is_some() || target_error.is_some())
}

/// Samples that no run reaches and that the sampler can still count.
const ENDLESS_SPP: i64 = 1 << 30;

/// # Errors
/// Whatever stops a render; see [`Error`].
pub(super) fn render(args: &RenderArgs, cancel: &Arc<AtomicBool>) -> Result<()> {
    let mut extra = Vec::new();
    if let Some(spp) = args.output.spp {
        extra.push((
            if args.converge { "converge.spp" } else { spp_key(args.method) },
            Value::Integer(spp.into()),
        ));
    } else if args.converge && endless(&args.output, args.target_error) {
        extra.push(("converge.spp", Value::Integer(ENDLESS_SPP)));
    } else if args.method == Method::Path && endless(&args.output, None) {
        extra.push(("path.spp", Value::Integer(ENDLESS_SPP)));
    }
    if let Some(error) = args.target_error {
        extra.push(("converge.target_error", Value::Float(error)));
    }
    if let Some(alpha) = &args.alpha {
        extra.push(("decompose.alpha", crate::config::parse_value(alpha)));
    }
    if let Some(denoise) = args.denoise {
        extra.push(("denoise", Value::String(name(denoise))));
    }
    check_outputs(&args.output)?;
    check_samples(args)?;
    let job = args.scene.prepare(&extra, args.output.time_limit, cancel)?;
    let denoiser = job.config.denoise.open(&job.run)?;
    let world = World::new(&job.scene, args.scene.backend, &job.run)?;
    warn_of_camera(&args.scene, &job.run, &world);
    let config = &job.config;
    let inputs = config.inputs(world.diagonal);
    let mut rendered = match args.method {
        Method::Path => path::render(&world, &config.path, config.seed, &job.run)?,
        Method::Decomposition => {
            decomposed(args, &job.scene, &world, &config.decompose, inputs, &job.run)?
        }
        Method::IrradianceCache => {
            with_cache(args, &job.scene, &world, &config.cache, inputs, &job.run)?
        }
        Method::Gather => gather::render(&world, &config.gather, inputs, &job.run)?,
        Method::PointBased => point_based::render(&world, &config.points, inputs, &job.run)?,
        Method::LocalCorrection => {
            local_correction::render(&world, &config.local, &config.record, config.seed, &job.run)?
        }
        Method::PhotonMap => photon_map::render(
            &world,
            inputs.near_cell,
            &config.photon,
            &config.record,
            config.seed,
            &job.run,
        )?,
        Method::Direct => {
            direct::render(&world, &config.record, &config.direct, config.seed, &job.run)?
        }
    };
    if args.converge {
        rendered = converged(args, &world, config, rendered, &job.run)?;
    }
    if let Some(denoiser) = &denoiser {
        denoised(&mut rendered, denoiser, args.method, &job.run)?;
    }
    write_samples(args, &rendered)?;
    if let Some(path) = &args.photons {
        photon_map::write_photons(
            &world,
            inputs.near_cell,
            &config.photon,
            config.seed,
            path,
            &job.run,
        )?;
    }
    finish(&args.scene, &args.output, &name(args.method), &job, &world, rendered)
}

/// Denoises the picture and says by what.
fn denoised(rendered: &mut Rendered, denoiser: &Denoiser, method: Method, run: &Run) -> Result<()> {
    let parts = if method == Method::Path { Parts::Apart } else { Parts::Together };
    denoise(&mut rendered.film, denoiser, parts, run)?;
    let who = format!("Open Image Denoise {}", denoiser.dotted());
    rendered.film.header.insert("nearfar.denoiser".into(), who.clone());
    rendered.stats.insert("denoiser".into(), json!(who));
    Ok(())
}

/// Options that only some methods understand.
fn check_samples(args: &RenderArgs) -> Result<()> {
    let unknown = |option: &str, methods: &str| {
        Err(Error::Usage(format!(
            "{option}: --method {} has none; use {methods}",
            name(args.method)
        )))
    };
    if !matches!(args.method, Method::IrradianceCache | Method::Decomposition) {
        if args.load_cache.is_some() {
            return unknown("--load-cache", "--method decomposition or irradiance-cache");
        }
        if args.save_cache.is_some() {
            return unknown("--save-cache", "--method decomposition or irradiance-cache");
        }
        if args.locations.is_some() {
            return unknown("--locations", "--method decomposition or irradiance-cache");
        }
        if args.locations_png.is_some() {
            return unknown("--locations-png", "--method decomposition or irradiance-cache");
        }
    }
    if args.converge && matches!(args.method, Method::Path | Method::PhotonMap) {
        return unknown(
            "--converge",
            "a method with a picture to start from, such as --method decomposition (nearfar reference converges by itself)",
        );
    }
    if args.photons.is_some() && args.method != Method::PhotonMap {
        return unknown("--photons", "--method photon-map");
    }
    [&args.save_cache, &args.locations, &args.locations_png, &args.photons]
        .into_iter()
        .flatten()
        .try_for_each(|path| check_writable(path))
}

fn with_cache(
    args: &RenderArgs,
    scene: &Scene,
    world: &World,
    settings: &CacheSettings,
    inputs: Inputs<'_>,
    run: &Run,
) -> Result<Rendered> {
    // The key reads the whole scene: made only where there is a file to compare it with.
    let key = || store::key(Fingerprint::new(scene), &inputs, settings);
    let earlier = args.load_cache.as_deref().map(|path| store::load(path, &key())).transpose()?;
    let (rendered, cache) = cache::render(world, settings, inputs, earlier, run)?;
    if let Some(path) = &args.save_cache {
        store::save(path, &key(), &cache.records)?;
    }
    Ok(rendered)
}

fn decomposed(
    args: &RenderArgs,
    scene: &Scene,
    world: &World,
    settings: &DecomposeSettings,
    inputs: Inputs<'_>,
    run: &Run,
) -> Result<Rendered> {
    let key = || decompose::store::key(Fingerprint::new(scene), &inputs, settings, world.diagonal);
    let prepared = match &args.load_cache {
        Some(path) => decompose::resume(
            world,
            settings,
            inputs,
            decompose::store::load(path, &key(), &inputs, settings)?,
            run,
        )?,
        None => decompose::prepare(world, settings, inputs, run)?,
    };
    if let Some(path) = &args.save_cache {
        let _phase = run.phase("save", 1);
        decompose::store::save(path, &key(), &decompose::store::Known::new(&prepared), settings)?;
    }
    decompose::picture(world, settings, &prepared, inputs.seed, run)
}

/// Path-traced halves of independent seeds bring the model's picture towards the truth.
fn converged(
    args: &RenderArgs,
    world: &World,
    config: &RenderConfig,
    model: Rendered,
    run: &Run,
) -> Result<Rendered> {
    let mut sample = |half: usize, earlier: Option<&Film>, spp: u32| {
        let settings = PathSettings { spp, target_error: 0.0, ..config.path.clone() };
        path::reference(
            world,
            &settings,
            hash64(config.seed ^ CONVERGE_KEY ^ half as u64),
            run,
            earlier,
            true,
        )
        .map(|r| r.film)
    };
    let rendered = converge::render(model, &config.converge, &mut sample, run)?;
    if !args.scene.quiet {
        let of = |key: &str| {
            rendered.stats.get(&format!("converge_{key}")).and_then(serde_json::Value::as_f64)
        };
        match (of("spp"), of("relmse"), of("bias"), of("noise"), of("model"), of("path")) {
            (Some(spp), Some(relmse), Some(bias), Some(noise), Some(model), Some(path)) => {
                eprintln!(
                    "note: {spp:.1} samples a pixel; estimated relMSE {relmse:.2e} (bias {bias:.2e}, noise {noise:.2e}); model alone {model:.2e}, samples alone {path:.2e}"
                );
            }
            _ => eprintln!("note: no time for samples: the picture is the model's"),
        }
    }
    Ok(rendered)
}

/// Keeps the seeds of the halves apart from every other use of the seed.
const CONVERGE_KEY: u64 = 0x636f_6e76_6572_6765;

/// Stops by which the picture under the dots is darkened.
const BACKDROP_STOPS: f32 = -2.0;

fn write_samples(args: &RenderArgs, rendered: &Rendered) -> Result<()> {
    if let Some(path) = &args.locations {
        rendered.locations.write_ply(path)?;
    }
    if let (Some(path), Some(marks)) = (&args.locations_png, rendered.film.channels.get("location"))
    {
        let exposure = args.output.exposure + BACKDROP_STOPS;
        let mut pixels = rendered.film.rgb("").unwrap_or_default();
        mark(&mut pixels, marks, exposure);
        film::write_png_rgb(&pixels, rendered.film.width, rendered.film.height, path, exposure)?;
    }
    Ok(())
}

/// # Errors
/// Whatever stops a render; see [`Error`].
pub(super) fn reference(args: &ReferenceArgs, cancel: &Arc<AtomicBool>) -> Result<()> {
    let mut extra = Vec::new();
    if let Some(spp) = args.output.spp {
        extra.push(("path.spp", Value::Integer(spp.into())));
    } else if endless(&args.output, args.target_error) {
        extra.push(("path.spp", Value::Integer(ENDLESS_SPP)));
    }
    if let Some(error) = args.target_error {
        extra.push(("path.target_error", Value::Float(error)));
    }
    check_outputs(&args.output)?;
    let earlier = args.resume.as_deref().map(film::read_exr).transpose()?;
    let job = args.scene.prepare(&extra, args.output.time_limit, cancel)?;
    let world = World::new(&job.scene, args.scene.backend, &job.run)?;
    warn_of_camera(&args.scene, &job.run, &world);
    let rendered = path::reference(
        &world,
        &job.config.path,
        job.config.seed,
        &job.run,
        earlier.as_ref(),
        !args.no_state,
    )?;
    finish(&args.scene, &args.output, &name(Method::Path), &job, &world, rendered)
}

/// At once, so that a user can stop before hours are spent on a black picture.
pub(super) fn warn_of_camera(scene: &SceneOptions, run: &Run, world: &World) {
    if !scene.quiet && run.install(|| camera_inside_wall(world)) {
        eprintln!("warning: {CAMERA_INSIDE_WALL}");
    }
}

pub(super) fn check_outputs(output: &OutputOptions) -> Result<()> {
    if output.output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("exr")) {
        return Err(Error::Usage(format!(
            "--output {}: the image is OpenEXR, name it .exr (--png writes a PNG beside it)",
            output.output.display()
        )));
    }
    if let Some(layer) = output.aov.iter().find(|l| !LAYERS.contains(&layer_of(l))) {
        return Err(Error::Usage(format!(
            "--aov {layer}: no method has such a layer; choose among {}",
            LAYERS.join(", ")
        )));
    }
    check_writable(&output.output)?;
    output.stats.as_deref().map_or(Ok(()), check_writable)
}

/// The name of a choice, as written on the command line.
fn name<T: clap::ValueEnum>(choice: T) -> String {
    clap::ValueEnum::to_possible_value(&choice)
        .map_or_else(String::new, |v| v.get_name().to_owned())
}

/// Layers that some method writes.
const LAYERS: [&str; 23] = [
    "none",
    "direct",
    "indirect",
    "emission",
    "irradiance",
    "far",
    "near",
    "albedo",
    "N",
    "P",
    "depth",
    "cluster",
    "cell",
    "location",
    "noisy",
    "occlusion",
    "open",
    "bent",
    "traced",
    "variance",
    "samples",
    "half0",
    "half1",
];

fn layer_of(channel: &str) -> &str {
    channel.split_once('.').map_or(channel, |(layer, _)| layer)
}

/// Keeps the beauty, the running sums and the named layers; warns of layers that this method does
/// not have.
pub(super) fn keep_layers(film: &mut Film, wanted: &[String], run: &Run) {
    if wanted.is_empty() {
        return;
    }
    for layer in wanted
        .iter()
        .filter(|w| *w != "none" && !film.channels.keys().any(|c| layer_of(c) == layer_of(w)))
    {
        run.warn(format!("--aov {layer}: this method has no such layer"));
    }
    film.channels.retain(|c, _| {
        ["R", "G", "B"].contains(&c.as_str())
            || layer_of(c) == "state"
            || wanted.iter().any(|w| layer_of(w) == layer_of(c))
    });
}

/// The header of an image.
pub(super) fn describe(
    film: &mut Film,
    scene: &SceneOptions,
    method: &str,
    job: &Job,
) -> Result<()> {
    for (key, value) in [
        ("nearfar.version", env!("CARGO_PKG_VERSION").to_owned()),
        ("nearfar.scene", scene.scene.display().to_string()),
        ("nearfar.method", method.to_owned()),
        ("nearfar.seed", job.config.seed.to_string()),
        ("nearfar.settings", job.config.to_table()?.to_string()),
        ("nearfar.seconds", format!("{:.2}", job.start.elapsed().as_secs_f64())),
        ("nearfar.complete", (!job.run.cancelled()).to_string()),
    ] {
        film.header.insert(key.into(), value);
    }
    Ok(())
}

/// Writes image, statistics and notes.
pub(super) fn finish(
    scene: &SceneOptions,
    output: &OutputOptions,
    method: &str,
    job: &Job,
    world: &World,
    rendered: Rendered,
) -> Result<()> {
    let Rendered { mut film, stats, .. } = rendered;
    keep_layers(&mut film, &output.aov, &job.run);
    if !scene.quiet {
        job.run.warnings().iter().for_each(|w| eprintln!("warning: {w}"));
    }
    describe(&mut film, scene, method, job)?;
    {
        let _phase = job.run.phase("write", 1);
        film::write_exr(
            &film,
            &output.output,
            if output.half { Precision::Half } else { Precision::Full },
        )?;
        if output.png {
            film::write_png(&film, &output.output.with_extension("png"), output.exposure)?;
        }
    }
    let mut stats = statistics::collect(&job.run, job.start.elapsed().as_secs_f64(), stats);
    for (key, value) in [
        ("method", json!(method)),
        ("backend", json!(scene.backend)),
        ("width", json!(film.width)),
        ("height", json!(film.height)),
        ("seed", json!(job.config.seed)),
        ("triangles", json!(world.geometry.len())),
    ] {
        stats.insert(key.into(), value);
    }
    if let Some(path) = &output.stats {
        statistics::write(&stats, path)?;
    }
    if scene.verbose {
        job.run
            .seconds()
            .iter()
            .for_each(|(phase, seconds)| eprintln!("{phase:>12} {seconds:8.2} s"));
        eprintln!(
            "{:>12} {:8.2} s, {:.2} s of CPU",
            "total",
            job.start.elapsed().as_secs_f64(),
            statistics::cpu_seconds()
        );
    }
    if job.run.cancelled() { Err(Error::Interrupted) } else { Ok(()) }
}
