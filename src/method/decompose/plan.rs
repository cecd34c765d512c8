//! Proxy and clusters for all views of a known camera path at once: nothing that a frame needs
//! appears in the middle of it.
//!
//! A cluster that appears changes the blend of those around it, which is seen as a pop. So every
//! frame is looked at beforehand, by one ray a pixel; boxes of a quarter of `cluster_radius` keep
//! the first two points of every facing that fall into them, in the order of the frames; what is
//! kept is clustered and sampled as the points of one picture would be. The frames then add
//! nothing.
//!
//! From [`World`] and views comes [`Prepared`] without camera samples, for [`Prepared::look`]. The
//! result has the same bits for any number of threads. It takes memory for two points a box of the
//! surface that the path sees, whatever the number of frames. What only falls between the rays of
//! one a pixel gets no cluster of its own: such points blend the clusters in reach, or take the
//! nearest.

use std::collections::HashMap;

use glam::{IVec3, Vec2};
use rayon::prelude::*;

use super::far::extend::extend;
use super::store::Known;
use super::{Context, DecomposeSettings, Prepared};
use crate::error::Result;
use crate::math::{Ray, offset_origin};
use crate::method::stage::{Inputs, Stage};
use crate::proxy::{Need, Proxy};
use crate::record::{CameraSamples, ShadingPoints};
use crate::run::{RayKind, Run};
use crate::scene::Camera;
use crate::shading::{Surface, World};

/// Boxes along a cluster's radius, and points of a facing that one keeps.
const BOXES: f32 = 4.0;
const KEPT: u32 = 2;

/// What the pixels' middles see, row by row.
fn look(world: &World, view: &Camera, run: &Run) -> Vec<Surface> {
    run.rays.add(RayKind::Primary, u64::from(view.width) * u64::from(view.height));
    let row = |y: u32| {
        let see = |x: u32| {
            let dir = view.direction(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
            world.closest(&Ray::new(view.eye, dir))
        };
        (0..view.width).filter_map(see).filter(|s| s.albedo.max_element() > 0.0).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<Surface>> =
        run.install(|| (0..view.height).into_par_iter().map(row).collect());
    rows.concat()
}

/// Points of all views, thinned to two a box and facing.
fn thinned(world: &World, views: &[Camera], side: f32, run: &Run) -> Result<ShadingPoints> {
    let phase = run.phase("plan", views.len() as u64);
    let mut boxes: HashMap<(IVec3, IVec3), u32> = HashMap::new();
    let mut points = ShadingPoints::default();
    for view in views {
        run.check()?;
        for s in look(world, view, run) {
            let kept = boxes
                .entry(((s.p / side).floor().as_ivec3(), (s.ns * 1.5).round().as_ivec3()))
                .or_default();
            if *kept < KEPT {
                *kept += 1;
                points.p.push(offset_origin(s.p, s.ng, world.diagonal));
                points.ng.push(s.ng);
                points.ns.push(s.ns);
            }
        }
        phase.advance(1);
    }
    Ok(points)
}

/// Proxy and clusters for all `views`; what is `known` already stays as it is.
///
/// # Errors
/// As [`super::prepare`]; as [`super::resume`] for a known proxy of other cells.
pub fn plan(
    world: &World,
    settings: &DecomposeSettings,
    inputs: Inputs<'_>,
    views: &[Camera],
    known: Option<Known>,
    run: &Run,
) -> Result<Prepared> {
    let mut prepared = match known {
        Some(known) => {
            let mut prepared = Prepared::known(world, settings, inputs, known, run)?;
            prepared.stage.proxy.need(world, Need::Views(views), run)?;
            prepared
        }
        None => {
            settings.validate()?;
            inputs.validate()?;
            settings.suits(inputs.photon)?;
            let proxy = Proxy::new(world, inputs.proxy(), Need::Views(views), run)?;
            let stage = Stage { proxy, samples: CameraSamples::default() };
            Prepared { stage, ..Prepared::empty(settings.lengths(world.around.extent)) }
        }
    };
    let points = thinned(world, views, prepared.lengths.cluster_radius / BOXES, run)?;
    let all = (0..points.len() as u32).collect();
    let Prepared { stage, sampled, lengths, .. } = &mut prepared;
    let (proxy, lengths, seed) = (&stage.proxy, *lengths, inputs.seed);
    let context = Context { world, proxy, settings, lengths, seed, run };
    prepared.sample_seconds = extend(&context, &points, all, sampled)?;
    prepared.sampled.clusters.forget_members();
    Ok(prepared)
}
