//! A room whose one wide window looks on a garden through a blind of slats.
//!
//! Metres, y up. Room x 0–5.5, y 0–2.8, z 0–4.5; the window takes most of the wall z = 4.5, and
//! before it hang 54 slats 5 cm deep and 2 mm thick, tilted. Outside: grass, hedges and a white
//! garden wall. Sun and sky enter only between the slats.
//! Knob  `detail` (default 1, 0.25–8) multiplies the segments of all round parts.

use glam::{Vec2, Vec3};
use serde::Deserialize;

use super::solid::Solids;
use super::{Generated, diffuse};
use crate::sampling::{Rng, Stream};

/// Parameters of the garden room.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GardenRoomParameters {
    /// Multiplies the segments of round parts, 0.25–8.
    pub detail: f32,
}

impl Default for GardenRoomParameters {
    fn default() -> Self {
        Self { detail: 1.0 }
    }
}

const NAMES: [(&str, [f32; 3]); 11] = [
    ("wall", [0.80, 0.79, 0.75]),
    ("ceiling", [0.84, 0.84, 0.83]),
    ("floor", [0.46, 0.32, 0.20]),
    ("slat", [0.72, 0.70, 0.64]),
    ("wood", [0.40, 0.25, 0.14]),
    ("linen", [0.66, 0.60, 0.50]),
    ("clay", [0.56, 0.28, 0.16]),
    ("leaf", [0.14, 0.34, 0.10]),
    ("grass", [0.16, 0.30, 0.08]),
    ("garden-wall", [0.74, 0.72, 0.66]),
    ("blue", [0.16, 0.26, 0.46]),
];
const WALL: u32 = 0;
const CEILING: u32 = 1;
const FLOOR: u32 = 2;
const SLAT: u32 = 3;
const WOOD: u32 = 4;
const LINEN: u32 = 5;
const CLAY: u32 = 6;
const LEAF: u32 = 7;
const GRASS: u32 = 8;
const GARDEN_WALL: u32 = 9;
const BLUE: u32 = 10;
const SIZE: Vec3 = Vec3::new(5.5, 2.8, 4.5);

/// Makes the garden room.
///
/// # Errors
/// When `detail` is out of range.
pub fn garden_room(p: &GardenRoomParameters) -> Result<Generated, String> {
    if !(0.25..=8.0).contains(&p.detail) {
        return Err(format!("detail is {} but must lie from 0.25 to 8", p.detail));
    }
    let round = ((28.0 * p.detail).round() as u32).max(6);
    let mut s = Solids::default();
    shell(&mut s);
    blind(&mut s);
    furniture(&mut s, round);
    garden(&mut s, round);
    Ok(Generated { mesh: s.mesh, materials: diffuse(&NAMES), ..Generated::default() })
}

/// The room with its window.
fn shell(s: &mut Solids) {
    let (xs, ys, zs) = (
        [-0.3, 0.0, 0.5, 5.0, SIZE.x, SIZE.x + 0.3],
        [-0.3, 0.0, 0.35, 2.45, SIZE.y, SIZE.y + 0.3],
        [-0.3, 0.0, SIZE.z, SIZE.z + 0.3],
    );
    let filled = |[i, j, k]: [usize; 3]| {
        let room = (1..4).contains(&i) && (1..4).contains(&j) && k == 1;
        let window = i == 2 && j == 2 && k == 2;
        !(room || window)
    };
    s.grid([&xs, &ys, &zs], filled, |c, n| {
        if n.y > 0.5 && c.y < 0.1 {
            FLOOR
        } else if n.y < -0.5 {
            CEILING
        } else {
            WALL
        }
    });
    let skirting: Vec<Vec2> =
        [(-0.01, -0.01), (0.016, -0.01), (0.016, 0.08), (0.006, 0.10), (-0.01, 0.10)]
            .map(Vec2::from)
            .into();
    let corner = Vec3::new(0.0, 0.0, SIZE.z);
    s.frame(corner, Vec3::X * SIZE.x, Vec3::NEG_Z * SIZE.z, &skirting, WALL);
}

/// Slats that are tilted downwards to the garden, two cords and a head rail.
fn blind(s: &mut Solids) {
    let z = SIZE.z - 0.06;
    let tilt = Vec3::new(0.0, -0.5, 0.866);
    let up = Vec3::new(0.0, 0.866, 0.5);
    let half: Vec<Vec2> =
        [(-0.025, -0.001), (0.025, -0.001), (0.025, 0.001), (-0.025, 0.001)].map(Vec2::from).into();
    for i in 0..54 {
        let y = 0.32 + 0.04 * i as f32;
        s.bar(Vec3::new(0.45, y, z), Vec3::new(5.05, y, z), tilt, up, &half, SLAT);
    }
    for x in [0.9, 2.75, 4.6] {
        s.cuboid(Vec3::new(x, 0.30, z - 0.002), Vec3::new(x + 0.004, 2.5, z + 0.002), SLAT);
    }
    s.cuboid(Vec3::new(0.43, 2.47, z - 0.03), Vec3::new(5.07, 2.54, z + 0.03), SLAT);
}

/// Table and chairs, a bench with cushions, a plant in a pot, a shelf at the wall.
fn furniture(s: &mut Solids, round: u32) {
    let table = Vec3::new(2.9, 0.0, 2.3);
    let top: Vec<Vec2> =
        [(0.58, 0.72), (0.60, 0.73), (0.60, 0.75), (0.58, 0.76)].map(Vec2::from).into();
    s.lathe(table, &top, 2 * round, |_, _| 1.0, WOOD);
    let foot: Vec<Vec2> = [(0.28, -0.01), (0.28, 0.02), (0.06, 0.08), (0.045, 0.4), (0.07, 0.725)]
        .map(Vec2::from)
        .into();
    s.lathe(table, &foot, round, |_, _| 1.0, WOOD);
    let jug: Vec<Vec2> = [(0.05, 0.0), (0.08, 0.05), (0.075, 0.13), (0.04, 0.2), (0.05, 0.24)]
        .map(Vec2::from)
        .into();
    s.lathe(table + Vec3::new(0.1, 0.758, 0.1), &jug, round, |_, _| 1.0, BLUE);
    for (x, z, back) in [(2.1, 2.2, -1.0), (3.7, 2.4, 1.0)] {
        let at = Vec3::new(x, 0.0, z);
        s.cuboid(at + Vec3::new(-0.2, 0.43, -0.2), at + Vec3::new(0.2, 0.47, 0.2), WOOD);
        for (dx, dz) in [(-0.18, -0.18), (0.18, -0.18), (-0.18, 0.18), (0.18, 0.18)] {
            let leg = at + Vec3::new(dx, 0.0, dz);
            let high = if dx * back > 0.0 { 0.95 } else { 0.44 };
            s.cuboid(
                leg + Vec3::new(-0.017, -0.01, -0.017),
                leg + Vec3::new(0.017, high, 0.017),
                WOOD,
            );
        }
        for y in [0.6, 0.74, 0.88] {
            let bar = at + Vec3::new(0.18 * back, y, 0.0);
            s.cuboid(
                bar + Vec3::new(-0.008, 0.0, -0.175),
                bar + Vec3::new(0.008, 0.06, 0.175),
                WOOD,
            );
        }
    }
    s.cuboid(Vec3::new(-0.01, -0.01, 0.6), Vec3::new(0.62, 0.40, 3.2), WOOD);
    for z in [0.7, 1.55, 2.4] {
        s.cuboid(Vec3::new(0.02, 0.395, z), Vec3::new(0.6, 0.50, z + 0.75), LINEN);
        s.cuboid(Vec3::new(0.02, 0.49, z + 0.1), Vec3::new(0.16, 0.86, z + 0.65), BLUE);
    }
    for y in [1.5, 1.85] {
        s.cuboid(Vec3::new(1.4, y, -0.01), Vec3::new(4.2, y + 0.03, 0.24), WOOD);
    }
    let mut rng = Rng::new(23, Stream::Scene, 13, 0);
    let mut x = 1.45;
    while x < 4.0 {
        let (thick, high) = (0.02 + 0.04 * rng.next_f32(), 0.18 + 0.08 * rng.next_f32());
        let tint = [CLAY, BLUE, LINEN, WOOD][rng.below(4)];
        s.cuboid(Vec3::new(x, 1.528, 0.02), Vec3::new(x + thick, 1.53 + high, 0.19), tint);
        x += thick + 0.003;
    }
    let pot: Vec<Vec2> =
        [(0.14, -0.01), (0.20, 0.34), (0.22, 0.34), (0.22, 0.40), (0.17, 0.40), (0.15, 0.33)]
            .map(Vec2::from)
            .into();
    let at = Vec3::new(4.95, 0.0, 3.85);
    s.lathe(at, &pot, round, |_, _| 1.0, CLAY);
    for i in 0..26 {
        let angle = 2.4 * i as f32;
        let out = Vec3::new(angle.cos(), 0.0, angle.sin());
        let side = Vec3::new(-angle.sin(), 0.0, angle.cos());
        let rise = 0.5 + 0.035 * i as f32;
        let ring = |t: f32, wide: f32| {
            let c = at + Vec3::Y * (0.3 + rise * t) + out * (0.1 + 0.42 * t * t);
            let w = side * wide;
            vec![c - w, c - out * 0.004, c + w, c + out * 0.004]
        };
        s.tube(
            &[ring(0.0, 0.01), ring(0.4, 0.04), ring(0.75, 0.045), ring(1.0, 0.006)],
            false,
            LEAF,
        );
    }
}

/// Grass, a wall at its end, hedges as balls.
fn garden(s: &mut Solids, round: u32) {
    s.cuboid(Vec3::new(-8.0, -0.4, 4.75), Vec3::new(14.0, -0.1, 16.0), GRASS);
    s.cuboid(Vec3::new(-8.0, -0.2, 13.0), Vec3::new(14.0, 2.2, 13.3), GARDEN_WALL);
    for (i, x) in [-2.0, 0.4, 2.2, 4.4, 6.9, 9.0].into_iter().enumerate() {
        let r = 0.7 + 0.15 * (i % 3) as f32;
        let ball: Vec<Vec2> = (1..12)
            .map(|k| {
                let a = std::f32::consts::PI * k as f32 / 12.0;
                Vec2::new(r * a.sin(), r * (1.0 - a.cos()) - 0.3)
            })
            .collect();
        s.lathe(Vec3::new(x, 0.0, 10.0 + 0.6 * (i % 2) as f32), &ball, round, |_, _| 1.0, LEAF);
    }
}
