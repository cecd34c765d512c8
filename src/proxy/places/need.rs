//! Where views ask for light: what lattices of their pixels see, and what lies around there.

use glam::Vec2;
use rayon::prelude::*;

use super::cover::Point;
use crate::math::Ray;
use crate::proxy::Landing;
use crate::run::{RayKind, Run};
use crate::sampling::{Sobol, Stream};
use crate::scene::Camera;
use crate::shading::World;

/// Pixels that are looked through, about, whatever the size of the picture; of small pictures as
/// many as they have.
const PIXELS: f32 = 16_384.0;
/// Cosine rays from what each of them sees.
const RAYS: u32 = 16;

/// Landings around what `views` see; many views share √views times the pixels of one.
pub(super) fn landings(world: &World, views: &[Camera], seed: u64, run: &Run) -> Vec<Landing> {
    let pixels = PIXELS / (views.len() as f32).sqrt();
    let look = |(i, view)| self::look(world, view, pixels, (i, seed), run);
    (0..).zip(views).flat_map(look).collect()
}

fn look(
    world: &World,
    camera: &Camera,
    pixels: f32,
    (number, seed): (u64, u64),
    run: &Run,
) -> Vec<Landing> {
    let (width, height) = (camera.width as f32, camera.height as f32);
    let pixels = pixels.min(width * height);
    let columns = (pixels * width / height).sqrt().ceil().max(1.0) as u32;
    let rows = (pixels * height / width).sqrt().ceil().max(1.0) as u32;
    let land = |ray: Ray, out: &mut Vec<Landing>| {
        let hit = world.rays.closest(&ray)?;
        let landing = Landing::new(world, &ray, &hit);
        if world.geometry.albedo(hit.triangle, hit.u, hit.v).max_element() > 0.0 {
            out.push(landing);
        }
        Some(landing)
    };
    let row = |j: u32| {
        let (mut out, mut rays) = (Vec::new(), 0);
        for i in 0..columns {
            let sobol =
                Sobol::new(seed, Stream::Link, number << 41 | 1 << 40 | u64::from(j * columns + i));
            let at = (Vec2::new(i as f32, j as f32) + sobol.sample_2d(0, 1))
                / Vec2::new(columns as f32, rows as f32);
            let pixel = at * Vec2::new(width, height);
            rays += 1;
            let seen = land(Ray::new(camera.eye, camera.direction(pixel)), &mut out);
            let Some(seen) = seen else { continue };
            let point = Point::new(world, &seen);
            let wi = (0..RAYS).map(|r| point.cosine_direction(sobol.sample_2d(r, 0)));
            for ray in wi.filter_map(|wi| point.ray(world, wi)) {
                rays += 1;
                land(ray, &mut out);
            }
        }
        run.rays.add(RayKind::Sample, rays);
        out
    };
    let rows: Vec<Vec<Landing>> = run.install(|| (0..rows).into_par_iter().map(row).collect());
    rows.into_iter().flatten().collect()
}
