//! The light of parts: shadow rays and gather rays from their points.
//!
//! ```text
//! E_direct = mean over the points of direct irradiance, one shadow ray each
//! E_indirect = mean over cosine rays of B where they land, π L of the sky elsewhere
//! ```
//! What a ray lands on becomes a link to another part, or a landing that no part holds yet.
//! Emitters are found by both kinds of rays, each weighted by its density over that of both
//! `[Veach97]` §9.2: a point close to an emitter would have its light from few shadow rays of great
//! weight.

use glam::{Vec2, Vec3};

use super::bright::Bright;
use super::cover::{NewPart, Point};
use super::noise::Moments;
use super::{Light, Places};
use crate::proxy::Landing;
use crate::radiometry::{Rgb, luminance};
use crate::sampling::{Sobol, Stream, hash64};
use crate::shading::{LightSample, World, shadow_ray};

/// Steps that no path exceeds: white walls would hold it for ever.
const LONGEST_WALK: u32 = 256;
/// Fewest shadow rays of a part, where so many are allowed.
const FEWEST_SHADOW_RAYS: u32 = 4;

/// Rays that were shot.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rays {
    pub shadow: u64,
    pub gather: u64,
}

impl std::ops::AddAssign for Rays {
    fn add_assign(&mut self, other: Self) {
        self.shadow += other.shadow;
        self.gather += other.gather;
    }
}

/// Light that comes by way of another part: `weight` times all of its irradiance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    pub to: u32,
    pub weight: Rgb,
}

/// What the gather rays of one part found.
#[derive(Debug, Default)]
pub(super) struct Gathered {
    /// How many, those below the horizon too.
    pub count: u32,
    /// Sum of the direct irradiance of the emitters that they met.
    pub emitted: Rgb,
    /// Sum of the irradiance that the sky sent along them.
    pub sky: Rgb,
    /// Sum of its squared luminance.
    pub sky_squared: f32,
    pub links: Vec<Link>,
    /// Landings without a part, and the weight of their irradiance.
    pub open: Vec<(Landing, Rgb)>,
    pub rays: u64,
}

/// Where a cosine ray ended.
enum Met {
    /// Irradiance that it stands for.
    Sky(Rgb),
    /// A surface, its albedo, and the direct irradiance that it sends.
    Surface(Landing, Rgb, Rgb),
    /// Below the horizon.
    Nothing,
}

/// Density of cosine rays per steradian, by the cosine.
fn pdf_cosine(cos: f32) -> f32 {
    cos.max(0.0) * std::f32::consts::FRAC_1_PI
}

/// Direct irradiance at a point by one shadow ray, and how many were shot.
pub(super) fn shadow(world: &World, at: &Point, pick: f32, uv: Vec2) -> (Rgb, u64) {
    if world.lights.is_empty() {
        return (Rgb::ZERO, 0);
    }
    let share = |light: &LightSample| match light.is_on_surface() {
        true => {
            let pdf = light.pdf_solid_angle;
            pdf / (pdf + pdf_cosine(at.ns.dot(light.wi)))
        }
        false => 1.0,
    };
    let e = shadow_ray(world, [at.p, at.ng, at.ns], pick, uv, share);
    (e.unwrap_or_default(), u64::from(e.is_some()))
}

fn shoot(world: &World, at: &Point, wi: Vec3, rays: &mut u64) -> Met {
    let Some(ray) = at.ray(world, wi) else { return Met::Nothing };
    *rays += 1;
    let Some(hit) = world.rays.closest(&ray) else {
        return Met::Sky(world.lights.sky.radiance(wi) * std::f32::consts::PI);
    };
    let albedo = world.geometry.albedo(hit.triangle, hit.u, hit.v);
    let pdf_light =
        world.lights.pdf_solid_angle(ray.origin, at.ns, wi, hit.triangle, ray.at(hit.t));
    let emitted = match pdf_light > 0.0 {
        true => {
            let pdf = pdf_cosine(at.ns.dot(wi));
            let radiance = world.geometry.material(hit.triangle).emission;
            radiance * (std::f32::consts::PI * pdf / (pdf + pdf_light))
        }
        false => Rgb::ZERO,
    };
    Met::Surface(Landing::new(world, &ray, &hit), albedo, emitted)
}

impl Places {
    /// Direct light of a part, but for what gather rays find of it, by a shadow ray for each of its
    /// landings, within limits; its samples; and how many rays were shot.
    pub(super) fn direct(&self, world: &World, part: &NewPart, most: u32) -> (Rgb, Moments, u64) {
        let sobol = Sobol::new(self.seed, Stream::Place, part.element);
        let count = part.landings.clamp(FEWEST_SHADOW_RAYS.min(most), most);
        let (mut sum, mut samples, mut rays) = (Rgb::ZERO, Moments::default(), 0);
        for i in 0..count {
            let at = part.points[i as usize % part.points.len()];
            // The lamp is picked by the part's own sequence: stratified over all of its rays.
            let (e, shot) = shadow(world, &at, sobol.sample_1d(i, 1), sobol.sample_2d(i, 2));
            sum += e;
            samples.add(luminance(e));
            rays += shot;
        }
        (sum / count as f32, samples, rays)
    }

    /// Shoots gather rays of a part, of its sequence those in `which`.
    pub(super) fn gather(
        &self,
        world: &World,
        bright: &Bright,
        part: &NewPart,
        which: std::ops::Range<u32>,
    ) -> Gathered {
        let sobol = Sobol::new(self.seed, Stream::Place, part.element);
        let mut found = Gathered { count: which.len() as u32, ..Gathered::default() };
        let count = which.len() as u32;
        let aimed = bright.aim(&part.points[0]).rays(count, sobol.sample_1d(which.start, 4));
        let share = aimed as f32 / count.max(1) as f32;
        let mut due = 0;
        for i in which {
            let at = part.points[i as usize % part.points.len()];
            due += aimed;
            let is_aimed = due >= count;
            due -= if is_aimed { count } else { 0 };
            let sample = bright.aim(&at).sample(is_aimed, share, sobol.sample_2d(i, 3));
            let Some((wi, weight)) = sample else { continue };
            match shoot(world, &at, wi, &mut found.rays) {
                Met::Nothing => {}
                Met::Sky(e) => {
                    let e = weight * e;
                    found.sky += e;
                    found.sky_squared += luminance(e) * luminance(e);
                }
                Met::Surface(landing, albedo, emitted) => {
                    found.emitted += weight * emitted;
                    if albedo == Vec3::ZERO {
                        continue;
                    }
                    let albedo = weight * albedo;
                    match self.find(world, &landing) {
                        Some(to) => found.links.push(Link { to, weight: albedo }),
                        None => found.open.push((landing, albedo)),
                    }
                }
            }
        }
        found
    }

    /// Direct light at a landing by a shadow ray, but for what gather rays find of it.
    pub(super) fn direct_at(&self, world: &World, landing: &Landing) -> (Rgb, u64) {
        let walk = self.walk_of(landing);
        shadow(world, &Point::new(world, landing), walk.sample_1d(0, 0), walk.sample_2d(0, 1))
    }

    /// Random numbers of a landing.
    fn walk_of(&self, landing: &Landing) -> Sobol {
        let bits = u64::from(landing.u.to_bits()) << 32 | u64::from(landing.v.to_bits());
        let element = hash64(bits) ^ u64::from(landing.triangle) << 1 ^ landing.side as u64;
        Sobol::new(self.seed, Stream::PlaceWalk, element)
    }

    /// Light of a landing without a part, by a path with one shadow ray at each of its points:
    /// what is known of it, and the part where the path ends. Russian roulette by the albedo ends
    /// others. Every step has dimensions of its own: steps that shared a stratified sequence would
    /// not be independent.
    pub(super) fn walk(&self, world: &World, landing: &Landing, rays: &mut Rays) -> (Light, Link) {
        let walk = self.walk_of(landing);
        let (mut light, mut at, mut beta) = (Light::default(), *landing, Rgb::ONE);
        for step in 0..LONGEST_WALK {
            let point = Point::new(world, &at);
            let (pick, uv) = (walk.sample_1d(0, 4 * step), walk.sample_2d(0, 4 * step + 1));
            let (direct, shot) = shadow(world, &point, pick, uv);
            rays.shadow += shot;
            let mut add = |e: Rgb| {
                *(if step == 0 { &mut light.direct } else { &mut light.indirect }) += beta * e;
            };
            add(direct);
            let wi = point.cosine_direction(walk.sample_2d(0, 4 * step + 2));
            match shoot(world, &point, wi, &mut rays.gather) {
                Met::Nothing => break,
                Met::Sky(e) => {
                    light.indirect += beta * e;
                    break;
                }
                Met::Surface(next, albedo, emitted) => {
                    add(emitted);
                    if albedo == Vec3::ZERO {
                        break;
                    }
                    beta *= albedo;
                    if let Some(to) = self.find(world, &next) {
                        return (light, Link { to, weight: beta });
                    }
                    let survival = albedo.max_element().min(1.0);
                    if walk.sample_1d(0, 4 * step + 3) >= survival {
                        break;
                    }
                    beta /= survival;
                    at = next;
                }
            }
        }
        (light, Link { to: 0, weight: Rgb::ZERO })
    }
}
