//! Which function a [`Method`] is.

use std::path::Path;

use super::checkpoint::Tracer;
use super::kept::Kept;
use super::renderer::Renderer;
use crate::atomic_file;
use crate::config::RenderConfig;
use crate::error::Result;
use crate::film::read_whole_exr;
use crate::method::{
    Method, Rendered, cache, decompose, direct, final_gather, local_correction, photon_map,
    point_based,
};
use crate::scene::Fingerprint;

/// The method's own picture, before anything that all methods share is done to it.
pub(super) fn picture(
    renderer: &Renderer<'_>,
    config: &RenderConfig,
    method: Method,
    kept: &Kept,
) -> Result<Rendered> {
    kept.check(method)?;
    let (world, run) = (renderer.world(), renderer.run());
    let (seed, inputs) = (config.seed, config.inputs(world.around.extent));
    match method {
        Method::Decomposition | Method::Course => decomposed(renderer, config, kept),
        Method::IrradianceCache => cached(renderer, config, kept),
        Method::Gather => final_gather::render(world, &config.gather, inputs, run),
        Method::Path => traced(renderer, config, kept),
        Method::PointBased => point_based::render(world, &config.point_based, inputs, run),
        Method::LocalCorrection => {
            local_correction::render(world, &config.local, &config.record, seed, run)
        }
        Method::Direct => direct::render(world, &config.record, &config.direct, seed, run),
        Method::PhotonMap => photon_map::render(world, inputs, run),
    }
}

fn traced(renderer: &Renderer<'_>, config: &RenderConfig, kept: &Kept) -> Result<Rendered> {
    let earlier = kept.resume.as_deref().map(read_whole_exr).transpose()?;
    let mut tracer = Tracer::new((renderer.world(), config, renderer.run()), Method::Path, kept);
    tracer.picture(earlier, false)
}

fn decomposed(renderer: &Renderer<'_>, config: &RenderConfig, kept: &Kept) -> Result<Rendered> {
    use decompose::store;
    let (world, run) = (renderer.world(), renderer.run());
    let (settings, inputs) = (&config.decompose, config.inputs(world.around.extent));
    // The key reads the whole scene: made only where there is a file to compare it with.
    let key = || store::key(Fingerprint::new(renderer.scene()), &inputs, settings, world);
    let prepared = match &kept.load {
        Some(path) => {
            let known = store::load(path, &key(), &inputs, settings)?;
            decompose::resume(world, settings, inputs, known, run)?
        }
        None => decompose::prepare(world, settings, inputs, run)?,
    };
    if let Some(path) = &kept.save {
        let _phase = run.phase("save", 1);
        let known = store::Known::new(&prepared);
        let save = |path: &Path| store::save(path, &key(), &known, &inputs, settings);
        atomic_file::rescued(path, save)?;
    }
    decompose::picture(world, settings, &prepared, inputs.seed, run)
}

fn cached(renderer: &Renderer<'_>, config: &RenderConfig, kept: &Kept) -> Result<Rendered> {
    use cache::store;
    let (world, run) = (renderer.world(), renderer.run());
    let (settings, inputs) = (&config.cache, config.inputs(world.around.extent));
    let key = || store::key(Fingerprint::new(renderer.scene()), &inputs, settings, world);
    let earlier = kept.load.as_deref().map(|path| store::load(path, &key())).transpose()?;
    let (rendered, cache) = cache::render(world, settings, inputs, earlier, run)?;
    if let Some(path) = &kept.save {
        atomic_file::rescued(path, |path| store::save(path, &key(), &cache.records))?;
    }
    Ok(rendered)
}
