//! How large the surroundings of what is seen are: the scale of every length that is a percentage.
//!
//! ```text
//! extent = min(diagonal, SPAN · q)     q = third quartile of the distances between landings
//! midst  = their componentwise median
//! ```
//! The camera's view is sampled on a lattice; from every surface that it meets a few directions
//! with cosine density leave into the half-space of the seen side, and where they land are points
//! of what surrounds the picture. Distances between pairs of them tell how large it is, whatever
//! lies beyond its windows or under it: a ground of kilometres around a house changes the third
//! quartile as little as it changes the picture. [`SPAN`] is chosen so that in a closed room, empty
//! or furnished, the ceiling holds and the extent is the diagonal of the scene.
//!
//! Inputs      the ray backend, the triangles, one or several views.
//! Output      a length in scene units, between [`FLOOR`] times the diagonal and the diagonal.
//! Guarantees  the same for every picture size, seed and thread count; scaled scenes have scaled
//!             extents, by the bit for powers of two; shifts and turns change it by rounding only.
//! Not         lamps and brightness are not looked at. Where almost nothing lands (an open plane),
//!             the diagonal stands in: there is no near and far then.
//! Cost        some 20,000 rays; they are not counted in the statistics.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::Surface;
use crate::accel::RayQuery;
use crate::math::{Frame, Ray};
use crate::sampling::{Sobol, Stream, sample_cosine_hemisphere};
use crate::scene::Camera;
use crate::tessellate::Geometry;

/// Directions from each surface that is seen.
const DIRECTIONS: u32 = 8;
/// Lattice points along each side of a picture, all views together.
const LATTICE: usize = 48;
/// Fewest landings that say something.
const LEAST: usize = 32;
/// A number that shares no factor with the number of landings, nearly always: pairs are far apart
/// in the picture.
const STEP: usize = 7919;
/// The part of the distances that lies below the one that counts.
const SHARE: f64 = 0.75;
/// Extent over that distance.
const SPAN: f32 = 5.0;
/// Least extent, as a share of the diagonal.
const FLOOR: f32 = 1e-6;

/// How large the surroundings of what is seen are, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// The scale of every relative length, scene units.
    pub extent: f32,
    /// The midst, world space.
    pub midst: Vec3,
}

/// Those of all of `views`. Call inside the thread pool.
pub(super) fn surroundings(
    rays: &dyn RayQuery,
    geometry: &Geometry,
    views: &[Camera],
) -> Surroundings {
    let diagonal = geometry.bounds.diagonal();
    let side = (LATTICE as f64 / (views.len().max(1) as f64).sqrt()).ceil() as usize;
    let points: Vec<Vec3> = (0..views.len() * side * side)
        .into_par_iter()
        .flat_map_iter(|i| {
            let (view, x, y) = (&views[i / (side * side)], i % side, i / side % side);
            let at = (Vec2::new(x as f32, y as f32) + 0.5) / side as f32
                * Vec2::new(view.width as f32, view.height as f32);
            let ray = Ray::new(view.eye, view.direction(at));
            let seen = rays.closest(&ray).map(|hit| Surface::new(geometry, &hit, -ray.dir));
            seen.into_iter().flat_map(move |s| landings(rays, s, i as u64, diagonal))
        })
        .collect();
    if points.len() < LEAST {
        return Surroundings { extent: diagonal, midst: geometry.bounds.center() };
    }
    let partner = |i: usize| points[(i * STEP + points.len() / 2) % points.len()];
    let mut distances: Vec<f32> =
        points.iter().enumerate().map(|(i, p)| p.distance(partner(i))).collect();
    let rank = ((distances.len() - 1) as f64 * SHARE) as usize;
    let (_, &mut across, _) = distances.select_nth_unstable_by(rank, f32::total_cmp);
    let median = |axis: usize| {
        let mut along: Vec<f32> = points.iter().map(|p| p[axis]).collect();
        *along.select_nth_unstable_by(points.len() / 2, f32::total_cmp).1
    };
    let midst = Vec3::new(median(0), median(1), median(2));
    Surroundings { extent: (SPAN * across).clamp(FLOOR * diagonal, diagonal), midst }
}

/// Where rays from `s` land.
fn landings(
    rays: &dyn RayQuery,
    s: Surface,
    element: u64,
    diagonal: f32,
) -> impl Iterator<Item = Vec3> {
    let sobol = Sobol::new(0, Stream::Extent, element);
    let frame = Frame::from_normal(s.ng);
    (0..DIRECTIONS).filter_map(move |k| {
        let wi = frame.world_from_local(sample_cosine_hemisphere(sobol.sample_2d(k, 0)));
        let ray = s.ray(wi, diagonal);
        rays.closest(&ray).map(|hit| ray.origin + ray.dir * hit.t)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::Backend;
    use crate::run::Run;
    use crate::scene::{Material, Mesh, Scene};
    use crate::shading::World;

    /// A room of 4 × 3 × 4 m with a window, `ground` metres of ground around it (0: none), all
    /// times `scale`; and its camera, inside.
    fn room(ground: f32, scale: f32) -> Scene {
        let mut mesh = Mesh::default();
        let mut quad = |a: [f32; 3], b: [f32; 3], c: [f32; 3]| {
            let [a, b, c] = [a, b, c].map(|p| Vec3::from_array(p) * scale);
            let base = mesh.positions.len() as u32;
            mesh.positions.extend([a, b, b + c - a, c]);
            mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| i + base)));
        };
        quad([0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0]);
        quad([0.0, 3.0, 0.0], [4.0, 3.0, 0.0], [0.0, 3.0, 4.0]);
        quad([0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]);
        quad([0.0, 0.0, 4.0], [4.0, 0.0, 4.0], [0.0, 3.0, 4.0]);
        quad([0.0, 0.0, 0.0], [0.0, 0.0, 4.0], [0.0, 3.0, 0.0]);
        // The wall with the window: below and above it.
        quad([4.0, 0.0, 0.0], [4.0, 0.0, 4.0], [4.0, 1.0, 0.0]);
        quad([4.0, 1.6, 0.0], [4.0, 1.6, 4.0], [4.0, 3.0, 0.0]);
        if ground > 0.0 {
            quad([-ground, -0.1, -ground], [ground, -0.1, -ground], [-ground, -0.1, ground]);
        }
        mesh.materials = vec![0; mesh.triangles.len()];
        let camera = Camera {
            eye: Vec3::new(3.5, 1.6, 3.5) * scale,
            target: Vec3::new(0.5, 1.0, 0.5) * scale,
            vfov_deg: 65.0,
            ..Camera::default()
        };
        let materials = vec![Material::default()];
        Scene { camera, meshes: vec![mesh], materials, ..Scene::default() }
    }

    fn world(ground: f32, scale: f32) -> World {
        World::new(&room(ground, scale), Backend::Bvh, &Run::new(1).unwrap()).unwrap()
    }

    #[test]
    fn a_room_is_its_own_measure_whatever_the_ground() {
        let alone = world(0.0, 1.0);
        assert_eq!(alone.around.extent, alone.diagonal);
        let extents = [10.0, 100.0, 1e3, 1e4].map(|ground| world(ground, 1.0).around.extent);
        for extent in extents {
            assert!(extent < 4.0 * alone.diagonal && extent > alone.diagonal, "{extent}");
            assert!((extent / extents[0] - 1.0).abs() < 0.05, "{extents:?}");
        }
    }

    #[test]
    fn scaled_scenes_have_scaled_extents() {
        let plain = world(100.0, 1.0);
        for scale in [0.125, 1024.0] {
            let scaled = world(100.0, scale);
            assert_eq!(scaled.around.extent, plain.around.extent * scale);
            assert_eq!(scaled.around.midst, plain.around.midst * scale);
        }
    }

    #[test]
    fn the_size_of_the_picture_does_not_matter() {
        let run = Run::new(1).unwrap();
        let mut scene = room(100.0, 1.0);
        let extents = [(160, 90), (1280, 720)].map(|(width, height)| {
            (scene.camera.width, scene.camera.height) = (width, height);
            World::new(&scene, Backend::Bvh, &run).unwrap().around.extent
        });
        assert!((extents[0] / extents[1] - 1.0).abs() < 1e-5, "{extents:?}");
    }
}
