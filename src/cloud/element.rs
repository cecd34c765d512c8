//! Surface elements: the discs that stand for a surface, with whatever is baked on them.
//!
//! A disc has a position, a unit normal and an area A (radius √(A/π)). It is two-sided: the front
//! is the side that the normal faces. Channels are colours per element. Those that the gather
//! knows:
//!
//! | Channel | |
//! |---|---|
//! | `_radiosity` | light leaving the front, W·m⁻² |
//! | `_radiosity_back` | light leaving the back; absent: dark |
//! | `albedo`, `direct`, `direct_back`, `emission` | for whoever looks, and for further bounces |

use glam::{Vec2, Vec3};

use super::Piece;
use crate::radiometry::Rgb;
use crate::scene::Sides;
use crate::tessellate::{Geometry, analyze_topology};

/// A colour per element.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Channel {
    /// Name as in the file.
    pub name: String,
    /// One value an element.
    pub values: Vec<Rgb>,
}

/// Elements; arrays of equal length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cloud {
    /// Centres, world space.
    pub p: Vec<Vec3>,
    /// Unit normals of the fronts.
    pub n: Vec<Vec3>,
    /// Areas, scene units squared.
    pub area: Vec<f32>,
    /// Only the front is ever seen: closed parts, and meshes said to be one-sided.
    pub one_sided: Vec<bool>,
    /// Further values.
    pub channels: Vec<Channel>,
}

/// Points along a side of the grid at which a masked piece is asked whether it exists.
const MASK_SIDE: u32 = 4;

impl Cloud {
    /// Channel of the light that leaves the fronts.
    pub const RADIOSITY: &'static str = "_radiosity";
    /// Channel of the light that leaves the backs.
    pub const RADIOSITY_BACK: &'static str = "_radiosity_back";

    /// The elements of the pieces of a geometry, and the piece each came from: centres of the
    /// pieces; of masked pieces the part that exists, where there is any.
    pub fn from_pieces(geometry: &Geometry, pieces: &[Piece]) -> (Self, Vec<u32>) {
        use rayon::prelude::*;
        let masks = geometry.masks();
        let made: Vec<Option<(Vec3, Vec3, f32)>> = pieces
            .par_iter()
            .map(|piece| {
                let (mut center, mut share) = (piece.at(Vec2::splat(0.5)), 1.0);
                if let Some(masks) = &masks {
                    let stratum = |i: u32| {
                        piece.at((Vec2::new((i % MASK_SIDE) as f32, (i / MASK_SIDE) as f32) + 0.5)
                            / MASK_SIDE as f32)
                    };
                    let inside = (0..MASK_SIDE * MASK_SIDE)
                        .map(stratum)
                        .filter(|b| masks.exists(piece.triangle, b.x, b.y));
                    let (count, sum) = inside.fold((0u32, Vec2::ZERO), |(n, s), b| (n + 1, s + b));
                    if count == 0 {
                        return None;
                    }
                    center = sum / count as f32;
                    share = count as f32 / (MASK_SIDE * MASK_SIDE) as f32;
                }
                let s = geometry.surface(piece.triangle, center.x, center.y);
                Some((s.p, s.ng, piece.area * share))
            })
            .collect();
        let topology =
            geometry.sides_of_mesh.contains(&Sides::Auto).then(|| analyze_topology(geometry));
        let one_sided = |t: usize| match geometry.sides_of_mesh[geometry.mesh_of[t] as usize] {
            Sides::One => true,
            Sides::Two => false,
            Sides::Auto => topology.as_ref().is_some_and(|a| a.closed_of_triangle[t]),
        };
        let (mut cloud, mut from) = (Self::default(), Vec::with_capacity(pieces.len()));
        for (made, i) in made.into_iter().zip(0..) {
            let Some((p, n, area)) = made else { continue };
            cloud.p.push(p);
            cloud.n.push(n);
            cloud.area.push(area);
            cloud.one_sided.push(one_sided(pieces[i as usize].triangle as usize));
            from.push(i);
        }
        (cloud, from)
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.p.len()
    }
    /// True without elements.
    pub fn is_empty(&self) -> bool {
        self.p.is_empty()
    }
    /// Values of a channel.
    pub fn channel(&self, name: &str) -> Option<&[Rgb]> {
        self.channels.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }
    /// Sets a channel; `values` has one entry an element.
    pub fn set(&mut self, name: &str, values: Vec<Rgb>) {
        self.channels.retain(|c| c.name != name);
        self.channels.push(Channel { name: name.into(), values });
    }
    /// Sum of the areas.
    pub fn total_area(&self) -> f64 {
        self.area.iter().map(|&a| f64::from(a)).sum()
    }
}
