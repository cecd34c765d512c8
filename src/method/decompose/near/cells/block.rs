//! Eight facets side by side, and their share of the near sum of a point.

use glam::Vec3;

use super::monte_carlo::{Covering, covered};
use super::{NearQuery, NearSum};
use crate::ffi::lanes::{Eight, Lanes};
use crate::method::decompose::NearHits;
use crate::proxy::Facet;
use crate::radiometry::Rgb;
use crate::sampling::Rng;
use crate::sh::{MOMENTS, cross, dot, moments8};
use crate::tessellate::Side;

/// Eight facets.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub(super) corners: [[Eight; 3]; 3],
    centroid: [Eight; 3],
    /// Radiosity over π of the front and the back.
    front: [Eight; 3],
    back: [Eight; 3],
    /// Lane mask: the back does not exist.
    one_sided: Eight,
    /// Fraction of the facet that exists (masks); 0 in lanes without a facet (the last block may
    /// be short).
    coverage: Eight,
}

impl Block {
    /// Of at most eight facets; lanes past the last repeat it and count nothing.
    pub(super) fn new(facets: &[Facet], ids: &[u32]) -> Self {
        let of: [Facet; 8] =
            std::array::from_fn(|lane| facets[ids[lane.min(ids.len() - 1)] as usize]);
        let lanes = |f: &dyn Fn(&Facet) -> f32| Eight::from_fn(|lane| f(&of[lane]));
        let coverage = |lane: usize| if lane < ids.len() { of[lane].coverage } else { 0.0 };
        let radiance = std::f32::consts::FRAC_1_PI;
        Self {
            corners: std::array::from_fn(|v| {
                std::array::from_fn(|k| lanes(&|facet| facet.corners[v][k]))
            }),
            centroid: std::array::from_fn(|k| lanes(&|facet| facet.centroid[k])),
            front: std::array::from_fn(|k| {
                lanes(&|facet| facet.radiosity_of(Side::Front)[k] * radiance)
            }),
            back: std::array::from_fn(|k| {
                lanes(&|facet| facet.radiosity_of(Side::Back)[k] * radiance)
            }),
            one_sided: Eight::mask(|lane| of[lane].one_sided),
            coverage: Eight::from_fn(coverage),
        }
    }

    /// The lanes of `active` whose centroid `x` sees.
    fn visible(&self, active: u32, x: Vec3, query: &NearQuery<'_>) -> Eight {
        Eight::mask(|i| active >> i & 1 == 1 && query.sees(x, lane(&self.centroid, i)))
    }
}

/// Lane `i` of three components.
pub(super) fn lane(v: &[Eight; 3], i: usize) -> Vec3 {
    Vec3::new(v[0].0[i], v[1].0[i], v[2].0[i])
}

/// A near sum that is being made.
pub(super) struct Summation<'a, L> {
    x: Vec3,
    n: Vec3,
    query: &'a NearQuery<'a>,
    /// Height over a plane that counts as lying in it.
    tolerance: f32,
    moments: [L; MOMENTS],
    sent: [L; 3],
    out: NearSum,
}

impl<'a, L: Lanes> Summation<'a, L> {
    /// Nothing yet, at `x` with unit normal `n`.
    #[inline(always)]
    pub(super) fn new(x: Vec3, n: Vec3, query: &'a NearQuery<'a>, tolerance: f32) -> Self {
        let (moments, sent) = ([L::ZERO; MOMENTS], [L::ZERO; 3]);
        Self { x, n, query, tolerance, moments, sent, out: NearSum::default() }
    }

    /// The sum over all lanes.
    #[inline(always)]
    pub(super) fn finish(mut self) -> NearSum {
        for (total, lanes) in self.out.moments.iter_mut().zip(self.moments) {
            *total = lanes.sum();
        }
        let [r, g, b] = self.sent;
        self.out.sent = Rgb::new(r.sum(), g.sum(), b.sum());
        self.out
    }

    /// Membership of facets at these distances, as [`NearHits::membership`].
    #[inline(always)]
    fn membership(&self, distance: L) -> L {
        let alpha = self.query.alpha;
        if alpha == f32::INFINITY {
            return L::ONE;
        }
        match self.query.near_hits {
            NearHits::Damp => {
                let t =
                    ((L::splat(alpha) - distance) * L::splat(4.0 / alpha)).max(L::ZERO).min(L::ONE);
                t * t * (L::splat(3.0) - t - t)
            }
            NearHits::Ignore => L::splat(alpha).gt(distance) & L::ONE,
        }
    }

    /// Adds a block.
    #[inline(always)]
    pub(super) fn add(&mut self, block: &Block, rng: &mut Rng) {
        let (x, n) = (self.x, self.n);
        let x8 = [L::splat(x.x), L::splat(x.y), L::splat(x.z)];
        let n8 = [L::splat(n.x), L::splat(n.y), L::splat(n.z)];
        let to_centroid = from(&block.centroid, x8);
        let distance = dot(to_centroid, to_centroid).sqrt();
        let m = self.membership(distance) * L::load(&block.coverage);
        let [a, b, c] = &block.corners;
        let (a, b, c) = (from(a, x8), from(b, x8), from(c, x8));
        let tolerance = L::splat(self.tolerance);
        let reaches = dot(a, n8).max(dot(b, n8)).max(dot(c, n8)).gt(tolerance);
        let normal = cross(less(b, a), less(c, a));
        let det = dot(normal, a);
        let back = det.gt(L::ZERO);
        let apart = det.abs().gt(tolerance * dot(normal, normal).sqrt());
        let one_sided = L::load(&block.one_sided);
        let mut active = m.gt(L::ZERO) & reaches & apart & !(back & one_sided);
        if active.any() && self.query.trace.is_some() {
            let lanes = active.to_bitmask();
            self.out.rays += lanes.count_ones();
            active &= L::load(&block.visible(lanes, x, self.query));
        }
        if !active.any() {
            return;
        }
        // Wind every triangle clockwise as seen from x, so that the moments come out positive.
        let v = [a, choose(back, b, c), choose(back, c, b)];
        let weight = active & m;
        let found = moments8(&v, n);
        for (sum, moment) in self.moments.iter_mut().zip(found) {
            *sum = weight.mul_add(moment, *sum);
        }
        let weighted_g = weight * found[0];
        for (sum, (from_back, from_front)) in
            self.sent.iter_mut().zip(block.back.iter().zip(&block.front))
        {
            let sent = back.select(L::load(from_back), L::load(from_front));
            *sum = weighted_g.mul_add(sent, *sum);
        }
        let active = active.to_bitmask();
        self.out.cells += active.count_ones();
        if let Some((field, samples)) = self.query.monte_carlo {
            let g = weighted_g.store();
            let lanes = Covering { corners: &block.corners, active, weighted_g: &g };
            self.out.covered += covered(&lanes, (x, n), field, samples, rng);
        }
    }
}

/// Places relative to `x`.
#[inline(always)]
fn from<L: Lanes>(places: &[Eight; 3], x: [L; 3]) -> [L; 3] {
    less([L::load(&places[0]), L::load(&places[1]), L::load(&places[2])], x)
}
#[inline(always)]
fn less<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
#[inline(always)]
fn choose<L: Lanes>(mask: L, yes: [L; 3], no: [L; 3]) -> [L; 3] {
    [mask.select(yes[0], no[0]), mask.select(yes[1], no[1]), mask.select(yes[2], no[2])]
}
