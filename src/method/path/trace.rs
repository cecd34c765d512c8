//! One camera sample: a path and what it brings back.

use std::f32::consts::PI;

use glam::Vec3;

use super::PathSettings;
use super::pixels::{Pixel, Sample};
use crate::math::{Frame, Ray, offset_origin};
use crate::radiometry::Rgb;
use crate::sampling::{
    PixelFilter, Rng, Sobol, Stream, pdf_cosine_hemisphere, sample_cosine_hemisphere,
};
use crate::shading::{World, light_visible};

/// Bounces with Sobol points of their own; later ones draw independent numbers.
const SOBOL_BOUNCES: u32 = 6;

/// Rays shot by one task.
#[derive(Default)]
pub(super) struct Rays {
    pub(super) primary: u64,
    pub(super) shadow: u64,
    pub(super) sample: u64,
}

/// What all samples share.
pub(super) struct View<'a> {
    world: &'a World,
    seed: u64,
    max_depth: u32,
    roulette_from: u32,
    filter: PixelFilter,
    /// Ray direction of pixel position (x, y): corner + x · right + y · down.
    corner: Vec3,
    right: Vec3,
    down: Vec3,
    forward: Vec3,
}

/// Power heuristic, safe for infinite densities.
fn power_heuristic(a: f32, b: f32) -> f32 {
    if a.is_infinite() {
        return 1.0;
    }
    if b > a {
        let r = a / b;
        r * r / (1.0 + r * r)
    } else if a > 0.0 {
        let r = b / a;
        1.0 / (1.0 + r * r)
    } else {
        0.0
    }
}

impl<'a> View<'a> {
    pub(super) fn new(world: &'a World, settings: &PathSettings, seed: u64) -> Self {
        let camera = &world.camera;
        let (right, up, forward) = camera.axes();
        let scale = camera.pixel_angle();
        let corner = forward - right * (0.5 * camera.width as f32 * scale)
            + up * (0.5 * camera.height as f32 * scale);
        let max_depth = if settings.max_depth == 0 { u32::MAX } else { settings.max_depth };
        Self {
            world,
            seed,
            max_depth,
            roulette_from: settings.roulette_from,
            filter: settings.filter,
            corner,
            right: right * scale,
            down: -up * scale,
            forward,
        }
    }

    /// Adds the pixel's next sample.
    pub(super) fn sample(&self, index: u32, pixel: &mut Pixel, rays: &mut Rays) {
        let half = pixel.count & 1;
        let element = u64::from(index) * 2 + u64::from(half);
        let sobol = Sobol::new(self.seed, Stream::Camera, element);
        let number = pixel.count >> 1;
        let at = self.filter.position(sobol.sample_2d(number, 0));
        let (x, y) = (index % self.world.camera.width, index / self.world.camera.width);
        let dir = (self.corner + self.right * (x as f32 + at.x) + self.down * (y as f32 + at.y))
            .normalize();
        let rng = Rng::new(self.seed, Stream::Camera, element, u64::from(number));
        pixel.add(
            half,
            &self.trace(Ray::new(self.world.camera.eye, dir), &sobol, number, rng, rays),
        );
    }

    fn trace(
        &self,
        mut ray: Ray,
        sobol: &Sobol,
        number: u32,
        mut rng: Rng,
        rays: &mut Rays,
    ) -> Sample {
        let world = self.world;
        let mut out = Sample::default();
        let mut beta = Rgb::ONE;
        // Where the ray left, with which density: for weighing the light it meets against
        // next-event estimation.
        let (mut from, mut normal, mut pdf) = (Vec3::ZERO, Vec3::ZERO, 0.0f32);
        rays.primary += 1;
        for depth in 0.. {
            let Some(hit) = world.rays.closest(&ray) else {
                if depth == 0 {
                    out.emission = world.lights.background(ray.dir);
                } else {
                    out.indirect += beta * world.lights.sky.radiance(ray.dir);
                    let sun = world.lights.sun_disc(ray.dir);
                    if sun != Rgb::ZERO {
                        let weight =
                            power_heuristic(pdf, world.lights.pdf_sun_disc(from, normal, ray.dir));
                        *out.of(depth) += beta * sun * weight;
                    }
                }
                break;
            };
            let s = crate::shading::Surface::new(&world.geometry, &hit, -ray.dir);
            if depth == 0 {
                out.emission = s.le;
                (out.albedo, out.normal, out.position) = (s.albedo, s.ns, s.p);
                out.depth = (s.p - world.camera.eye).dot(self.forward);
                out.hit = true;
            } else if s.le != Rgb::ZERO {
                let weight = power_heuristic(
                    pdf,
                    world.lights.pdf_solid_angle(from, normal, ray.dir, s.triangle, s.p),
                );
                *out.of(depth) += beta * s.le * weight;
            }
            if depth >= self.max_depth || s.albedo == Rgb::ZERO {
                break;
            }
            let (u_light, u_dir, u_pick, u_end) = if depth < SOBOL_BOUNCES {
                let more = sobol.sample_2d(number, 3 * depth + 3);
                (
                    sobol.sample_2d(number, 3 * depth + 1),
                    sobol.sample_2d(number, 3 * depth + 2),
                    more.x,
                    more.y,
                )
            } else {
                (rng.next_2d(), rng.next_2d(), rng.next_f32(), rng.next_f32())
            };
            beta *= s.albedo;
            from = offset_origin(s.p, s.ng, world.diagonal);
            normal = s.ns;
            if let Some(light) = world.lights.sample(from, normal, u_pick, u_light) {
                let cos = normal.dot(light.wi);
                if cos > 0.0 && s.ng.dot(light.wi) > 0.0 {
                    rays.shadow += 1;
                    if light_visible(world, &light) {
                        let weight =
                            power_heuristic(light.pdf_solid_angle, pdf_cosine_hemisphere(cos));
                        *out.of(depth + 1) += beta * light.weight * (cos / PI * weight);
                    }
                }
            }
            if depth + 1 >= self.roulette_from {
                let survive = beta.max_element().min(1.0);
                if u_end >= survive {
                    break;
                }
                beta /= survive;
            }
            let wi = Frame::from_normal(normal).world_from_local(sample_cosine_hemisphere(u_dir));
            let cos = normal.dot(wi);
            if cos <= 0.0 || s.ng.dot(wi) <= 0.0 {
                break;
            }
            pdf = pdf_cosine_hemisphere(cos);
            ray = Ray::new(from, wi);
            rays.sample += 1;
        }
        out
    }
}

impl Sample {
    /// Where light met at surface point number `depth` of the path belongs: met at 1 it is direct,
    /// later indirect.
    fn of(&mut self, depth: u32) -> &mut Rgb {
        if depth == 1 { &mut self.direct } else { &mut self.indirect }
    }
}

#[cfg(test)]
mod tests {
    use super::power_heuristic;

    #[test]
    fn heuristic_sums_to_one_without_overflow() {
        for (a, b) in [(1.0f32, 3.0f32), (1e30, 1e30), (1e-30, 1e-30), (1e38, 1e-38), (0.0, 2.0)] {
            assert!((power_heuristic(a, b) + power_heuristic(b, a) - 1.0).abs() < 1e-6, "{a} {b}");
        }
        assert_eq!(power_heuristic(f32::INFINITY, 1.0), 1.0);
        assert_eq!(power_heuristic(0.0, 0.0), 0.0);
    }
}
