//! The three passes in a row.

use serde_json::json;

use super::alpha::adaptive;
use super::cluster::{Clusters, cluster};
use super::far;
use super::interpolate::FarField;
use super::near::NearTree;
use super::near_sets::NearSets;
use super::reconstruct::reconstruct;
use super::validity::{self, Sight};
use super::{AlphaMode, DecomposeSettings, Lengths, NearVisibility};
use crate::error::Result;
use crate::method::Rendered;
use crate::method::locations::Locations;
use crate::method::stage::{Inputs, Stage};
use crate::radiometry::Rgb;
use crate::run::Run;
use crate::sh::ShRgb;
use crate::shading::World;

/// Everything before pass 3; budgets and other callers swap single parts of it.
#[derive(Debug)]
pub struct Prepared {
    /// Lengths in scene units.
    pub lengths: Lengths,
    /// Proxy and pass 1.
    pub stage: Stage,
    /// Pass 2a.
    pub clusters: Clusters,
    /// Pass 2b: one a cluster.
    pub sh: Vec<ShRgb>,
    /// CPU seconds of pass 2b, summed over threads.
    pub sample_seconds: f64,
}

/// Proxy, pass 1 and pass 2.
///
/// # Errors
/// As [`Stage::new`].
pub fn prepare(world: &World, settings: &DecomposeSettings, inputs: Inputs<'_>, run: &Run) -> Result<Prepared> {
    settings.validate()?;
    let stage = Stage::new(world, inputs, run)?;
    let points = &stage.samples.points;
    let lengths = settings.lengths(world.diagonal);
    let clusters = {
        let _phase = run.phase("cluster", 1);
        let stride = settings.record_stride;
        let chosen = |&i: &u32| {
            let pixel = points.pixel[i as usize];
            (pixel % stage.samples.width) % stride == 0 && (pixel / stage.samples.width) % stride == 0
        };
        let chosen: Vec<u32> = (0..points.len() as u32).filter(chosen).collect();
        run.install(|| {
            let clusters = match settings.alpha_mode {
                AlphaMode::Single => cluster(points, chosen, lengths.cluster_radius, settings.cluster_normal_cos, inputs.seed),
                AlphaMode::Adaptive => adaptive(world, points, chosen, settings, inputs.seed, run),
            };
            if settings.sight { validity::separate(world, points, &clusters) } else { clusters }
        })
    };
    let (sh, sample_seconds) = far::sample(world, stage.proxy(), points, &clusters, settings, inputs.seed, run)?;
    Ok(Prepared { lengths, stage, clusters, sh, sample_seconds })
}

/// The clusters' centres; each belongs to the pixel whose point lies nearest.
fn locations(prepared: &Prepared) -> Locations {
    let Prepared { clusters, sh, stage, .. } = prepared;
    let points = &stage.samples.points;
    let nearest = |c: usize| {
        let distance = |i: u32| points.p[i as usize].distance_squared(clusters.center[c]);
        let member = clusters.members_of(c).iter().min_by(|&&a, &&b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)));
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

/// The picture by the three passes, with layers `far`, `near`, `cluster.id` and `location` beside the common ones.
///
/// # Errors
/// As [`prepare`].
pub fn render(world: &World, settings: &DecomposeSettings, inputs: Inputs<'_>, run: &Run) -> Result<Rendered> {
    let prepared = prepare(world, settings, inputs, run)?;
    let (samples, proxy) = (&prepared.stage.samples, prepared.stage.proxy());
    let tree = settings.sums_cells().then(|| {
        let _phase = run.phase("reconstruct", 1);
        run.install(|| NearTree::new(proxy))
    });
    let field = FarField::new(&prepared.clusters, &prepared.sh, prepared.lengths.blend_radius, settings.blend_normal_power);
    let field = if settings.sight { field.with_sight(Sight::new(world, &samples.points, &prepared.clusters)) } else { field };
    let sets = tree.as_ref().filter(|_| settings.near_visibility == NearVisibility::TrianglesRays).map(|tree| {
        let _phase = run.phase("sets", 1);
        let Lengths { alpha, blend_radius, .. } = prepared.lengths;
        run.install(|| NearSets::new(world, proxy, tree, &samples.points, &prepared.clusters, settings, alpha, blend_radius, inputs.seed, run))
    });
    let found = reconstruct(world, proxy, &samples.points, &field, tree.as_ref(), sets.as_ref(), settings, inputs.seed, run)?;

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
    let locations = locations(&prepared);
    film.set("location", locations.marks(samples));

    let near_cells: u64 = found.iter().map(|f| u64::from(f.near_cells)).sum();
    let mut stats = prepared.stage.stats();
    for (key, value) in [
        ("alpha", json!(prepared.lengths.alpha)),
        ("clusters", json!(prepared.clusters.len())),
        ("rays_per_cluster", json!(settings.rays)),
        ("microseconds_per_cluster", json!(prepared.sample_seconds * 1e6 / prepared.clusters.len().max(1) as f64)),
        ("own_samples", json!(found.iter().filter(|f| f.cluster.is_none()).count())),
        ("near_triangles_mean", json!(near_cells as f64 / samples.points.len().max(1) as f64)),
    ] {
        stats.insert(key.into(), value);
    }
    Ok(Rendered { film, stats, locations })
}
