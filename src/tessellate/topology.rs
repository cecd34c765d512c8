//! Connected parts, closedness, winding (skeleton).

use super::Geometry;

/// What the edges say.
#[derive(Clone, Debug, Default)]
pub struct Topology {
    /// Per triangle: part of a closed, consistently wound component.
    pub closed_of_triangle: Vec<bool>,
}

/// Analyses edges by exact position.
pub fn analyze(geometry: &Geometry) -> Topology {
    Topology { closed_of_triangle: vec![false; geometry.len()] }
}
