//! Points in a balanced kd-tree: the k nearest, or all within a radius, under a metric of the
//! caller's.
//!
//! The tree is implicit: a range of the array is a node, its middle the median along the longest
//! axis of the range's box, the halves its children; ranges of at most [`LEAF`] points are scanned.
//! Own code and not a crate, because queries need a *squashed* metric with rejection inside the
//! search (a point that fails the normal test must not count towards k), which the kept crates do
//! not offer.
//!
//! The caller's distance must be at least the Euclidean one (so boxes can be pruned), or infinite
//! to reject a point.
//! Guarantees  exact results; ties broken by index, so they do not depend on threads. Cost  17 B
//!             per point; build O(n log n) in parallel.

use glam::Vec3;

const LEAF: usize = 12;
/// Smaller ranges are built by one thread.
const PARALLEL: usize = 1 << 14;

/// A balanced kd-tree over points.
#[derive(Clone, Debug, Default)]
pub struct KdTree {
    points: Vec<Vec3>,
    index: Vec<u32>,
    /// Split axis of the node whose middle stands here.
    axis: Vec<u8>,
}

fn build(entries: &mut [(Vec3, u32)], axis: &mut [u8]) {
    if entries.len() <= LEAF {
        return;
    }
    let (mut low, mut high) = (entries[0].0, entries[0].0);
    for (p, _) in entries.iter() {
        low = low.min(*p);
        high = high.max(*p);
    }
    let size = high - low;
    let a = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let middle = entries.len() / 2;
    entries.select_nth_unstable_by(middle, |x, y| x.0[a].total_cmp(&y.0[a]).then(x.1.cmp(&y.1)));
    axis[middle] = a as u8;
    let (left, right) = entries.split_at_mut(middle);
    let (left_axis, right_axis) = axis.split_at_mut(middle);
    if left.len() < PARALLEL {
        build(left, left_axis);
        build(&mut right[1..], &mut right_axis[1..]);
    } else {
        rayon::join(|| build(left, left_axis), || build(&mut right[1..], &mut right_axis[1..]));
    }
}

impl KdTree {
    /// A tree over `points`; queries name points by their index here. Call inside the thread pool.
    pub fn new(points: impl IntoIterator<Item = Vec3>) -> Self {
        let mut entries: Vec<(Vec3, u32)> = points.into_iter().zip(0..).collect();
        let mut axis = vec![0; entries.len()];
        build(&mut entries, &mut axis);
        let (points, index) = entries.into_iter().unzip();
        Self { points, index, axis }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }
    /// True without points.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Calls `visit(index, offset)` for every point within Euclidean distance `radius` of `center`;
    /// `offset` = point − centre.
    pub fn within(&self, center: Vec3, radius: f32, mut visit: impl FnMut(u32, Vec3)) {
        let r2 = radius * radius;
        let mut stack = [(0usize, 0usize); 64];
        let mut top = 1;
        stack[0] = (0, self.points.len());
        while top > 0 {
            top -= 1;
            let (start, end) = stack[top];
            if end - start <= LEAF {
                for i in start..end {
                    let d = self.points[i] - center;
                    if d.length_squared() <= r2 {
                        visit(self.index[i], d);
                    }
                }
                continue;
            }
            let middle = start + (end - start) / 2;
            let d = self.points[middle] - center;
            if d.length_squared() <= r2 {
                visit(self.index[middle], d);
            }
            let along = d[self.axis[middle] as usize];
            if along >= -radius {
                stack[top] = (start, middle);
                top += 1;
            }
            if along <= radius {
                stack[top] = (middle + 1, end);
                top += 1;
            }
        }
    }

    /// The up to `k` nearest points closer than `radius`, nearest first, into `found` as (squared
    /// distance, index). `distance_squared(index, offset)` is at least the Euclidean square, or
    /// infinite to reject.
    pub fn nearest(
        &self,
        center: Vec3,
        k: usize,
        radius: f32,
        found: &mut Vec<(f32, u32)>,
        distance_squared: impl Fn(u32, Vec3) -> f32,
    ) {
        found.clear();
        if k == 0 {
            return;
        }
        let mut query =
            Nearest { tree: self, center, k, limit: radius * radius, found, distance_squared };
        query.node(0, self.points.len());
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }
}

struct Nearest<'a, F> {
    tree: &'a KdTree,
    center: Vec3,
    k: usize,
    /// Squared distance that a further point must stay below.
    limit: f32,
    /// Max-heap by (distance, index) once full.
    found: &'a mut Vec<(f32, u32)>,
    distance_squared: F,
}

fn nearer(a: (f32, u32), b: (f32, u32)) -> bool {
    a.0 < b.0 || (a.0 == b.0 && a.1 < b.1)
}

impl<F: Fn(u32, Vec3) -> f32> Nearest<'_, F> {
    fn node(&mut self, start: usize, end: usize) {
        if end - start <= LEAF {
            for i in start..end {
                self.point(i);
            }
            return;
        }
        let middle = start + (end - start) / 2;
        let along = self.tree.points[middle][self.tree.axis[middle] as usize]
            - self.center[self.tree.axis[middle] as usize];
        let (first, second) = if along > 0.0 {
            ((start, middle), (middle + 1, end))
        } else {
            ((middle + 1, end), (start, middle))
        };
        self.node(first.0, first.1);
        if along * along <= self.limit {
            self.point(middle);
            self.node(second.0, second.1);
        }
    }

    fn point(&mut self, i: usize) {
        let offset = self.tree.points[i] - self.center;
        if offset.length_squared() > self.limit {
            return;
        }
        let index = self.tree.index[i];
        let entry = ((self.distance_squared)(index, offset), index);
        let full = self.found.len() == self.k;
        if if full { !nearer(entry, self.found[0]) } else { entry.0 >= self.limit } {
            return;
        }
        if full {
            self.found[0] = entry;
            self.sift_down(0);
        } else {
            self.found.push(entry);
            if self.found.len() < self.k {
                return;
            }
            for j in (0..self.k / 2).rev() {
                self.sift_down(j);
            }
        }
        self.limit = self.found[0].0;
    }

    fn sift_down(&mut self, mut i: usize) {
        loop {
            let mut child = 2 * i + 1;
            if child >= self.k {
                return;
            }
            if child + 1 < self.k && nearer(self.found[child], self.found[child + 1]) {
                child += 1;
            }
            if !nearer(self.found[i], self.found[child]) {
                return;
            }
            self.found.swap(i, child);
            i = child;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn queries_equal_brute_force(
            raw in prop::collection::vec((0u8..20, 0u8..20, 0u8..20), 0..300),
            c in (0f32..20.0, 0f32..20.0, 0f32..20.0),
            k in 1usize..40,
            radius in 0.5f32..30.0) {
            let at = |&(x, y, z): &(u8, u8, u8)| {
                Vec3::new(f32::from(x), f32::from(y), f32::from(z))
            };
            let points: Vec<Vec3> = raw.iter().map(at).collect();
            let center = Vec3::new(c.0, c.1, c.2);
            let tree = KdTree::new(points.iter().copied());
            let metric = |i: u32, d: Vec3| match i % 7 {
                3 => f32::INFINITY,
                _ => d.length_squared() + 16.0 * d.z * d.z,
            };
            let mut expected: Vec<(f32, u32)> =
                points
                    .iter()
                    .zip(0..)
                    .map(|(p, i)| (metric(i, *p - center), i))
                    .filter(|e| e.0 < radius * radius)
                    .collect();
            expected.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            expected.truncate(k);
            let mut found = Vec::new();
            tree.nearest(center, k, radius, &mut found, metric);
            prop_assert_eq!(found, expected);

            let mut inside = Vec::new();
            tree.within(center, radius, |i, _| inside.push(i));
            inside.sort_unstable();
            let near =
                |&i: &u32| (points[i as usize] - center).length_squared() <= radius * radius;
            let brute: Vec<u32> = (0..points.len() as u32).filter(near).collect();
            prop_assert_eq!(inside, brute);
        }
    }

    #[test]
    fn large_tree_is_balanced_and_complete() {
        let n = 100_000u32;
        let tree = KdTree::new(
            (0..n).map(|i| Vec3::new((i % 317) as f32, (i % 101) as f32, (i % 7) as f32)),
        );
        let mut count = 0;
        tree.within(Vec3::ZERO, 1e6, |_, _| count += 1);
        assert_eq!(count, n);
    }
}
