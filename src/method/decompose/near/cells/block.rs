//! Eight facets side by side, and their share of the near sum of a point.

use glam::Vec3;
use wide::f32x8;

use super::monte_carlo::{Lanes, covered};
use super::{NearQuery, NearSum};
use crate::method::decompose::NearHits;
use crate::proxy::Facet;
use crate::radiometry::Rgb;
use crate::sampling::Rng;
use crate::sh::{MOMENTS, moments8};
use crate::tessellate::Side;

pub(super) type F = f32x8;

/// Eight facets.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub(super) corners: [[F; 3]; 3],
    centroid: [F; 3],
    /// Radiosity over π of the front and the back.
    front: [F; 3],
    back: [F; 3],
    /// Lane mask: the back does not exist.
    one_sided: F,
    /// Fraction of the facet that exists (masks); 0 in lanes without a facet (the last block may
    /// be short).
    coverage: F,
}

/// All bits of a lane where `set`.
fn mask(set: bool) -> f32 {
    f32::from_bits(if set { u32::MAX } else { 0 })
}

impl Block {
    /// Of at most eight facets; lanes past the last repeat it and count nothing.
    pub(super) fn new(facets: &[Facet], ids: &[u32]) -> Self {
        let of: [Facet; 8] =
            std::array::from_fn(|lane| facets[ids[lane.min(ids.len() - 1)] as usize]);
        let lanes = |f: &dyn Fn(&Facet) -> f32| F::from(std::array::from_fn(|lane| f(&of[lane])));
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
            one_sided: lanes(&|facet| mask(facet.one_sided)),
            coverage: F::from(std::array::from_fn(coverage)),
        }
    }

    /// The lanes of `active` whose centroid `x` sees.
    fn visible(&self, active: F, x: Vec3, query: &NearQuery<'_>) -> F {
        let [cx, cy, cz] = self.centroid.map(F::to_array);
        let lanes = active.to_bitmask();
        let seen = |i: usize| lanes >> i & 1 == 1 && query.sees(x, Vec3::new(cx[i], cy[i], cz[i]));
        F::from(std::array::from_fn(|i| mask(seen(i))))
    }
}

/// A near sum that is being made.
pub(super) struct Summation<'a> {
    x: Vec3,
    n: Vec3,
    query: &'a NearQuery<'a>,
    /// Height over a plane that counts as lying in it.
    tolerance: F,
    moments: [F; MOMENTS],
    sent: [F; 3],
    out: NearSum,
}

impl<'a> Summation<'a> {
    /// Nothing yet, at `x` with unit normal `n`.
    pub(super) fn new(x: Vec3, n: Vec3, query: &'a NearQuery<'a>, tolerance: f32) -> Self {
        Self {
            x,
            n,
            query,
            tolerance: F::splat(tolerance),
            moments: [F::ZERO; MOMENTS],
            sent: [F::ZERO; 3],
            out: NearSum::default(),
        }
    }

    /// The sum over all lanes.
    pub(super) fn finish(self) -> NearSum {
        NearSum {
            moments: self.moments.map(F::reduce_add),
            sent: Rgb::from_array(self.sent.map(F::reduce_add)),
            ..self.out
        }
    }

    /// Membership of facets at these distances, as [`NearHits::membership`].
    fn membership(&self, distance: F) -> F {
        let alpha = self.query.alpha;
        if alpha == f32::INFINITY {
            return F::ONE;
        }
        match self.query.near_hits {
            NearHits::Damp => {
                let t = ((F::splat(alpha) - distance) * F::splat(4.0 / alpha))
                    .fast_max(F::ZERO)
                    .fast_min(F::ONE);
                t * t * (F::splat(3.0) - t - t)
            }
            NearHits::Ignore => distance.simd_lt(F::splat(alpha)) & F::ONE,
        }
    }

    /// Adds a block.
    pub(super) fn add(&mut self, block: &Block, rng: &mut Rng) {
        let (x, n) = (self.x, self.n);
        let x8 = x.to_array().map(F::splat);
        let n8 = n.to_array().map(F::splat);
        let to_centroid: [F; 3] = std::array::from_fn(|k| block.centroid[k] - x8[k]);
        let m = self.membership(dot(to_centroid, to_centroid).sqrt()) * block.coverage;
        let mut v: [[F; 3]; 3] =
            std::array::from_fn(|c| std::array::from_fn(|k| block.corners[c][k] - x8[k]));
        let height = v.map(|c| dot(c, n8));
        let reaches = height[0].fast_max(height[1]).fast_max(height[2]).simd_gt(self.tolerance);
        let normal = cross(
            std::array::from_fn(|k| v[1][k] - v[0][k]),
            std::array::from_fn(|k| v[2][k] - v[0][k]),
        );
        let det = dot(normal, v[0]);
        let back = det.simd_gt(F::ZERO);
        let apart = det.abs().simd_gt(self.tolerance * dot(normal, normal).sqrt());
        let mut active = m.simd_gt(F::ZERO) & reaches & apart & !(back & block.one_sided);
        if active.any() && self.query.trace.is_some() {
            self.out.rays += active.to_bitmask().count_ones();
            active &= block.visible(active, x, self.query);
        }
        if !active.any() {
            return;
        }
        // Wind every triangle clockwise as seen from x, so that the moments come out positive.
        let [_, second, third] = &mut v;
        for (a, b) in second.iter_mut().zip(third) {
            (*a, *b) = (back.bitselect(*a, *b), back.bitselect(*b, *a));
        }
        let weight = active & m;
        let found = moments8(&v, n);
        for (sum, moment) in self.moments.iter_mut().zip(found) {
            *sum = weight.mul_add(moment, *sum);
        }
        let weighted_g = weight * found[0];
        for (sum, (from_back, from_front)) in
            self.sent.iter_mut().zip(block.back.iter().zip(&block.front))
        {
            *sum = weighted_g.mul_add(back.bitselect(*from_back, *from_front), *sum);
        }
        self.out.cells += active.to_bitmask().count_ones();
        if let Some((field, samples)) = self.query.monte_carlo {
            let lanes = Lanes { corners: &block.corners, active, weighted_g };
            self.out.covered += covered(&lanes, (x, n), field, samples, rng);
        }
    }
}

fn dot(a: [F; 3], b: [F; 3]) -> F {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}
fn cross(a: [F; 3], b: [F; 3]) -> [F; 3] {
    [
        a[1].mul_sub(b[2], a[2] * b[1]),
        a[2].mul_sub(b[0], a[0] * b[2]),
        a[0].mul_sub(b[1], a[1] * b[0]),
    ]
}
