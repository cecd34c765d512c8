//! Landings become places, and places parts: sets of points that see each other.
//!
//! All landings with the key of the size that suits them make a place; at most [`MEMBERS`] of them
//! become its points. A place that something divides has a part for each of the sets that see each
//! other: the first point left leads, and takes along all that it sees. A place of one part is
//! clear where the first point sees its four corners too, for whatever divides a square hides one
//! of them; on other places every landing is asked what it sees.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::key::Spot;
use super::{LIFT, Light, Part, Place, Places};
use crate::math::{Frame, Ray, offset_origin};
use crate::proxy::Landing;
use crate::sampling::{hash64, sample_cosine_hemisphere};
use crate::shading::World;

/// Points of a place, at most.
const MEMBERS: usize = 8;
/// What a shared place holds beyond its outermost points, in sizes, along its normal.
const SLACK: f32 = 0.1;
/// Corners are looked for at this share of the way to them.
const INNER: f32 = 0.98;
/// Levels from a place up to its neighbourhood.
const AROUND: i32 = 5;

/// A point of a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub p: Vec3,
    /// Unit geometric normal of the side.
    pub ng: Vec3,
    /// Unit shading normal of the side.
    pub ns: Vec3,
}

impl Point {
    pub fn new(world: &World, landing: &Landing) -> Self {
        let s = world.geometry.surface(landing.triangle, landing.u, landing.v);
        let sign = landing.side.sign();
        Self { p: s.p, ng: s.ng * sign, ns: s.ns * sign }
    }

    /// A direction over the cosine of the hemisphere.
    pub fn cosine_direction(&self, uv: Vec2) -> Vec3 {
        Frame::from_normal(self.ns).world_from_local(sample_cosine_hemisphere(uv))
    }

    /// A ray; none where it would start into the surface.
    pub fn ray(&self, world: &World, wi: Vec3) -> Option<Ray> {
        let outwards = wi.dot(self.ng) > 0.0;
        outwards.then(|| Ray::new(offset_origin(self.p, self.ng, world.diagonal), wi))
    }
}

/// A part that is to be lit.
#[derive(Debug)]
pub(super) struct NewPart {
    /// Keys its random numbers.
    pub element: u64,
    pub points: Vec<Point>,
    /// Landings it stands for.
    pub landings: u32,
    /// The same for all parts of its neighbourhood.
    pub around: u64,
    /// Where its place lies, and at which level.
    pub spot: Spot,
    pub level: i32,
}

/// What a place consists of.
struct Divided {
    parts: Vec<(Part, NewPart)>,
    /// One part, and nothing hides the corners of the place from its first point.
    clear: bool,
    /// Triangles share the place.
    shared: bool,
    /// Short rays it took.
    short: u64,
}

/// A landing by key: `(key, index, level)`.
type Keyed = (u64, u32, i32);

impl Places {
    /// Adds the places of `landings`, without light. Returns their parts in the order that they
    /// have at the end of [`Places::parts`], and the short rays shot. Where a place is there
    /// already and none of its parts sees a landing, the landing adds nothing.
    pub(super) fn cover(&mut self, world: &World, landings: &[Landing]) -> (Vec<NewPart>, u64) {
        let key = |(i, landing): (usize, &Landing)| {
            let level = self.grids.level(landing);
            (self.grids.key(&self.grids.spot(world, landing), level), i as u32, level)
        };
        let mut keyed: Vec<Keyed> = landings.par_iter().enumerate().map(key).collect();
        keyed.par_sort_unstable();
        let places: Vec<&[Keyed]> = keyed
            .chunk_by(|a, b| a.0 == b.0)
            .filter(|place| !self.index.contains_key(&place[0].0))
            .collect();
        let divided: Vec<Divided> =
            places.par_iter().map(|place| self.divide(world, landings, place)).collect();
        let (mut out, mut rays) = (Vec::new(), 0);
        self.index.reserve(places.len());
        for (place, Divided { parts, clear, shared, short }) in places.iter().zip(divided) {
            let (first, count) = (self.parts.len() as u32, parts.len() as u16);
            let place_of = Place { first, parts: count, clear, whole: clear && !shared };
            self.index.insert(place[0].0, place_of);
            rays += short;
            for (part, new) in parts {
                self.parts.push(part);
                self.lights.push(Light::default());
                out.push(new);
            }
        }
        (out, rays)
    }

    /// The parts of a place.
    fn divide(&self, world: &World, landings: &[Landing], place: &[Keyed]) -> Divided {
        let (key, first, level) = place[0];
        let count = place.len().min(MEMBERS);
        let spot = self.grids.spot(world, &landings[first as usize]);
        let around = self.grids.key(&spot, level + AROUND);
        let shared = self.grids.is_shared(&spot, level);
        let size = self.grids.size_at(level);
        let lift = LIFT[usize::from(shared)] * size;
        let mut left: Vec<Point> = (0..count)
            .map(|i| place[i * place.len() / count].1)
            .map(|landing| Point::new(world, &landings[landing as usize]))
            .collect();
        let (mut parts, mut short) = (Vec::new(), 0);
        while let Some((&leader, others)) = left.split_first() {
            let at = (leader.p, leader.ng);
            let (seen, hidden): (Vec<Point>, Vec<Point>) =
                others.iter().partition(|o| sees(world, at, (o.p, o.ng), lift));
            short += others.len() as u64;
            let points: Vec<Point> = std::iter::once(leader).chain(seen).collect();
            let heights = points.iter().map(|o| (o.p - leader.p).dot(leader.ng));
            let (low, high) = heights.fold((0.0f32, 0.0f32), |(l, h), x| (l.min(x), h.max(x)));
            let slack = if shared { SLACK * size } else { f32::INFINITY };
            let heights = [low - slack, high + slack];
            let part =
                Part { p: leader.p, ng: leader.ng, size, heights, need: self.needs, edge: false };
            let landings = (place.len() * points.len()).div_ceil(count) as u32;
            let element = hash64(key ^ parts.len() as u64);
            parts.push((part, NewPart { element, points, landings, around, spot, level }));
            left = hidden;
        }
        let mut clear = parts.len() == 1;
        if clear {
            let first = &landings[first as usize];
            let corners = self.grids.corners(&spot, level);
            clear = corners.into_iter().all(|corner| {
                short += 1;
                let corner = if shared { corner } else { within(world, first, corner) };
                let inner = first.p + (corner - first.p) * INNER;
                sees(world, (first.p, spot.normal), (inner, spot.normal), lift)
            });
        }
        Divided { parts, clear, shared, short }
    }
}

/// Where the way from a landing to a point of its plane leaves its triangle, or that point.
fn within(world: &World, landing: &Landing, to: Vec3) -> Vec3 {
    let [a, b, c] = world.geometry.corners(landing.triangle);
    let (e1, e2, way) = (b - a, c - a, to - landing.p);
    let n = e1.cross(e2);
    let area = n.length_squared().max(f32::MIN_POSITIVE);
    let (du, dv) = (way.cross(e2).dot(n) / area, e1.cross(way).dot(n) / area);
    let weights = [(landing.u, du), (landing.v, dv), (1.0 - landing.u - landing.v, -du - dv)];
    let falling = weights.into_iter().filter(|&(_, change)| change < 0.0);
    let share = falling.map(|(weight, change)| weight.max(0.0) / -change).fold(1.0, f32::min);
    landing.p + way * share
}

/// Whether one point with its normal sees another, both lifted.
pub(super) fn sees(world: &World, from: (Vec3, Vec3), to: (Vec3, Vec3), lift: f32) -> bool {
    let lifted = |(p, n): (Vec3, Vec3)| offset_origin(p, n, world.diagonal) + n * lift;
    !world.rays.occluded(&Ray::segment(lifted(from), lifted(to)))
}
