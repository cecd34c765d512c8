//! The three passes in a row, from nothing or from what is known of the scene.

use serde_json::json;

use super::cluster::Clusters;
use super::extend::extend;
use super::interpolate::FarField;
use super::near::NearTree;
use super::near_boxes::NearBoxes;
use super::near_sets::NearSets;
use super::reconstruct::reconstruct_with;
use super::store::Known;
use super::validity::Sight;
use super::{DecomposeSettings, Lengths, NearVisibility};
use crate::error::{Error, Result};
use crate::method::Rendered;
use crate::method::locations::Locations;
use crate::method::stage::{Inputs, Stage};
use crate::proxy::{Need, Proxy};
use crate::radiometry::Rgb;
use crate::record::{CameraSamples, camera_samples};
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
    /// CPU seconds of pass 2b for the last view, summed over threads.
    pub sample_seconds: f64,
    /// Clusters from before the last view: from a file, or from other cameras.
    pub earlier: usize,
    /// Cell sides that were gathered for the last view alone.
    pub sides_added: usize,
}

/// Proxy, pass 1 and pass 2.
///
/// # Errors
/// As [`Stage::new`].
pub fn prepare(
    world: &World,
    settings: &DecomposeSettings,
    inputs: Inputs<'_>,
    run: &Run,
) -> Result<Prepared> {
    settings.validate()?;
    let stage = Stage::new(world, inputs, run)?;
    let mut prepared = Prepared { stage, ..Prepared::empty(settings.lengths(world.diagonal)) };
    prepared.cover(world, settings, inputs.seed, run)?;
    Ok(prepared)
}

/// As [`prepare`], but from what is known: only what this camera sees and nothing covers is
/// computed.
///
/// # Errors
/// As [`prepare`]; [`Error::Render`] when the known proxy is not of this scene's cells.
pub fn resume(
    world: &World,
    settings: &DecomposeSettings,
    inputs: Inputs<'_>,
    known: Known,
    run: &Run,
) -> Result<Prepared> {
    let mut prepared = Prepared::known(world, settings, inputs, known, run)?;
    prepared.look(world, settings, inputs, true, run)?;
    Ok(prepared)
}

impl Prepared {
    pub(super) fn empty(lengths: Lengths) -> Self {
        let stage = Stage::default();
        Self {
            lengths,
            stage,
            clusters: Clusters::default(),
            sh: Vec::new(),
            sample_seconds: 0.0,
            earlier: 0,
            sides_added: 0,
        }
    }

    /// What is known, without a view; [`Prepared::look`] gives it one.
    ///
    /// # Errors
    /// As [`resume`].
    pub fn known(
        world: &World,
        settings: &DecomposeSettings,
        inputs: Inputs<'_>,
        known: Known,
        run: &Run,
    ) -> Result<Self> {
        settings.validate()?;
        inputs.record.validate()?;
        let clusters = known.clusters();
        let proxy = Proxy::restore(world, inputs.proxy(), known.proxy, run)?;
        let stage = Stage { proxy, samples: CameraSamples::default() };
        Ok(Self { stage, clusters, sh: known.sh, ..Self::empty(settings.lengths(world.diagonal)) })
    }

    /// Turns to the world's present camera; with `extend`, proxy and clusters are extended to all
    /// it sees, else they stay.
    ///
    /// # Errors
    /// [`Error::Interrupted`].
    pub fn look(
        &mut self,
        world: &World,
        settings: &DecomposeSettings,
        inputs: Inputs<'_>,
        extend: bool,
        run: &Run,
    ) -> Result<()> {
        self.sides_added = 0;
        self.sample_seconds = 0.0;
        if extend {
            let views = std::slice::from_ref(&world.camera);
            let more = self.stage.proxy.need(world, Need::Views(views), run)?;
            self.sides_added = more.sides;
        }
        self.stage.samples = camera_samples(world, inputs.record, inputs.direct, inputs.seed, run)?;
        if extend {
            return self.cover(world, settings, inputs.seed, run);
        }
        self.earlier = self.clusters.len();
        self.clusters.forget_members();
        Ok(())
    }

    /// Clusters for every recorded point that has none.
    fn cover(
        &mut self,
        world: &World,
        settings: &DecomposeSettings,
        seed: u64,
        run: &Run,
    ) -> Result<()> {
        self.earlier = self.clusters.len();
        let Stage { proxy, samples } = &self.stage;
        let points = &samples.points;
        let stride = settings.record_stride;
        let chosen = |&i: &u32| {
            let pixel = points.pixel[i as usize];
            (pixel % samples.width) % stride == 0 && (pixel / samples.width) % stride == 0
        };
        let chosen: Vec<u32> = (0..points.len() as u32).filter(chosen).collect();
        (_, self.sample_seconds) = extend(
            world,
            proxy,
            points,
            chosen,
            &mut self.clusters,
            &mut self.sh,
            settings,
            &self.lengths,
            seed,
            run,
        )?;
        Ok(())
    }
}

/// The clusters' centres; each belongs to the pixel whose point lies nearest.
fn locations(prepared: &Prepared) -> Locations {
    let Prepared { clusters, sh, stage, .. } = prepared;
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
    let (samples, proxy) = (&prepared.stage.samples, &prepared.stage.proxy);
    let tree = settings.sums_cells().then(|| {
        let _phase = run.phase("reconstruct", 1);
        run.install(|| NearTree::new(proxy))
    });
    let field = FarField::new(
        &prepared.clusters,
        &prepared.sh,
        prepared.lengths.blend_radius,
        settings.blend_normal_power,
    );
    let field = if settings.sight {
        field.with_sight(Sight::new(world, &prepared.clusters))
    } else {
        field
    };
    if settings.near_visibility == NearVisibility::TrianglesRays
        && (0..prepared.clusters.len()).any(|c| prepared.clusters.members_of(c).is_empty())
    {
        let fix = "\"triangles+rays\" starts rays from the points of every cluster, which clusters of a file or of other views have lost; use \"rays\"";
        return Err(Error::setting("decompose.near_visibility", fix));
    }
    let sets = tree
        .as_ref()
        .filter(|_| settings.near_visibility == NearVisibility::TrianglesRays)
        .map(|tree| {
            let _phase = run.phase("sets", 1);
            let Lengths { alpha, blend_radius, .. } = prepared.lengths;
            run.install(|| {
                NearSets::new(
                    world,
                    proxy,
                    tree,
                    &samples.points,
                    &prepared.clusters,
                    settings,
                    alpha,
                    blend_radius,
                    seed,
                    run,
                )
            })
        });
    let near = match boxes.filter(|_| settings.near_visibility == NearVisibility::Rays) {
        Some(boxes) => {
            Some(boxes.at(world, proxy, &samples.points, &field, settings, seed, run)?)
        }
        None => None,
    };
    let found = reconstruct_with(
        world,
        proxy,
        &samples.points,
        &field,
        tree.as_ref(),
        sets.as_ref(),
        near.as_deref(),
        settings,
        seed,
        run,
    )?;

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
    let mut stats = prepared.stage.stats();
    for (key, value) in [
        ("alpha", json!(prepared.lengths.alpha)),
        ("clusters", json!(prepared.clusters.len())),
        ("rays_per_cluster", json!(settings.rays)),
        ("clusters_loaded", json!(prepared.earlier)),
        ("sides_added", json!(prepared.sides_added)),
        (
            "microseconds_per_cluster",
            json!(
                prepared.sample_seconds * 1e6
                    / (prepared.clusters.len() - prepared.earlier).max(1) as f64
            ),
        ),
        ("own_samples", json!(found.iter().filter(|f| f.cluster.is_none()).count())),
        ("near_triangles_mean", json!(near_cells as f64 / samples.points.len().max(1) as f64)),
    ] {
        stats.insert(key.into(), value);
    }
    Ok(Rendered { film, stats, locations })
}
