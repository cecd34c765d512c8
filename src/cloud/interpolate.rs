//! Gathers at few places of a picture and interpolation between them, as far as the values found
//! say that it may be done.
//!
//! The picture is cut into blocks of 16 pixels, then 8, 4, 2 and 1. At each size, every block that
//! holds points still without a value gathers in its middle. Values of the other points are moving
//! least squares fits, linear in the plane of the point p, over the places r around it,
//!
//! ```text
//! v(p) = Σ_r v_r w_r (c₀ + c·x_r)        w = 1 / (x² + h²)
//! ```
//!
//! which reproduce linear fields exactly. A value is accepted if all of this holds; with n places:
//!
//! * The places have like normals and lie about in the plane of p.
//! * Σ |weights| ≤ 1.6, so that p lies among the places and not beyond them.
//! * The nearest place lies within √maxvariation · R, or in the same pixel. R is the harmonic mean
//!   distance to what is seen `[Ward88]`, at most `maxdist` and 1 / falloff, and 0.3 of that with
//!   three places or fewer. This catches contact shadows that lie between places.
//! * The residual of the fit, times n / (n − 3), is at most `maxvariation` of occlusion and three
//!   times that of light. This catches shadows and light that do not depend on distance.
//!
//! What is not accepted waits for the places of the next finer blocks; single pixels gather for
//! themselves.
//!
//! Input is a [`Hierarchy`] and receivers with their pixels; output is one [`Gathered`] a receiver,
//! the same for any number of threads, that lies between the values it comes from. With
//! `maxvariation` 0 there is a gather everywhere. Errors are not bounded: whatever is smaller than
//! blocks and far away can be missed. A receiver costs about 1 µs beside the gathers.

use glam::{Mat3, Vec2, Vec3};
use rayon::prelude::*;

use super::radiosity::gather_all;
use super::{Gathered, Hierarchy, Overlap, PointBasedSettings, Receiver};
use crate::error::Result;
use crate::math::Frame;
use crate::run::Run;
use crate::shading::Sky;

/// Receivers of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Receivers<'a> {
    /// Where.
    pub at: &'a [Receiver],
    /// Pixel of each (row · width + column).
    pub pixel: &'a [u32],
    /// Side of a pixel there, scene units.
    pub footprint: &'a [f32],
    /// Columns of the picture.
    pub width: u32,
}

/// Sides of blocks.
const BLOCKS: [u32; 5] = [16, 8, 4, 2, 1];
/// Least cosine between the normals of a place and a receiver.
const LIKE_NORMALS: f32 = 0.94;
/// Largest slope of the line from a place to a receiver against the receiver's plane.
const LIKE_PLANE: f32 = 0.15;
/// Most places that a value comes from.
const MOST: usize = 24;
/// Largest Σ |weights|.
const INSIDE: f32 = 1.6;
/// Places in this many pixels, those of the same one, are near enough, whatever is near by.
const ADJACENT: f32 = 0.5;
/// Distance over harmonic mean distance that is accepted, times √maxvariation.
const REACH: f32 = 1.0;
/// Coefficients of a fit: with no more places than these, its residual says nothing.
const COEFFICIENTS: usize = 3;
/// [`REACH`] times this is accepted there.
const FEW: f32 = 0.3;
/// Residual of light over that of occlusion.
const LIGHT: f32 = 3.0;
/// Places of unlike surfaces in one block.
const SURFACES: usize = 3;

/// A gather that was made.
#[derive(Clone, Copy, Debug)]
struct Place {
    receiver: u32,
    x: u32,
    y: u32,
    value: Gathered,
}

/// Values of receivers, and the receivers that are left.
type Given = (Vec<(u32, Gathered)>, Vec<u32>);

/// Receivers without a value in a block.
#[derive(Clone, Debug, Default)]
struct Block {
    x: u32,
    y: u32,
    rest: Vec<u32>,
}

/// Gathers for all receivers; second the number of gathers that were made.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn gather_some(
    tree: &Hierarchy,
    settings: &PointBasedSettings,
    receivers: Receivers<'_>,
    sky: &Sky,
    run: &Run,
) -> Result<(Vec<Gathered>, usize)> {
    if settings.maxvariation <= 0.0 || settings.overlap != Overlap::Raster {
        return Ok((
            gather_all(tree, settings, None, receivers.at, sky, "gather", run)?,
            receivers.at.len(),
        ));
    }
    let mut out = vec![Gathered::default(); receivers.at.len()];
    let mut places: Vec<Place> = Vec::new();
    let mut blocks = first_blocks(receivers);
    for (level, side) in BLOCKS.into_iter().enumerate() {
        let chosen: Vec<u32> = run
            .install(|| blocks.par_iter().map(|b| choose(b, side, receivers)).collect::<Vec<_>>())
            .concat();
        let at: Vec<Receiver> = chosen.iter().map(|&i| receivers.at[i as usize]).collect();
        let values = gather_all(tree, settings, None, &at, sky, "gather", run)?;
        places.extend(chosen.iter().zip(values).map(|(&receiver, value)| {
            let pixel = receivers.pixel[receiver as usize];
            Place { receiver, x: pixel % receivers.width, y: pixel / receivers.width, value }
        }));
        let index = Index::new(&places, side, receivers);
        let found: Vec<Given> = run.install(|| {
            blocks
                .par_iter()
                .with_min_len(8)
                .map_with(Vec::new(), |near, block| {
                    interpolate(block, &index, receivers, settings, tree.is_lit(), near)
                })
                .collect()
        });
        for &(i, value) in found.iter().flat_map(|f| &f.0) {
            out[i as usize] = value;
        }
        let Some(&finer) = BLOCKS.get(level + 1) else { break };
        blocks = found.into_iter().flat_map(|(_, rest)| parts(rest, finer, receivers)).collect();
        run.check()?;
    }
    for place in &places {
        out[place.receiver as usize] = place.value;
    }
    Ok((out, places.len()))
}

fn first_blocks(receivers: Receivers<'_>) -> Vec<Block> {
    let side = BLOCKS[0];
    let columns = receivers.width.div_ceil(side);
    let rows = receivers.pixel.iter().max().map_or(0, |p| p / receivers.width / side + 1);
    let mut blocks: Vec<Block> = (0..columns * rows)
        .map(|i| Block { x: i % columns * side, y: i / columns * side, rest: Vec::new() })
        .collect();
    for (i, &pixel) in receivers.pixel.iter().enumerate() {
        blocks
            [(pixel / receivers.width / side * columns + pixel % receivers.width / side) as usize]
            .rest
            .push(i as u32);
    }
    blocks.retain(|b| !b.rest.is_empty());
    blocks
}

/// The receivers by blocks of a smaller side.
fn parts(mut rest: Vec<u32>, side: u32, receivers: Receivers<'_>) -> Vec<Block> {
    let corner = |i: u32| {
        let pixel = receivers.pixel[i as usize];
        (pixel / receivers.width / side * side, pixel % receivers.width / side * side)
    };
    rest.sort_by_key(|&i| corner(i));
    rest.chunk_by(|&a, &b| corner(a) == corner(b))
        .map(|c| Block { y: corner(c[0]).0, x: corner(c[0]).1, rest: c.to_vec() })
        .collect()
}

/// True when values at `from` say something about `to`; `slack` is a distance from its plane that
/// does not count.
fn alike(from: &Receiver, to: &Receiver, slack: f32) -> bool {
    let d = from.p - to.p;
    from.ns.dot(to.ns) >= LIKE_NORMALS && d.dot(to.ng).abs() <= LIKE_PLANE * d.length() + slack
}

/// Where a block gathers: in its middle; and where surfaces are unlike that.
fn choose(block: &Block, side: u32, receivers: Receivers<'_>) -> Vec<u32> {
    if side == 1 {
        return block.rest.clone();
    }
    let middle = Vec2::new(block.x as f32, block.y as f32) + 0.5 * (side - 1) as f32;
    let off = |i: u32| {
        let pixel = receivers.pixel[i as usize];
        Vec2::new((pixel % receivers.width) as f32, (pixel / receivers.width) as f32)
            .distance_squared(middle)
    };
    let mut chosen: Vec<u32> = Vec::new();
    for _ in 0..SURFACES {
        let unlike = |i: u32| {
            chosen.iter().all(|&c| {
                !alike(
                    &receivers.at[c as usize],
                    &receivers.at[i as usize],
                    receivers.footprint[i as usize],
                )
            })
        };
        let Some(next) = block
            .rest
            .iter()
            .copied()
            .filter(|&i| unlike(i))
            .min_by(|&a, &b| off(a).total_cmp(&off(b)))
        else {
            break;
        };
        chosen.push(next);
    }
    chosen
}

/// Places by blocks of pixels.
struct Index<'a> {
    places: &'a [Place],
    side: u32,
    columns: u32,
    rows: u32,
    starts: Vec<u32>,
    order: Vec<u32>,
}

impl<'a> Index<'a> {
    fn new(places: &'a [Place], side: u32, receivers: Receivers<'_>) -> Self {
        let columns = receivers.width.div_ceil(side);
        let rows = receivers.pixel.iter().max().map_or(0, |p| p / receivers.width / side + 1);
        let cell = |p: &Place| (p.y / side * columns + p.x / side) as usize;
        let mut starts = vec![0u32; (columns * rows) as usize + 1];
        places.iter().for_each(|p| starts[cell(p) + 1] += 1);
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut order = vec![0; places.len()];
        for (i, p) in places.iter().enumerate() {
            order[next[cell(p)] as usize] = i as u32;
            next[cell(p)] += 1;
        }
        Self { places, side, columns, rows, starts, order }
    }

    /// Places in the block at a pixel and `ring` blocks around.
    fn near(&self, x: u32, y: u32, ring: u32, out: &mut Vec<u32>) {
        out.clear();
        let (column, row) = (x / self.side, y / self.side);
        let (from, to) = (column.saturating_sub(ring), (column + ring).min(self.columns - 1));
        for r in row.saturating_sub(ring)..=(row + ring).min(self.rows - 1) {
            let span = self.starts[(r * self.columns + from) as usize] as usize
                ..self.starts[(r * self.columns + to) as usize + 1] as usize;
            out.extend_from_slice(&self.order[span]);
        }
    }
}

/// Values of a block's receivers, and those that are left.
fn interpolate(
    block: &Block,
    index: &Index<'_>,
    receivers: Receivers<'_>,
    settings: &PointBasedSettings,
    lit: bool,
    near: &mut Vec<u32>,
) -> Given {
    let (mut found, mut rest) = (Vec::new(), Vec::new());
    rest.clone_from(&block.rest);
    for ring in 1..=2 {
        index.near(block.x, block.y, ring, near);
        rest.retain(|&i| match value(i, near, index, receivers, settings, lit) {
            Some(value) => {
                found.push((i, value));
                false
            }
            None => true,
        });
        if near.len() >= MOST {
            break;
        }
    }
    (found, rest)
}

/// The interpolated value, if it is accepted.
fn value(
    i: u32,
    near: &[u32],
    index: &Index<'_>,
    receivers: Receivers<'_>,
    settings: &PointBasedSettings,
    lit: bool,
) -> Option<Gathered> {
    let variation = settings.maxvariation;
    let (at, pixel, footprint) =
        (&receivers.at[i as usize], receivers.pixel[i as usize], receivers.footprint[i as usize]);
    let own = Vec2::new((pixel % receivers.width) as f32, (pixel / receivers.width) as f32);
    let frame = Frame::from_normal(at.ng);
    let h2 = (0.3 * index.side as f32 * footprint).powi(2);
    let mut used: [(Vec3, f32, u32); MOST] = [(Vec3::ZERO, 0.0, 0); MOST];
    let mut count = 0;
    let (mut moments, mut nearest, mut pixels) = (Mat3::ZERO, (f32::INFINITY, 0.0), f32::INFINITY);
    for &k in near {
        let place = &index.places[k as usize];
        if place.receiver == i {
            return Some(place.value);
        }
        let from = &receivers.at[place.receiver as usize];
        if count == MOST || !alike(from, at, 0.5 * footprint) {
            continue;
        }
        let d = from.p - at.p;
        let x = Vec3::new(1.0, d.dot(frame.s), d.dot(frame.t));
        let d2 = d.length_squared();
        let w = 1.0 / (d2 + h2);
        moments += Mat3::from_cols(x * (w * x.x), x * (w * x.y), x * (w * x.z));
        used[count] = (x, w, k);
        count += 1;
        if d2 < nearest.0 {
            nearest = (d2, place.value.distance);
        }
        pixels = pixels.min(own.distance(Vec2::new(place.x as f32, place.y as f32)));
    }
    let used = &used[..count];
    let far = nearest.1.min(settings.maxdist).min(1.0 / settings.falloff);
    let reach = far * if count <= COEFFICIENTS { FEW * REACH } else { REACH };
    if count == 0 || (nearest.0 > variation * reach * reach && pixels > ADJACENT) {
        return None;
    }
    let ridge = 1e-3 * (moments.y_axis.y + moments.z_axis.z) + 1e-20 * moments.x_axis.x;
    moments.y_axis.y += ridge;
    moments.z_axis.z += ridge;
    let inverse = moments.inverse();
    let plane = inverse * Vec3::X;
    if !plane.is_finite() {
        return None;
    }
    let place = |k: u32| &index.places[k as usize].value;
    let (mut sum, mut inside, mut total) = (Gathered::default(), 0.0f32, 0.0);
    let (mut occlusion, mut light) = (Vec3::ZERO, Vec3::ZERO);
    let (mut low, mut high) = (*place(used[0].2), *place(used[0].2));
    for &(x, w, k) in used {
        let (v, share) = (place(k), w * plane.dot(x));
        sum.occlusion += v.occlusion * share;
        sum.open += v.open * share;
        sum.bent_normal += v.bent_normal * share;
        sum.irradiance += v.irradiance * share;
        sum.from_map += v.from_map * share;
        sum.distance += v.distance.min(1e30) * share;
        (low.occlusion, high.occlusion) =
            (low.occlusion.min(v.occlusion), high.occlusion.max(v.occlusion));
        (low.open, high.open) = (low.open.min(v.open), high.open.max(v.open));
        (low.irradiance, high.irradiance) =
            (low.irradiance.min(v.irradiance), high.irradiance.max(v.irradiance));
        (low.from_map, high.from_map) =
            (low.from_map.min(v.from_map), high.from_map.max(v.from_map));
        inside += share.abs();
        total += w;
        occlusion += x * (w * v.occlusion);
        light += x * (w * v.irradiance.element_sum());
    }
    if inside > INSIDE && pixels > ADJACENT {
        return None;
    }
    let (occlusion, light) = (inverse * occlusion, inverse * light);
    let freedom = count as f32 / count.saturating_sub(COEFFICIENTS).max(1) as f32;
    let residual = |fit: Vec3, of: &dyn Fn(&Gathered) -> f32| {
        used.iter().map(|&(x, w, k)| w * (of(place(k)) - fit.dot(x)).powi(2)).sum::<f32>() / total
            * freedom
    };
    if residual(occlusion, &|v| v.occlusion) > variation * variation {
        return None;
    }
    if lit {
        let most = LIGHT * variation * light.x.max(0.0);
        if residual(light, &|v| v.irradiance.element_sum()) > most * most {
            return None;
        }
    }
    sum.occlusion = sum.occlusion.clamp(low.occlusion, high.occlusion);
    sum.open = sum.open.clamp(low.open, high.open);
    sum.irradiance = sum.irradiance.clamp(low.irradiance, high.irradiance);
    sum.from_map = sum.from_map.clamp(low.from_map, high.from_map);
    Some(sum)
}
