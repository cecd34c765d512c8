//! Whether the camera stands where it can see anything.

use glam::Vec3;

use crate::math::Ray;
use crate::shading::World;
use crate::tessellate::analyze_topology;

/// What to tell when [`camera_inside_wall`].
pub const CAMERA_INSIDE_WALL: &str =
    "the camera is inside a wall: nearly all it sees are backs of closed parts; move camera.eye";

/// True when the camera stands inside a closed solid: nine of ten rays around it first meet the
/// back of one. Costs 64 rays, and the topology only where most of them meet backs.
pub fn camera_inside_wall(world: &World) -> bool {
    const RAYS: usize = 64;
    let met = (0..RAYS).filter_map(|i| {
        // Fibonacci directions.
        let z = 1.0 - (2.0 * i as f32 + 1.0) / RAYS as f32;
        let (s, c) = (2.399_963_2 * i as f32).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let ray = Ray::new(world.camera.eye, Vec3::new(r * c, r * s, z));
        let triangle = world.rays.closest(&ray)?.triangle as usize;
        (world.geometry.face_normals[triangle].dot(ray.dir) > 0.0).then_some(triangle)
    });
    let backs: Vec<usize> = met.collect();
    let most = |count: usize| count * 10 >= RAYS * 9;
    if !most(backs.len()) {
        return false;
    }
    let closed = analyze_topology(&world.geometry).closed_of_triangle;
    most(backs.iter().filter(|&&t| closed[t]).count())
}
