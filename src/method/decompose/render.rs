//! The three passes in a row.

use serde_json::json;

use super::cluster::{Clusters, cluster};
use super::far::{self, Proxy};
use super::interpolate::FarField;
use super::near::NearTree;
use super::reconstruct::reconstruct;
use super::{DecomposeSettings, Lengths};
use crate::error::Result;
use crate::method::Rendered;
use crate::photon::{CellRadiosity, PhotonSettings, ProxyStats, solve};
use crate::radiometry::Rgb;
use crate::record::{CameraSamples, RecordSettings, camera_samples};
use crate::run::Run;
use crate::sh::ShRgb;
use crate::shading::{DirectSettings, World};
use crate::tessellate::Cells;

/// Everything before pass 3; budgets and other callers swap single parts of it.
#[derive(Debug)]
pub struct Prepared {
    /// Lengths in scene units.
    pub lengths: Lengths,
    /// Pieces of surfaces.
    pub cells: Cells,
    /// Radiosity of their sides.
    pub radiosity: CellRadiosity,
    /// What the proxy tells of itself.
    pub proxy_stats: ProxyStats,
    /// Pass 1.
    pub samples: CameraSamples,
    /// Pass 2a.
    pub clusters: Clusters,
    /// Pass 2b: one a cluster.
    pub sh: Vec<ShRgb>,
}

impl Prepared {
    /// The proxy, borrowed.
    pub fn proxy(&self) -> Proxy<'_> {
        Proxy { cells: &self.cells, radiosity: &self.radiosity }
    }
}

/// Settings of all the rooms this method uses.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// Passes 2 and 3.
    pub decompose: &'a DecomposeSettings,
    /// The proxy.
    pub photon: &'a PhotonSettings,
    /// Pass 1.
    pub record: &'a RecordSettings,
    /// Direct light of pass 1.
    pub direct: &'a DirectSettings,
    /// Seed of every random number.
    pub seed: u64,
}

/// Proxy, pass 1 and pass 2.
///
/// # Errors
/// Settings out of range, cells that do not fit memory, [`crate::error::Error::Interrupted`].
pub fn prepare(world: &World, inputs: Inputs<'_>, run: &Run) -> Result<Prepared> {
    let Inputs { decompose: settings, photon, record, direct, seed } = inputs;
    settings.validate()?;
    record.validate()?;
    let lengths = settings.lengths(world.diagonal);
    let cells = {
        let _phase = run.phase("cells", 1);
        run.install(|| Cells::new(&world.geometry, lengths.near_cell))?
    };
    let (radiosity, proxy_stats) = solve(world, &cells, photon, seed, run)?;
    let samples = camera_samples(world, record, direct, seed, run)?;
    let clusters = {
        let _phase = run.phase("cluster", 1);
        let stride = settings.record_stride;
        let chosen = |&i: &u32| {
            let pixel = samples.points.pixel[i as usize];
            (pixel % samples.width) % stride == 0 && (pixel / samples.width) % stride == 0
        };
        let chosen: Vec<u32> = (0..samples.points.len() as u32).filter(chosen).collect();
        run.install(|| cluster(&samples.points, chosen, lengths.cluster_radius, settings.cluster_normal_cos, seed))
    };
    let sh = far::sample(world, Proxy { cells: &cells, radiosity: &radiosity }, &samples.points, &clusters, settings, seed, run)?;
    Ok(Prepared { lengths, cells, radiosity, proxy_stats, samples, clusters, sh })
}

/// 1 in the pixels whose point lies nearest to the centre of a cluster: the sample locations.
fn centers(prepared: &Prepared) -> Vec<f32> {
    let (clusters, samples) = (&prepared.clusters, &prepared.samples);
    let mut marks = vec![0.0; (samples.width * samples.height) as usize];
    for (c, center) in clusters.center.iter().enumerate() {
        let distance = |i: u32| samples.points.p[i as usize].distance_squared(*center);
        if let Some(&nearest) = clusters.members_of(c).iter().min_by(|&&a, &&b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b))) {
            marks[samples.points.pixel[nearest as usize] as usize] = 1.0;
        }
    }
    marks
}

/// The picture by the three passes, with layers `far`, `near`, `cluster.id` and `cluster.center` beside the common ones.
///
/// # Errors
/// As [`prepare`].
pub fn render(world: &World, inputs: Inputs<'_>, run: &Run) -> Result<Rendered> {
    let prepared = prepare(world, inputs, run)?;
    let settings = inputs.decompose;
    let samples = &prepared.samples;
    let tree = {
        let _phase = run.phase("reconstruct", 1);
        run.install(|| NearTree::new(prepared.proxy()))
    };
    let field = FarField::new(&prepared.clusters, &prepared.sh, prepared.lengths.blend_radius, settings.blend_normal_power);
    let found = reconstruct(world, prepared.proxy(), &samples.points, &field, &tree, settings, inputs.seed, run)?;

    let irradiance: Vec<Rgb> = found.iter().map(|f| f.total).collect();
    let far: Vec<Rgb> = found.iter().map(|f| f.far).collect();
    let near: Vec<Rgb> = found.iter().map(|f| f.total - f.far).collect();
    let mut film = samples.compose(&irradiance);
    film.set_rgb("far", &samples.reflect(&far));
    film.set_rgb("near", &samples.reflect(&near));
    let mut id = vec![-1.0f32; (samples.width * samples.height) as usize];
    for (f, &pixel) in found.iter().zip(&samples.points.pixel).rev() {
        id[pixel as usize] = f.cluster as f32;
    }
    film.set("cluster.id", id);
    film.set("cluster.center", centers(&prepared));

    let near_cells: u64 = found.iter().map(|f| u64::from(f.near_cells)).sum();
    let mut stats = serde_json::Map::new();
    for (key, value) in [
        ("alpha", json!(prepared.lengths.alpha)),
        ("cells", json!(prepared.cells.len())),
        ("photons", json!(prepared.proxy_stats.photons)),
        ("clusters", json!(prepared.clusters.len())),
        ("shading_points", json!(samples.points.len())),
        ("rays_per_cluster", json!(settings.rays)),
        ("near_triangles_mean", json!(near_cells as f64 / samples.points.len().max(1) as f64)),
    ] {
        stats.insert(key.into(), value);
    }
    Ok(Rendered { film, stats })
}
