//! Photons leaving the lights.
//!
//! Flux of a photon = (emitted radiance · cos / density) summed over the choices: π L A for
//! surfaces, L Ω · π R² for suns and sky, whose rays start on a disc that touches the scene's
//! bounding sphere of radius R, 4π I for points, I ∫ falloff dω for spots. This is the flux of a
//! whole emission; `proxy::trace` divides it by `proxy.photons` and carries it from hit to hit.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::{LightTable, PhotonEmission, Source, spot_falloff};
use crate::math::{Frame, Ray, offset_origin};
use crate::radiometry::Rgb;
use crate::sampling::{
    sample_cosine_hemisphere, sample_disc, sample_triangle, sample_uniform_cone,
    sample_uniform_sphere,
};

impl LightTable {
    /// A photon: `u_pick` picks the light by power, `u1` the place and `u2` the direction. `None`
    /// without lights, and for a masked-out place (that try carries no flux).
    pub fn emit_photon(&self, u_pick: f32, u1: Vec2, u2: Vec2) -> Option<PhotonEmission> {
        let (index, rest) = self.emission.sample(u_pick)?;
        let chance = self.emission.probability(index);
        let Some(source) = self.sources.get(index) else {
            let (to_sky, weight) = self.sky.sample(rest, u2)?;
            let flux = weight * (PI * self.radius * self.radius / chance);
            return Some(PhotonEmission { ray: self.inward_ray(to_sky, u1), flux, from_sky: true });
        };
        let flux = self.power_of(source) / chance;
        let ray = match *source {
            Source::Triangle { v0, e1, e2, normal, ref cutout, .. } => {
                let b = sample_triangle(u1);
                if cutout.as_ref().is_some_and(|c| !c.exists(b)) {
                    return None;
                }
                self.leave(v0 + e1 * b.x + e2 * b.y, normal, u2)
            }
            Source::Sphere { ref faces, ref pick_face, .. } => {
                let [a, b, c] = faces[pick_face.sample(rest)?.0];
                let at = sample_triangle(u1);
                self.leave(
                    a + (b - a) * at.x + (c - a) * at.y,
                    (b - a).cross(c - a).normalize(),
                    u2,
                )
            }
            Source::DeltaSun { to_sun, .. } => self.inward_ray(to_sun, u1),
            Source::Sun { to_sun, one_minus_cos, .. } => self.inward_ray(
                Frame::from_normal(to_sun).world_from_local(sample_uniform_cone(u2, one_minus_cos)),
                u1,
            ),
            Source::Map(ref bright) => {
                let (to_light, pdf) = bright.part.sample(u2)?;
                let flux =
                    bright.part.texel(to_light) * (PI * self.radius * self.radius / (pdf * chance));
                return Some(PhotonEmission {
                    ray: self.inward_ray(to_light, u1),
                    flux,
                    from_sky: false,
                });
            }
            Source::Point { position, .. } => Ray::new(position, sample_uniform_sphere(u2)),
            Source::Spot { position, axis, intensity, cos_inner, cos_outer } => {
                let local = sample_uniform_cone(u2, 1.0 - cos_outer);
                let share = spot_falloff(local.z, cos_inner, cos_outer);
                let ray = Ray::new(position, Frame::from_normal(axis).world_from_local(local));
                return Some(PhotonEmission {
                    ray,
                    flux: intensity * (share * TAU * (1.0 - cos_outer) / chance),
                    from_sky: false,
                });
            }
        };
        Some(PhotonEmission { ray, flux, from_sky: false })
    }

    fn leave(&self, p: Vec3, normal: Vec3, u: Vec2) -> Ray {
        Ray::new(
            offset_origin(p, normal, self.diagonal),
            Frame::from_normal(normal).world_from_local(sample_cosine_hemisphere(u)),
        )
    }

    /// A ray that travels along −`to_light` from a disc that touches the bounding sphere on the
    /// light's side.
    fn inward_ray(&self, to_light: Vec3, u: Vec2) -> Ray {
        let frame = Frame::from_normal(to_light);
        let d = sample_disc(u) * self.radius;
        Ray::new(self.center + to_light * self.radius + frame.s * d.x + frame.t * d.y, -to_light)
    }

    /// Flux of one source, W per channel.
    pub(super) fn power_of(&self, source: &Source) -> Rgb {
        let disc = PI * self.radius * self.radius;
        match *source {
            Source::Triangle { area, radiance, .. } | Source::Sphere { area, radiance, .. } => {
                radiance * (PI * area)
            }
            Source::DeltaSun { irradiance, .. } => irradiance * disc,
            Source::Sun { radiance, one_minus_cos, .. } => radiance * (TAU * one_minus_cos * disc),
            Source::Map(ref bright) => bright.part.integral() * disc,
            Source::Point { intensity, .. } => intensity * (4.0 * PI),
            // ∫ smoothstep over its range of cosines is half the range.
            Source::Spot { intensity, cos_inner, cos_outer, .. } => {
                intensity * (TAU * ((1.0 - cos_inner) + 0.5 * (cos_inner - cos_outer)))
            }
        }
    }
}
