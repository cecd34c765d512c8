//! Two-sided diffuse material with emission on the front and an optional cut-out mask.

use crate::radiometry::{MAX_ALBEDO, Rgb};

/// Index into [`super::Scene::textures`].
pub type TextureId = u32;

/// A diffuse material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name as in the file.
    pub name: String,
    /// Diffuse reflectance, multiplied with `albedo_texture`; the product is clamped to
    /// [`MAX_ALBEDO`].
    pub albedo: Rgb,
    /// Texture of the reflectance.
    pub albedo_texture: Option<TextureId>,
    /// Radiance emitted from the front side (the side the winding faces).
    pub emission: Rgb,
    /// Constant opacity; with `opacity_texture` the product. A surface point exists where it is at
    /// least ½.
    pub opacity: f32,
    /// Mask texture (its `mask` channel is read).
    pub opacity_texture: Option<TextureId>,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: "default".into(),
            albedo: Rgb::splat(0.5),
            albedo_texture: None,
            emission: Rgb::ZERO,
            opacity: 1.0,
            opacity_texture: None,
        }
    }
}

impl Material {
    /// True when it emits.
    pub fn emits(&self) -> bool {
        self.emission.max_element() > 0.0
    }
    /// Albedo for a texel value (1 without texture).
    pub fn albedo_with(&self, texel: Rgb) -> Rgb {
        (self.albedo * texel).clamp(Rgb::ZERO, Rgb::splat(MAX_ALBEDO))
    }
}
