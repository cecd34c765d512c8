//! Rays as a render would shoot them, recorded so that every backend can be given the same ones.
//!
//! * camera (closest hit): pixels in rows, one sample each, as often as needed;
//! * shadow (any hit): from what the camera sees to a point on a light, or in a cosine direction
//!   where no light can be sampled;
//! * photon (closest hit): from lights (or random points of the scene without any), up to four
//!   diffuse bounces: incoherent;
//! * gather (closest hit): 16 cosine directions at each of the points that the camera sees.
//!
//! Guarantee: a stream depends on scene, seed and count only.

use glam::{Vec2, Vec3};

use crate::math::{Frame, Hit, Ray};
use crate::sampling::{Rng, Stream as Key, sample_cosine_hemisphere, sample_uniform_sphere};
use crate::shading::{Surface, World};

/// Gather rays at one point.
const GATHER: usize = 16;
/// Longest photon path.
const BOUNCES: usize = 4;

/// Recorded rays of one kind.
#[derive(Clone, Debug)]
pub struct Stream {
    /// What the rays are for.
    pub name: &'static str,
    /// Any hit is asked for, not the closest.
    pub any: bool,
    /// The rays.
    pub rays: Vec<Ray>,
}

/// Records `count` rays of each kind; kinds for which the scene gives no rays are left out.
pub fn record(world: &World, count: usize, seed: u64) -> Vec<Stream> {
    let camera = camera_rays(world, count, seed);
    let mut hits: Vec<Option<Hit>> = vec![None; camera.len()];
    world.rays.closest_batch(&camera, &mut hits, 1);
    let surface =
        |(ray, hit): (&Ray, &Option<Hit>)| hit.map(|h| Surface::new(&world.geometry, &h, -ray.dir));
    let seen: Vec<Surface> = camera.iter().zip(&hits).filter_map(surface).collect();
    let streams = [
        Stream { name: "camera", any: false, rays: camera },
        Stream { name: "shadow", any: true, rays: shadow_rays(world, &seen, count, seed) },
        Stream { name: "photon", any: false, rays: photon_rays(world, count, seed) },
        Stream { name: "gather", any: false, rays: gather_rays(world, &seen, count, seed) },
    ];
    streams.into_iter().filter(|s| !s.rays.is_empty()).collect()
}

fn camera_rays(world: &World, count: usize, seed: u64) -> Vec<Ray> {
    let camera = &world.camera;
    let pixels = (camera.width as usize * camera.height as usize).max(1);
    let mut rays = Vec::with_capacity(count);
    for i in 0..count {
        // Whole rows spread over the picture when there are fewer rays than pixels.
        let pixel = if count >= pixels {
            i % pixels
        } else {
            (i / 64 * (pixels * 64 / count) + i % 64) % pixels
        };
        let mut rng = Rng::new(seed, Key::Test, pixel as u64, (i / pixels) as u64);
        let corner = Vec2::new(
            (pixel % camera.width as usize) as f32,
            (pixel / camera.width as usize) as f32,
        );
        rays.push(Ray::new(camera.eye, camera.direction(corner + rng.next_2d())));
    }
    rays
}

fn cosine_ray(world: &World, surface: &Surface, rng: &mut Rng) -> Ray {
    surface.ray(
        Frame::from_normal(surface.ng).world_from_local(sample_cosine_hemisphere(rng.next_2d())),
        world.diagonal,
    )
}

fn shadow_rays(world: &World, seen: &[Surface], count: usize, seed: u64) -> Vec<Ray> {
    let take = if seen.is_empty() { 0 } else { count };
    (0..take)
        .map(|i| {
            let surface = &seen[i % seen.len()];
            let mut rng = Rng::new(seed, Key::BenchShadow, i as u64, 0);
            let origin = surface.ray(surface.ng, world.diagonal).origin;
            let light = world.lights.sample(origin, surface.ns, rng.next_f32(), rng.next_2d());
            light.map_or_else(|| cosine_ray(world, surface, &mut rng), |l| l.ray)
        })
        .collect()
}

fn photon_rays(world: &World, count: usize, seed: u64) -> Vec<Ray> {
    let mut rays = Vec::with_capacity(count);
    if world.geometry.is_empty() {
        return rays;
    }
    for photon in 0.. {
        let mut rng = Rng::new(seed, Key::BenchPhoton, photon, 0);
        let emitted = world.lights.emit_photon(rng.next_f32(), rng.next_2d(), rng.next_2d());
        let mut ray = emitted.map_or_else(
            || {
                let bounds = world.rays.bounds();
                let place = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
                Ray::new(
                    bounds.min + (bounds.max - bounds.min) * place,
                    sample_uniform_sphere(rng.next_2d()),
                )
            },
            |e| e.ray,
        );
        for _ in 0..BOUNCES {
            if rays.len() == count {
                return rays;
            }
            rays.push(ray);
            let Some(surface) = world.closest(&ray) else { break };
            ray = cosine_ray(world, &surface, &mut rng);
        }
    }
    rays
}

fn gather_rays(world: &World, seen: &[Surface], count: usize, seed: u64) -> Vec<Ray> {
    let take = if seen.is_empty() { 0 } else { count };
    let stride = (seen.len() * GATHER / count.max(1)).max(1);
    (0..take)
        .map(|i| {
            let mut rng = Rng::new(seed, Key::BenchGather, i as u64, 0);
            cosine_ray(world, &seen[(i / GATHER * stride) % seen.len()], &mut rng)
        })
        .collect()
}
