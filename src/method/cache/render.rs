//! Fill and final pass in a row.

use rayon::prelude::*;

use super::fill::Cache;
use super::hemisphere::Site;
use super::interpolate::interpolate;
use super::measure::{Derivatives, MeasureSettings, measure};
use super::settings::CacheSettings;
use crate::error::Result;
use crate::film::Layer;
use crate::method::locations::{LOCATION, Locations};
use crate::method::stage::{Inputs, Stage, StageStatistics};
use crate::method::{MethodStatistics, Rendered};
use crate::radiometry::Rgb;
use crate::run::{RayKind, Run};
use crate::shading::World;

/// Layers of the picture beside those of the camera samples.
pub const LAYERS: [Layer; 1] = [LOCATION];

/// What the cache tells of its picture.
#[derive(Clone, Debug, serde::Serialize)]
pub struct CacheStatistics {
    /// Proxy and points.
    #[serde(flatten)]
    pub stage: StageStatistics,
    /// Records in all.
    pub records: usize,
    /// Those of them that were there before.
    pub records_loaded: usize,
    /// Rays of a new record.
    pub rays_per_record: f64,
    /// CPU time of a new record.
    pub microseconds_per_record: f64,
}

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
        let site = Site { p, ng, ns, seed, element: i as u64 };
        let settings = MeasureSettings::new(settings.rays, Derivatives::None);
        let measured = measure(world, &stage.proxy, &site, &settings);
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
    let mut cache = Cache::new(settings, samples.width * samples.height, world);
    for record in earlier.unwrap_or_default() {
        cache.insert(record, None);
    }
    let loaded = cache.records.len();
    let irradiance = fill_and_interpolate(world, settings, &stage, &mut cache, inputs.seed, run)?;
    let mut film = samples.compose(&irradiance);
    let locations = locations(&cache);
    film.set("location", locations.marks(samples));
    let measured = (cache.records.len() - loaded).max(1) as f64;
    let statistics = MethodStatistics::IrradianceCache(CacheStatistics {
        stage: stage.statistics(),
        records: cache.records.len(),
        records_loaded: loaded,
        rays_per_record: cache.rays as f64 / measured,
        microseconds_per_record: cache.measure_seconds * 1e6 / measured,
    });
    Ok((Rendered { film, statistics, locations }, cache))
}
