//! Rays and hits, laid out as the border to C expects them.

use glam::Vec3;

/// A ray: points `origin + t · dir` for `t` in the open interval (`t_min`, `t_max`). `dir` need not
/// be unit; `t` counts in its lengths.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin, world space.
    pub origin: Vec3,
    /// Start of the interval.
    pub t_min: f32,
    /// Direction, world space.
    pub dir: Vec3,
    /// End of the interval; infinite for an unbounded ray.
    pub t_max: f32,
}

impl Ray {
    /// An unbounded ray.
    pub fn new(origin: Vec3, dir: Vec3) -> Self {
        Self { origin, t_min: 0.0, dir, t_max: f32::INFINITY }
    }
    /// From `a` towards `b`, ending just short of `b` (relative 1e-4).
    pub fn segment(a: Vec3, b: Vec3) -> Self {
        Self { origin: a, t_min: 0.0, dir: b - a, t_max: 1.0 - 1e-4 }
    }
    /// Point at `t`.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.dir * t
    }
}

/// The closest surface on a ray: position `(1−u−v)·v0 + u·v1 + v·v2` of triangle `triangle`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f32,
    /// Barycentric weight of vertex 1.
    pub u: f32,
    /// Barycentric weight of vertex 2.
    pub v: f32,
    /// Triangle index in the geometry the backend was built from.
    pub triangle: u32,
}

/// Origin for a ray that leaves a surface at `p` on the side of the unit normal `n`, far enough
/// that it does not meet the surface again.
///
/// The step is relative to the magnitude of the coordinates and to `scale` (the scene's diagonal):
/// 32 ulp of the larger of
/// |p| and 1e-2 of the diagonal. Chosen; the conformance and thin-wall tests hold it.
pub fn offset_origin(p: Vec3, n: Vec3, scale: f32) -> Vec3 {
    let magnitude = p.abs().max_element().max(0.01 * scale);
    p + n * (magnitude * (32.0 * f32::EPSILON))
}
