//! Coarse-to-fine overture: records are measured until every shading point is within reach of one.
//!
//! ```text
//! for stride in 64, 32, …, 1:
//!     for points of pixels on that grid, in an order that spreads:
//!         not covered → measure a record there
//! ```
//! Work is done in batches whose size depends on the number of records alone: the points of a batch
//! are tested against the frozen cache, the uncovered ones measured in parallel and inserted in
//! order. A measurement that an earlier one of its batch covers is kept: it is paid for. Neighbour
//! clamping happens at insertion and may uncover points, so all points are visited again until none
//! is left.
//!
//! Input   shading points, proxy, [`Rule`]. Output  [`Cache`]. Guarantees  bit-identical for any
//!         thread count; random numbers are keyed by the record's position. Cost  records · rays,
//!         and a lookup per point and visit.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use cpu_time::ThreadTime;
use rayon::prelude::*;

use super::hemisphere::Site;
use super::measure::{MeasureSettings, measure};
use super::octree::Octree;
use super::record::CacheRecord;
use super::settings::CacheSettings;
use super::validity::Rule;
use crate::error::Result;
use crate::math::Aabb;
use crate::proxy::Proxy;
use crate::record::CameraSamples;
use crate::run::{RayKind, Run};
use crate::sampling::hash64;
use crate::shading::World;

/// Pixel distance of the first pass.
const COARSEST: u32 = 64;
/// Visits of all points after the last pass, at most.
const ROUNDS: usize = 16;
/// Points tested for one that is measured.
const LOOK_AHEAD: usize = 8;

/// Records that are measured, and kept, at a time.
const BLOCK: usize = 4;

/// By how much the share of points that need a record falls from pass to pass, where nothing is
/// known of it.
const FALLS: f64 = 0.4;

/// How many records are still to be measured, by the shares of points that needed one.
struct Outlook {
    /// All points, and those of the passes before.
    points: usize,
    seen: usize,
    /// Share that needed a record in the pass before.
    open: f64,
    falls: f64,
}

impl Outlook {
    /// In a pass of so many points, after so many of which a share needed one.
    fn records(&self, of_pass: usize, tested: usize, share: f64) -> f64 {
        let known = tested as f64 / (tested as f64 + 100.0);
        let share = known * share + (1.0 - known) * self.open * self.falls;
        let falls =
            known * (share / self.open.max(1e-9)).clamp(0.05, 0.7) + (1.0 - known) * self.falls;
        let mut more = (of_pass.saturating_sub(tested)) as f64 * share;
        let (mut rest, mut next) = (self.points.saturating_sub(self.seen + of_pass), of_pass);
        let mut open = share;
        while rest > 0 {
            (next, open) = (rest.min(next.max(1) * 4), open * falls);
            more += next as f64 * open;
            rest -= next;
        }
        more
    }

    /// The pass is over.
    fn next(&mut self, of_pass: usize, measured: usize) {
        self.seen += of_pass;
        if of_pass > 0 {
            let open = measured as f64 / of_pass as f64;
            self.falls = (open / self.open.max(1e-9)).clamp(0.05, 0.7);
            self.open = open;
        }
    }
}

/// Records, and where they are.
#[derive(Clone, Debug)]
pub struct Cache {
    /// All records, in order of insertion.
    pub records: Vec<CacheRecord>,
    /// Pixel that a record was made for; none when it was loaded.
    pub pixel: Vec<Option<u32>>,
    /// Validity.
    pub rule: Rule,
    /// Rays shot for records measured here.
    pub rays: u64,
    /// CPU seconds inside measuring, summed over threads.
    pub measure_seconds: f64,
    reach: f32,
    bounds: Aabb,
    spheres: Octree,
    clearances: Octree,
}

impl Cache {
    /// An empty cache for a picture of so many pixels.
    pub fn new(settings: &CacheSettings, pixels: u32, world: &World) -> Self {
        let bounds = &world.geometry.bounds;
        Self {
            records: Vec::new(),
            pixel: Vec::new(),
            rule: Rule::new(settings, pixels, world.around.extent),
            rays: 0,
            measure_seconds: 0.0,
            reach: settings.reach,
            bounds: *bounds,
            spheres: Octree::new(bounds),
            clearances: Octree::new(bounds),
        }
    }

    /// Adds a record as it is.
    pub fn insert(&mut self, record: CacheRecord, pixel: Option<u32>) {
        let index = self.records.len() as u32;
        self.spheres.insert(index, record.p, self.rule.sphere(&record, self.reach));
        if self.rule.clamps_neighbours() {
            self.clearances.insert(index, record.p, record.clearance);
        }
        self.records.push(record);
        self.pixel.push(pixel);
    }

    /// Adds a record; it and its neighbours limit one another's clearance by their distance.
    pub fn insert_clamped(&mut self, mut record: CacheRecord, pixel: Option<u32>) {
        if self.rule.clamps_neighbours() {
            let bound = |own: &CacheRecord, other: &CacheRecord| {
                if own.n.dot(other.n) > 0.0 {
                    other.clearance + own.p.distance(other.p)
                } else {
                    f32::INFINITY
                }
            };
            let mut lowest = record.clearance;
            for i in self.clearances.within(record.p, record.clearance) {
                lowest = lowest.min(bound(&record, &self.records[i as usize]));
            }
            self.rule.clamp(&mut record, lowest);
            let Self { records, clearances, rule, .. } = self;
            clearances.around(record.p, |i| {
                let other = &mut records[i as usize];
                rule.clamp(other, bound(other, &record));
                false
            });
        }
        self.insert(record, pixel);
    }

    /// Builds the tree of spheres anew: radii may have shrunk, and its order shall not tell in
    /// which way the records came.
    fn settle(&mut self) {
        self.spheres = Octree::new(&self.bounds);
        for (i, record) in self.records.iter().enumerate() {
            self.spheres.insert(i as u32, record.p, self.rule.sphere(record, self.reach));
        }
    }

    /// Calls `visit` with records that have weight at a point until it returns true; counts test
    /// rays.
    pub fn lookup(
        &self,
        world: &World,
        p: glam::Vec3,
        n: glam::Vec3,
        reach: f32,
        rays: &mut u64,
        mut visit: impl FnMut(&CacheRecord, f32) -> bool,
    ) -> bool {
        self.spheres.around(p, |i| {
            let record = &self.records[i as usize];
            let weight = self.rule.weight(record, p, n, reach);
            weight > 0.0 && !self.rule.leaks(world, record, p, rays) && visit(record, weight)
        })
    }

    /// Measures until every shading point is covered (phase `fill`).
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    pub fn fill(
        &mut self,
        world: &World,
        proxy: &Proxy,
        samples: &CameraSamples,
        rays: u32,
        seed: u64,
        run: &Run,
    ) -> Result<()> {
        let points = &samples.points;
        let phase = run.phase("fill", points.len() as u64);
        let nanoseconds = AtomicU64::new(0);
        let pass = |stride: u32| {
            let on = |pixel: u32, s: u32| {
                (pixel % samples.width).is_multiple_of(s)
                    && (pixel / samples.width).is_multiple_of(s)
            };
            let of_pass = |&i: &u32| {
                let pixel = points.pixel[i as usize];
                on(pixel, stride) && (stride == COARSEST || !on(pixel, 2 * stride))
            };
            let mut chosen: Vec<u32> = (0..points.len() as u32).filter(of_pass).collect();
            chosen.sort_by_cached_key(|&i| hash64(u64::from(i)));
            chosen
        };
        let mut outlook = Outlook { points: points.len(), seen: 0, open: 1.0, falls: FALLS };
        let mut stride = COARSEST;
        let mut rounds = 0;
        while rounds < ROUNDS {
            let todo = if stride > 0 { pass(stride) } else { (0..points.len() as u32).collect() };
            let before = self.records.len();
            let mut at = 0;
            let mut measured_here = 0;
            while at < todo.len() {
                run.check()?;
                let batch = (self.records.len() / 8).clamp(16, 1024);
                let ahead = &todo[at..(at + LOOK_AHEAD * batch).min(todo.len())];
                let covered: Vec<bool> = run.install(|| {
                    ahead
                        .par_iter()
                        .with_min_len(64)
                        .map(|&i| {
                            self.covers(world, points.p[i as usize], points.ns[i as usize], run)
                        })
                        .collect()
                });
                let mut tested = 0;
                let mut open = Vec::new();
                for (&i, &covered) in ahead.iter().zip(&covered) {
                    if open.len() == batch {
                        break;
                    }
                    tested += 1;
                    if !covered {
                        open.push(i as usize);
                    }
                }
                let rule = self.rule;
                let settings = MeasureSettings::new(rays, rule.derivatives());
                let one = |i: usize| {
                    let start = ThreadTime::now();
                    // The same in every unit of length.
                    let key = (points.p[i] / world.diagonal)
                        .to_array()
                        .iter()
                        .fold(0, |h, v| hash64(h ^ u64::from(v.to_bits())));
                    let (p, ng, ns) = (points.p[i], points.ng[i], points.ns[i]);
                    let site = Site { p, ng, ns, seed, element: key };
                    let m = measure(world, proxy, &site, &settings);
                    nanoseconds.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
                    (rule.record(&m, p, ns, points.footprint[i]), m.rays)
                };
                let some = |(): &mut (), range: Range<usize>| {
                    open[range].iter().map(|&i| one(i)).collect()
                };
                let measured: Vec<(CacheRecord, u32)> =
                    run.blocks("fill", (open.len(), BLOCK), (), some)?;
                for ((record, shot), &i) in measured.into_iter().zip(&open) {
                    self.rays += u64::from(shot);
                    run.rays.add(RayKind::Sample, u64::from(shot));
                    self.insert_clamped(record, Some(points.pixel[i]));
                }
                at += tested;
                measured_here += open.len();
                phase.advance(open.len() as u64);
                let share = measured_here as f64 / at.max(1) as f64;
                run.expect("fill", outlook.records(todo.len(), at, share) as u64);
            }
            outlook.next(todo.len(), measured_here);
            stride /= 2;
            if stride == 0 {
                rounds += 1;
                if rounds > 1 && self.records.len() == before {
                    break;
                }
            }
        }
        self.measure_seconds += nanoseconds.into_inner() as f64 * 1e-9;
        self.settle();
        Ok(())
    }

    fn covers(&self, world: &World, p: glam::Vec3, n: glam::Vec3, run: &Run) -> bool {
        let mut rays = 0;
        let covered = self.lookup(world, p, n, 1.0, &mut rays, |_, _| true);
        run.rays.add(RayKind::Visibility, rays);
        covered
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_to_come_follow_the_shares_of_the_passes() {
        let mut outlook = Outlook { points: 21_000, seen: 0, open: 1.0, falls: FALLS };
        outlook.next(1000, 1000);
        outlook.next(4000, 2000);
        // Half of the points of the last pass, and then again half of the share.
        let more = outlook.records(16_000, 0, 0.0);
        assert!((more - 16_000.0 * 0.25).abs() < 1e-6, "{more}");
        let more = outlook.records(16_000, 15_999, 0.25);
        assert!(more < 0.3, "{more}");
    }
}
