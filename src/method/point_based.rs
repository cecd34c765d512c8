//! `--method point-based`: direct light, and indirect light gathered from surface elements; no ray
//! is shot for occlusion or indirect light.
//!
//! ```text
//! image = direct + albedo · (E_elements + sky · open) / π
//! ```
//!
//! at the shading points of pass 1. The cloud of elements is baked first ([`crate::cloud::bake`])
//! or given. The only rays are the camera's and the shadow rays of direct light, at camera samples
//! and, while baking, at elements. Beside the usual layers there are `occlusion` (0 to 1),
//! `bent.X/Y/Z` (the mean open direction) and `open` (the share of the sky that is seen). The cost
//! is at most a gather per shading point, of which there are about 1.1 a pixel; most are
//! interpolated.

use glam::Vec3;
use rayon::prelude::*;

use super::locations::Locations;
use super::stage::Inputs;
use super::{MethodStatistics, Rendered};
use crate::cloud::{
    Cloud, Gathered, Hierarchy, PointBasedSettings, Receiver, Receivers, accessibility, bake,
    gather_all, gather_some,
};
use crate::error::{Error, Result};
use crate::film::Layer;
use crate::math::{Frame, Ray};
use crate::radiometry::Rgb;
use crate::record::{CameraSamples, ShadingPoints, camera_samples};
use crate::run::{RayKind, Run};
use crate::sampling::{Sobol, Stream, sample_cosine_hemisphere, sample_disc};
use crate::shading::World;

const OCCLUSION: Layer =
    Layer::alone("occlusion", "share of the cosine-weighted hemisphere that is covered, 0 to 1");
const OPEN: Layer = Layer::alone("open", "share of the sky that is seen, 0 to 1");
const BENT: Layer = Layer::xyz("bent", "mean open direction, world space");

/// Layers of the picture beside those of the camera samples.
pub const LAYERS: [Layer; 3] = [OCCLUSION, OPEN, BENT];

/// What is told of the picture.
#[derive(Clone, Debug, serde::Serialize)]
pub struct PointStatistics {
    /// Surface elements.
    pub elements: usize,
    /// Points that were lit.
    pub shading_points: usize,
    /// Gathers that were made; the other points are interpolated.
    pub gathers: usize,
    /// Memory of an element in its tree.
    pub bytes_per_element: usize,
}

/// The shading points as receivers; `samplebase` jitters them within their pixel.
pub fn receivers(
    points: &ShadingPoints,
    settings: &PointBasedSettings,
    seed: u64,
) -> Vec<Receiver> {
    (0..points.len())
        .map(|i| {
            let mut p = points.p[i];
            if settings.samplebase > 0.0 {
                let frame = Frame::from_normal(points.ng[i]);
                let u = Sobol::new(seed, Stream::Receiver, i as u64).sample_2d(0, 8);
                let shift = sample_disc(u) * (0.5 * settings.samplebase * points.footprint[i]);
                p += frame.s * shift.x + frame.t * shift.y;
            }
            Receiver { p, ng: points.ng[i], ns: points.ns[i] }
        })
        .collect()
}

/// What was gathered at the points of a picture.
#[derive(Debug)]
pub struct PointLayers {
    /// Camera samples and points.
    pub samples: CameraSamples,
    /// One a point.
    pub gathered: Vec<Gathered>,
    /// Gathers that were made; the other points are interpolated.
    pub gathers: usize,
}

impl PointLayers {
    /// Layer values per pixel of a quantity of the points.
    pub fn layer(&self, of: impl Fn(&Gathered) -> Rgb) -> Vec<Rgb> {
        self.samples.mean(&self.gathered.iter().map(of).collect::<Vec<_>>())
    }
}

/// Camera samples and a gather at every point, from a cloud and its tree.
///
/// # Errors
/// For settings out of range, [`crate::error::Error::Interrupted`].
pub fn gather_picture(
    world: &World,
    cloud: &Cloud,
    tree: &Hierarchy,
    settings: &PointBasedSettings,
    inputs: Inputs<'_>,
    run: &Run,
) -> Result<PointLayers> {
    settings.validate()?;
    inputs.validate()?;
    let samples = camera_samples(world, inputs.record, inputs.direct, inputs.seed, run)?;
    let at = receivers(&samples.points, settings, inputs.seed);
    let (gathered, gathers) = match accessibility(tree, cloud, world.diagonal, settings, run)? {
        Some(weights) => (
            gather_all(tree, settings, Some(&weights), &at, &world.lights.sky, "gather", run)?,
            at.len(),
        ),
        None => {
            let receivers = Receivers {
                at: &at,
                pixel: &samples.points.pixel,
                footprint: &samples.points.footprint,
                width: samples.width,
            };
            gather_some(tree, settings, receivers, &world.lights.sky, run)?
        }
    };
    Ok(PointLayers { samples, gathered, gathers })
}

/// Camera samples of a scene without elements.
fn unlit(world: &World, inputs: Inputs<'_>, run: &Run) -> Result<PointLayers> {
    inputs.validate()?;
    let samples = camera_samples(world, inputs.record, inputs.direct, inputs.seed, run)?;
    if !samples.points.is_empty() {
        return Err(Error::Usage("a cloud without elements lights nothing; bake it again".into()));
    }
    Ok(PointLayers { samples, gathered: Vec::new(), gathers: 0 })
}

/// The picture.
///
/// # Errors
/// As [`bake`] and [`gather_picture`].
pub fn render(
    world: &World,
    settings: &PointBasedSettings,
    inputs: Inputs<'_>,
    run: &Run,
) -> Result<Rendered> {
    let cloud = bake(world, settings, inputs.proxy(), inputs.seed, run)?;
    render_cloud(world, &cloud, settings, inputs, run)
}

/// The picture from a cloud that is there already.
///
/// # Errors
/// As [`gather_picture`]; clouds without elements.
pub fn render_cloud(
    world: &World,
    cloud: &Cloud,
    settings: &PointBasedSettings,
    inputs: Inputs<'_>,
    run: &Run,
) -> Result<Rendered> {
    let tree = {
        let _phase = run.phase("tree", 1);
        let made = || Hierarchy::new(cloud, settings.hitsides);
        // Without surfaces there are no points either, and nothing to gather.
        let nothing = world.geometry.is_empty() || cloud.is_empty();
        (!nothing).then(|| run.install(made)).transpose()?
    };
    let layers = match &tree {
        Some(tree) => gather_picture(world, cloud, tree, settings, inputs, run)?,
        None => unlit(world, inputs, run)?,
    };
    let sky = &world.lights.sky;
    let irradiance: Vec<Rgb> =
        layers.gathered.iter().map(|g| g.irradiance + g.from_sky(sky)).collect();
    let mut film = layers.samples.compose(&irradiance);
    film.set("occlusion", layers.layer(|g| Rgb::splat(g.occlusion)).iter().map(|c| c.x).collect());
    film.set(
        "open",
        layers
            .layer(|g| Rgb::splat(g.open * std::f32::consts::FRAC_1_PI))
            .iter()
            .map(|c| c.x)
            .collect(),
    );
    film.set_xyz("bent", &layers.layer(|g| g.bent_normal));
    let statistics = MethodStatistics::PointBased(PointStatistics {
        elements: cloud.len(),
        shading_points: layers.gathered.len(),
        gathers: layers.gathers,
        bytes_per_element: tree.map_or(0, |tree| tree.bytes() / tree.len()),
    });
    Ok(Rendered { film, statistics, locations: Locations::default() })
}

/// Occlusion at the points by `rays` cosine rays each, with the distances and the fall-off of
/// `settings`: what the points are compared with.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn traced_occlusion(
    world: &World,
    points: &ShadingPoints,
    settings: &PointBasedSettings,
    rays: u32,
    seed: u64,
    run: &Run,
) -> Result<Vec<f32>> {
    let phase = run.phase("traced", points.len() as u64);
    let out = run.install(|| {
        (0..points.len())
            .into_par_iter()
            .with_min_len(16)
            .map(|i| {
                if run.cancelled() {
                    return 0.0;
                }
                let sobol = Sobol::new(seed, Stream::Gather, i as u64);
                let frame = Frame::from_normal(points.ns[i]);
                let mut sum = 0.0f64;
                for r in 0..rays {
                    let wi: Vec3 =
                        frame.world_from_local(sample_cosine_hemisphere(sobol.sample_2d(r, 0)));
                    if wi.dot(points.ng[i]) <= 0.0 {
                        sum += 1.0;
                        continue;
                    }
                    let ray = Ray { t_max: settings.maxdist, ..Ray::new(points.p[i], wi) };
                    sum += if settings.falloff == 0.0 {
                        f64::from(u8::from(world.rays.occluded(&ray)))
                    } else {
                        world
                            .rays
                            .closest(&ray)
                            .map_or(0.0, |hit| f64::from(settings.weight(hit.t)))
                    };
                }
                run.rays.add(RayKind::Sample, u64::from(rays));
                phase.advance(1);
                (sum / f64::from(rays)) as f32
            })
            .collect()
    });
    run.check()?;
    Ok(out)
}
