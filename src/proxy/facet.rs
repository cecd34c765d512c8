//! Facets: what the near sum of the course runs over, and what shows the proxy as it is.

use glam::Vec3;

use crate::radiometry::Rgb;
use crate::tessellate::Side;

/// A triangle no edge of which is longer than [`super::Proxy::piece_size`], with the light that
/// leaves it. All facets together are the surface of the scene.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// Corners, world space, wound so that the front is seen counter-clockwise.
    pub corners: [Vec3; 3],
    /// The point whose distance decides how near the facet is.
    pub centroid: Vec3,
    /// Triangle of the geometry that it is a part of.
    pub triangle: u32,
    /// Radiosity of the front and the back, W·m⁻² per existing area.
    pub radiosity: [Rgb; 2],
    /// Indirect irradiance of the front and the back, W·m⁻²; zero where nothing reflects.
    pub indirect: [Rgb; 2],
    /// The back does not exist.
    pub one_sided: bool,
    /// Fraction that exists; less than 1 where a mask cuts holes.
    pub coverage: f32,
}

impl Facet {
    /// Radiosity of a side, W·m⁻² per existing area.
    pub fn radiosity_of(&self, side: Side) -> Rgb {
        self.radiosity[side as usize]
    }
    /// Indirect irradiance of a side, W·m⁻².
    pub fn indirect_of(&self, side: Side) -> Rgb {
        self.indirect[side as usize]
    }
    /// Area, holes included, squared scene units.
    pub fn area(&self) -> f32 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a).length() * 0.5
    }
    /// Unit normal of the front; zero for a facet without area.
    pub fn normal(&self) -> Vec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a).normalize_or_zero()
    }
}
