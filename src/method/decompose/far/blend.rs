//! Pass 3a: the far field at a point, blended from the clusters around it.
//!
//! ```text
//! c(x) = Σ wᵢ cᵢ / Σ wᵢ      wᵢ = (1 − d²/Rᵢ²)² · max(0, N·Nᵢ)^p,   d = |x − Pᵢ| < Rᵢ
//! ```
//! The SH is linear in its coefficients, so blending coefficients blends irradiance. A point with
//! no cluster in reach takes its nearest cluster by d / max(N·Nᵢ, 0.1); where that one may not
//! serve it ([`super::sight`]) the caller samples the point's own hemisphere, so that nothing is
//! ever black, or lit through a wall, for want of a sample.
//!
//! The field is continuous in x inside the reach, but for clusters that come into sight. A uniform
//! grid of side R finds a few tens of candidates a query.

use glam::Vec3;
use rayon::prelude::*;

use super::{Clusters, SampledClusters, Sight};
use crate::math::KdTree;
use crate::method::decompose::Context;
use crate::sh::ShRgb;

/// Clusters with their SH, indexed by position.
#[derive(Debug)]
pub struct FarField<'a> {
    clusters: &'a Clusters,
    sh: &'a [ShRgb],
    radius: f32,
    /// Largest reach of a cluster.
    reach: f32,
    normal_power: f32,
    sight: Option<Sight<'a>>,
    origin: Vec3,
    side: f32,
    dims: [i32; 3],
    /// Clusters of grid cell i are `order[start[i]..start[i + 1]]`.
    start: Vec<u32>,
    order: Vec<u32>,
}

/// The far field at a point.
#[derive(Clone, Copy, Debug)]
pub struct Blend {
    /// Blended coefficients.
    pub sh: ShRgb,
    /// Cluster of the largest weight.
    pub cluster: u32,
    /// Blended alpha as a multiple of the picture's.
    pub scale: f32,
}

const MAX_SIDE_CELLS: f32 = 200.0;

impl<'a> FarField<'a> {
    /// The field that the settings ask for.
    pub fn of(context: &Context<'a>, sampled: &'a SampledClusters) -> Self {
        let Context { world, settings, lengths, .. } = *context;
        let field = Self::new(sampled, lengths.blend_radius, settings.blend_normal_power);
        if settings.sight { field.with_sight(Sight::new(world, &sampled.clusters)) } else { field }
    }

    /// Indexes the clusters for a reach of `radius`.
    pub fn new(sampled: &'a SampledClusters, radius: f32, normal_power: f32) -> Self {
        let SampledClusters { clusters, sh } = sampled;
        let bounds = crate::math::Aabb::around(clusters.center.iter().copied());
        let extent = if bounds.is_empty() { Vec3::ZERO } else { bounds.max - bounds.min };
        let reach = radius
            * clusters
                .scale
                .iter()
                .copied()
                .fold(if clusters.scale.is_empty() { 1.0 } else { 0.0 }, f32::max);
        let side = reach.max(extent.max_element() / MAX_SIDE_CELLS).max(f32::MIN_POSITIVE);
        let dims = extent.to_array().map(|e| (e / side) as i32 + 1);
        let origin = if bounds.is_empty() { Vec3::ZERO } else { bounds.min };
        let mut field = Self {
            clusters,
            sh,
            radius,
            reach,
            normal_power,
            sight: None,
            origin,
            side,
            dims,
            start: Vec::new(),
            order: Vec::new(),
        };
        let slots: Vec<usize> =
            clusters.center.iter().map(|&p| field.slot(field.grid(p))).collect();
        let mut start = vec![0u32; (dims[0] * dims[1] * dims[2]) as usize + 1];
        for &s in &slots {
            start[s + 1] += 1;
        }
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        field.order = (0..clusters.len() as u32).collect();
        field.order.sort_by_key(|&i| slots[i as usize]);
        field.start = start;
        field
    }

    /// By cluster, those within the reach of interpolation and facing alike that it does not see;
    /// empty without a test of sight.
    pub fn hidden_pairs(&self) -> Vec<Vec<u32>> {
        let Some(sight) = &self.sight else { return Vec::new() };
        let Clusters { center, normal, .. } = self.clusters;
        let tree = KdTree::new(center.iter().copied());
        let hidden = |a: usize| {
            let mut list = Vec::new();
            tree.within(center[a], self.radius, |b, _| {
                if normal[a].dot(normal[b as usize]) > 0.5 && !sight.between(a, b as usize) {
                    list.push(b);
                }
            });
            list
        };
        (0..center.len()).into_par_iter().map(hidden).collect()
    }

    /// With only those clusters in play that `sight` lets serve a point.
    #[must_use]
    pub fn with_sight(self, sight: Sight<'a>) -> Self {
        Self { sight: Some(sight), ..self }
    }

    fn serves(&self, i: usize, p: Vec3, n: Vec3) -> bool {
        self.sight.as_ref().is_none_or(|s| s.serves(i, p, n))
    }

    fn grid(&self, p: Vec3) -> [i32; 3] {
        let g = (p - self.origin) / self.side;
        std::array::from_fn(|k| (g[k].floor() as i32).clamp(0, self.dims[k] - 1))
    }
    fn slot(&self, g: [i32; 3]) -> usize {
        ((g[2] * self.dims[1] + g[1]) * self.dims[0] + g[0]) as usize
    }

    /// The blended field at `p` with unit normal `n`, with the blended alpha; `None` where no
    /// cluster may serve it.
    pub fn at(&self, p: Vec3, n: Vec3) -> Option<Blend> {
        let (low, high) =
            (self.grid(p - Vec3::splat(self.reach)), self.grid(p + Vec3::splat(self.reach)));
        let (mut out, mut sum, mut scale, mut best) = (ShRgb::default(), 0.0, 0.0, (0, 0.0));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                let row = self.slot([low[0], y, z])..=self.slot([high[0], y, z]);
                let range = self.start[*row.start()] as usize..self.start[*row.end() + 1] as usize;
                for &i in &self.order[range] {
                    let w = self.weight(i as usize, p, n);
                    if w > 0.0 && self.serves(i as usize, p, n) {
                        out.add_scaled(&self.sh[i as usize], w);
                        sum += w;
                        scale += w * self.clusters.scale_of(i as usize);
                        if w > best.1 {
                            best = (i, w);
                        }
                    }
                }
            }
        }
        if sum < 1e-6 {
            return self.nearest(p, n);
        }
        let inverse = 1.0 / sum;
        for c in &mut out.0 {
            *c *= inverse;
        }
        let scale = if self.clusters.scale.is_empty() { 1.0 } else { scale * inverse };
        Some(Blend { sh: out, cluster: best.0, scale })
    }

    fn weight(&self, i: usize, p: Vec3, n: Vec3) -> f32 {
        let d2 = self.clusters.center[i].distance_squared(p);
        let r = self.radius * self.clusters.scale_of(i);
        let r2 = r * r;
        if d2 >= r2 {
            return 0.0;
        }
        let k = 1.0 - d2 / r2;
        k * k * self.clusters.normal[i].dot(n).max(0.0).powf(self.normal_power)
    }

    fn nearest(&self, p: Vec3, n: Vec3) -> Option<Blend> {
        let cost = |i: usize| {
            self.clusters.center[i].distance(p) / self.clusters.normal[i].dot(n).max(0.1)
        };
        let best = (0..self.clusters.len()).min_by(|&a, &b| cost(a).total_cmp(&cost(b)))?;
        self.serves(best, p, n).then(|| Blend {
            sh: self.sh[best],
            cluster: best as u32,
            scale: self.clusters.scale_of(best),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radiometry::Rgb;

    #[test]
    fn one_cluster_everywhere_and_a_constant_stays() {
        let clusters = Clusters {
            center: vec![Vec3::ZERO, Vec3::X, Vec3::new(0.5, 9.0, 0.0)],
            normal: vec![Vec3::Z; 3],
            radius: vec![0.1; 3],
            start: vec![0; 4],
            ..Clusters::default()
        };
        let mut constant = ShRgb::default();
        constant.0[0] = Rgb::new(1.0, 2.0, 3.0);
        let sampled = SampledClusters { clusters, sh: vec![constant; 3] };
        let field = FarField::new(&sampled, 1.5, 4.0);
        for p in [Vec3::ZERO, Vec3::new(0.5, 0.3, 0.2), Vec3::new(40.0, -3.0, 2.0)] {
            let c = field.at(p, Vec3::new(0.0, 0.6, 0.8)).unwrap();
            assert!((c.sh.0[0] - constant.0[0]).length() < 1e-5);
        }
        assert_eq!(field.at(Vec3::new(0.9, 0.1, 0.0), Vec3::Z).unwrap().cluster, 1);
        assert_eq!(field.at(Vec3::new(0.5, 8.0, 0.0), Vec3::Z).unwrap().cluster, 2);
    }
}
