//! Which place a landing belongs to, at every size.
//!
//! Sizes are `size · 2^level`. A triangle with an edge of at least that size has places of its own:
//! one for each side and each square of a grid over the axes that its plane leans to. Smaller
//! triangles share the cubes of a grid, one place for each way of facing. A key is a hash of all
//! that, of 64 bits: of a million places two have the same by a chance of one in thirty million.

use glam::{I64Vec3, Vec3};
use rayon::prelude::*;

use crate::proxy::Landing;
use crate::sampling::hash64;
use crate::shading::World;
use crate::tessellate::Side;

/// Grids are moved aside, for walls like to lie at round coordinates.
const ASIDE: Vec3 = Vec3::new(0.37, 0.41, 0.29);
/// Levels are kept within these.
const LEVELS: [i32; 2] = [-60, 60];
/// Ways of facing along each axis, from −2 to 2.
const WAYS: u64 = 5;

/// The grids of a scene.
#[derive(Debug)]
pub(super) struct Grids {
    /// Size of level 0, scene units.
    size: f32,
    /// Size of a place over the length of the ray that landed.
    reach: f32,
    /// The highest level at which a triangle has places of its own.
    own_up_to: Vec<i8>,
}

/// A landing with what its keys are made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    p: Vec3,
    /// Unit geometric normal of the side.
    pub normal: Vec3,
    triangle: u32,
    side: Side,
    own_up_to: i32,
}

/// Largest whole power of two that is not above a positive number.
fn exponent(x: f32) -> i32 {
    ((x.to_bits() >> 23) as i32 - 127).clamp(LEVELS[0], LEVELS[1])
}

fn power_of_two(exponent: i32) -> f32 {
    f32::from_bits(((exponent.clamp(LEVELS[0], LEVELS[1]) + 127) as u32) << 23)
}

/// The two axes along which a surface is cut into squares, and that across.
fn axes(normal: Vec3) -> [usize; 3] {
    let n = normal.abs();
    if n.x >= n.y && n.x >= n.z {
        [1, 2, 0]
    } else if n.y >= n.z {
        [2, 0, 1]
    } else {
        [0, 1, 2]
    }
}

fn hash(what: u64, [a, b]: [i64; 2]) -> u64 {
    hash64(hash64(what).wrapping_add((a as u64 & 0xffff_ffff) | (b as u64) << 32))
}

fn level_bits(level: i32) -> u64 {
    u64::from(level as u8) << 48
}

/// The key of a cube and a way of facing.
fn shared_key(spot: &Spot, level: i32, at: I64Vec3) -> u64 {
    let facing = ((spot.normal * 2.0).round().as_i64vec3() + 2).as_u64vec3();
    let facing = (facing.x * WAYS + facing.y) * WAYS + facing.z;
    hash(facing << 56 | level_bits(level) | (at.z as u64 & 0xffff_ffff), [at.x, at.y])
}

impl Spot {
    /// A point of the plane of its triangle as a landing; none outside the triangle.
    pub fn landing(&self, world: &World, p: Vec3) -> Option<Landing> {
        let [a, b, c] = world.geometry.corners(self.triangle);
        let (e1, e2, way) = (b - a, c - a, p - a);
        let n = e1.cross(e2);
        let (u, v) = (way.cross(e2).dot(n), e1.cross(way).dot(n));
        let area = n.length_squared();
        let inside = u >= 0.0 && v >= 0.0 && u + v <= area && area > 0.0;
        let [u, v] = [u / area, v / area];
        inside.then_some(Landing { p, triangle: self.triangle, u, v, side: self.side, reach: 0.0 })
    }
}

impl Grids {
    pub fn new(world: &World, size: f32, reach: f32) -> Self {
        let geometry = &world.geometry;
        let longest = |triangle: u32| {
            let [a, b, c] = geometry.corners(triangle);
            a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a)).sqrt()
        };
        let own_up_to = (0..geometry.triangles.len() as u32)
            .into_par_iter()
            .map(|t| exponent(longest(t) / size) as i8)
            .collect();
        Self { size, reach, own_up_to }
    }

    /// What it holds of memory.
    pub fn bytes(&self) -> usize {
        self.own_up_to.capacity()
    }

    pub fn spot(&self, world: &World, landing: &Landing) -> Spot {
        let Landing { p, triangle, side, .. } = *landing;
        let normal = world.geometry.face_normals[triangle as usize] * side.sign();
        let own_up_to = i32::from(self.own_up_to[triangle as usize]);
        Spot { p, normal, triangle, side, own_up_to }
    }

    /// The level that suits a landing. Between two levels the landing itself decides, so that no
    /// seam shows where sizes change.
    pub fn level(&self, landing: &Landing) -> i32 {
        let bits = u64::from(landing.u.to_bits()) << 32 | u64::from(landing.v.to_bits());
        let dither = (hash64(bits ^ u64::from(landing.triangle)) >> 40) as f32 / 16_777_216.0;
        let wanted = self.reach * landing.reach / self.size * (1.0 + dither);
        if wanted > 1.0 { exponent(wanted) } else { 0 }
    }

    pub fn size_at(&self, level: i32) -> f32 {
        self.size * power_of_two(level)
    }

    /// Whether places of this level are shared by the triangles around.
    pub fn is_shared(&self, spot: &Spot, level: i32) -> bool {
        level > spot.own_up_to
    }

    pub fn key(&self, spot: &Spot, level: i32) -> u64 {
        self.key_of(spot, level, self.cell(spot, level).as_i64vec3())
    }

    /// Keys of the squares or cubes next to that of a spot, of each pair that above.
    pub fn next(&self, spot: &Spot, level: i32) -> impl Iterator<Item = u64> {
        let at = self.cell(spot, level).as_i64vec3();
        let [a, b, c] = axes(spot.normal);
        let axes = [a, b, c].into_iter().take(if self.is_shared(spot, level) { 3 } else { 2 });
        axes.map(move |axis| {
            let mut next = at;
            next[axis] += 1;
            self.key_of(spot, level, next)
        })
    }

    /// The key of the cube of a spot, whatever triangles share it.
    pub fn cube(&self, spot: &Spot, level: i32) -> u64 {
        shared_key(spot, level, self.cell(spot, level).as_i64vec3())
    }

    /// Keys of the cube of a spot and of those around it, along its surface.
    pub fn cubes(&self, spot: &Spot, level: i32) -> impl Iterator<Item = u64> {
        let at = self.cell(spot, level).as_i64vec3();
        let [a, b, _] = axes(spot.normal);
        (0..9).map(move |i| {
            let mut next = at;
            next[a] += i / 3 - 1;
            next[b] += i % 3 - 1;
            shared_key(spot, level, next)
        })
    }

    fn key_of(&self, spot: &Spot, level: i32, at: I64Vec3) -> u64 {
        if self.is_shared(spot, level) {
            return shared_key(spot, level, at);
        }
        let [a, b, _] = axes(spot.normal);
        let triangle = u64::from(spot.triangle) << 1 | spot.side as u64;
        hash(u64::MAX << 56 | level_bits(level) | triangle, [at[a], at[b]])
    }

    fn cell(&self, spot: &Spot, level: i32) -> Vec3 {
        (spot.p / self.size_at(level) + ASIDE).floor()
    }

    /// Corners of the square around a spot, in the plane of its triangle.
    pub fn corners(&self, spot: &Spot, level: i32) -> [Vec3; 4] {
        let size = self.size_at(level);
        let low = (self.cell(spot, level) - ASIDE) * size;
        let (n, p, [a, b, c]) = (spot.normal, spot.p, axes(spot.normal));
        [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]].map(|[i, j]| {
            let mut corner = p;
            corner[a] = low[a] + i * size;
            corner[b] = low[b] + j * size;
            corner[c] -= (n[a] * (corner[a] - p[a]) + n[b] * (corner[b] - p[b])) / n[c];
            corner
        })
    }
}
