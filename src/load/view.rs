//! The view and the light of a scene that brings none.
//!
//! What is upwards is guessed of y and z, the two that programs write: that along which the lower
//! side of the model has more area that faces along it, for models stand on something and have
//! floors. Light is a grey sky and a sun from behind the viewer's left shoulder, so that faces of
//! different directions differ; together they give a surface that faces the sun about as much light
//! as a sky of radiance 1.

use glam::Vec3;

use super::validate::bounds;
use crate::radiometry::Rgb;
use crate::scene::{Camera, Light, Scene};

/// Of the height, what counts as the lower side.
const LOW: f32 = 0.02;
/// Cosine from which on a face counts as facing along an axis.
const FACES: f32 = 0.95;
/// How much more area z needs, since y is the rule in OBJ files.
const FAVOUR: f64 = 1.5;

/// The axis that is upwards in a model, y or z.
pub fn guess_up(scene: &Scene) -> Vec3 {
    let around = bounds(scene);
    let base = |axis: usize| -> f64 {
        let low = around.min[axis] + LOW * (around.max[axis] - around.min[axis]);
        let area = |corners: [Vec3; 3]| {
            let [a, b, c] = corners;
            let n = (b - a).cross(c - a);
            let lies = (a + b + c)[axis] / 3.0 <= low && n[axis].abs() > FACES * n.length();
            if lies { 0.5 * f64::from(n.length()) } else { 0.0 }
        };
        let of = |m: &crate::scene::Mesh| -> f64 {
            m.triangles.iter().map(|t| area(t.map(|i| m.positions[i as usize]))).sum()
        };
        scene.meshes.iter().map(of).sum()
    };
    if base(2) > FAVOUR * base(1) { Vec3::Z } else { Vec3::Y }
}

/// Right, up and towards the viewer of a view from the front, `up` being about an axis.
fn axes(up: Vec3) -> [Vec3; 3] {
    if up.z.abs() > up.y.abs() { [Vec3::X, Vec3::Z, -Vec3::Y] } else { [Vec3::X, Vec3::Y, Vec3::Z] }
}

/// A camera outside of all there is that holds it in view: from the front right, a little above.
pub fn framing(scene: &Scene, camera: &Camera) -> Camera {
    let around = bounds(scene);
    let radius = (around.diagonal() * 0.5).max(1e-6);
    let aspect = camera.width as f32 / camera.height.max(1) as f32;
    let half = (camera.vfov_deg.to_radians() * 0.5).tan() * aspect.min(1.0);
    let distance = radius / half.atan().sin();
    let [right, up, back] = axes(camera.up);
    let target = around.center();
    let eye = target + (right * 0.5 + up * 0.35 + back).normalize() * distance;
    Camera { eye, target, ..camera.clone() }
}

/// Light that shows form, for a viewer with this `up`.
pub fn lights(up: Vec3) -> [Light; 2] {
    let [right, up, back] = axes(up);
    [
        Light::Sky { radiance: Rgb::splat(0.5) },
        Light::Sun {
            direction_to_sun: (up * 0.9 - right * 0.6 + back * 0.5).normalize(),
            irradiance: Rgb::splat(1.6),
            angular_radius_deg: 2.0,
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::super::validate::check_camera;
    use super::*;
    use crate::scene::{Material, Mesh};
    use glam::Vec2;
    use std::path::Path;

    /// Triangles of a slab with a stick on it, which stands along an axis.
    fn standing(axis: usize) -> Scene {
        let at = |x: f32, y: f32, height: f32| {
            let mut p = Vec3::new(x, x, x);
            p[axis] = height;
            p[if axis == 2 { 1 } else { 2 }] = y;
            p
        };
        let positions = vec![
            at(0.0, 0.0, 0.0),
            at(3.0, 0.0, 0.0),
            at(0.0, 2.0, 0.0),
            at(0.5, 1.0, 0.0),
            at(0.0, 1.0, 9.0),
            at(1.0, 1.0, 9.0),
        ];
        let triangles = vec![[0, 1, 2], [3, 4, 5]];
        let mesh = Mesh { positions, triangles, materials: vec![0; 2], ..Mesh::default() };
        let materials = vec![Material::default()];
        Scene { meshes: vec![mesh], materials, ..Scene::default() }
    }

    #[test]
    fn models_stand_on_something() {
        assert_eq!(guess_up(&standing(1)), Vec3::Y);
        assert_eq!(guess_up(&standing(2)), Vec3::Z);
        assert_eq!(guess_up(&Scene::default()), Vec3::Y);
    }

    #[test]
    fn framing_holds_the_corners() {
        for (axis, up, width, height) in [(1, Vec3::Y, 640, 360), (2, Vec3::Z, 100, 300)] {
            let scene = standing(axis);
            let b = bounds(&scene);
            let c = framing(&scene, &Camera { up, width, height, ..Camera::default() });
            check_camera(&c, Path::new("x"), None).unwrap();
            for k in 0..8 {
                let pick =
                    |bit: usize, i: usize| if k >> bit & 1 == 0 { b.min[i] } else { b.max[i] };
                let (Vec2 { x, y }, _) =
                    c.project(Vec3::new(pick(0, 0), pick(1, 1), pick(2, 2))).unwrap();
                assert!(x >= 0.0 && x <= width as f32 && y >= 0.0 && y <= height as f32);
            }
        }
    }
}
