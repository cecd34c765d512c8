//! Which clusters may serve a point: those whose anchor it sees.
//!
//! A cluster speaks for the light on its side of a wall. Position and normal do not tell sides
//! apart where walls and boards are thinner than a cluster is wide: floors on both sides of a wall,
//! boards of a shelf, slats, hairs. So a segment between the point and the cluster's anchor (the
//! member nearest to its centre) must be free:
//!
//! ```text
//! a′ = a + n_a (d/10 + ¾ max(0, −n_a·(b − a))),   b′ alike,   d = |b − a|
//! a′ to b′ must meet nothing
//! ```
//!
//! The lift keeps the segment above what both stand on: on a convex surface the apex of the two
//! tangent planes is at most half as high as the one point lies below the plane of the other. What
//! stands lower than a tenth of the distance hides little of the hemisphere and is passed over.
//!
//! [`separate`] cuts clusters until all members see the anchor; [`Sight`] is the test for other
//! points. No sample is blended through a surface that rises more than a tenth of the distance. The
//! blend is not continuous where a cluster comes into sight. The test costs an occlusion ray a
//! recorded point and one a point and cluster in reach, about 5 % of the CPU time; it is the
//! default for what it keeps out (figures in `docs/records/2026-11-decompose.md`).

use glam::Vec3;
use rayon::prelude::*;

use super::cluster::{Clusters, anchor, summarize};
use crate::math::Ray;
use crate::record::ShadingPoints;
use crate::shading::World;

const LIFT: f32 = 0.1;
const CONVEX: f32 = 0.75;

/// True when nothing stands between two surface points, each with the unit normal of its side.
pub fn free(world: &World, a: (Vec3, Vec3), b: (Vec3, Vec3)) -> bool {
    let between = b.0 - a.0;
    let d = between.length();
    if d == 0.0 {
        return true;
    }
    let from = a.0 + a.1 * (LIFT * d + CONVEX * (-between.dot(a.1)).max(0.0));
    let to = b.0 + b.1 * (LIFT * d + CONVEX * between.dot(b.1).max(0.0));
    !world.rays.occluded(&Ray::segment(from, to))
}

/// Cuts every cluster into groups whose members see the group's anchor.
pub fn separate(world: &World, points: &ShadingPoints, clusters: &Clusters) -> Clusters {
    let at = |i: u32| (points.p[i as usize], points.ns[i as usize]);
    let groups: Vec<Vec<Vec<u32>>> = (0..clusters.len())
        .into_par_iter()
        .with_min_len(16)
        .map(|c| {
            let mut rest = clusters.members_of(c).to_vec();
            let mut center = clusters.center[c];
            let mut groups = Vec::new();
            while !rest.is_empty() {
                let anchor = anchor(points, &rest, center);
                let (seen, hidden): (Vec<u32>, Vec<u32>) =
                    rest.iter().partition(|&&i| i == anchor || free(world, at(i), at(anchor)));
                groups.push(seen);
                rest = hidden;
                center = rest.iter().map(|&i| points.p[i as usize]).sum::<Vec3>()
                    / rest.len().max(1) as f32;
            }
            groups
        })
        .collect();
    let scale = if clusters.scale.is_empty() {
        Vec::new()
    } else {
        groups
            .iter()
            .enumerate()
            .flat_map(|(c, g)| g.iter().map(move |_| clusters.scale[c]))
            .collect()
    };
    Clusters { scale, ..summarize(points, groups.into_iter().flatten()) }
}

/// The anchors of clusters, to be seen or not.
#[derive(Clone, Debug)]
pub struct Sight<'a> {
    world: &'a World,
    anchors: Vec<(Vec3, Vec3)>,
}

impl<'a> Sight<'a> {
    /// For the given clusters.
    pub fn new(world: &'a World, clusters: &Clusters) -> Self {
        Self {
            world,
            anchors: clusters.anchor.iter().copied().zip(clusters.normal.iter().copied()).collect(),
        }
    }

    /// Whether two clusters see each other.
    pub fn between(&self, a: usize, b: usize) -> bool {
        free(self.world, self.anchors[a], self.anchors[b])
    }

    /// Whether a cluster may serve the point `p` with unit normal `n`.
    pub fn serves(&self, cluster: usize, p: Vec3, n: Vec3) -> bool {
        free(self.world, (p, n), self.anchors[cluster])
    }
}
