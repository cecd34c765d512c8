//! Far hits shared between clusters: every cluster's fit takes the hits of the clusters around it,
//! each seen from its own centre.
//!
//! ```text
//! hit y of cluster i, seen from centre c:   wi' = (y − c)/|y − c|,   dω' = dω · J
//! J = (cos θ'_y / cos θ_y) (|y − p|² / |y − c|²)
//! weight in the fit:   k(|c − Pᵢ|) · max(0, N·Nᵢ)^p · min(J, 4) · (1 − m)
//! m = larger membership of y in the near balls of p and c
//! ```
//!
//! Seen from a step aside a distant hit keeps its radiance (surfaces are diffuse) and changes only
//! direction and solid angle: parallax is exact, so neighbours serve as if they were rays of one's
//! own. Near hits do not: their solid angle changes without bound and what hides them changes too,
//! so a cluster uses only its own (weight 1 − 0.9 m).
//!
//! With one cluster, or `pool_radius = 0`, the result is the plain fit of the cluster's own rays; a
//! constant field stays constant. What a neighbour saw may be hidden from here: that is not tested,
//! and is an error of the size that blending their SH would make. A pooled hit costs about 30 ns at
//! three bands. The knob is `pool_radius`, by default two cluster radii.

use glam::Vec3;

use super::Sight;
use super::cluster::Clusters;
use crate::math::KdTree;
use crate::method::decompose::{DecomposeSettings, Lengths, NearHits};
use crate::radiometry::Rgb;
use crate::sh::{Fit, ShRgb};

/// Largest ratio of solid angles a hit keeps when seen from elsewhere.
const MAX_JACOBIAN: f32 = 4.0;

/// What a far ray found.
#[derive(Clone, Copy, Debug)]
pub struct FarHit {
    /// Unit direction of the ray.
    pub wi: Vec3,
    /// Distance; infinite for the sky.
    pub t: f32,
    /// Where it ended, world space; the origin's for the sky.
    pub position: Vec3,
    /// Unit normal there, towards the ray's origin; any for the sky.
    pub normal: Vec3,
    /// Radiance, W·sr⁻¹·m⁻².
    pub radiance: Rgb,
    /// Membership of the hit in the near ball of the ray's origin.
    pub membership: f32,
}

impl FarHit {
    /// Weight in the fit of the cluster that shot the ray.
    pub fn own_weight(&self) -> f32 {
        1.0 - 0.9 * self.membership
    }
}

/// All hits of all clusters.
#[derive(Debug)]
pub struct Pool<'a> {
    clusters: &'a Clusters,
    hits: &'a [Vec<FarHit>],
    sight: Option<&'a Sight<'a>>,
    settings: &'a DecomposeSettings,
    lengths: Lengths,
    tree: KdTree,
}

impl<'a> Pool<'a> {
    /// `hits` by cluster; with `sight` only clusters that see each other share.
    pub fn new(
        clusters: &'a Clusters,
        hits: &'a [Vec<FarHit>],
        sight: Option<&'a Sight<'a>>,
        settings: &'a DecomposeSettings,
        lengths: Lengths,
    ) -> Self {
        Self {
            clusters,
            hits,
            sight,
            settings,
            lengths,
            tree: KdTree::new(clusters.center.iter().copied()),
        }
    }

    /// SH of one cluster.
    pub fn fit(&self, cluster: usize) -> ShRgb {
        let mut fit = Fit::new(self.settings.sh_bands as usize);
        for hit in &self.hits[cluster] {
            fit.add(hit.wi, hit.radiance, hit.own_weight());
        }
        let (c, n, reach) = (
            self.clusters.center[cluster],
            self.clusters.normal[cluster],
            self.lengths.pool_radius,
        );
        if reach > 0.0 {
            self.tree.within(c, reach, |i, offset| {
                let i = i as usize;
                let near = (1.0 - offset.length_squared() / (reach * reach)).max(0.0);
                let weight = near
                    * self.clusters.normal[i]
                        .dot(n)
                        .max(0.0)
                        .powf(self.settings.blend_normal_power);
                if i != cluster && weight > 0.01 && self.sight.is_none_or(|s| s.between(cluster, i))
                {
                    self.add(
                        &mut fit,
                        c,
                        weight,
                        self.lengths.alpha * self.clusters.scale_of(cluster),
                        &self.hits[i],
                    );
                }
            });
        }
        fit.solve(self.settings.ridge)
    }

    fn add(&self, fit: &mut Fit, c: Vec3, weight: f32, alpha: f32, hits: &[FarHit]) {
        for hit in hits {
            if hit.t == f32::INFINITY {
                fit.add(hit.wi, hit.radiance, weight);
                continue;
            }
            let to = hit.position - c;
            let distance = to.length();
            let wi = to / distance.max(f32::MIN_POSITIVE);
            let (cos, cos_there) = (-wi.dot(hit.normal), -hit.wi.dot(hit.normal));
            let m = NearHits::Damp.membership(distance, alpha).max(hit.membership);
            if cos <= 0.0 || cos_there <= 1e-3 || m >= 1.0 {
                continue;
            }
            let jacobian = (cos / cos_there * (hit.t / distance).powi(2)).min(MAX_JACOBIAN);
            fit.add(wi, hit.radiance, weight * jacobian * (1.0 - m));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::length::Length;
    use crate::math::Frame;
    use crate::sampling::{Sobol, Stream, sample_uniform_hemisphere};

    /// Hits from `p` (normal +z) under a ceiling at z = 1, radiance 1 where x > 0.
    fn under_a_ceiling(p: Vec3) -> Vec<FarHit> {
        let sobol = Sobol::new(1, Stream::Test, 7);
        let frame = Frame::from_normal(Vec3::Z);
        (0..8192)
            .map(|i| {
                let wi = frame.world_from_local(sample_uniform_hemisphere(sobol.sample_2d(i, 0)));
                let t = (1.0 - p.z) / wi.z;
                let position = p + wi * t;
                let radiance = if position.x > 0.0 { Rgb::ONE } else { Rgb::ZERO };
                FarHit { wi, t, position, normal: -Vec3::Z, radiance, membership: 0.0 }
            })
            .collect()
    }

    fn clusters(centers: &[Vec3]) -> Clusters {
        let n = centers.len();
        Clusters {
            center: centers.to_vec(),
            normal: vec![Vec3::Z; n],
            radius: vec![0.1; n],
            start: vec![0; n + 1],
            ..Clusters::default()
        }
    }

    #[test]
    fn a_neighbours_hits_are_seen_from_the_own_centre() {
        let settings = DecomposeSettings {
            pool_radius: Some(Length::Units(1.0)),
            ..DecomposeSettings::default()
        };
        let lengths = Lengths { alpha: 0.1, ..settings.lengths(1.0) };
        let (here, there) = (Vec3::ZERO, Vec3::new(0.4, 0.0, 0.0));
        let clusters = clusters(&[here, there]);
        let fitted = |own: Vec<FarHit>, other: Vec<FarHit>| {
            Pool::new(&clusters, &[own, other], None, &settings, lengths)
                .fit(0)
                .irradiance(Vec3::Z)
                .x
        };
        let truth = std::f32::consts::FRAC_PI_2;
        let pooled = fitted(Vec::new(), under_a_ceiling(there));
        let unmoved = fitted(under_a_ceiling(there), Vec::new());
        // Half the cosine-weighted hemisphere looks at the bright half. The fit spreads what it
        // cannot represent: a few percent.
        assert!((pooled / truth - 1.0).abs() < 0.04, "{pooled} {truth}");
        assert!((unmoved / truth - 1.0).abs() > 0.2, "{unmoved} {truth}");
    }

    #[test]
    fn no_reach_is_the_own_fit_and_a_constant_stays() {
        let mut settings = DecomposeSettings {
            pool_radius: Some(Length::Units(0.0)),
            ..DecomposeSettings::default()
        };
        let clusters = clusters(&[Vec3::ZERO, Vec3::new(0.4, 0.0, 0.0)]);
        let mut hits = [under_a_ceiling(clusters.center[0]), under_a_ceiling(clusters.center[1])];
        let alone = Pool::new(&clusters, &hits, None, &settings, settings.lengths(1.0)).fit(0);
        hits[1].clear();
        assert_eq!(
            Pool::new(&clusters, &hits, None, &settings, settings.lengths(1.0)).fit(0),
            alone
        );
        settings.pool_radius = Some(Length::Units(1.0));
        hits[1] = under_a_ceiling(clusters.center[1]);
        hits.iter_mut().flatten().for_each(|h| h.radiance = Rgb::new(1.0, 2.0, 3.0));
        let constant = Pool::new(&clusters, &hits, None, &settings, settings.lengths(1.0)).fit(0);
        assert!(
            (constant.irradiance(Vec3::Z) / std::f32::consts::PI - Rgb::new(1.0, 2.0, 3.0))
                .length()
                < 1e-4
        );
    }
}
