//! Fill and final pass in a row.

use rayon::prelude::*;
use serde_json::json;

use super::fill::Cache;
use super::interpolate::interpolate;
use super::measure::{Derivatives, measure};
use super::settings::CacheSettings;
use crate::error::Result;
use crate::method::Rendered;
use crate::method::locations::Locations;
use crate::method::stage::{Inputs, Stage};
use crate::radiometry::Rgb;
use crate::run::{RayKind, Run};
use crate::shading::World;

/// Extends `cache` to all shading points of the stage and blends it there.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn fill_and_interpolate(
    world: &World,
    settings: &CacheSettings,
    stage: &Stage,
    cache: &mut Cache,
    seed: u64,
    run: &Run,
) -> Result<Vec<Rgb>> {
    cache.fill(world, &stage.proxy, &stage.samples, settings.rays, seed, run)?;
    let points = &stage.samples.points;
    let blended = interpolate(world, cache, points, settings, run)?;
    // Few or none: points that no record reaches, measured by themselves.
    let own = |i: usize| {
        let (p, ng, ns) = (points.p[i], points.ng[i], points.ns[i]);
        let measured = measure(
            world,
            &stage.proxy,
            p,
            ng,
            ns,
            settings.rays,
            Derivatives::None,
            seed,
            i as u64,
        );
        run.rays.add(RayKind::Sample, u64::from(measured.rays));
        measured.irradiance
    };
    let whole = run.install(|| {
        blended.par_iter().enumerate().map(|(i, e)| e.unwrap_or_else(|| own(i))).collect()
    });
    run.check()?;
    Ok(whole)
}

fn locations(cache: &Cache) -> Locations {
    let records = &cache.records;
    Locations {
        p: records.iter().map(|r| r.p).collect(),
        n: records.iter().map(|r| r.n).collect(),
        radius: records.iter().map(|r| (r.radius[0] * r.radius[1]).sqrt()).collect(),
        irradiance: records.iter().map(|r| r.irradiance).collect(),
        pixel: cache.pixel.clone(),
    }
}

/// The picture by irradiance caching, with layer `location` beside the common ones, and the cache.
/// `earlier`: a cache to extend.
///
/// # Errors
/// As [`Stage::new`]; settings out of range.
pub fn render(
    world: &World,
    settings: &CacheSettings,
    inputs: Inputs<'_>,
    earlier: Option<Vec<super::CacheRecord>>,
    run: &Run,
) -> Result<(Rendered, Cache)> {
    settings.validate()?;
    let stage = Stage::new(world, inputs, run)?;
    let samples = &stage.samples;
    let mut cache = Cache::new(settings, samples.width * samples.height, &world.geometry.bounds);
    for record in earlier.unwrap_or_default() {
        cache.insert(record, None);
    }
    let loaded = cache.records.len();
    let irradiance = fill_and_interpolate(world, settings, &stage, &mut cache, inputs.seed, run)?;
    let mut film = samples.compose(&irradiance);
    let locations = locations(&cache);
    film.set("location", locations.marks(samples));
    let measured = (cache.records.len() - loaded).max(1) as f64;
    let mut stats = stage.stats();
    for (key, value) in [
        ("records", json!(cache.records.len())),
        ("records_loaded", json!(loaded)),
        ("rays_per_record", json!(cache.rays as f64 / measured)),
        ("microseconds_per_record", json!(cache.measure_seconds * 1e6 / measured)),
    ] {
        stats.insert(key.into(), value);
    }
    Ok((Rendered { film, stats, locations }, cache))
}
