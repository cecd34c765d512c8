//! Boxes of horizontal slats inside one another, in a white room open to a lamp on one side: near
//! surfaces that hide each other.
//!
//! The unit of length is the height of the outermost box. Every slat is a closed solid of
//! `thickness`; slats of neighbouring boxes are staggered, so that most of what lies near a point
//! is hidden from it by something nearer.
//! Knobs  `boxes` 3, `slats` 10 per side and box, `thickness` 0.25 of a slat's pitch.

use glam::Vec3;
use serde::Deserialize;

use super::solid::Solids;
use super::{Generated, diffuse};

/// Parameters of the slats.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SlatsParameters {
    /// Boxes inside one another, 1–8.
    pub boxes: u32,
    /// Slats a side, 2–200.
    pub slats: u32,
    /// Thickness of a slat as a share of its pitch, 0–1 exclusive.
    pub thickness: f32,
}

impl Default for SlatsParameters {
    fn default() -> Self {
        Self { boxes: 3, slats: 10, thickness: 0.25 }
    }
}

/// Makes the slats.
///
/// # Errors
/// When a parameter is out of range.
pub fn slats(p: &SlatsParameters) -> Result<Generated, String> {
    let thin = p.thickness > 0.0 && p.thickness < 1.0;
    if !(1..=8).contains(&p.boxes) || !(2..=200).contains(&p.slats) || !thin {
        return Err(
            "boxes must lie from 1 to 8, slats from 2 to 200, thickness between 0 and 1".into()
        );
    }
    let colors: [(&str, [f32; 3]); 4] = [
        ("white", [0.75; 3]),
        ("warm", [0.75, 0.45, 0.2]),
        ("cool", [0.2, 0.4, 0.7]),
        ("pale", [0.7, 0.68, 0.5]),
    ];
    let mut s = Solids::default();
    // A floor, a back and a left wall as one solid.
    s.grid(
        [&[-1.6, -1.5, 1.5], &[-0.1, 0.0, 2.0], &[-1.3, -1.2, 1.5]],
        |[i, j, k]| i == 0 || j == 0 || k == 0,
        |_, _| 0,
    );
    for b in 0..p.boxes {
        let shrink = 1.0 - b as f32 / (p.boxes as f32 + 0.4);
        let (half, height) = (0.62 * shrink, 0.25 + 0.95 * shrink);
        let pitch = height / p.slats as f32;
        let depth = 0.055 * shrink;
        let stagger = if b % 2 == 0 { 0.5 } else { 0.0 };
        for i in 0..p.slats {
            let low = 0.02 + (i as f32 + stagger * 0.8) * pitch;
            let high = low + pitch * p.thickness;
            // Four slats around; those along x reach over the corners.
            let m = 1 + b % 3;
            for side in [-1.0, 1.0] {
                let (a, c) = (side * half, side * (half + depth));
                let (z0, z1) = (a.min(c), a.max(c));
                s.cuboid(Vec3::new(-half - depth, low, z0), Vec3::new(half + depth, high, z1), m);
                s.cuboid(Vec3::new(z0, low, -half + 1e-3), Vec3::new(z1, high, half - 1e-3), m);
            }
        }
        // Corner posts stand inside the slats' corners.
        for (x, z) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let c = Vec3::new(x * (half + depth * 0.5), 0.0, z * (half + depth * 0.5));
            let r = depth * 0.35;
            s.cuboid(c + Vec3::new(-r, -0.01, -r), c + Vec3::new(r, height + 0.06, r), 0);
        }
    }
    s.cuboid(Vec3::new(-0.09, 0.2, -0.09), Vec3::new(0.09, 0.75, 0.09), 1);
    Ok(Generated { mesh: s.mesh, materials: diffuse(&colors), ..Generated::default() })
}
