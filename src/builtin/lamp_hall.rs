//! A hall with 300 lamps, shelves and columns: direct light of many small sources, each of which is
//! hidden from much of the hall.
//!
//! Metres, y up. Hall x 0–24, y 0–5, z 0–16. Lamps hang in 20 × 15 from the ceiling at four
//! heights, each a shade that is open below; three tints. Shelves with boxes in rows, columns
//! between them.
//! Knob  `detail` (default 1, 0.25–8) multiplies the segments of all round parts.

use glam::{Vec2, Vec3};
use serde::Deserialize;

use super::solid::Solids;
use super::{Generated, diffuse};
use crate::radiometry::Rgb;
use crate::sampling::{Rng, Stream};

/// Parameters of the hall.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LampHallParameters {
    /// Multiplies the segments of round parts, 0.25–8.
    pub detail: f32,
}

impl Default for LampHallParameters {
    fn default() -> Self {
        Self { detail: 1.0 }
    }
}

const NAMES: [(&str, [f32; 3]); 13] = [
    ("wall", [0.70, 0.70, 0.68]),
    ("ceiling", [0.75, 0.75, 0.74]),
    ("floor", [0.50, 0.50, 0.48]),
    ("column", [0.72, 0.68, 0.60]),
    ("shelf", [0.36, 0.38, 0.42]),
    ("shade", [0.12, 0.13, 0.15]),
    ("box-1", [0.58, 0.42, 0.26]),
    ("box-2", [0.22, 0.36, 0.56]),
    ("box-3", [0.66, 0.24, 0.16]),
    ("box-4", [0.70, 0.70, 0.62]),
    ("lamp-warm", [0.80, 0.80, 0.80]),
    ("lamp-white", [0.80, 0.80, 0.80]),
    ("lamp-cool", [0.80, 0.80, 0.80]),
];
const WALL: u32 = 0;
const CEILING: u32 = 1;
const FLOOR: u32 = 2;
const COLUMN: u32 = 3;
const SHELF: u32 = 4;
const SHADE: u32 = 5;
const BOX: u32 = 6;
const LAMP: u32 = 10;
const RADIANCE: [[f32; 3]; 3] = [[92.0, 64.0, 36.0], [72.0, 68.0, 62.0], [44.0, 60.0, 84.0]];
const SIZE: Vec3 = Vec3::new(24.0, 5.0, 16.0);

/// Makes the hall.
///
/// # Errors
/// When `detail` is out of range.
pub fn lamp_hall(p: &LampHallParameters) -> Result<Generated, String> {
    if !(0.25..=8.0).contains(&p.detail) {
        return Err(format!("detail is {} but must lie from 0.25 to 8", p.detail));
    }
    let round = ((24.0 * p.detail).round() as u32).max(6);
    let mut s = Solids::default();
    let lines = |length: f32| [-0.4, 0.0, length, length + 0.4];
    s.grid(
        [&lines(SIZE.x), &lines(SIZE.y), &lines(SIZE.z)],
        |c| c != [1; 3],
        |_, n| {
            if n.y > 0.5 {
                FLOOR
            } else if n.y < -0.5 {
                CEILING
            } else {
                WALL
            }
        },
    );
    let mut rng = Rng::new(17, Stream::Scene, 9, 0);
    for i in 0..20 {
        for j in 0..15 {
            let at = Vec2::new(0.6 + 1.2 * i as f32, 0.54 + 1.066 * j as f32);
            let high = 3.3 + 0.35 * rng.below(4) as f32;
            lamp(&mut s, Vec3::new(at.x, high, at.y), round.min(16), rng.below(3) as u32);
        }
    }
    for x in [4.0, 12.0, 20.0] {
        for z in [4.0, 12.0] {
            column(&mut s, Vec3::new(x, 0.0, z), round);
        }
    }
    for row in 0..4 {
        let z = 2.0 + 4.0 * row as f32;
        for (from, to) in [(1.5, 10.5), (13.5, 22.5)] {
            shelf(&mut s, from, to, z, &mut rng);
        }
    }
    let mut materials = diffuse(&NAMES);
    for (tint, radiance) in RADIANCE.into_iter().enumerate() {
        materials[LAMP as usize + tint].emission = Rgb::from(radiance);
    }
    Ok(Generated { mesh: s.mesh, materials, ..Generated::default() })
}

/// A shade on a rod, and in it a disc that shines downwards.
fn lamp(s: &mut Solids, at: Vec3, round: u32, tint: u32) {
    let ring = |r: f32, y: f32| -> Vec<Vec3> {
        let angles = (0..round).map(|i| std::f32::consts::TAU * i as f32 / round as f32);
        angles.map(|a| at + Vec3::new(r * a.cos(), y, r * a.sin())).collect()
    };
    let profile = [(0.13, 0.0), (0.14, 0.0), (0.06, 0.16), (0.012, 0.17)];
    let mut rings: Vec<Vec<Vec3>> = profile.map(|(r, y)| ring(r, y)).into();
    rings.push(ring(0.012, SIZE.y + 0.01 - at.y));
    rings.insert(0, ring(0.07, 0.10));
    s.tube(&rings, false, SHADE);
    s.tube_by(&[ring(0.055, 0.06), ring(0.055, 0.08), ring(0.03, 0.12)], false, |k| {
        if k == 0 { LAMP + tint } else { SHADE }
    });
}

/// A round column on a square base.
fn column(s: &mut Solids, foot: Vec3, round: u32) {
    let profile: Vec<Vec2> = [
        (0.40, 0.1),
        (0.40, 0.22),
        (0.33, 0.28),
        (0.29, 0.4),
        (0.26, 4.3),
        (0.30, 4.4),
        (0.38, 4.6),
        (0.38, 4.8),
    ]
    .map(Vec2::from)
    .into();
    s.lathe(foot, &profile, 2 * round, |_, _| 1.0, COLUMN);
    s.cuboid(foot + Vec3::new(-0.45, -0.01, -0.45), foot + Vec3::new(0.45, 0.12, 0.45), COLUMN);
    s.cuboid(foot + Vec3::new(-0.45, 4.78, -0.45), foot + Vec3::new(0.45, 5.01, 0.45), COLUMN);
}

/// A shelf of three boards with boxes on it, 0.8 m deep.
fn shelf(s: &mut Solids, from: f32, to: f32, z: f32, rng: &mut Rng) {
    let count = ((to - from) / 1.5).round() as u32;
    for i in 0..=count {
        let x = from + (to - from) * i as f32 / count as f32;
        for dz in [-0.4, 0.34] {
            let low = Vec3::new(x - 0.03, -0.01, z + dz);
            s.cuboid(low, low + Vec3::new(0.06, 2.4, 0.06), SHELF);
        }
    }
    for y in [0.2, 1.0, 1.8] {
        let (low, high) = (Vec3::new(from - 0.05, y, z - 0.38), Vec3::new(to + 0.05, y, z + 0.38));
        s.cuboid(low, high + Vec3::Y * 0.04, SHELF);
        let mut x = from + 0.08;
        while x < to - 0.75 {
            let wide = 0.3 + 0.35 * rng.next_f32();
            let size = Vec3::new(wide, 0.25 + 0.35 * rng.next_f32(), 0.4 + 0.3 * rng.next_f32());
            if rng.next_f32() < 0.8 {
                let low = Vec3::new(x, y + 0.039, z - 0.5 * size.z);
                s.cuboid(low, low + size, BOX + rng.below(4) as u32);
            }
            x += wide + 0.04 + 0.1 * rng.next_f32();
        }
    }
}
