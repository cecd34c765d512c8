//! Light sources for next-event estimation and photon emission. (Skeleton: signatures are the contract.)

use glam::{Vec2, Vec3};

use super::World;
use crate::math::Ray;
use crate::radiometry::Rgb;
use crate::run::Run;
use crate::scene::Scene;
use crate::tessellate::Geometry;

/// One connection to a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction to the light.
    pub wi: Vec3,
    /// Shadow ray: open segment from the shading point to just short of the light.
    pub ray: Ray,
    /// Radiance over the density of the whole choice (light and point), so that E ≈ cos θ · `weight` when unoccluded.
    pub weight: Rgb,
    /// Density of `wi` per steradian, including the choice of light; infinite for delta lights.
    pub pdf_solid_angle: f32,
    /// Set for tessellated sphere lights: the sample counts only if the closest hit of `ray` is a triangle of this scene light.
    pub must_hit_light: Option<u32>,
}

/// A photon leaving a light.
#[derive(Clone, Copy, Debug)]
pub struct PhotonEmission {
    /// Ray of the photon.
    pub ray: Ray,
    /// Flux carried, W per channel, for one of `count` photons.
    pub flux: Rgb,
}

/// All lights but none of their shadows.
#[derive(Debug, Default)]
pub struct LightTable {
    /// Constant sky radiance.
    pub sky: Rgb,
}

/// How direct light is sampled.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DirectSettings {
    /// Shadow rays per camera sample.
    pub light_samples: u32,
}

impl Default for DirectSettings {
    fn default() -> Self {
        Self { light_samples: 1 }
    }
}

impl LightTable {
    /// Collects emissive triangles and lights.
    pub fn new(scene: &Scene, _geometry: &Geometry) -> Self {
        let sky = scene.lights.iter().map(|l| if let crate::scene::Light::Sky { radiance } = l { *radiance } else { Rgb::ZERO }).sum();
        Self { sky }
    }
}

/// Irradiance at `p` with unit normal `n` from sun, lamps and emitters (not the sky) by `count` shadow rays.
/// `sample(i)` gives (pick, uv) of ray i. Adds to the shadow ray count through the returned number of rays.
pub fn direct_irradiance(_world: &World, _p: Vec3, _ng: Vec3, _n: Vec3, _count: u32, _sample: &mut dyn FnMut(u32) -> (f32, Vec2)) -> (Rgb, u64) {
    (Rgb::ZERO, 0)
}

#[allow(dead_code, reason = "skeleton")]
fn _keep(_: &Run) {}
