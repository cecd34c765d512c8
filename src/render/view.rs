//! Whether the camera stands where it can see anything.

use glam::{Vec2, Vec3};

use crate::math::Ray;
use crate::radiometry::Rgb;
use crate::shading::{Surface, World, shadow_ray};
use crate::tessellate::Side;

/// What to tell when [`camera_inside_wall`].
pub const CAMERA_INSIDE_WALL: &str =
    "the camera is inside a wall: nearly all it sees are backs of closed parts; move camera.eye";

/// True when the camera stands inside a solid: nine of ten rays around it first meet backs, none
/// goes out, and no lamp lights what they meet, as one would in a room whose walls are wound
/// outwards. Costs 64 rays, and as many to lamps where most of them meet backs.
pub fn camera_inside_wall(world: &World) -> bool {
    const RAYS: usize = 64;
    let seen = (0..RAYS).map(|i| {
        // Fibonacci directions.
        let z = 1.0 - (2.0 * i as f32 + 1.0) / RAYS as f32;
        let (s, c) = (2.399_963_2 * i as f32).sin_cos();
        let r = (1.0 - z * z).sqrt();
        world.closest(&Ray::new(world.camera.eye, Vec3::new(r * c, r * s, z)))
    });
    let Some(seen) = seen.collect::<Option<Vec<Surface>>>() else { return false };
    let backs: Vec<&Surface> = seen.iter().filter(|s| s.side == Side::Back).collect();
    if backs.len() * 10 < RAYS * 9 {
        return false;
    }
    let lit = |(i, s): (usize, &&Surface)| {
        let pick = (i as f32 + 0.5) / RAYS as f32;
        let uv = Vec2::new(pick, radical_inverse(i as u32));
        shadow_ray(world, [s.p, s.ng, s.ns], pick, uv, |_| 1.0).is_some_and(|e| e != Rgb::ZERO)
    };
    !backs.iter().enumerate().any(lit)
}

/// Van der Corput's sequence in base 2.
fn radical_inverse(i: u32) -> f32 {
    i.reverse_bits() as f32 / 4_294_967_296.0
}
