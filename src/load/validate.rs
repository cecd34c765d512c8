//! Checks of a scene that is otherwise well-formed.
//! Zero-area triangles pass: [`crate::tessellate`] drops and counts them, `shading::World` warns.

use std::path::Path;

use crate::error::{Error, Result};
use crate::math::Aabb;
use crate::scene::{Camera, Light, Scene};

/// Most pixels of an image: 2²⁸, some 40 GiB with all layers.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Longest diagonal that leaves room for squares and cubes in single precision.
pub const MAX_DIAGONAL: f32 = 1e15;

/// Brightest light: squares of what many samples of it sum up to are finite in single precision.
pub const MAX_LIGHT: f32 = 1e15;

/// Checks the field of view, and that the image fits memory.
///
/// # Errors
/// [`Error::Input`] at `line` of `file`, with the fix.
pub fn check_lens(c: &Camera, file: &Path, line: Option<usize>) -> Result<()> {
    let fail = |message: String| Err(Error::input(file, line, message));
    if !(c.vfov_deg > 0.0 && c.vfov_deg < 180.0) {
        return fail(format!("camera vfov_deg is {} but must lie between 0 and 180", c.vfov_deg));
    }
    if c.width == 0 || c.height == 0 {
        return fail("camera width and height must be at least 1".into());
    }
    if u64::from(c.width) * u64::from(c.height) > MAX_PIXELS {
        return fail(format!(
            "an image of {}x{} pixels does not fit memory; at most {MAX_PIXELS} pixels are allowed",
            c.width, c.height
        ));
    }
    Ok(())
}

/// Checks that the view exists.
///
/// # Errors
/// [`Error::Input`] at `line` of `file`, with the fix.
pub fn check_camera(c: &Camera, file: &Path, line: Option<usize>) -> Result<()> {
    let fail = |message: String| Err(Error::input(file, line, message));
    if !(c.eye.is_finite() && c.target.is_finite() && c.up.is_finite()) {
        return fail("camera eye, target and up must be finite numbers".into());
    }
    if (c.target - c.eye).length() == 0.0 {
        return fail("camera eye and target are the same point; move one of them".into());
    }
    if (c.target - c.eye).normalize().cross(c.up.normalize_or_zero()).length() < 1e-6 {
        return fail(
            "camera up is zero or points along the view; choose another, e.g. [0, 1, 0] or [0, 0, \
             1]"
            .into(),
        );
    }
    Ok(())
}

/// Box around all triangles of all meshes and around lamps with a surface.
pub fn bounds(scene: &Scene) -> Aabb {
    let meshes = scene
        .meshes
        .iter()
        .flat_map(|m| m.triangles.iter().flatten().map(|&i| m.positions[i as usize]));
    let lamps = scene.lights.iter().flat_map(|l| match *l {
        Light::Quad { corner, edge1, edge2, .. } => {
            vec![corner, corner + edge1, corner + edge2, corner + edge1 + edge2]
        }
        Light::Sphere { center, radius, .. } => vec![center - radius, center + radius],
        _ => Vec::new(),
    });
    Aabb::around(meshes.chain(lamps))
}

/// Checks that there is something to see.
///
/// # Errors
/// [`Error::Input`] for scenes without triangles, extent or light, and with coordinates too large
/// to trace.
pub fn check_scene(scene: &Scene, file: &Path) -> Result<()> {
    let lamps = scene.lights.iter().any(|l| matches!(l, Light::Quad { .. } | Light::Sphere { .. }));
    if scene.meshes.iter().all(|m| m.triangles.is_empty()) && !lamps {
        return Err(Error::input(file, None, "the scene is empty; add a [[mesh]] with triangles"));
    }
    let largest = bounds(scene);
    if largest.diagonal().is_nan() || largest.diagonal() > MAX_DIAGONAL {
        return Err(Error::input(
            file,
            None,
            "coordinates are too large to trace; scale the scene down below 1e15 units",
        ));
    }
    if largest.diagonal() == 0.0 {
        let mesh = scene.meshes.first().map_or("the scene", |mesh| mesh.name.as_str());
        return Err(Error::input(
            file,
            None,
            format!("{mesh} is but a point: all of its corners are alike; export it again"),
        ));
    }
    let brightest = brightest(scene);
    if brightest > MAX_LIGHT {
        return Err(Error::input(
            file,
            None,
            format!(
                "a light of {brightest:e} is too bright for single precision; scale all lights \
                 down, below {MAX_LIGHT:e}"
            ),
        ));
    }
    if !emits(scene) {
        return Err(Error::input(
            file,
            None,
            "nothing emits light; add a [[light]] (e.g. type = \"sky\", radiance = [1, 1, 1]) or \
             a material with emission",
        ));
    }
    Ok(())
}

/// The largest radiance, irradiance or intensity.
fn brightest(scene: &Scene) -> f32 {
    let of_light = |light: &Light| match light {
        Light::Quad { radiance, .. } | Light::Sphere { radiance, .. } | Light::Sky { radiance } => {
            radiance.max_element()
        }
        Light::Sun { irradiance, .. } => irradiance.max_element(),
        Light::Environment { map } => {
            map.texels.iter().map(|c| c.max_element()).fold(0.0, f32::max)
        }
        Light::Point { intensity, .. } | Light::Spot { intensity, .. } => intensity.max_element(),
    };
    let surfaces = scene.materials.iter().map(|m| m.emission.max_element());
    scene.lights.iter().map(of_light).chain(surfaces).fold(0.0, f32::max)
}

/// True when a light or a material in use emits.
pub fn emits(scene: &Scene) -> bool {
    let lit = scene.lights.iter().any(|l| match l {
        Light::Quad { radiance, .. } | Light::Sphere { radiance, .. } | Light::Sky { radiance } => {
            radiance.max_element() > 0.0
        }
        Light::Sun { irradiance, .. } => irradiance.max_element() > 0.0,
        Light::Environment { map } => map.texels.iter().any(|c| c.max_element() > 0.0),
        Light::Point { intensity, .. } | Light::Spot { intensity, .. } => {
            intensity.max_element() > 0.0
        }
    });
    lit || scene
        .meshes
        .iter()
        .any(|m| m.materials.iter().any(|&i| scene.materials[i as usize].emits()))
}
