//! From a hit to light: surfaces, light sources, direct light.
//!
//! Conventions: `wo` points towards the viewer, `wi` towards the light; both unit, both away from
//! the surface. `ng`/`ns` of a [`Surface`] face `wo`.

mod lights;
mod surface;
mod surroundings;
mod world;

pub use lights::{
    DirectSettings, LightSample, LightTable, PhotonEmission, Sky, direct_irradiance, light_visible,
    seen_irradiance, shadow_ray,
};
pub use surface::Surface;
pub use surroundings::Surroundings;
pub use world::World;
