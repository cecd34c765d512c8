//! The light of a place: shadow rays and gather rays from its points.
//!
//! ```text
//! E_direct = mean over its points of direct irradiance, one shadow ray each
//! E_indirect = mean over cosine rays of the radiosity where they land, π L of the sky elsewhere
//! ```
//! What the rays of the last generation meet is lit by a short path each.

use glam::Vec3;

use super::patch::{LIFT, Patch, Point, sees};
use super::{GENERATIONS, Key, Known, Light, Places};
use crate::math::{Frame, Ray, offset_origin};
use crate::proxy::Landing;
use crate::radiometry::Rgb;
use crate::sampling::{Sobol, Stream, sample_cosine_hemisphere};
use crate::shading::{World, direct_irradiance};

/// Steps that no path exceeds: white walls would hold it for ever.
const LONGEST_WALK: u32 = 256;

/// Rays shot for a place.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rays {
    pub shadow: u64,
    pub gather: u64,
    pub short: u64,
}

impl Places {
    /// Finds what is to be known of a key.
    pub(super) fn find(&self, world: &World, key: Key) -> (Known, Rays) {
        let Patch { mut points, divided, heights, rays } = self.patch(world, &key);
        let mut shot = Rays { short: rays, ..Rays::default() };
        if key.point == 0 && (divided || points.is_empty()) {
            return (Known::Divided(points.into()), shot);
        }
        if key.point > 0 {
            let Some(&from) = points.get(usize::from(key.point) - 1) else {
                return (Known::Divided(points.into()), shot);
            };
            let lift = LIFT * self.smallest();
            shot.short += points.len() as u64;
            points
                .retain(|to| to.p == from.p || sees(world, (from.p, from.ng), (to.p, to.ng), lift));
        }
        let sobol = Sobol::new(self.seed, Stream::Place, key.hash());
        let generation = u32::from(key.generation);
        let direct = self.direct(world, &points, generation, &sobol, &mut shot);
        let indirect = self.gather(world, &points, key, &sobol, &mut shot);
        (Known::Lit(Light { direct, indirect }, heights), shot)
    }

    fn direct(
        &self,
        world: &World,
        points: &[Point],
        generation: u32,
        sobol: &Sobol,
        shot: &mut Rays,
    ) -> Rgb {
        let count = (self.direct_samples >> generation).max(4).min(self.direct_samples);
        let mut sum = Rgb::ZERO;
        for i in 0..count {
            let at = points[i as usize % points.len()];
            // The lamp is picked by the place's own sequence: stratified over all of its rays.
            let mut sample = |_: u32| (sobol.sample_1d(i, 1), sobol.sample_2d(i, 2));
            let (e, rays) = direct_irradiance(world, at.p, at.ng, at.ns, 1, &mut sample);
            sum += e;
            shot.shadow += rays;
        }
        sum / count as f32
    }

    fn gather(
        &self,
        world: &World,
        points: &[Point],
        key: Key,
        sobol: &Sobol,
        shot: &mut Rays,
    ) -> Rgb {
        let generation = u32::from(key.generation);
        let last = generation + 1 == GENERATIONS;
        let count = (self.gather_rays >> generation).max(4).min(self.gather_rays);
        let (mut from_sky, mut from_surfaces) = (Rgb::ZERO, Rgb::ZERO);
        for i in 0..count {
            let at = points[i as usize % points.len()];
            let wi = Frame::from_normal(at.ns)
                .world_from_local(sample_cosine_hemisphere(sobol.sample_2d(i, 3)));
            if wi.dot(at.ng) <= 0.0 {
                continue;
            }
            shot.gather += 1;
            let ray = Ray::new(offset_origin(at.p, at.ng, world.diagonal), wi);
            let Some(hit) = world.rays.closest(&ray) else {
                from_sky += world.lights.sky.radiance(wi) * std::f32::consts::PI;
                continue;
            };
            let landing = Landing::new(world, &ray, &hit);
            let reflected = world.geometry.albedo(hit.triangle, hit.u, hit.v);
            if reflected == Vec3::ZERO {
                continue;
            }
            let light = if last {
                let element = key.hash() ^ (u64::from(i) + 1);
                self.walk(world, landing, &Sobol::new(self.seed, Stream::PlaceWalk, element), shot)
            } else {
                let (light, _) = self.irradiance(world, &landing, generation + 1);
                light.direct + light.indirect
            };
            from_surfaces += reflected * light;
        }
        let rays = count as f32;
        (from_sky + from_surfaces) / rays
    }

    /// Irradiance at one landing by a path with one shadow ray at each of its points, which Russian
    /// roulette by the albedo ends. Every step has dimensions of its own: steps that shared a
    /// stratified sequence would not be independent.
    fn walk(&self, world: &World, landing: Landing, walk: &Sobol, shot: &mut Rays) -> Rgb {
        let (mut sum, mut beta, mut landing) = (Rgb::ZERO, Rgb::ONE, landing);
        for step in 0..LONGEST_WALK {
            let s = world.geometry.surface(landing.triangle, landing.u, landing.v);
            let sign = landing.side.sign();
            let (ng, ns) = (s.ng * sign, s.ns * sign);
            if step > 0 {
                let survival = s.albedo.max_element().min(1.0);
                if walk.sample_1d(0, 4 * step + 3) >= survival {
                    break;
                }
                beta *= s.albedo / survival;
            }
            let mut sample =
                |_: u32| (walk.sample_1d(0, 4 * step), walk.sample_2d(0, 4 * step + 1));
            let (direct, rays) = direct_irradiance(world, s.p, ng, ns, 1, &mut sample);
            shot.shadow += rays;
            sum += beta * direct;
            let wi = Frame::from_normal(ns)
                .world_from_local(sample_cosine_hemisphere(walk.sample_2d(0, 4 * step + 2)));
            if wi.dot(ng) <= 0.0 {
                break;
            }
            shot.gather += 1;
            let ray = Ray::new(offset_origin(s.p, ng, world.diagonal), wi);
            let Some(hit) = world.rays.closest(&ray) else {
                sum += beta * world.lights.sky.radiance(wi) * std::f32::consts::PI;
                break;
            };
            landing = Landing::new(world, &ray, &hit);
        }
        sum
    }
}
