//! A furnished study, made for lighting by hand: corners, furniture on the floor, things on tables,
//! colours beside white walls.
//!
//! Metres, y up. Room x 0–6, y 0–3, z 0–5, closed all around; the camera stands inside. Boards on
//! the floor, skirting and cornice, a shelf of books, a desk with a chair, a sofa on a rug, a low
//! table with fruit, a curtain. What touches overlaps by millimetres, never lies face on face.
//! Knob  `detail` (default 1, 0.25–8) multiplies the segments of all round parts.
//! Knob  `window` (default false) opens one small window in the wall z = 5, behind the camera.
//! Knob  `white` (default false) paints walls, ceiling, trim and boards white.

mod furniture;

use glam::{Vec2, Vec3};
use serde::Deserialize;

use super::solid::Solids;
use super::{Generated, diffuse};
use crate::radiometry::Rgb;
use crate::sampling::{Rng, Stream};

/// Parameters of the study.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StudyParameters {
    /// Multiplies the segments of round parts, 0.25–8.
    pub detail: f32,
    /// A window of 0.5 × 0.6 m.
    pub window: bool,
    /// White walls, ceiling, trim and floor.
    pub white: bool,
}

impl Default for StudyParameters {
    fn default() -> Self {
        Self { detail: 1.0, window: false, white: false }
    }
}

const NAMES: [(&str, [f32; 3]); 17] = [
    ("wall", [0.78, 0.75, 0.69]),
    ("ceiling", [0.84, 0.83, 0.80]),
    ("trim", [0.82, 0.80, 0.76]),
    ("board-1", [0.45, 0.29, 0.17]),
    ("board-2", [0.50, 0.33, 0.19]),
    ("board-3", [0.40, 0.25, 0.14]),
    ("walnut", [0.30, 0.18, 0.10]),
    ("sofa", [0.16, 0.34, 0.36]),
    ("cushion", [0.72, 0.42, 0.10]),
    ("rug", [0.52, 0.12, 0.10]),
    ("rug-border", [0.68, 0.58, 0.42]),
    ("curtain", [0.56, 0.09, 0.07]),
    ("cream", [0.76, 0.70, 0.58]),
    ("green", [0.18, 0.38, 0.16]),
    ("blue", [0.14, 0.22, 0.46]),
    ("orange", [0.78, 0.36, 0.06]),
    ("plaster", [0.80, 0.80, 0.79]),
];
const WALL: u32 = 0;
const CEILING: u32 = 1;
const TRIM: u32 = 2;
const BOARD: u32 = 3;
const WALNUT: u32 = 6;
const SOFA: u32 = 7;
const CUSHION: u32 = 8;
const RUG: u32 = 9;
const RUG_BORDER: u32 = 10;
const CURTAIN: u32 = 11;
const CREAM: u32 = 12;
const GREEN: u32 = 13;
const BLUE: u32 = 14;
const ORANGE: u32 = 15;
const PLASTER: u32 = 16;

const SIZE: Vec3 = Vec3::new(6.0, 3.0, 5.0);

/// Makes the study.
///
/// # Errors
/// When `detail` is out of range.
pub fn study(p: &StudyParameters) -> Result<Generated, String> {
    if !(0.25..=8.0).contains(&p.detail) {
        return Err(format!("detail is {} but must lie from 0.25 to 8", p.detail));
    }
    let segments = |n: u32| ((n as f32 * p.detail).round() as u32).max(4);
    let mut s = Solids::default();
    shell(&mut s, p.window);
    furniture::shelf(&mut s);
    furniture::desk(&mut s, &segments);
    furniture::sofa(&mut s, &segments);
    furniture::low_table(&mut s, &segments);
    furniture::curtain(&mut s, &segments);
    let mut materials = diffuse(&NAMES);
    if p.white {
        materials[..=BOARD as usize + 2].iter_mut().for_each(|m| m.albedo = Rgb::splat(0.85));
    }
    Ok(Generated { mesh: s.mesh, materials, ..Generated::default() })
}

/// Walls with thickness, boards, skirting, cornice.
fn shell(s: &mut Solids, window: bool) {
    let lines = |length: f32, opening: [f32; 2]| {
        let (before, after) = (vec![-0.3, 0.0], vec![length, length + 0.3]);
        [before, if window { opening.to_vec() } else { Vec::new() }, after].concat()
    };
    let (xs, ys) = (lines(SIZE.x, [2.9, 3.4]), lines(SIZE.y, [1.35, 1.95]));
    let zs = [-0.3, 0.0, SIZE.z, SIZE.z + 0.3];
    let (last_x, last_y) = (xs.len() - 2, ys.len() - 2);
    let filled = |[i, j, k]: [usize; 3]| {
        let room = (1..last_x).contains(&i) && (1..last_y).contains(&j) && k == 1;
        let opening = window && i == 2 && j == 2 && k == 2;
        !(room || opening)
    };
    s.grid([&xs, &ys, &zs], filled, |_, n| if n.y < -0.5 { CEILING } else { WALL });
    let mut rng = Rng::new(3, Stream::Scene, 5, 0);
    let width = SIZE.z / 34.0;
    for row in 0..34 {
        let (z, mut x) = (row as f32 * width, -0.3 - 1.2 * rng.next_f32());
        while x < SIZE.x + 0.02 {
            let length = 1.1 + 0.7 * rng.next_f32();
            let (from, to) = (x.max(-0.02), (x + length).min(SIZE.x + 0.02));
            if to - from > 0.05 {
                let high = 0.012 + 0.001 * rng.next_f32();
                block(
                    s,
                    Vec3::new(from + 0.001, -0.02, z + 0.001),
                    Vec3::new(to - 0.001, high, z + width - 0.001),
                    0.0025,
                    BOARD + rng.below(3) as u32,
                );
            }
            x += length;
        }
    }
    let skirting: Vec<Vec2> =
        [(-0.01, 0.0), (0.018, 0.0), (0.018, 0.09), (0.012, 0.11), (0.006, 0.125), (-0.01, 0.125)]
            .map(Vec2::from)
            .into();
    let cornice: Vec<Vec2> = [
        (-0.01, -0.16),
        (0.012, -0.16),
        (0.02, -0.14),
        (0.03, -0.135),
        (0.05, -0.08),
        (0.09, -0.045),
        (0.13, -0.035),
        (0.14, -0.02),
        (0.14, 0.02),
        (-0.01, 0.02),
    ]
    .map(Vec2::from)
    .into();
    let around = |s: &mut Solids, y: f32, profile: &[Vec2]| {
        s.frame(Vec3::new(0.0, y, SIZE.z), Vec3::X * SIZE.x, Vec3::NEG_Z * SIZE.z, profile, TRIM);
    };
    around(s, 0.0, &skirting);
    around(s, SIZE.y, &cornice);
}

/// A box with chamfered edges.
fn block(s: &mut Solids, low: Vec3, high: Vec3, chamfer: f32, material: u32) {
    let c = chamfer.min(0.2 * (high - low).min_element());
    let ring = |y: f32, inset: f32| {
        let (a, b) = (low + inset, high - inset);
        [
            (a.x, a.z + c),
            (a.x + c, a.z),
            (b.x - c, a.z),
            (b.x, a.z + c),
            (b.x, b.z - c),
            (b.x - c, b.z),
            (a.x + c, b.z),
            (a.x, b.z - c),
        ]
        .map(|(x, z)| Vec3::new(x, y, z))
        .to_vec()
    };
    s.tube(
        &[ring(low.y, c), ring(low.y + c, 0.0), ring(high.y - c, 0.0), ring(high.y, c)],
        false,
        material,
    );
}
