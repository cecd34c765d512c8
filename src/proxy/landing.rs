//! Where rays land, and what the proxy answers there.
//!
//! A [`Landing`] is a hit without its light: callers collect landings, ask the proxy for what they
//! need ([`super::Need::Landings`]) and read it afterwards ([`super::Proxy::read`]).

use glam::Vec3;

use crate::math::{Hit, Ray};
use crate::radiometry::Rgb;
use crate::shading::{Surface, World};
use crate::tessellate::Side;

/// A point on one side of a surface, as a ray met it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Landing {
    /// Position, world space.
    pub p: Vec3,
    /// Triangle of the geometry.
    pub triangle: u32,
    /// Barycentric weight of vertex 1.
    pub u: f32,
    /// Barycentric weight of vertex 2.
    pub v: f32,
    /// Side that the ray met.
    pub side: Side,
    /// Length of the ray, scene units; 0 where no ray decides how finely light is to be known.
    pub reach: f32,
}

impl Landing {
    /// Where `ray` had its `hit`.
    pub fn new(world: &World, ray: &Ray, hit: &Hit) -> Self {
        let normal = world.geometry.face_normals[hit.triangle as usize];
        Self {
            p: ray.at(hit.t),
            triangle: hit.triangle,
            u: hit.u,
            v: hit.v,
            side: Side::met(normal, ray.dir),
            reach: hit.t * ray.dir.length(),
        }
    }
}

impl From<&Surface> for Landing {
    fn from(s: &Surface) -> Self {
        Self { p: s.p, triangle: s.triangle, u: s.u, v: s.v, side: s.side, reach: 0.0 }
    }
}

/// The piece of surface whose light a landing is told; all landings on it are told the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece(pub(super) u32);

impl Piece {
    /// No piece: the light is the landing's own.
    pub const NONE: Self = Self(u32::MAX);

    /// A number that tells pieces apart.
    pub fn number(self) -> u32 {
        self.0
    }
}

/// Light at a landing, emission left out: it is direct light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Radiosity, W·m⁻² per existing area; radiance is this / π.
    pub radiosity: Rgb,
    /// Indirect irradiance, W·m⁻².
    pub indirect: Rgb,
    /// Where it comes from.
    pub piece: Piece,
}

/// A place of the light by need, for pictures of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownPlace {
    /// Its size, scene units.
    pub size: f32,
    /// Direct irradiance, W·m⁻².
    pub direct: Rgb,
    /// Indirect irradiance, W·m⁻².
    pub indirect: Rgb,
    /// The need that it was made for, counted from 0: in a film that of the frame.
    pub need: u32,
}

/// Light that arrives along a ray.
#[derive(Clone, Copy, Debug)]
pub struct Incident {
    /// Radiance, W·sr⁻¹·m⁻².
    pub radiance: Rgb,
    /// Distance in lengths of the ray's direction; infinite for the sky.
    pub t: f32,
    /// The point that decides how near the surface is: that which stands for the piece of surface
    /// the light comes from, or the hit itself. None for the sky.
    pub stands_at: Option<Vec3>,
    /// Unit geometric normal there, towards the ray's origin; zero for the sky.
    pub normal: Vec3,
}
