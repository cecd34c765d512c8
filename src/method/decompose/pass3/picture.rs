//! The picture that pass 3 makes, with its layers, statistics and the places that were sampled.

use serde_json::json;

use super::Pass3;
use crate::error::Result;
use crate::method::Rendered;
use crate::method::decompose::far::SampledClusters;
use crate::method::decompose::near::boxes::NearBoxes;
use crate::method::decompose::{DecomposeSettings, Prepared, prepare};
use crate::method::locations::Locations;
use crate::method::stage::Inputs;
use crate::radiometry::Rgb;
use crate::run::Run;
use crate::shading::World;

/// The clusters' centres; each belongs to the pixel whose point lies nearest.
fn locations(prepared: &Prepared) -> Locations {
    let Prepared { sampled: SampledClusters { clusters, sh }, stage, .. } = prepared;
    let points = &stage.samples.points;
    let nearest = |c: usize| {
        let distance = |i: u32| points.p[i as usize].distance_squared(clusters.center[c]);
        let member = clusters
            .members_of(c)
            .iter()
            .min_by(|&&a, &&b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)));
        member.map(|&m| points.pixel[m as usize])
    };
    Locations {
        p: clusters.center.clone(),
        n: clusters.normal.clone(),
        radius: clusters.radius.clone(),
        irradiance: sh.iter().zip(&clusters.normal).map(|(sh, &n)| sh.irradiance(n)).collect(),
        pixel: (0..clusters.len()).map(nearest).collect(),
    }
}

/// The picture by the three passes, with layers `far`, `near`, `cluster.id` and `location` beside
/// the common ones.
///
/// # Errors
/// As [`prepare`].
pub fn render(
    world: &World,
    settings: &DecomposeSettings,
    inputs: Inputs<'_>,
    run: &Run,
) -> Result<Rendered> {
    picture(world, settings, &prepare(world, settings, inputs, run)?, inputs.seed, run)
}

/// Pass 3 and the picture of what is prepared.
///
/// # Errors
/// [`Error::Interrupted`].
pub fn picture(
    world: &World,
    settings: &DecomposeSettings,
    prepared: &Prepared,
    seed: u64,
    run: &Run,
) -> Result<Rendered> {
    picture_with(world, settings, prepared, None, seed, run)
}

/// As [`picture`]; with `boxes`, and near visibility by rays, the near part is kept there from
/// picture to picture.
///
/// # Errors
/// [`Error::Interrupted`].
pub fn picture_with(
    world: &World,
    settings: &DecomposeSettings,
    prepared: &Prepared,
    boxes: Option<&mut NearBoxes>,
    seed: u64,
    run: &Run,
) -> Result<Rendered> {
    let samples = &prepared.stage.samples;
    let mut pass3 = Pass3::new(prepared.context(world, settings, seed, run), &prepared.sampled);
    if let Some(boxes) = boxes {
        pass3 = pass3.keeping(boxes);
    }
    let found = pass3.irradiance(&samples.points)?;

    let irradiance: Vec<Rgb> = found.iter().map(|f| f.total).collect();
    let far: Vec<Rgb> = found.iter().map(|f| f.far).collect();
    let near: Vec<Rgb> = found.iter().map(|f| f.total - f.far).collect();
    let mut film = samples.compose(&irradiance);
    film.set_rgb("far", &samples.reflect(&far));
    film.set_rgb("near", &samples.reflect(&near));
    let mut id = vec![-1.0f32; (samples.width * samples.height) as usize];
    for (f, &pixel) in found.iter().zip(&samples.points.pixel).rev() {
        id[pixel as usize] = f.cluster.map_or(-1.0, |c| c as f32);
    }
    film.set("cluster.id", id);
    let locations = locations(prepared);
    film.set("location", locations.marks(samples));

    let near_cells: u64 = found.iter().map(|f| u64::from(f.near_cells)).sum();
    let clusters = prepared.sampled.clusters.len();
    let mut stats = prepared.stage.stats();
    for (key, value) in [
        ("alpha", json!(prepared.lengths.alpha)),
        ("clusters", json!(clusters)),
        ("rays_per_cluster", json!(settings.rays)),
        ("clusters_loaded", json!(prepared.earlier)),
        ("sides_added", json!(prepared.sides_added)),
        (
            "microseconds_per_cluster",
            json!(prepared.sample_seconds * 1e6 / (clusters - prepared.earlier).max(1) as f64),
        ),
        ("own_samples", json!(found.iter().filter(|f| f.cluster.is_none()).count())),
        ("near_triangles_mean", json!(near_cells as f64 / samples.points.len().max(1) as f64)),
    ] {
        stats.insert(key.into(), value);
    }
    Ok(Rendered { film, stats, locations })
}
