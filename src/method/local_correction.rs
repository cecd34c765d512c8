//! `--method local-correction`: a scene lit by hand, its flat ambient term corrected by the
//! surfaces that are near `[Course07]`.
//!
//! ```text
//! off   E = E_lights + ∫ L_ambient (n·w) dw
//! on    E = E_lights + ∫_{near} B/π (n·w) dw + ∫_{not near} L_ambient (n·w) dw
//!       lights without shadows, one ambient field for all
//! ```
//! What the near surfaces send is added and what the ambient field had claimed for the directions
//! they cover is taken away: contact shadows and local bleeding. Near is the far field's alpha
//! here: `local.reach`; coverage fades out over its second half. Near surfaces are elements
//! ([`crate::cloud`]) with B = albedo · (E_lights + E_ambient), so overlap is dealt with by the
//! raster. The ambient field: `local.ambient` holds one radiance for all directions, or 4 or 9 SH
//! coefficients (order l² + l + m, world axes).
//!
//! Guarantees  no ray but the camera's: no shadow, sample or visibility ray. Irradiance is never
//!             negative.
//! Not         shadows of the lights, and anything farther than the reach. Cost  a gather over near
//!             elements per shading point.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::locations::Locations;
use super::{MethodStatistics, Rendered};
use crate::cloud::{Cloud, Gather, Hierarchy, HitSides, PointBasedSettings, Receiver, dice};
use crate::error::{Error, Result};
use crate::length::Length;
use crate::math::offset_origin;
use crate::radiometry::Rgb;
use crate::record::{RecordSettings, camera_samples};
use crate::run::Run;
use crate::sampling::{Sobol, Stream};
use crate::settings::section;
use crate::sh::ShRgb;
use crate::shading::{DirectSettings, World};

/// Points that are gathered at, and kept, at a time.
const BLOCK: usize = 64;

/// What the local correction tells of its picture.
#[derive(Clone, Debug, serde::Serialize)]
pub struct LocalStatistics {
    /// Points that were lit.
    pub shading_points: usize,
    /// Surface elements asked for.
    pub elements: u64,
}

section! {
    /// Local correction of a flat ambient term.
    pub struct LocalSettings in "local", checked by together {
        /// Correct; without it the flat ambient term stays.
        correction: bool = true;
        /// Ambient radiance: one RGB triple (all directions alike), or 4 or 9 triples of SH
        /// coefficients.
        ambient: Vec<[f32; 3]> = vec![[0.3; 3]], unit "W·sr⁻¹·m⁻²";
        /// What is nearer corrects.
        reach: Length = Length::Percent(10.0), in above(0.0);
        /// Surface elements.
        elements: u64 = 200_000, in from(1.0).to(400e6), unit "elements";
        /// Points on lights with extent, per shading point.
        light_samples: u32 = 16, in from(1.0).to(4096.0), unit "points";
    }
}

impl LocalSettings {
    fn together(&self) -> Result<()> {
        if ![1, 4, 9].contains(&self.ambient.len())
            || self.ambient.iter().flatten().any(|v| !v.is_finite())
        {
            return Err(Error::setting(
                "local.ambient",
                "write one RGB triple, or 4 or 9 triples of SH coefficients, all finite",
            ));
        }
        Ok(())
    }

    fn field(&self) -> ShRgb {
        let mut field = ShRgb::default();
        for (c, v) in field.0.iter_mut().zip(&self.ambient) {
            *c = Rgb::from_array(*v);
        }
        if self.ambient.len() == 1 {
            // A constant of 1 has the coefficient √(4π).
            field.0[0] *= (4.0 * std::f32::consts::PI).sqrt();
        }
        field
    }
}

/// Irradiance of the lights as if nothing stood in their way.
fn unshadowed(world: &World, p: Vec3, ng: Vec3, n: Vec3, count: u32, sobol: &Sobol) -> Rgb {
    if world.lights.is_empty() {
        return Rgb::ZERO;
    }
    let origin = offset_origin(p, ng, world.diagonal);
    let count = if world.lights.is_one_delta() { 1 } else { count };
    let one = |i: u32| {
        let pick = ((i as f32 + sobol.sample_1d(i, 0)) / count as f32).min(0.999_999_9);
        let light = world.lights.sample(origin, n, pick, sobol.sample_2d(i, 1))?;
        (n.dot(light.wi) > 0.0 && ng.dot(light.wi) > 0.0).then(|| light.weight * n.dot(light.wi))
    };
    (0..count).filter_map(one).sum::<Rgb>() / count as f32
}

/// The near surfaces and what leaves them.
fn near_surfaces(
    world: &World,
    settings: &LocalSettings,
    field: &ShRgb,
    seed: u64,
) -> Result<Hierarchy> {
    let (geometry, wanted) = (
        &world.geometry,
        PointBasedSettings { elements: settings.elements, ..PointBasedSettings::default() },
    );
    let pieces = dice(geometry, wanted.dicing())?;
    let (mut cloud, from) = Cloud::from_pieces(geometry, &pieces);
    let leaving = |sign: f32| -> Vec<Rgb> {
        from.par_iter()
            .map(|&i| {
                let piece = &pieces[i as usize];
                let b = piece.at(Vec2::splat(0.5));
                let s = geometry.surface(piece.triangle, b.x, b.y);
                let sobol =
                    Sobol::new(seed, Stream::Element, 2 * u64::from(i) + u64::from(sign < 0.0));
                let lights = unshadowed(
                    world,
                    s.p,
                    s.ng * sign,
                    s.ns * sign,
                    settings.light_samples,
                    &sobol,
                );
                s.albedo * (lights + field.irradiance(s.ns * sign)).max(Rgb::ZERO)
            })
            .collect()
    };
    let (front, back) = (leaving(1.0), leaving(-1.0));
    cloud.set(Cloud::RADIOSITY, front);
    cloud.set(Cloud::RADIOSITY_BACK, back);
    Hierarchy::new(&cloud, HitSides::Both)
}

/// The picture; layers `direct` (the lights), `indirect` and `irradiance` (the ambient term,
/// corrected or not).
///
/// # Errors
/// For settings out of range, [`Error::Interrupted`].
pub fn render(
    world: &World,
    settings: &LocalSettings,
    record: &RecordSettings,
    seed: u64,
    run: &Run,
) -> Result<Rendered> {
    settings.validate()?;
    record.validate()?;
    let field = settings.field();
    let samples = camera_samples(
        world,
        record,
        &DirectSettings { light_samples: Some(0), ..DirectSettings::default() },
        seed,
        run,
    )?;
    let points = &samples.points;
    let lights: Vec<Rgb> = run.install(|| {
        (0..points.len())
            .into_par_iter()
            .map(|i| {
                unshadowed(
                    world,
                    points.p[i],
                    points.ng[i],
                    points.ns[i],
                    settings.light_samples,
                    &Sobol::new(seed, Stream::Direct, i as u64),
                )
            })
            .collect()
    });
    let ambient: Vec<Rgb> = if settings.correction && !points.is_empty() {
        let tree = {
            let _phase = run.phase("tree", 1);
            run.install(|| near_surfaces(world, settings, &field, seed))?
        };
        let reach = settings.reach.resolve(world.around.extent);
        let near = PointBasedSettings { maxdist: reach, ..PointBasedSettings::default() };
        let phase = run.phase("gather", points.len() as u64);
        let gather = Gather::new(&tree, &near).fading(reach);
        phase.blocks((points.len(), BLOCK), gather, |gather, range| {
            let one = |i: usize| {
                let receiver = Receiver { p: points.p[i], ng: points.ng[i], ns: points.ns[i] };
                let (near, rest) = gather.gather_under(&receiver, &|w| field.radiance(w));
                (near.irradiance + rest).max(Rgb::ZERO)
            };
            range.map(one).collect()
        })?
    } else {
        points.ns.iter().map(|&n| field.irradiance(n).max(Rgb::ZERO)).collect()
    };
    run.check()?;
    let together: Vec<Rgb> = lights.iter().zip(&ambient).map(|(a, b)| *a + *b).collect();
    let mut film = samples.compose(&together);
    film.set_rgb("direct", &samples.reflect(&lights));
    film.set_rgb("indirect", &samples.reflect(&ambient));
    film.set_rgb("irradiance", &samples.mean(&ambient));
    let statistics = MethodStatistics::LocalCorrection(LocalStatistics {
        shading_points: points.len(),
        elements: settings.elements,
    });
    Ok(Rendered { film, statistics, locations: Locations::default() })
}
