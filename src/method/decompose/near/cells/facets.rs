//! The pieces of surface that the near sum runs over, as the proxy has them: the one place of the
//! sum that knows what the proxy is made of.

use glam::Vec3;

use crate::photon::Proxy;
use crate::radiometry::Rgb;
use crate::tessellate::Side;

/// A triangle with the light that leaves it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// Corners, world space, wound so that the front is seen counter-clockwise.
    pub(super) corners: [Vec3; 3],
    /// The place whose distance decides how near the facet is.
    pub(super) centroid: Vec3,
    /// Radiosity of the front, W·m⁻² per existing area.
    pub(super) front: Rgb,
    /// Radiosity of the back.
    pub(super) back: Rgb,
    /// The back does not exist.
    pub(super) one_sided: bool,
    /// Fraction that exists.
    pub(super) coverage: f32,
}

/// All facets of a proxy.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facets<'a>(pub(super) Proxy<'a>);

impl Facets<'_> {
    /// Number of facets.
    pub(super) fn len(self) -> usize {
        self.0.cells.len()
    }

    /// Longest edge, scene units.
    pub(super) fn size(self) -> f32 {
        self.0.cells.near_cell
    }

    /// The place of facet `i`.
    pub(super) fn centroid(self, i: u32) -> Vec3 {
        self.0.cells.centroids[i as usize]
    }

    /// The corners of facet `i`.
    pub(super) fn corners(self, i: u32) -> [Vec3; 3] {
        self.0.cells.corners[i as usize]
    }

    /// Facet `i`.
    pub(super) fn get(self, i: u32) -> Facet {
        let Proxy { cells, radiosity } = self.0;
        Facet {
            corners: self.corners(i),
            centroid: self.centroid(i),
            front: radiosity.get(i, Side::Front),
            back: radiosity.get(i, Side::Back),
            one_sided: cells.one_sided[i as usize],
            coverage: radiosity.coverage(i),
        }
    }
}
