//! Which light to sample: groups of lights picked by their estimated unoccluded irradiance at the
//! shading point.
//!
//! Σ power / d² with the cosines bounded from below, so that a light that can contribute always
//! keeps a positive probability, and one that provably cannot (behind its own plane or below the
//! receiver's horizon) has none. Many lights are halved at the median of their longest extent until
//! three quarters of the most groups remain; suns always stand alone.
//!
//! There are two tables: a coarse one, all of whose groups are looked at for every pick, and a fine
//! one for those who bring a choice of their own ([`crate::guide`]).

use glam::Vec3;

use super::{Source, spot_falloff};
use crate::math::Aabb;
use crate::radiometry::Rgb;
use crate::sampling::Discrete;

/// Most groups that are looked at for one pick.
pub(super) const MOST: usize = 64;
/// Most groups of a choice that was made beforehand.
pub(super) const MOST_FINE: usize = 512;
/// Least cosine that the estimate assumes at either end.
const LEAST_COS: f32 = 0.05;

#[derive(Debug)]
struct Group {
    members: Vec<u32>,
    within: Discrete,
    center: Vec3,
    radius: f32,
    /// Σ power, channels added, over 4π: what irradiance falls from by distance squared.
    strength: f32,
}

/// Groups of sources.
#[derive(Debug, Default)]
pub(super) struct Groups {
    groups: Vec<Group>,
    /// Per source: its group and its probability inside it.
    place: Vec<(u32, f32)>,
    /// Sources that are suns with a disc, and the bright part of a map.
    pub(super) suns: Vec<u32>,
}

/// A picked source, its probability, and what is left of the random number.
pub(super) struct Picked {
    pub(super) source: u32,
    pub(super) probability: f32,
}

impl Groups {
    /// At most `most` groups, and suns.
    pub(super) fn new(sources: &[Source], powers: &[Rgb], most: usize) -> Self {
        let (mut placed, mut sets): (Vec<u32>, Vec<Vec<u32>>) = (Vec::new(), Vec::new());
        for (i, source) in sources.iter().enumerate() {
            if source.bounds().is_some() {
                placed.push(i as u32)
            } else {
                sets.push(vec![i as u32])
            }
        }
        if placed.len() + sets.len() <= most {
            sets.extend(placed.into_iter().map(|i| vec![i]));
        } else {
            sets.extend(halve(placed, sources, most - most / 4));
        }
        let mut out = Self { place: vec![(0, 0.0); sources.len()], ..Self::default() };
        for members in sets {
            let bounds = members
                .iter()
                .filter_map(|&i| sources[i as usize].bounds())
                .fold(Aabb::EMPTY, |a, b| Aabb { min: a.min.min(b.min), max: a.max.max(b.max) });
            let within =
                Discrete::new(members.iter().map(|&i| f64::from(powers[i as usize].element_sum())));
            for (k, &i) in members.iter().enumerate() {
                out.place[i as usize] = (out.groups.len() as u32, within.probability(k));
            }
            let strength = within.total() as f32 / (4.0 * std::f32::consts::PI);
            let center = if bounds.is_empty() { Vec3::ZERO } else { bounds.center() };
            out.groups.push(Group {
                members,
                within,
                center,
                radius: 0.5 * bounds.diagonal(),
                strength,
            });
        }
        out.suns = (0..sources.len() as u32)
            .filter(|&i| matches!(sources[i as usize], Source::Sun { .. } | Source::Map(_)))
            .collect();
        out
    }

    /// A source for `u`; `None` when no source can reach `p`.
    pub(super) fn pick(&self, sources: &[Source], p: Vec3, n: Vec3, u: f32) -> Option<Picked> {
        if let [group] = self.groups.as_slice()
            && let [source] = group.members.as_slice()
        {
            return Some(Picked { source: *source, probability: 1.0 });
        }
        let mut cdf = [0.0f32; MOST];
        let mut total = 0.0f32;
        let count = self.groups.len().min(MOST);
        for (slot, group) in cdf.iter_mut().zip(&self.groups) {
            total += group.importance(sources, p, n);
            *slot = total;
        }
        let (g, _) = pick_of(&cdf[..count], u)?;
        let before = if g == 0 { 0.0 } else { cdf[g - 1] };
        let width = cdf[g] - before;
        let group = &self.groups[g];
        let probability = group.importance(sources, p, n) / total;
        if let [source] = group.members.as_slice() {
            return Some(Picked { source: *source, probability });
        }
        let rest = (u * total - before) / width;
        let (k, _) = group.within.sample(rest.clamp(0.0, 0.999_999_9))?;
        Some(Picked {
            source: group.members[k],
            probability: probability * group.within.probability(k),
        })
    }

    /// How many.
    pub(super) fn len(&self) -> usize {
        self.groups.len()
    }

    /// About the unoccluded irradiance at `p` from group `g`.
    pub(super) fn importance(&self, sources: &[Source], g: usize, p: Vec3, n: Vec3) -> f32 {
        self.groups[g].importance(sources, p, n)
    }

    /// A source of group `g`, which was picked with probability `chance`, for `u`.
    pub(super) fn member(&self, g: usize, chance: f32, u: f32) -> Option<Picked> {
        let group = &self.groups[g];
        let (k, _) = group.within.sample(u)?;
        let probability = chance * group.within.probability(k);
        Some(Picked { source: group.members[k], probability })
    }

    /// Probability that [`Groups::pick`] gives `source` at `p`.
    pub(super) fn probability(&self, sources: &[Source], p: Vec3, n: Vec3, source: u32) -> f32 {
        let (g, within) = self.place[source as usize];
        if self.groups.len() == 1 {
            return within;
        }
        let mut total = 0.0;
        let mut own = 0.0;
        for (i, group) in self.groups.iter().enumerate() {
            let w = group.importance(sources, p, n);
            total += w;
            if i == g as usize {
                own = w;
            }
        }
        if total > 0.0 { own / total * within } else { 0.0 }
    }
}

/// An entry of a running sum for `u`, and its share of the whole; none where nothing has weight.
fn pick_of(cdf: &[f32], u: f32) -> Option<(usize, f32)> {
    let total = *cdf.last()?;
    if total.is_nan() || total <= 0.0 {
        return None;
    }
    let mut k = cdf.partition_point(|&c| c <= u * total).min(cdf.len() - 1);
    while k > 0 && cdf[k] <= cdf[k - 1] {
        k -= 1;
    }
    let before = if k == 0 { 0.0 } else { cdf[k - 1] };
    Some((k, (cdf[k] - before) / total))
}

impl Group {
    fn importance(&self, sources: &[Source], p: Vec3, n: Vec3) -> f32 {
        if let [source] = self.members.as_slice() {
            return estimate(&sources[*source as usize], p, n);
        }
        let to = self.center - p;
        if n.dot(to) <= -self.radius {
            return 0.0;
        }
        self.strength / to.length_squared().max(self.radius * self.radius).max(f32::MIN_POSITIVE)
    }
}

/// About the unoccluded irradiance at `p` with normal `n`, channels added; zero only when it is
/// zero.
fn estimate(source: &Source, p: Vec3, n: Vec3) -> f32 {
    match *source {
        Source::Triangle { v0, e1, e2, normal, area, radiance, .. } => {
            let to = v0 - p;
            let (a, b, c) = (n.dot(to), n.dot(to + e1), n.dot(to + e2));
            let height = -normal.dot(to);
            if height <= 0.0 || a.max(b).max(c) <= 0.0 {
                return 0.0;
            }
            let middle = to + (e1 + e2) / 3.0;
            let d2 = middle.length_squared().max(area * 0.25);
            let d = d2.sqrt();
            radiance.element_sum()
                * area
                * (height / d).clamp(LEAST_COS, 1.0)
                * ((a + b + c) / (3.0 * d)).clamp(LEAST_COS, 1.0)
                / d2
        }
        Source::Sphere { center, radius, radiance, .. } => {
            let to = center - p;
            let d2 = to.length_squared().max(radius * radius);
            let height = n.dot(to);
            if height <= -radius {
                0.0
            } else {
                radiance.element_sum() * std::f32::consts::PI * radius * radius / d2
                    * (height / d2.sqrt()).max(LEAST_COS)
            }
        }
        Source::DeltaSun { to_sun, irradiance } => {
            irradiance.element_sum() * n.dot(to_sun).max(0.0)
        }
        Source::Sun { to_sun, radiance, one_minus_cos } => {
            let sin = (one_minus_cos * (2.0 - one_minus_cos)).sqrt();
            let cos = n.dot(to_sun);
            if cos <= -sin {
                0.0
            } else {
                radiance.element_sum() * std::f32::consts::TAU * one_minus_cos * cos.max(sin)
            }
        }
        Source::Map(ref bright) => bright.estimate(n),
        Source::Point { position, intensity } => {
            intensity.element_sum() * toward_point(position - p, n)
        }
        Source::Spot { position, axis, intensity, cos_inner, cos_outer } => {
            let to = position - p;
            intensity.element_sum()
                * toward_point(to, n)
                * spot_falloff(-axis.dot(to.normalize_or_zero()), cos_inner, cos_outer)
        }
    }
}

fn toward_point(to: Vec3, n: Vec3) -> f32 {
    let d2 = to.length_squared();
    if d2 > 0.0 { n.dot(to).max(0.0) / (d2 * d2.sqrt()) } else { 0.0 }
}

/// Halves the set with the most members at the median of its longest extent until `count` sets
/// remain.
fn halve(all: Vec<u32>, sources: &[Source], count: usize) -> Vec<Vec<u32>> {
    let middle = |i: u32| sources[i as usize].bounds().map_or(Vec3::ZERO, |b| b.center());
    let mut sets = vec![all];
    while sets.len() < count {
        let Some(at) = (0..sets.len())
            .filter(|&i| sets[i].len() > 1)
            .max_by_key(|&i| (sets[i].len(), std::cmp::Reverse(i)))
        else {
            break;
        };
        let mut set = sets.swap_remove(at);
        let bounds = Aabb::around(set.iter().map(|&i| middle(i)));
        let axis = (bounds.max - bounds.min).max_position();
        set.sort_by(|&a, &b| middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(&b)));
        let upper = set.split_off(set.len() / 2);
        sets.extend([set, upper]);
    }
    sets
}
