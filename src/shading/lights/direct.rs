//! Irradiance from lights, by shadow rays.

use glam::{Vec2, Vec3};

use super::LightSample;
use crate::math::offset_origin;
use crate::radiometry::Rgb;
use crate::sampling::Discrete;
use crate::shading::World;

/// True when the light of `sample` is seen along its ray.
pub fn light_visible(world: &World, sample: &LightSample) -> bool {
    match sample.must_hit_light {
        None => !world.rays.occluded(&sample.ray),
        Some(light) => world.rays.closest(&sample.ray).is_some_and(|hit| {
            let t = hit.triangle as usize;
            world.geometry.light_of[t] == light
                && world.geometry.face_normals[t].dot(sample.wi) < 0.0
        }),
    }
}

/// Irradiance at the surface point `p` with facing geometric normal `ng` and normal `n` (both unit)
/// from sun, lamps and emitters (not the sky) by up to `count` shadow rays; also returns how many
/// were shot.
///
/// `sample(i)` gives (pick, uv) of ray i, uniform; the pick is stratified here: ray i takes the
/// i-th of `count` equal parts. `p` is moved off the surface along `ng` here. A single light
/// without extent takes one ray whatever `count`. W·m⁻²; 0 for `count` = 0. With `choice` the
/// groups of [`super::LightTable::choices`] are drawn from it; every group that reaches the point
/// must have a weight.
pub fn direct_irradiance(
    world: &World,
    [p, ng, n]: [Vec3; 3],
    choice: Option<&Discrete>,
    count: u32,
    sample: &mut dyn FnMut(u32) -> (f32, Vec2),
) -> (Rgb, u64) {
    if world.lights.is_empty() || count == 0 {
        return (Rgb::ZERO, 0);
    }
    let count = if world.lights.is_one_delta() { 1 } else { count };
    let origin = offset_origin(p, ng, world.diagonal);
    let (mut sum, mut rays) = (Rgb::ZERO, 0);
    for i in 0..count {
        let (pick, uv) = sample(i);
        let pick = ((i as f32 + pick) / count as f32).min(0.999_999_9);
        let found = match choice {
            None => shadow_ray(world, [p, ng, n], pick, uv, |_| 1.0),
            Some(choice) => {
                let light = world.lights.sample_by(choice, origin, pick, uv).1;
                light.and_then(|light| seen_irradiance(world, &light, ng, n))
            }
        };
        rays += u64::from(found.is_some());
        sum += found.unwrap_or_default();
    }
    (sum / count as f32, rays)
}

/// Irradiance at a surface point (as in [`direct_irradiance`]: position and two normals) by one
/// shadow ray, with the `share` that its sample has among other ways to find that light. None where
/// no ray was shot.
pub fn shadow_ray(
    world: &World,
    [p, ng, n]: [Vec3; 3],
    pick: f32,
    uv: Vec2,
    share: impl Fn(&LightSample) -> f32,
) -> Option<Rgb> {
    let origin = offset_origin(p, ng, world.diagonal);
    let light = world.lights.sample(origin, n, pick, uv)?;
    seen_irradiance(world, &light, ng, n).map(|e| e * share(&light))
}

/// Irradiance by one connection, where it is seen; none where no ray was shot.
pub fn seen_irradiance(world: &World, light: &LightSample, ng: Vec3, n: Vec3) -> Option<Rgb> {
    let cos = n.dot(light.wi);
    if cos <= 0.0 || ng.dot(light.wi) <= 0.0 {
        return None;
    }
    Some(if light_visible(world, light) { light.weight * cos } else { Rgb::ZERO })
}
