//! A dark round church below a bright dome.
//!
//! Metres, y up. Nave of radius 9, walls to 9 m, a gallery on a ring of columns over a dark
//! ambulatory; above it a drum of 16 piers with windows between them, and the dome, which the sun
//! and the sky light through the windows and the lantern's opening. The floor sees the light
//! only as the dome sends it down.
//! Knob  `detail` (default 1, 0.25–8) multiplies the segments of all round parts.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Vec2, Vec3};
use serde::Deserialize;

use super::solid::Solids;
use super::{Generated, diffuse};

/// Parameters of the rotunda.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RotundaParameters {
    /// Multiplies the segments of round parts, 0.25–8.
    pub detail: f32,
}

impl Default for RotundaParameters {
    fn default() -> Self {
        Self { detail: 1.0 }
    }
}

const NAMES: [(&str, [f32; 3]); 6] = [
    ("stone", [0.46, 0.42, 0.36]),
    ("floor", [0.30, 0.26, 0.22]),
    ("dome", [0.84, 0.82, 0.78]),
    ("marble", [0.58, 0.56, 0.54]),
    ("wood", [0.22, 0.13, 0.07]),
    ("cloth", [0.50, 0.07, 0.06]),
];
const STONE: u32 = 0;
const FLOOR: u32 = 1;
const DOME: u32 = 2;
const MARBLE: u32 = 3;
const WOOD: u32 = 4;
const CLOTH: u32 = 5;
const PIERS: u32 = 16;

/// Makes the rotunda.
///
/// # Errors
/// When `detail` is out of range.
pub fn rotunda(p: &RotundaParameters) -> Result<Generated, String> {
    if !(0.25..=8.0).contains(&p.detail) {
        return Err(format!("detail is {} but must lie from 0.25 to 8", p.detail));
    }
    let segments = |n: u32| ((n as f32 * p.detail).round() as u32).max(6);
    let mut s = Solids::default();
    let disc = [(0.01, -0.4), (10.0, -0.4), (10.0, 0.0), (0.01, 0.0)].map(Vec2::from);
    s.lathe(Vec3::ZERO, &disc, segments(96), |_, _| 1.0, FLOOR);
    let around = segments(96);
    let ring = |s: &mut Solids, profile: &[(f32, f32)], material: u32| {
        revolve(s, &profile.iter().copied().map(Vec2::from).collect::<Vec<_>>(), around, material);
    };
    ring(&mut s, &[(9.0, -0.1), (9.9, -0.1), (9.9, 9.0), (9.0, 9.0)], STONE);
    // The gallery's floor, its parapet and the cornice below the drum.
    ring(&mut s, &[(6.6, 4.6), (9.05, 4.6), (9.05, 5.0), (6.6, 5.0)], STONE);
    ring(&mut s, &[(6.65, 4.98), (6.85, 4.98), (6.85, 5.9), (6.65, 5.9)], MARBLE);
    ring(&mut s, &[(8.6, 8.9), (9.95, 8.9), (9.95, 9.3), (8.3, 9.3), (8.4, 9.1)], MARBLE);
    for i in 0..PIERS {
        pier(&mut s, TAU * i as f32 / PIERS as f32);
    }
    ring(&mut s, &[(8.4, 12.0), (9.95, 12.0), (9.95, 12.5), (8.2, 12.5)], MARBLE);
    dome(&mut s, segments(24), around);
    for i in 0..12 {
        let angle = TAU * (i as f32 + 0.5) / 12.0;
        column(&mut s, Vec3::new(6.9 * angle.cos(), 0.0, 6.9 * angle.sin()), &segments);
    }
    pews(&mut s);
    altar(&mut s, segments(32));
    Ok(Generated { mesh: s.mesh, materials: diffuse(&NAMES), ..Generated::default() })
}

/// A closed ring about the vertical axis; `profile` is a polygon of (radius, height).
fn revolve(s: &mut Solids, profile: &[Vec2], around: u32, material: u32) {
    let rings: Vec<Vec<Vec3>> = (0..around)
        .map(|i| {
            let (sin, cos) = (TAU * i as f32 / around as f32).sin_cos();
            profile.iter().map(|p| Vec3::new(p.x * cos, p.y, p.x * sin)).collect()
        })
        .collect();
    s.tube(&rings, true, material);
}

/// One pier of the drum: half of the circle is wall, half is window.
fn pier(s: &mut Solids, angle: f32) {
    let half = 0.25 * TAU / PIERS as f32;
    let corner = |r: f32, a: f32, y: f32| Vec3::new(r * a.cos(), y, r * a.sin());
    let section = |y: f32| {
        vec![
            corner(8.8, angle - half, y),
            corner(9.6, angle - half, y),
            corner(9.6, angle + half, y),
            corner(8.8, angle + half, y),
        ]
    };
    s.tube(&[section(9.2), section(12.1)], false, STONE);
}

/// The dome, half a metre thick, with ribs, and a lantern's ring around its opening.
fn dome(s: &mut Solids, steps: u32, around: u32) {
    let foot = 12.45;
    let opening: f32 = 0.9;
    let (inner, outer) = (8.8_f32, 9.4_f32);
    let arc = |radius: f32, i: u32| {
        let last = FRAC_PI_2 - (opening / radius).asin();
        let a = last * i as f32 / steps as f32;
        Vec2::new(radius * a.cos(), foot + radius * a.sin())
    };
    let mut profile: Vec<Vec2> = (0..=steps).map(|i| arc(inner, i)).collect();
    profile.extend((0..=steps).rev().map(|i| arc(outer, i)));
    revolve(s, &profile, around, DOME);
    let top = foot + 8.6;
    let lantern = [(0.8, top), (1.1, top), (1.1, top + 1.4), (0.8, top + 1.4)].map(Vec2::from);
    revolve(s, &lantern, around, DOME);
    for i in 0..PIERS {
        let (sin, cos) = (TAU * i as f32 / PIERS as f32).sin_cos();
        let (out, side) = (Vec3::new(cos, 0.0, sin), Vec3::new(-sin, 0.0, cos));
        let rings: Vec<Vec<Vec3>> = (0..=steps)
            .map(|k| {
                let (a, b) = (arc(inner + 0.1, k), arc(inner - 0.12, k));
                let w = side * 0.15;
                let (a, b) = (out * a.x + Vec3::Y * a.y, out * b.x + Vec3::Y * b.y);
                vec![a - w, b - w * 0.6, b + w * 0.6, a + w]
            })
            .collect();
        s.tube(&rings, false, MARBLE);
    }
}

/// A column below the gallery's edge.
fn column(s: &mut Solids, foot: Vec3, segments: &impl Fn(u32) -> u32) {
    let profile: Vec<Vec2> = [
        (0.42, -0.02),
        (0.42, 0.2),
        (0.33, 0.3),
        (0.28, 0.4),
        (0.25, 3.9),
        (0.32, 4.1),
        (0.42, 4.35),
        (0.42, 4.62),
    ]
    .map(Vec2::from)
    .into();
    s.lathe(foot, &profile, segments(32), |_, _| 1.0, MARBLE);
}

/// Rows of pews on both sides of the middle.
fn pews(s: &mut Solids) {
    for row in 0..6 {
        let x = -3.6 + 1.1 * row as f32;
        let wide = (30.0 - x * x).sqrt().min(4.6);
        for side in [-1.0, 1.0] {
            let (z0, z1) = (side * 0.9, side * wide);
            let mut board = |x0: f32, x1: f32, y0: f32, y1: f32| {
                s.cuboid(Vec3::new(x0, y0, z0.min(z1)), Vec3::new(x1, y1, z0.max(z1)), WOOD);
            };
            board(x, x + 0.42, 0.40, 0.45);
            board(x - 0.05, x + 0.01, 0.2, 0.95);
            board(x - 0.08, x - 0.04, 0.9, 1.0);
            for z in [z0, z1] {
                let low = Vec3::new(x - 0.1, -0.01, z - 0.03);
                s.cuboid(low, low + Vec3::new(0.56, 1.05, 0.06), WOOD);
            }
        }
    }
}

/// Steps, a table with a cloth, two candlesticks.
fn altar(s: &mut Solids, round: u32) {
    let center = Vec3::new(4.6, 0.0, 0.0);
    for (r, y) in [(1.9, 0.15), (1.6, 0.30), (1.3, 0.45)] {
        let step = [(0.01, -0.1 * y), (r, -0.1 * y), (r, y), (0.01, y)].map(Vec2::from);
        s.lathe(center, &step, 2 * round, |_, _| 1.0, MARBLE);
    }
    s.cuboid(center + Vec3::new(-0.4, 0.44, -0.8), center + Vec3::new(0.4, 1.4, 0.8), STONE);
    s.cuboid(center + Vec3::new(-0.45, 1.05, -0.7), center + Vec3::new(0.45, 1.42, 0.7), CLOTH);
    let stick: Vec<Vec2> =
        [(0.09, 0.0), (0.1, 0.03), (0.02, 0.08), (0.02, 0.5), (0.06, 0.56)].map(Vec2::from).into();
    for z in [-0.55, 0.55] {
        s.lathe(center + Vec3::new(0.0, 1.41, z), &stick, round, |_, _| 1.0, MARBLE);
    }
}
