//! Lights beside emissive materials. Quads and spheres also become geometry (visible, occluding) in
//! `tessellate`.

use crate::radiometry::Rgb;
use glam::Vec3;

/// A light source.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// Parallelogram that emits along `edge1 × edge2`; black otherwise.
    Quad {
        /// Corner, world space.
        corner: Vec3,
        /// First edge.
        edge1: Vec3,
        /// Second edge.
        edge2: Vec3,
        /// Emitted radiance.
        radiance: Rgb,
    },
    /// Sphere that emits outwards; black otherwise.
    Sphere {
        /// Centre, world space.
        center: Vec3,
        /// Radius in scene units.
        radius: f32,
        /// Emitted radiance.
        radiance: Rgb,
    },
    /// Sun: a direction, or a disc of constant radiance when `angular_radius_deg > 0`.
    Sun {
        /// Unit direction towards the sun.
        direction_to_sun: Vec3,
        /// Irradiance on a plane that faces the sun.
        irradiance: Rgb,
        /// Angular radius in degrees; 0: delta direction.
        angular_radius_deg: f32,
    },
    /// Constant radiance from everywhere that no surface covers.
    Sky {
        /// Radiance.
        radiance: Rgb,
    },
    /// Radiance from everywhere that no surface covers, by a picture.
    Environment {
        /// The picture and its rotation.
        map: std::sync::Arc<super::Environment>,
    },
    /// Isotropic point.
    Point {
        /// Position, world space.
        position: Vec3,
        /// Radiant intensity, W/sr.
        intensity: Rgb,
    },
    /// Point with a cone: full inside `inner_deg`, smoothstep to zero at `outer_deg` (half angles
    /// from the axis).
    Spot {
        /// Position, world space.
        position: Vec3,
        /// Unit axis.
        direction: Vec3,
        /// Radiant intensity on the axis, W/sr.
        intensity: Rgb,
        /// Half angle of full intensity, degrees.
        inner_deg: f32,
        /// Half angle of zero intensity, degrees.
        outer_deg: f32,
    },
}
