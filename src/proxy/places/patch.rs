//! What a place covers: its shape, its points, and whether something stands between them.
//!
//! A triangle with an edge of at least half a size is cut into pieces: its longest edge is bisected
//! until no edge is longer than the size; the way down is the key. Smaller triangles share the
//! cubes of a grid of that size, one for each way of facing: the points of such a place are those
//! that parallel rays meet, which look at the cube from the side that it faces.

use glam::{IVec3, Vec2, Vec3};

use super::{Key, Places};
use crate::math::{Frame, Ray, offset_origin};
use crate::proxy::Landing;
use crate::sampling::{Sobol, Stream, sample_triangle};
use crate::shading::World;
use crate::tessellate::Side;

/// Which patch of surface, on which side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Shape {
    /// Piece of a triangle; `path` begins with a one, then a bit for every bisection.
    Piece { triangle: u32, side: Side, path: u64 },
    /// Surface in a cube of edge 2^`level`/8 sizes that faces about `facing`.
    Cube { level: i8, at: [i32; 3], facing: [i8; 3] },
}

impl Shape {
    pub fn words(&self) -> [u64; 3] {
        match *self {
            Self::Piece { triangle, side, path } => [u64::from(triangle), path, side as u64],
            Self::Cube { level, at, facing } => {
                let word = |x: i32| u64::from(x as u32);
                let [a, b, c] = facing.map(|f| u64::from(f as u8));
                let rest = u64::from(level as u8) << 32 | a << 40 | b << 48 | c << 56;
                [word(at[0]) | word(at[1]) << 32, word(at[2]) | rest, 2]
            }
        }
    }
}

/// A point of a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub p: Vec3,
    /// Unit geometric normal of the side.
    pub ng: Vec3,
    /// Unit shading normal of the side.
    pub ns: Vec3,
}

/// A corner of a piece: position, and barycentrics in its triangle.
type Corner = (Vec3, Vec2);

fn corners(world: &World, triangle: u32) -> [Corner; 3] {
    let [a, b, c] = world.geometry.corners(triangle);
    [(a, Vec2::ZERO), (b, Vec2::X), (c, Vec2::Y)]
}

/// The longest edge (from its first corner on) and its length.
fn longest(c: &[Corner; 3]) -> (usize, f32) {
    let length = |i: usize| c[i].0.distance_squared(c[(i + 1) % 3].0);
    let [a, b, d] = [length(0), length(1), length(2)];
    let edge = if a >= b && a >= d {
        0
    } else if b >= d {
        1
    } else {
        2
    };
    (edge, [a, b, d][edge].sqrt())
}

/// Cuts a piece in two at an edge; keeps the half at that edge's first corner, or the other.
fn halve(c: &mut [Corner; 3], edge: usize, other: bool) {
    let (i, j) = (edge, (edge + 1) % 3);
    let middle = ((c[i].0 + c[j].0) * 0.5, (c[i].1 + c[j].1) * 0.5);
    c[if other { i } else { j }] = middle;
}

const DEEPEST: u64 = 1 << 62;

/// The way of one landing down to smaller and smaller places.
pub(super) struct Walk {
    triangle: u32,
    side: Side,
    piece: [Corner; 3],
    /// Weights of the landing in `piece`.
    weights: [f32; 3],
    path: u64,
    /// Longest edge of the whole triangle.
    whole: f32,
    p: Vec3,
    /// Unit normal of the side.
    n: Vec3,
    /// Size of the grid's unit: that of the smallest cubes.
    unit: f32,
}

impl Walk {
    pub fn new(world: &World, landing: &Landing, unit: f32) -> Self {
        let Landing { triangle, u, v, side, .. } = *landing;
        let piece = corners(world, triangle);
        let [a, b, c] = piece.map(|c| c.0);
        Self {
            triangle,
            side,
            piece,
            weights: [1.0 - u - v, u, v],
            path: 1,
            whole: longest(&piece).1,
            p: a * (1.0 - u - v) + b * u + c * v,
            n: world.geometry.face_normals[triangle as usize] * side.sign(),
            unit,
        }
    }

    /// The shape of this size; sizes may only shrink from call to call.
    pub fn shape(&mut self, size: f32) -> Shape {
        if self.whole < 0.5 * size {
            let level = (size / self.unit).log2().round();
            let edge = self.unit * level.exp2();
            return Shape::Cube {
                level: level as i8,
                at: cube_of(self.p, edge).to_array(),
                facing: facing_of(self.n),
            };
        }
        loop {
            let (edge, length) = longest(&self.piece);
            if length <= size || self.path >= DEEPEST {
                break;
            }
            let (i, j) = (edge, (edge + 1) % 3);
            let b = &mut self.weights;
            let other = b[i] < b[j];
            let (keep, cut) = if other { (j, i) } else { (i, j) };
            b[keep] -= b[cut];
            b[cut] *= 2.0;
            halve(&mut self.piece, edge, other);
            self.path = self.path << 1 | u64::from(other);
        }
        Shape::Piece { triangle: self.triangle, side: self.side, path: self.path }
    }

    /// The whole triangle.
    pub fn triangle(&self) -> Shape {
        Shape::Piece { triangle: self.triangle, side: self.side, path: 1 }
    }

    /// Position and unit normal of the side.
    pub fn at(&self) -> (Vec3, Vec3) {
        (self.p, self.n)
    }

    /// Whether the landing lies in the layer of a cube's points.
    pub fn within(&self, shape: Shape, heights: [f32; 2]) -> bool {
        let Shape::Cube { level, at, facing } = shape else { return true };
        let (center, edge) = cube(at, level, self.unit);
        let height = (self.p - center).dot(direction(facing));
        let slack = 0.1 * edge;
        height >= heights[0] - slack && height <= heights[1] + slack
    }
}

/// Grids are moved aside, for walls like to lie at round coordinates.
const ASIDE: Vec3 = Vec3::new(0.37, 0.41, 0.29);

fn cube_of(p: Vec3, edge: f32) -> IVec3 {
    (p / edge + ASIDE).floor().as_ivec3()
}

/// Middle and edge of a cube.
fn cube(at: [i32; 3], level: i8, unit: f32) -> (Vec3, f32) {
    let edge = unit * f32::from(level).exp2();
    ((IVec3::from_array(at).as_vec3() + 0.5 - ASIDE) * edge, edge)
}

fn facing_of(n: Vec3) -> [i8; 3] {
    (n * 2.0).round().to_array().map(|x| x as i8)
}

fn direction(facing: [i8; 3]) -> Vec3 {
    Vec3::from_array(facing.map(f32::from)).normalize_or_zero()
}

/// Points of a place, at most.
pub(super) const POINTS: u32 = 8;
/// Rays that look for the points of a cube.
const LOOKS: u32 = 16;
/// Height over the surface, in sizes, at which points are asked whether they see each other.
pub(super) const LIFT: f32 = 0.06;
/// Layers of a cube that are farther apart than this part of its edge are places of their own.
const THICKEST: f32 = 0.35;

/// What a place covers.
pub(super) struct Patch {
    pub points: Vec<Point>,
    /// Something stands between the points.
    pub divided: bool,
    /// Heights of the points over the middle of a cube.
    pub heights: [f32; 2],
    /// Rays that it took.
    pub rays: u64,
}

impl Places {
    pub(super) fn patch(&self, world: &World, key: &Key) -> Patch {
        let sobol = Sobol::new(self.seed, Stream::Place, Key { point: 0, ..*key }.hash());
        match key.shape {
            Shape::Piece { triangle, side, path } => piece(world, triangle, side, path, &sobol),
            Shape::Cube { level, at, facing } => {
                surface_in_cube(world, cube(at, level, self.smallest()), facing, &sobol)
            }
        }
    }
}

fn point(world: &World, triangle: u32, u: f32, v: f32, side: Side) -> Point {
    let s = world.geometry.surface(triangle, u, v);
    Point { p: s.p, ng: s.ng * side.sign(), ns: s.ns * side.sign() }
}

/// Whether one lifted point sees another.
pub(super) fn sees(world: &World, from: (Vec3, Vec3), to: (Vec3, Vec3), lift: f32) -> bool {
    let lifted = |(p, n): (Vec3, Vec3)| offset_origin(p, n, world.diagonal) + n * lift;
    !world.rays.occluded(&Ray::segment(lifted(from), lifted(to)))
}

/// Whether nothing lies on a point, up to a height.
fn open(world: &World, at: &Point, height: f32) -> bool {
    let ray = Ray::new(offset_origin(at.p, at.ng, world.diagonal), at.ng);
    !world.rays.occluded(&Ray { t_max: height, ..ray })
}

fn piece(world: &World, triangle: u32, side: Side, path: u64, sobol: &Sobol) -> Patch {
    let mut c = corners(world, triangle);
    for bit in (0..path.ilog2()).rev() {
        let (edge, _) = longest(&c);
        halve(&mut c, edge, path >> bit & 1 == 1);
    }
    let size = longest(&c).1;
    let at = |b: Vec2| c[0].1 * (1.0 - b.x - b.y) + c[1].1 * b.x + c[2].1 * b.y;
    let points = (0..POINTS)
        .map(|i| at(sample_triangle(sobol.sample_2d(i, 0))).clamp(Vec2::ZERO, Vec2::ONE))
        .filter(|b| world.geometry.exists(triangle, b.x, b.y))
        .map(|b| point(world, triangle, b.x, b.y, side))
        .filter(|p| open(world, p, LIFT * size))
        .collect();
    // What divides a piece crosses its border, drawn a little inwards.
    let middle = (c[0].0 + c[1].0 + c[2].0) / 3.0;
    let n = world.geometry.face_normals[triangle as usize] * side.sign();
    let inner = c.map(|(p, _)| (p + (middle - p) * 0.06, n));
    let clear = |i: usize| sees(world, inner[i], inner[(i + 1) % 3], LIFT * size);
    let divided = !(0..3).all(clear);
    Patch { points, divided, heights: [0.0; 2], rays: 3 + u64::from(POINTS) }
}

fn surface_in_cube(
    world: &World,
    (center, edge): (Vec3, f32),
    facing: [i8; 3],
    sobol: &Sobol,
) -> Patch {
    let n = direction(facing);
    let frame = Frame::from_normal(n);
    let half = 0.5 * edge * n.abs().element_sum();
    let mut patch = Patch { points: Vec::new(), divided: false, heights: [0.0; 2], rays: 0 };
    let mut heights = [f32::INFINITY, f32::NEG_INFINITY];
    for i in 0..LOOKS {
        let at = (sobol.sample_2d(i, 0) - 0.5) * edge * 1.2;
        let origin = center + frame.world_from_local(Vec3::new(at.x, at.y, half));
        let ray = Ray { t_max: 2.0 * half, ..Ray::new(origin, -n) };
        patch.rays += 1;
        let Some(hit) = world.rays.closest(&ray) else { continue };
        let side = Side::met(world.geometry.face_normals[hit.triangle as usize], -n);
        let found = point(world, hit.triangle, hit.u, hit.v, side);
        let inside = (found.p - center).abs().max_element() <= 0.5 * edge;
        if !inside || facing_of(found.ng) != facing || !open(world, &found, LIFT * edge) {
            continue;
        }
        let height = (found.p - center).dot(n);
        heights = [heights[0].min(height), heights[1].max(height)];
        patch.points.push(found);
        if patch.points.len() == POINTS as usize {
            break;
        }
    }
    let Some((first, others)) = patch.points.split_first() else {
        return Patch { divided: true, ..patch };
    };
    let clear = |o: &Point| sees(world, (first.p, first.ng), (o.p, o.ng), LIFT * edge);
    let divided = heights[1] - heights[0] > THICKEST * edge || !others.iter().all(clear);
    let rays = patch.rays + others.len() as u64;
    Patch { divided, heights, rays, ..patch }
}
