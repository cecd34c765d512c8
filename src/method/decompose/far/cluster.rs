//! Pass 2a: hierarchical vector quantisation of the shading points by position and normal.
//!
//! Top down: a node whose members lie further than `cluster_radius` from its centre, or turn
//! further than `cluster_normal_cos` from its normal, is split in two by k-means (k = 2) under the
//! distance d = |p − P| + r (1 − n·N), so that a right angle counts as one radius `[Course07]`.
//! Nodes above 20 000 points are cut at the median of their widest axis.
//!
//! [`cluster`](fn@cluster) turns a choice of [`ShadingPoints`] into [`Clusters`] in depth-first
//! order. Every chosen point is in exactly one cluster, both bounds hold for every cluster, and the
//! result is the same for any number of threads. It costs O(points · log clusters), a few
//! nanoseconds each.

use glam::Vec3;

use crate::record::ShadingPoints;
use crate::sampling::{Rng, Stream, hash64};

/// Groups of shading points; arrays over clusters, members in one array.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clusters {
    /// Mean position.
    pub center: Vec<Vec3>,
    /// Normalised mean normal.
    pub normal: Vec<Vec3>,
    /// Position of the member nearest to the centre: what points must see to be served.
    pub anchor: Vec<Vec3>,
    /// Largest distance of a member from the centre.
    pub radius: Vec<f32>,
    /// Members of cluster i are `members[start[i]..start[i + 1]]`.
    pub start: Vec<u32>,
    /// Indices of shading points.
    pub members: Vec<u32>,
    /// Own alpha and reach of every cluster as multiples of the picture's; empty: 1
    /// ([`super::adaptive_alpha`]).
    pub scale: Vec<f32>,
}

impl Clusters {
    /// Number of clusters.
    pub fn len(&self) -> usize {
        self.center.len()
    }
    /// True without clusters.
    pub fn is_empty(&self) -> bool {
        self.center.is_empty()
    }
    /// Alpha and reach of a cluster as multiples of the picture's.
    pub fn scale_of(&self, cluster: usize) -> f32 {
        self.scale.get(cluster).copied().unwrap_or(1.0)
    }
    /// Adds clusters made from other points: those that were there keep their places and lose their
    /// members, whose points are gone.
    pub fn append(&mut self, new: Self) {
        let earlier = self.len();
        self.forget_members();
        self.start.pop();
        self.start.extend(if new.start.is_empty() { vec![0] } else { new.start });
        self.members = new.members;
        self.center.extend(new.center);
        self.normal.extend(new.normal);
        self.anchor.extend(new.anchor);
        self.radius.extend(new.radius);
        if !(self.scale.is_empty() && new.scale.is_empty()) {
            self.scale.resize(earlier, 1.0);
            self.scale.extend(new.scale);
            self.scale.resize(self.center.len(), 1.0);
        }
    }
    /// Leaves all clusters without members.
    pub fn forget_members(&mut self) {
        self.start = vec![0; self.len() + 1];
        self.members.clear();
    }
    /// Members of a cluster.
    pub fn members_of(&self, cluster: usize) -> &[u32] {
        &self.members[self.start[cluster] as usize..self.start[cluster + 1] as usize]
    }
}

const MEDIAN_ABOVE: usize = 20_000;
const ITERATIONS: usize = 10;

/// How large a cluster may be.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Largest distance of a member from the centre, scene units.
    pub radius: f32,
    /// Least cosine between a member's normal and the cluster's.
    pub normal_cos: f32,
}

#[derive(Clone, Copy)]
struct Centre {
    p: Vec3,
    n: Vec3,
}

fn centre(points: &ShadingPoints, members: &[u32]) -> Centre {
    let (mut p, mut n) = (glam::DVec3::ZERO, Vec3::ZERO);
    for &i in members {
        p += points.p[i as usize].as_dvec3();
        n += points.ns[i as usize];
    }
    Centre {
        p: (p / members.len() as f64).as_vec3(),
        n: n.normalize_or(points.ns[members[0] as usize]),
    }
}

/// Clusters within `bounds` of the points listed in `chosen`.
pub fn cluster(
    points: &ShadingPoints,
    mut chosen: Vec<u32>,
    bounds: Bounds,
    seed: u64,
) -> Clusters {
    if chosen.is_empty() {
        return summarize(points, std::iter::empty());
    }
    summarize(points, split(points, &mut chosen, &bounds, seed, 1))
}

/// The member nearest to `center`.
pub fn anchor(points: &ShadingPoints, members: &[u32], center: Vec3) -> u32 {
    let distance = |i: u32| points.p[i as usize].distance_squared(center);
    members
        .iter()
        .copied()
        .min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)))
        .unwrap_or(0)
}

/// Clusters with the given members, none empty.
pub fn summarize(points: &ShadingPoints, groups: impl IntoIterator<Item = Vec<u32>>) -> Clusters {
    let mut out = Clusters { start: vec![0], ..Clusters::default() };
    for group in groups {
        let c = centre(points, &group);
        out.center.push(c.p);
        out.normal.push(c.n);
        out.anchor.push(points.p[anchor(points, &group, c.p) as usize]);
        out.radius
            .push(group.iter().map(|&i| points.p[i as usize].distance(c.p)).fold(0.0, f32::max));
        out.members.extend(group);
        out.start.push(out.members.len() as u32);
    }
    out
}

fn split(
    points: &ShadingPoints,
    members: &mut [u32],
    bounds: &Bounds,
    seed: u64,
    path: u64,
) -> Vec<Vec<u32>> {
    let c = centre(points, members);
    let fits = members.iter().all(|&i| {
        let i = i as usize;
        points.p[i].distance_squared(c.p) <= bounds.radius * bounds.radius
            && points.ns[i].dot(c.n) >= bounds.normal_cos
    });
    if fits || members.len() == 1 {
        return vec![members.to_vec()];
    }
    let middle = if members.len() > MEDIAN_ABOVE {
        median(points, members)
    } else {
        two_means(points, members, bounds, seed, path)
    };
    let (left, right) = members.split_at_mut(middle);
    let (mut a, b) = rayon::join(
        || split(points, left, bounds, seed, hash64(path) ^ 1),
        || split(points, right, bounds, seed, hash64(path ^ 0x5bd1_e995) ^ 2),
    );
    a.extend(b);
    a
}

/// Sorts by the widest axis and returns the middle.
fn median(points: &ShadingPoints, members: &mut [u32]) -> usize {
    let bounds = crate::math::Aabb::around(members.iter().map(|&i| points.p[i as usize]));
    let axis = (bounds.max - bounds.min).max_position();
    let middle = members.len() / 2;
    members.select_nth_unstable_by(middle, |&a, &b| {
        points.p[a as usize][axis].total_cmp(&points.p[b as usize][axis]).then(a.cmp(&b))
    });
    members[..middle].sort_unstable();
    members[middle..].sort_unstable();
    middle
}

/// Partitions by 2-means and returns the border; falls back to the median where all members
/// coincide.
fn two_means(
    points: &ShadingPoints,
    members: &mut [u32],
    bounds: &Bounds,
    seed: u64,
    path: u64,
) -> usize {
    let at = |i: u32| Centre { p: points.p[i as usize], n: points.ns[i as usize] };
    let distance = |i: u32, c: &Centre| {
        points.p[i as usize].distance(c.p) + bounds.radius * (1.0 - points.ns[i as usize].dot(c.n))
    };
    let mut rng = Rng::new(seed, Stream::Cluster, path, 0);
    let first = at(members[rng.below(members.len())]);
    // The second seed is the member furthest from the first.
    let far = |from: &Centre| {
        members
            .iter()
            .copied()
            .fold((members[0], -1.0), |best, i| {
                if distance(i, from) > best.1 { (i, distance(i, from)) } else { best }
            })
            .0
    };
    let mut a = at(far(&first));
    let mut b = at(far(&a));
    for _ in 0..ITERATIONS {
        let (near_a, near_b): (Vec<u32>, Vec<u32>) =
            members.iter().partition(|&&i| distance(i, &a) <= distance(i, &b));
        if near_a.is_empty() || near_b.is_empty() {
            return median(points, members);
        }
        let (next_a, next_b) = (centre(points, &near_a), centre(points, &near_b));
        let moved = next_a.p.distance(a.p) + next_b.p.distance(b.p);
        members[..near_a.len()].copy_from_slice(&near_a);
        members[near_a.len()..].copy_from_slice(&near_b);
        if moved < 1e-3 * bounds.radius {
            return near_a.len();
        }
        (a, b) = (next_a, next_b);
    }
    let (near_a, near_b): (Vec<u32>, Vec<u32>) =
        members.iter().partition(|&&i| distance(i, &a) <= distance(i, &b));
    if near_a.is_empty() || near_b.is_empty() {
        return median(points, members);
    }
    members[..near_a.len()].copy_from_slice(&near_a);
    members[near_a.len()..].copy_from_slice(&near_b);
    near_a.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::sample_uniform_sphere;

    fn bounds(radius: f32, normal_cos: f32) -> Bounds {
        Bounds { radius, normal_cos }
    }

    fn random_points(n: usize) -> ShadingPoints {
        let mut rng = Rng::new(1, Stream::Test, 0, 0);
        let mut points = ShadingPoints::default();
        for i in 0..n {
            let p = if i % 10 == 0 {
                Vec3::ONE
            } else {
                Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32())
            };
            points.p.push(p);
            points.ns.push(if i % 10 == 0 {
                Vec3::Z
            } else {
                sample_uniform_sphere(rng.next_2d())
            });
        }
        points
    }

    #[test]
    fn bounds_hold_and_every_point_has_a_cluster() {
        let points = random_points(30_000);
        let clusters = cluster(&points, (0..30_000).collect(), bounds(0.1, 0.7), 3);
        let mut seen = clusters.members.clone();
        seen.sort_unstable();
        assert!(seen.iter().copied().eq(0..30_000));
        for c in 0..clusters.len() {
            assert!(clusters.radius[c] <= 0.1 + 1e-6);
            for &i in clusters.members_of(c) {
                assert!(points.ns[i as usize].dot(clusters.normal[c]) >= 0.7 - 1e-5);
            }
        }
    }

    #[test]
    fn identical_points_and_no_points() {
        let mut points = random_points(0);
        for _ in 0..50 {
            points.p.push(Vec3::ONE);
            points.ns.push(Vec3::Z);
        }
        assert_eq!(cluster(&points, (0..50).collect(), bounds(0.0, 1.0 - 1e-6), 3).len(), 1);
        // Opposite normals at one position must still come apart.
        points.ns[7] = -Vec3::Z;
        assert_eq!(cluster(&points, (0..50).collect(), bounds(0.1, 0.5), 3).len(), 2);
        assert!(cluster(&points, Vec::new(), bounds(0.1, 0.5), 3).is_empty());
    }

    #[test]
    fn thread_count_changes_nothing() {
        let points = random_points(25_000);
        let run = |threads| {
            crate::run::Run::new(threads)
                .unwrap()
                .install(|| cluster(&points, (0..25_000).collect(), bounds(0.2, 0.5), 3).members)
        };
        assert_eq!(run(1), run(4));
    }
}
