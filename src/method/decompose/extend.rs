//! Clusters for another view: what it sees and no cluster covers.
//!
//! ```text
//! covered(x) :  some cluster with |x − P| ≤ cluster_radius and n·N ≥ cluster_normal_cos          the bounds that clusters are made under
//! ```
//! Points that are covered take no part; the rest are clustered among themselves
//! ([`super::cluster`]) and sampled ([`super::far`]) as if they were all there is. Clusters, once
//! made, never change: neither their place, nor their SH, nor the random numbers they came from.
//!
//! Input   clusters with their SH, shading points. Output  the same with more of them.
//! Guarantees  the points that clusters were made from are covered by them, so the same view adds
//!             nothing; bit-identical for any thread count. Not: the clusters that a fresh start
//!             would choose; near the border of what was seen before they lie denser.
//! Cost    one look-up a point.

use std::collections::HashMap;

use glam::{IVec3, Vec3};

use super::alpha::adaptive;
use super::cluster::{Clusters, cluster};
use super::{AlphaMode, DecomposeSettings, Lengths, far, validity};
use crate::error::Result;
use crate::proxy::Proxy;
use crate::record::ShadingPoints;
use crate::run::Run;
use crate::sampling::hash64;
use crate::sh::ShRgb;
use crate::shading::World;

/// Slack on the bounds, for rounding.
const SLACK: f32 = 1e-4;

/// Tells which points clusters cover: every box of side `cluster_radius` knows the clusters that
/// reach into it.
#[derive(Debug)]
pub struct Cover<'a> {
    clusters: &'a Clusters,
    radius: f32,
    normal_cos: f32,
    boxes: HashMap<IVec3, Vec<u32>>,
}

impl<'a> Cover<'a> {
    /// For clusters made with this radius and cosine.
    pub fn new(clusters: &'a Clusters, radius: f32, normal_cos: f32) -> Self {
        let radius = radius * (1.0 + SLACK);
        let mut cover =
            Self { clusters, radius, normal_cos: normal_cos - SLACK, boxes: HashMap::new() };
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
        (p / self.radius).floor().as_ivec3()
    }

    /// Whether a cluster covers `p` with unit normal `n`.
    pub fn covers(&self, p: Vec3, n: Vec3) -> bool {
        let near = |&&i: &&u32| {
            let i = i as usize;
            self.clusters.center[i].distance_squared(p) <= self.radius * self.radius
                && self.clusters.normal[i].dot(n) >= self.normal_cos
        };
        self.boxes.get(&self.at(p)).is_some_and(|list| list.iter().find(near).is_some())
    }
}

/// Adds clusters for those of the `chosen` points that none covers; returns how many, and the CPU
/// seconds that sampling them took.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn extend(
    world: &World,
    proxy: &Proxy,
    points: &ShadingPoints,
    mut chosen: Vec<u32>,
    clusters: &mut Clusters,
    sh: &mut Vec<ShRgb>,
    settings: &DecomposeSettings,
    lengths: &Lengths,
    seed: u64,
    run: &Run,
) -> Result<(usize, f64)> {
    let new = {
        let _phase = run.phase("cluster", 1);
        if !clusters.is_empty() {
            let cover = Cover::new(clusters, lengths.cluster_radius, settings.cluster_normal_cos);
            chosen.retain(|&i| !cover.covers(points.p[i as usize], points.ns[i as usize]));
        }
        run.install(|| {
            let clusters = match settings.alpha_mode {
                AlphaMode::Single => cluster(
                    points,
                    chosen,
                    lengths.cluster_radius,
                    settings.cluster_normal_cos,
                    seed,
                ),
                AlphaMode::Adaptive => adaptive(world, points, chosen, settings, seed, run),
            };
            if settings.sight { validity::separate(world, points, &clusters) } else { clusters }
        })
    };
    // Random numbers are keyed by a cluster's number among those made with it: later ones need
    // another seed.
    let seed =
        if clusters.is_empty() { seed } else { hash64(seed ^ hash64(clusters.len() as u64)) };
    let (new_sh, seconds) = far::sample(world, proxy, points, &new, settings, seed, run)?;
    sh.extend(new_sh);
    let count = new.len();
    clusters.append(new);
    Ok((count, seconds))
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
        let clusters = cluster(&points, (0..3000).step_by(2).collect(), 0.3, 0.7, 1);
        let cover = Cover::new(&clusters, 0.3, 0.7);
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
