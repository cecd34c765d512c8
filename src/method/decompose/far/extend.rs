//! Clusters for another view: what it sees and no cluster covers.
//!
//! ```text
//! covered(x):   some cluster with |x − P| ≤ cluster_radius and n·N ≥ cluster_normal_cos
//! ```
//!
//! These are the bounds that clusters are made under. Points that are covered take no part; the
//! rest are clustered among themselves ([`super::cluster`](mod@super::cluster)) and sampled
//! ([`super::sample`](mod@super::sample)) as if they were all there is. Clusters, once made, never
//! change: neither their place, nor their SH, nor the random numbers they came from.
//!
//! The points that clusters were made from are covered by them, so the same view adds nothing; the
//! result has the same bits for any number of threads. It is not what a fresh start would choose:
//! near the border of what was seen before, clusters lie denser. It costs a look-up a point.

use std::collections::HashMap;

use glam::{IVec3, Vec3};

use super::adaptive_alpha::adaptive;
use super::cluster::{Bounds, Clusters, cluster};
use super::{SampledClusters, sample, sight};
use crate::error::Result;
use crate::method::decompose::{AlphaMode, Context};
use crate::record::ShadingPoints;
use crate::sampling::hash64;

/// Slack on the bounds, for rounding.
const SLACK: f32 = 1e-4;

/// Tells which points clusters cover: every box of side `cluster_radius` knows the clusters that
/// reach into it.
#[derive(Debug)]
pub struct Cover<'a> {
    clusters: &'a Clusters,
    /// The bounds with some slack.
    bounds: Bounds,
    boxes: HashMap<IVec3, Vec<u32>>,
}

impl<'a> Cover<'a> {
    /// For clusters made under these bounds.
    pub fn new(clusters: &'a Clusters, bounds: Bounds) -> Self {
        let radius = bounds.radius * (1.0 + SLACK);
        let bounds = Bounds { radius, normal_cos: bounds.normal_cos - SLACK };
        let mut cover = Self { clusters, bounds, boxes: HashMap::new() };
        for (i, &p) in clusters.center.iter().enumerate() {
            let (low, high) = (cover.at(p - radius), cover.at(p + radius));
            for z in low.z..=high.z {
                for y in low.y..=high.y {
                    for x in low.x..=high.x {
                        cover.boxes.entry(IVec3::new(x, y, z)).or_default().push(i as u32);
                    }
                }
            }
        }
        cover
    }

    fn at(&self, p: Vec3) -> IVec3 {
        (p / self.bounds.radius).floor().as_ivec3()
    }

    /// Whether a cluster covers `p` with unit normal `n`.
    pub fn covers(&self, p: Vec3, n: Vec3) -> bool {
        let near = |&&i: &&u32| {
            let i = i as usize;
            self.clusters.center[i].distance_squared(p) <= self.bounds.radius.powi(2)
                && self.clusters.normal[i].dot(n) >= self.bounds.normal_cos
        };
        self.boxes.get(&self.at(p)).is_some_and(|list| list.iter().find(near).is_some())
    }
}

/// Adds clusters for those of the `chosen` points that none covers; returns the CPU seconds that
/// sampling them took.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn extend(
    context: &Context<'_>,
    points: &ShadingPoints,
    mut chosen: Vec<u32>,
    known: &mut SampledClusters,
) -> Result<f64> {
    let Context { world, settings, lengths, seed, run, .. } = *context;
    let bounds = Bounds { radius: lengths.cluster_radius, normal_cos: settings.cluster_normal_cos };
    let new = {
        let _phase = run.phase("cluster", 1);
        if !known.clusters.is_empty() {
            let cover = Cover::new(&known.clusters, bounds);
            chosen.retain(|&i| !cover.covers(points.p[i as usize], points.ns[i as usize]));
        }
        run.install(|| {
            let clusters = match settings.alpha_mode {
                AlphaMode::Single => cluster(points, chosen, bounds, seed),
                AlphaMode::Adaptive => adaptive(context, points, chosen),
            };
            if settings.sight { sight::separate(world, points, &clusters) } else { clusters }
        })
    };
    // Random numbers are keyed by a cluster's number among those made with it: later ones need
    // another seed.
    let earlier = known.clusters.len() as u64;
    let seed = if earlier == 0 { seed } else { hash64(seed ^ hash64(earlier)) };
    let (sh, seconds) = sample(&Context { seed, ..*context }, points, &new)?;
    known.sh.extend(sh);
    known.clusters.append(new);
    Ok(seconds)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream, sample_uniform_sphere};

    #[test]
    fn clusters_cover_their_points_and_nothing_far_or_turned() {
        let mut rng = Rng::new(4, Stream::Test, 0, 0);
        let mut points = ShadingPoints::default();
        for _ in 0..3000 {
            points.p.push(Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 4.0 - 2.0);
            points.ns.push(sample_uniform_sphere(rng.next_2d()));
        }
        let bounds = Bounds { radius: 0.3, normal_cos: 0.7 };
        let clusters = cluster(&points, (0..3000).step_by(2).collect(), bounds, 1);
        let cover = Cover::new(&clusters, bounds);
        let mut missed = 0;
        for i in 0..3000 {
            let (p, n) = (points.p[i], points.ns[i]);
            let slow = (0..clusters.len())
                .any(|c| clusters.center[c].distance(p) <= 0.3 && clusters.normal[c].dot(n) >= 0.7);
            assert!(cover.covers(p, n) || i % 2 == 1, "its own point {i}");
            assert!(cover.covers(p, n) || !slow);
            missed += usize::from(!slow);
        }
        assert!(missed > 100 && !cover.covers(Vec3::splat(9.0), Vec3::Z));
    }
}
