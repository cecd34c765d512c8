//! The picture that pass 3 makes, with its layers, statistics and the places that were sampled.

use super::Pass3;
use crate::error::Result;
use crate::film::Layer;
use crate::method::decompose::far::SampledClusters;
use crate::method::decompose::near::boxes::NearBoxes;
use crate::method::decompose::{DecomposeSettings, Prepared, prepare};
use crate::method::locations::{LOCATION, Locations};
use crate::method::stage::{Inputs, StageStatistics};
use crate::method::{MethodStatistics, Rendered};
use crate::radiometry::Rgb;
use crate::run::Run;
use crate::shading::World;

const FAR: Layer = Layer::rgb("far", "far part of the indirect light, W/(sr m²)");
const NEAR: Layer = Layer::rgb("near", "near part of the indirect light, may be negative");
const CLUSTER: Layer =
    Layer::one("cluster", "id", "cluster of the largest weight; −1 where there is none");

/// Layers of the picture beside those of the camera samples.
pub const LAYERS: [Layer; 4] = [FAR, NEAR, CLUSTER, LOCATION];

/// What the decomposition tells of its picture.
#[derive(Clone, Debug, serde::Serialize)]
pub struct DecomposeStatistics {
    /// Proxy and points.
    #[serde(flatten)]
    pub stage: StageStatistics,
    /// Near/far distance, scene units.
    pub alpha: f32,
    /// Clusters in all.
    pub clusters: usize,
    /// Far rays of a cluster.
    pub rays_per_cluster: u32,
    /// Clusters of a file or of other views.
    pub clusters_loaded: usize,
    /// Sides of the proxy gathered for this view alone.
    pub sides_added: usize,
    /// CPU time of a new cluster.
    pub microseconds_per_cluster: f64,
    /// Points that no cluster may serve.
    pub own_samples: usize,
    /// Near surfaces that took part in a point's light.
    pub near_triangles_mean: f64,
}

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
/// [`crate::error::Error::Interrupted`].
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
/// [`crate::error::Error::Interrupted`].
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
    film.set_rgb(FAR.name, &samples.reflect(&far));
    film.set_rgb(NEAR.name, &samples.reflect(&near));
    let mut id = vec![-1.0f32; (samples.width * samples.height) as usize];
    for (f, &pixel) in found.iter().zip(&samples.points.pixel).rev() {
        id[pixel as usize] = f.cluster.map_or(-1.0, |c| c as f32);
    }
    film.set("cluster.id", id);
    let locations = locations(prepared);
    film.set(LOCATION.name, locations.marks(samples));

    let near_cells: u64 = found.iter().map(|f| u64::from(f.near_cells)).sum();
    let clusters = prepared.sampled.clusters.len();
    let statistics = MethodStatistics::Decomposition(DecomposeStatistics {
        stage: prepared.stage.statistics(),
        alpha: prepared.lengths.alpha,
        clusters,
        rays_per_cluster: settings.rays,
        clusters_loaded: prepared.earlier,
        sides_added: prepared.sides_added,
        microseconds_per_cluster: prepared.sample_seconds * 1e6
            / (clusters - prepared.earlier).max(1) as f64,
        own_samples: found.iter().filter(|f| f.cluster.is_none()).count(),
        near_triangles_mean: near_cells as f64 / samples.points.len().max(1) as f64,
    });
    Ok(Rendered { film, statistics, locations })
}
