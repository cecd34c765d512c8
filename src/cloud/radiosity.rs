//! Light on the elements: what is baked into a cloud.
//!
//! ```text
//! B₀      = ⟨ρ E_direct⟩
//! B_{k+1} = B₀ + ρ (E_elements(B_k) + sky · open)
//! ```
//!
//! The direct irradiance E_direct is found by shadow rays at stratified points of each piece; these
//! rays belong to baking, not to gathering. A bounce is a gather over the elements themselves and
//! shoots none. It is made once for the elements of a small group of the tree that face alike, who
//! share it, with a coarser raster and larger groups than at receivers. After the last bounce the
//! rest of the series is estimated as Δ_k q / (1 − q), where q is the ratio of the powers of the
//! last two bounces. With `radiosity = "photon"` the indirect light is the proxy's instead.
//!
//! Input is a [`World`] with [`PointBasedSettings`]; output is a [`Cloud`] with the channels of
//! [`super::element`], the same for any number of threads. The cost is `direct_samples` shadow rays
//! per element and side, and a gather per group, facing and bounce.

use glam::Vec3;

use super::plain_sum::mean_open;
use super::{
    Accessibility, Cloud, Gather, Gathered, Hierarchy, Overlap, Piece, PointBasedSettings,
    RadiositySource, Receiver, dice, sum,
};
use crate::error::Result;
use crate::journal::stored;
use crate::math::offset_origin;
use crate::proxy::{Landing, Need, Proxy, ProxyInputs};
use crate::radiometry::{MAX_ALBEDO, Rgb};
use crate::run::{RayKind, Run};
use crate::sampling::{Sobol, Stream};
use crate::shading::{Sky, World, direct_irradiance};
use crate::tessellate::Side;

/// Elements are put in about this many groups, of 8 to 64, for bounces on them.
const GROUPS: usize = 8192;
/// Least cosine between normals of elements that share a gather.
const LIKE_NORMALS: f32 = 0.94;
/// Least `maxsolidangle` of bounces on elements: with the raster below, measured as the best trade
/// of bias for time.
const BOUNCE_SOLID_ANGLE: f32 = 0.1;
/// Largest `microbufres` there.
const BOUNCE_RES: u32 = 12;
/// Largest ratio of bounces that the rest is estimated from.
const MAX_RATIO: f32 = 0.95;

#[derive(Clone, Copy, Default)]
struct Lit {
    direct: [Rgb; 2],
    leaving: [Rgb; 2],
    albedo: Rgb,
    rays: u64,
}

stored!(Lit { direct, leaving, albedo, rays });

/// Elements without light: positions, normals, areas; and the piece of each.
///
/// # Errors
/// As [`dice`].
pub fn bake_areas(
    world: &World,
    settings: &PointBasedSettings,
    run: &Run,
) -> Result<(Cloud, Vec<Piece>)> {
    settings.validate()?;
    let _phase = run.phase("dice", 1);
    run.install(|| {
        let pieces = dice(&world.geometry, settings.dicing())?;
        let (cloud, from) = Cloud::from_pieces(&world.geometry, &pieces);
        Ok((cloud, from.into_iter().map(|i| pieces[i as usize]).collect()))
    })
}

/// Elements with light: `_radiosity`, `_radiosity_back`, `direct`, `direct_back`, `albedo`,
/// `emission`.
///
/// # Errors
/// For settings out of range, as [`dice`] and [`Proxy::new`], [`crate::error::Error::Interrupted`].
pub fn bake(
    world: &World,
    settings: &PointBasedSettings,
    proxy: ProxyInputs<'_>,
    seed: u64,
    run: &Run,
) -> Result<Cloud> {
    let (mut cloud, pieces) = bake_areas(world, settings, run)?;
    let lit = direct(world, &cloud, &pieces, settings.direct_samples, seed, run)?;
    let albedo: Vec<Rgb> = lit.iter().map(|l| l.albedo).collect();
    let mut leaving: [Vec<Rgb>; 2] =
        [0, 1].map(|side| lit.iter().map(|l: &Lit| l.leaving[side]).collect());
    for (name, side) in [("direct", 0), ("direct_back", 1)] {
        cloud.set(name, lit.iter().map(|l| l.direct[side]).collect());
    }
    cloud.set(
        "emission",
        pieces.iter().map(|p| world.geometry.material(p.triangle).emission).collect(),
    );
    match settings.radiosity {
        RadiositySource::Photon => {
            let landing = |piece: &Piece, side: Side| {
                let (b, triangle) = (piece.at(glam::Vec2::splat(0.5)), piece.triangle);
                let p = world.geometry.surface(triangle, b.x, b.y).p;
                Landing { p, triangle, u: b.x, v: b.y, side, reach: 0.0 }
            };
            let sides = pieces.iter().flat_map(|p| Side::BOTH.map(|side| landing(p, side)));
            let landings: Vec<Landing> = sides.collect();
            let inputs = ProxyInputs { seed, ..proxy };
            let proxy = Proxy::new(world, inputs, Need::Landings(&landings), run)?;
            for (i, both) in landings.chunks_exact(2).enumerate() {
                for (landing, leaving) in both.iter().zip(&mut leaving) {
                    leaving[i] += albedo[i] * proxy.read(world, landing).indirect;
                }
            }
        }
        RadiositySource::Bounces => bounces(
            &mut cloud,
            &albedo,
            &mut leaving,
            &world.lights.sky,
            world.diagonal,
            settings,
            run,
        )?,
    }
    let [front, back] = leaving;
    cloud.set("albedo", albedo);
    cloud.set(Cloud::RADIOSITY, front);
    cloud.set(Cloud::RADIOSITY_BACK, back);
    cloud.channels.reverse();
    cloud.channels.sort_by_key(|c| !c.name.starts_with('_'));
    cloud.channels[..2].sort_by_key(|c| c.name.len());
    Ok(cloud)
}

fn direct(
    world: &World,
    cloud: &Cloud,
    pieces: &[Piece],
    samples: u32,
    seed: u64,
    run: &Run,
) -> Result<Vec<Lit>> {
    let phase = run.phase("direct", pieces.len() as u64);
    let masks = world.geometry.masks();
    let one = |i: usize| {
        let piece = &pieces[i];
        let mut lit = Lit::default();
        if run.cancelled() || world.geometry.material(piece.triangle).albedo.max_element() <= 0.0 {
            return lit;
        }
        let sobol = Sobol::new(seed, Stream::Element, i as u64);
        let mut count = 0;
        for s in 0..samples {
            let b = piece.at(sobol.sample_2d(s, 0));
            if masks.as_ref().is_some_and(|m| !m.exists(piece.triangle, b.x, b.y)) {
                continue;
            }
            count += 1;
            let surface = world.geometry.surface(piece.triangle, b.x, b.y);
            lit.albedo += surface.albedo;
            for (side, sign) in
                [1.0, -1.0].into_iter().enumerate().take(1 + usize::from(!cloud.one_sided[i]))
            {
                let pairs = 1 + 2 * side as u32;
                let mut sample =
                    |_: u32| (sobol.sample_1d(s, pairs), sobol.sample_2d(s, pairs + 1));
                let at = [surface.p, surface.ng * sign, surface.ns * sign];
                let (e, rays) = direct_irradiance(world, at, None, 1, &mut sample);
                lit.direct[side] += e;
                lit.leaving[side] += e * surface.albedo;
                lit.rays += rays;
            }
        }
        let inverse = 1.0 / count.max(1) as f32;
        lit.direct = lit.direct.map(|v| v * inverse);
        lit.leaving = lit.leaving.map(|v| v * inverse);
        lit.albedo = (lit.albedo * inverse).min(Rgb::splat(MAX_ALBEDO));
        lit
    };
    let lit = phase.blocks((pieces.len(), 256), (), |(), range| range.map(one).collect())?;
    run.rays.add(RayKind::Shadow, lit.iter().map(|l| l.rays).sum());
    Ok(lit)
}

/// Adds the bounces to what leaves the sides of elements.
fn bounces(
    cloud: &mut Cloud,
    albedo: &[Rgb],
    leaving: &mut [Vec<Rgb>; 2],
    sky: &Sky,
    diagonal: f32,
    settings: &PointBasedSettings,
    run: &Run,
) -> Result<()> {
    let coarse = PointBasedSettings {
        maxsolidangle: settings.maxsolidangle.max(BOUNCE_SOLID_ANGLE),
        microbufres: settings.microbufres.min(BOUNCE_RES),
        overlap: Overlap::Raster,
        ..settings.clone()
    };
    let direct = leaving.clone();
    let power = |light: &[Vec<Rgb>; 2], area: &[f32]| -> f64 {
        light
            .iter()
            .flat_map(|side| side.iter().zip(area))
            .map(|(c, &a)| f64::from(c.element_sum() * a))
            .sum()
    };
    let mut change = 0.0;
    if cloud.is_empty() {
        return Ok(());
    }
    for bounce in 0..settings.bounces {
        cloud.set(Cloud::RADIOSITY, leaving[0].clone());
        cloud.set(Cloud::RADIOSITY_BACK, leaving[1].clone());
        let tree = run.install(|| Hierarchy::new(cloud, settings.hitsides))?;
        let irradiance = element_irradiance(&tree, cloud, sky, diagonal, &coarse, run)?;
        let mut next = direct.clone();
        for (side, next) in next.iter_mut().enumerate() {
            for ((n, &e), &rho) in next.iter_mut().zip(&irradiance[side]).zip(albedo) {
                *n += rho * e;
            }
        }
        let step = power(&next, &cloud.area) - power(leaving, &cloud.area);
        let last = bounce + 1 == settings.bounces;
        if last && settings.tail && bounce > 0 && change > 0.0 {
            let q = ((step / change) as f32).clamp(0.0, MAX_RATIO);
            for (next, now) in next.iter_mut().zip(leaving.iter()) {
                for (n, &b) in next.iter_mut().zip(now) {
                    *n = (*n + (*n - b) * (q / (1.0 - q))).max(Rgb::ZERO);
                }
            }
        }
        change = step;
        *leaving = next;
        if step <= 1e-3 * power(leaving, &cloud.area) {
            break;
        }
    }
    Ok(())
}

/// Irradiance of fronts and backs of all elements from the elements of a tree and the sky;
/// one-sided elements have dark backs.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn element_irradiance(
    tree: &Hierarchy,
    cloud: &Cloud,
    sky: &Sky,
    diagonal: f32,
    settings: &PointBasedSettings,
    run: &Run,
) -> Result<[Vec<Rgb>; 2]> {
    let groups = like_elements(tree, cloud);
    let gathered =
        gather_all(tree, settings, None, &seats(&groups, cloud, diagonal), sky, "bounce", run)?;
    let mut out = [vec![Rgb::ZERO; cloud.len()], vec![Rgb::ZERO; cloud.len()]];
    for (group, g) in groups.iter().zip(gathered) {
        for &e in &group.members {
            out[usize::from(group.back)][e as usize] = g.irradiance + g.from_sky(sky);
        }
    }
    Ok(out)
}

/// The weights of `overlap = "bunnell"`; none for the other modes.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn accessibility(
    tree: &Hierarchy,
    cloud: &Cloud,
    diagonal: f32,
    settings: &PointBasedSettings,
    run: &Run,
) -> Result<Option<Accessibility>> {
    if settings.overlap != Overlap::Bunnell {
        return Ok(None);
    }
    let groups = like_elements(tree, cloud);
    let receivers = seats(&groups, cloud, diagonal);
    let (mut before, mut now) = (vec![1.0; cloud.len()], vec![1.0; cloud.len()]);
    for _ in 0..settings.accessibility_passes {
        let weights = Accessibility::new(tree, &now);
        let gathered = gather_all(
            tree,
            settings,
            Some(&weights),
            &receivers,
            &Sky::default(),
            "accessibility",
            run,
        )?;
        let mut occlusion = [vec![0.0; cloud.len()], vec![0.0; cloud.len()]];
        for (group, g) in groups.iter().zip(gathered) {
            for &e in &group.members {
                occlusion[usize::from(group.back)][e as usize] = g.occlusion;
            }
        }
        before = std::mem::replace(&mut now, mean_open(cloud, &occlusion));
    }
    let mean: Vec<f32> = before.iter().zip(&now).map(|(a, b)| 0.5 * (a + b)).collect();
    Ok(Some(Accessibility::new(tree, &mean)))
}

/// Receivers at the seats of groups.
fn seats(groups: &[Group], cloud: &Cloud, diagonal: f32) -> Vec<Receiver> {
    let seat = |g: &Group| {
        let (e, sign) = (g.seat as usize, if g.back { -1.0 } else { 1.0 });
        let n = cloud.n[e] * sign;
        Receiver { p: offset_origin(cloud.p[e], n, diagonal), ng: n, ns: n }
    };
    groups.iter().map(seat).collect()
}

struct Group {
    members: Vec<u32>,
    /// The member whose place is gathered at.
    seat: u32,
    back: bool,
}

/// Elements of a small group of the tree that face alike, side by side.
fn like_elements(tree: &Hierarchy, cloud: &Cloud) -> Vec<Group> {
    let most = (cloud.len() / GROUPS).clamp(8, 64);
    let mut groups = Vec::new();
    for range in tree.groups(most) {
        let mut rest: Vec<u32> = tree.order[range].to_vec();
        while let Some(&first) = rest.first() {
            let n = cloud.n[first as usize];
            let alike = |e: u32| {
                cloud.n[e as usize].dot(n) >= LIKE_NORMALS
                    && cloud.one_sided[e as usize] == cloud.one_sided[first as usize]
            };
            let (members, others): (Vec<u32>, Vec<u32>) = rest.iter().partition(|&&e| alike(e));
            let mean =
                members.iter().map(|&e| cloud.p[e as usize]).sum::<Vec3>() / members.len() as f32;
            let off = |e: u32| cloud.p[e as usize].distance_squared(mean);
            let seat = members
                .iter()
                .copied()
                .fold(first, |best, e| if off(e) < off(best) { e } else { best });
            if !cloud.one_sided[first as usize] {
                groups.push(Group { members: members.clone(), seat, back: true });
            }
            groups.push(Group { members, seat, back: false });
            rest = others;
        }
    }
    groups
}

/// What a receiver sees, by the raster (`Ok`) or summed already (`Err`), with the light of a map of
/// the sky: exact for the raster's open cells, for sums the map's light from the mean open
/// direction.
fn under(sky: &Sky, r: &Receiver, how: std::result::Result<&mut Gather<'_>, Gathered>) -> Gathered {
    match how {
        Ok(gather) if sky.has_map() => {
            let (found, from_map) = gather.gather_under(r, &|w| sky.from_map(w));
            Gathered { from_map, ..found }
        }
        Ok(gather) => gather.gather(r),
        Err(found) if sky.has_map() => Gathered {
            from_map: sky.from_map(found.bent_normal.try_normalize().unwrap_or(r.ns)) * found.open,
            ..found
        },
        Err(found) => found,
    }
}

/// Gathers at every receiver, in parallel, in the mode of `settings.overlap`; `weights` are
/// [`accessibility`]'s.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn gather_all(
    tree: &Hierarchy,
    settings: &PointBasedSettings,
    weights: Option<&Accessibility>,
    receivers: &[Receiver],
    sky: &Sky,
    phase: &'static str,
    run: &Run,
) -> Result<Vec<Gathered>> {
    const BLOCK: usize = 256;
    let phase = run.phase(phase, receivers.len() as u64);
    let raster = settings.overlap == Overlap::Raster;
    phase.blocks((receivers.len(), BLOCK), Gather::new(tree, settings), |gather, range| {
        let one = |r: &Receiver| {
            let plain = || Err(sum(tree, settings, weights, r));
            under(sky, r, if raster { Ok(&mut *gather) } else { plain() })
        };
        receivers[range].iter().map(one).collect()
    })
}
