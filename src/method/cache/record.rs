//! What the cache keeps of a measurement.

use glam::Vec3;

use crate::journal::stored;
use crate::radiometry::Rgb;

/// One record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CacheRecord {
    /// Position, lifted off the surface, world space.
    pub p: Vec3,
    /// Unit shading normal.
    pub n: Vec3,
    /// On the plane with normal `n`, W·m⁻².
    pub irradiance: Rgb,
    /// Per channel: E(N) ≈ E + (n × N) · g.
    pub gradient_rotation: [Vec3; 3],
    /// Per channel, tangent to n, per unit length.
    pub gradient_translation: [Vec3; 3],
    /// Unit tangent along `radius[0]`.
    pub axis: Vec3,
    /// Reach in the fill along `axis` and across it, scene units.
    pub radius: [f32; 2],
    /// Distance to other surfaces after neighbour clamping, scene units (0 where the mode does
    /// without).
    pub clearance: f32,
    /// Least radius: the pixel footprint's share, scene units.
    pub floor: f32,
    /// Bit per azimuth sector about `Frame::from_normal(n)`: something low stands within reach.
    pub corral: u32,
    /// Relative standard error of the irradiance.
    pub standard_error: f32,
}

stored!(CacheRecord {
    p,
    n,
    irradiance,
    gradient_rotation,
    gradient_translation,
    axis,
    radius,
    clearance,
    floor,
    corral,
    standard_error,
});

impl CacheRecord {
    /// Extrapolated to a point and a normal; every channel between the record's own value over
    /// `limit` and times `limit`.
    pub fn extrapolate(&self, p: Vec3, n: Vec3, limit: f32) -> Rgb {
        let (turn, step) = (self.n.cross(n), p - self.p);
        let channel = |c: usize| {
            let e = self.irradiance[c];
            let value =
                e + turn.dot(self.gradient_rotation[c]) + step.dot(self.gradient_translation[c]);
            value.min(e * limit).max(e / limit).max(0.0)
        };
        Rgb::new(channel(0), channel(1), channel(2))
    }

    /// Largest radius.
    pub fn radius_max(&self) -> f32 {
        self.radius[0].max(self.radius[1])
    }
}
