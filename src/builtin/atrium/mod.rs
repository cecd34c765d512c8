//! A courtyard of two storeys: arcades around an open court, galleries behind them, lit by sun and
//! sky through the open roof.
//!
//! Metres, y up. Court x −9–9, z −4.5–4.5 between the arcades; galleries 3 m deep behind them;
//! ground floor y 0, upper floor y 4.6, roof y 8.6. The sun reaches a part of the court and of one
//! arcade; the galleries see it only by what the court sends back, so most of a picture taken in a
//! gallery is indirect light.
//!
//! Knob  `detail` (default 1, 0.05–4.2) multiplies the segments of all round parts and divides the
//!       floor finer; the count grows with its square:
//!
//! | `detail` | 0.05 | 0.2 | 0.5 | 0.8 | 1 | 2 | 4.16 |
//! |---|---|---|---|---|---|---|---|
//! | triangles | 30 k | 57 k | 227 k | 510 k | 748 k | 2.5 M | 10.0 M |
//!
//! Every part but the palms' fronds is closed and faces outwards; parts are sunk into one another,
//! never laid face on face.

mod lanterns;
mod parts;
mod plants;
mod shell;
mod vaults;

use glam::Vec3;
use serde::Deserialize;

use super::Generated;
use super::solid::Solids;
use crate::radiometry::Rgb;
use crate::scene::Material;

/// Parameters of the atrium.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AtriumParameters {
    /// Multiplies the segments of round parts and the fineness of the floor, 0.05–4.2.
    pub detail: f32,
    /// Lanterns under every gallery bay, whose material `glow` emits. Default false.
    pub lanterns: bool,
}

impl Default for AtriumParameters {
    fn default() -> Self {
        Self { detail: 1.0, lanterns: false }
    }
}

const NAMES: [(&str, [f32; 3]); 21] = [
    ("plaster", [0.80, 0.75, 0.66]),
    ("ochre", [0.72, 0.52, 0.27]),
    ("pompeian", [0.52, 0.13, 0.09]),
    ("limestone", [0.70, 0.65, 0.56]),
    ("marble", [0.82, 0.80, 0.76]),
    ("tile-light", [0.66, 0.59, 0.48]),
    ("tile-dark", [0.30, 0.20, 0.15]),
    ("joint", [0.22, 0.20, 0.18]),
    ("wood", [0.30, 0.17, 0.09]),
    ("drape-red", [0.58, 0.06, 0.05]),
    ("drape-green", [0.10, 0.32, 0.14]),
    ("drape-blue", [0.09, 0.16, 0.45]),
    ("iron", [0.07, 0.065, 0.06]),
    ("glow", [0.70, 0.66, 0.58]),
    ("sandstone", [0.60, 0.42, 0.29]),
    ("paving-grey", [0.56, 0.53, 0.48]),
    ("paving-warm", [0.66, 0.57, 0.46]),
    ("tile-rose", [0.60, 0.46, 0.38]),
    ("tile-slate", [0.22, 0.21, 0.20]),
    ("earth", [0.12, 0.08, 0.05]),
    ("frond", [0.16, 0.34, 0.09]),
];
const PLASTER: u32 = 0;
const OCHRE: u32 = 1;
const POMPEIAN: u32 = 2;
const LIMESTONE: u32 = 3;
const MARBLE: u32 = 4;
const TILE_LIGHT: u32 = 5;
const TILE_DARK: u32 = 6;
const JOINT: u32 = 7;
const WOOD: u32 = 8;
const DRAPES: [u32; 3] = [9, 10, 11];
const IRON: u32 = 12;
const GLOW: u32 = 13;
const SANDSTONE: u32 = 14;
const PAVING: [u32; 3] = [3, 15, 16];
const TILE_ROSE: u32 = 17;
const TILE_SLATE: u32 = 18;
const EARTH: u32 = 19;
const FROND: u32 = 20;
/// Radiance of the lanterns' globes.
const GLOW_RADIANCE: [f32; 3] = [190.0, 125.0, 62.0];

/// Half the court, from centre to the middle of the arcade walls.
const COURT: [f32; 2] = [9.0, 4.5];
const GALLERY: f32 = 3.0;
const BAY: f32 = 3.0;
const UPPER_FLOOR: f32 = 4.6;
const ROOF: f32 = 8.6;

/// One storey's arcade: floor, height of the columns' feet above it, of the arches' springing, and
/// of the wall's top.
struct Storey {
    floor: f32,
    column_foot: f32,
    spring: f32,
    top: f32,
    radius: f32,
}

const STOREYS: [Storey; 2] = [
    Storey { floor: 0.0, column_foot: 0.0, spring: 2.75, top: UPPER_FLOOR + 0.03, radius: 0.19 },
    Storey {
        floor: UPPER_FLOOR,
        column_foot: 0.93,
        spring: 2.30,
        top: ROOF + 0.03 - UPPER_FLOOR,
        radius: 0.15,
    },
];

/// A straight run of bays: from one corner of the court to the next, the court to its left.
struct Side {
    from: Vec3,
    along: Vec3,
    bays: u32,
}

impl Side {
    fn all() -> [Self; 4] {
        let [x, z] = COURT;
        let side =
            |from, along, length: f32| Self { from, along, bays: (length / BAY).round() as u32 };
        [
            side(Vec3::new(-x, 0.0, z), Vec3::X, 2.0 * x),
            side(Vec3::new(x, 0.0, z), Vec3::NEG_Z, 2.0 * z),
            side(Vec3::new(x, 0.0, -z), Vec3::NEG_X, 2.0 * x),
            side(Vec3::new(-x, 0.0, -z), Vec3::Z, 2.0 * z),
        ]
    }
    /// Into the court.
    fn inwards(&self) -> Vec3 {
        Vec3::Y.cross(self.along)
    }
    fn length(&self) -> f32 {
        self.bays as f32 * BAY
    }
}

/// Makes the atrium.
///
/// # Errors
/// When `detail` is out of range.
pub fn atrium(p: &AtriumParameters) -> Result<Generated, String> {
    if !(0.05..=4.2).contains(&p.detail) {
        return Err(format!("detail is {} but must lie from 0.05 to 4.2", p.detail));
    }
    let segments = |n: u32| ((n as f32 * p.detail).round() as u32).max(3);
    let mut s = Solids::default();
    shell::walls(&mut s);
    shell::floors(&mut s, p.detail);
    shell::mouldings(&mut s);
    vaults::vaults(&mut s, &segments);
    for (k, storey) in STOREYS.iter().enumerate() {
        for (number, side) in Side::all().iter().enumerate() {
            parts::arcade(&mut s, side, storey, &segments);
            for bay in 1..side.bays {
                let foot = side.from + side.along * (bay as f32 * BAY) + Vec3::Y * storey.floor;
                parts::column(&mut s, foot, storey, &segments);
            }
            for bay in 0..side.bays {
                if k == 1 {
                    parts::balustrade(&mut s, side, bay, &segments);
                }
                let hung = if k == 1 {
                    (bay + number as u32) % 3 == 1
                } else {
                    number == 2 && bay % 3 == 1
                };
                if hung {
                    parts::drape(
                        &mut s,
                        side,
                        bay,
                        storey,
                        DRAPES[(bay as usize / 2 + number + k) % 3],
                        &segments,
                    );
                }
            }
        }
    }
    parts::fountain(&mut s, &segments);
    parts::pots(&mut s, &segments);
    if p.lanterns {
        lanterns::lanterns(&mut s, &segments);
    }
    // Last: only these have texture coordinates.
    plants::plants(&mut s, &segments);
    let mut materials: Vec<Material> = NAMES
        .iter()
        .map(|&(name, albedo)| Material {
            name: name.into(),
            albedo: Rgb::from(albedo),
            ..Material::default()
        })
        .collect();
    materials[GLOW as usize].emission = Rgb::from(GLOW_RADIANCE);
    Ok(Generated { mesh: s.mesh, materials, ..Generated::default() })
}
