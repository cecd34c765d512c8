//! A point on a light as seen from a shading point, and the density of that choice. `wi` is unit
//! and points from the shading point to the light.

use glam::{Vec2, Vec3};

use super::pick::Picked;
use super::{LightSample, LightTable, Source, spot_falloff, sun_disc};
use crate::math::{Frame, Ray};
use crate::radiometry::Rgb;
use crate::sampling::{Discrete, pdf_uniform_cone, sample_triangle, sample_uniform_cone};

/// 1 − cos of the half angle under which a sphere appears, written without cancellation; 2 (all
/// directions) from inside.
fn sphere_one_minus_cos(center: Vec3, radius: f32, p: Vec3) -> f32 {
    let s2 = radius * radius / center.distance_squared(p);
    if s2 < 1.0 { s2 / (1.0 + (1.0 - s2).sqrt()) } else { 2.0 }
}

impl LightTable {
    /// A connection from `p` (already moved off its surface) with unit normal `n` to a point on a
    /// light; `u_pick` picks the light, `uv` the point. `None` when the choice contributes nothing:
    /// facing away, masked out, or no light can reach `p`.
    pub fn sample(&self, p: Vec3, n: Vec3, u_pick: f32, uv: Vec2) -> Option<LightSample> {
        let picked = self.groups.pick(&self.sources, p, n, u_pick)?;
        self.connect(picked, p, uv)
    }

    /// As [`LightTable::sample`], with the groups of [`LightTable::choices`] drawn from `choice`.
    /// Also tells which group it was.
    pub fn sample_by(
        &self,
        choice: &Discrete,
        p: Vec3,
        u_pick: f32,
        uv: Vec2,
    ) -> (usize, Option<LightSample>) {
        let Some((group, rest)) = choice.sample(u_pick) else { return (0, None) };
        let picked = self.fine.member(group, choice.probability(group), rest);
        (group, picked.and_then(|picked| self.connect(picked, p, uv)))
    }

    fn connect(&self, picked: Picked, p: Vec3, uv: Vec2) -> Option<LightSample> {
        let chance = picked.probability;
        let sample = match self.sources[picked.source as usize] {
            Source::Triangle { v0, e1, e2, normal, area, radiance, ref cutout } => {
                let b = sample_triangle(uv);
                let y = v0 + e1 * b.x + e2 * b.y;
                let to = y - p;
                let d2 = to.length_squared();
                let wi = to / d2.sqrt();
                let cos = -wi.dot(normal);
                if d2 <= 0.0 || cos <= 0.0 || cutout.as_ref().is_some_and(|c| !c.exists(b)) {
                    return None;
                }
                let pdf_solid_angle = chance * d2 / (cos * area);
                LightSample {
                    wi,
                    ray: Ray::segment(p, y),
                    weight: radiance / pdf_solid_angle,
                    pdf_solid_angle,
                    must_hit_light: None,
                }
            }
            Source::Sphere { light, center, radius, radiance, .. } => {
                let one_minus_cos = sphere_one_minus_cos(center, radius, p);
                let axis = (center - p).normalize_or(Vec3::Z);
                let wi = Frame::from_normal(axis)
                    .world_from_local(sample_uniform_cone(uv, one_minus_cos));
                let pdf_solid_angle = chance * pdf_uniform_cone(one_minus_cos);
                LightSample {
                    wi,
                    ray: Ray::new(p, wi),
                    weight: radiance / pdf_solid_angle,
                    pdf_solid_angle,
                    must_hit_light: Some(light),
                }
            }
            Source::Sun { to_sun, radiance, one_minus_cos } => {
                let wi = Frame::from_normal(to_sun)
                    .world_from_local(sample_uniform_cone(uv, one_minus_cos));
                let pdf_solid_angle = chance * pdf_uniform_cone(one_minus_cos);
                LightSample {
                    wi,
                    ray: Ray::new(p, wi),
                    weight: radiance / pdf_solid_angle,
                    pdf_solid_angle,
                    must_hit_light: None,
                }
            }
            Source::Map(ref bright) => {
                let (wi, pdf) = bright.part.sample(uv)?;
                let pdf_solid_angle = chance * pdf;
                LightSample {
                    wi,
                    ray: Ray::new(p, wi),
                    weight: bright.part.texel(wi) / pdf_solid_angle,
                    pdf_solid_angle,
                    must_hit_light: None,
                }
            }
            Source::DeltaSun { to_sun, irradiance } => {
                delta(to_sun, Ray::new(p, to_sun), irradiance / chance)
            }
            Source::Point { position, intensity } => {
                let to = position - p;
                delta(
                    to.try_normalize()?,
                    Ray::segment(p, position),
                    intensity / (to.length_squared() * chance),
                )
            }
            Source::Spot { position, axis, intensity, cos_inner, cos_outer } => {
                let to = position - p;
                let wi = to.try_normalize()?;
                let share = spot_falloff(-axis.dot(wi), cos_inner, cos_outer);
                if share <= 0.0 {
                    return None;
                }
                delta(
                    wi,
                    Ray::segment(p, position),
                    intensity * (share / (to.length_squared() * chance)),
                )
            }
        };
        (sample.weight.is_finite() && sample.pdf_solid_angle > 0.0).then_some(sample)
    }

    /// Density per steradian with which [`LightTable::sample`] at (`p`, `n`) gives the point `y` of
    /// the emissive triangle `triangle` (of the geometry) in the unit direction `wi`; 0 when that
    /// triangle is no light or is seen from behind.
    pub fn pdf_solid_angle(&self, p: Vec3, n: Vec3, wi: Vec3, triangle: u32, y: Vec3) -> f32 {
        let Some(&source) = self.source_of_triangle.get(triangle as usize) else { return 0.0 };
        if source == u32::MAX {
            return 0.0;
        }
        let on_light = match self.sources[source as usize] {
            Source::Triangle { normal, area, .. } => {
                let cos = -wi.dot(normal);
                if cos > 0.0 { y.distance_squared(p) / (cos * area) } else { 0.0 }
            }
            Source::Sphere { center, radius, .. } => {
                pdf_uniform_cone(sphere_one_minus_cos(center, radius, p))
            }
            _ => 0.0,
        };
        if on_light > 0.0 {
            on_light * self.groups.probability(&self.sources, p, n, source)
        } else {
            0.0
        }
    }

    /// Density per steradian with which [`LightTable::sample`] at (`p`, `n`) gives the direction
    /// `wi` through a sun disc or the bright part of a map; 0 outside all.
    pub fn pdf_sun_disc(&self, p: Vec3, n: Vec3, wi: Vec3) -> f32 {
        let of = |&i: &u32| match self.sources[i as usize] {
            ref s @ Source::Sun { one_minus_cos, .. } if sun_disc(s, wi) != Rgb::ZERO => {
                pdf_uniform_cone(one_minus_cos) * self.groups.probability(&self.sources, p, n, i)
            }
            Source::Map(ref bright) if sun_disc(&self.sources[i as usize], wi) != Rgb::ZERO => {
                bright.part.pdf_solid_angle(wi) * self.groups.probability(&self.sources, p, n, i)
            }
            _ => 0.0,
        };
        self.groups.suns.iter().map(of).sum()
    }
}

fn delta(wi: Vec3, ray: Ray, weight: Rgb) -> LightSample {
    LightSample { wi, ray, weight, pdf_solid_angle: f32::INFINITY, must_hit_light: None }
}
