//! A corridor with doors, radiators and pictures; the only lamp hangs round its corner.
//!
//! Metres, y up. The leg with the camera: x 0–10, z 0–2, y 0–2.7; round the corner the second leg:
//! x 8–10, z 2–9, whose ceiling holds a lamp near z = 7. Light reaches the camera's end after two
//! bounces and more, all of it through the corner.
//! Knob  `detail` (default 1, 0.25–8) multiplies the segments of all round parts.

use glam::{Vec2, Vec3};
use serde::Deserialize;

use super::solid::Solids;
use super::{Generated, diffuse};
use crate::radiometry::Rgb;

/// Parameters of the corridor.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CorridorParameters {
    /// Multiplies the segments of round parts, 0.25–8.
    pub detail: f32,
}

impl Default for CorridorParameters {
    fn default() -> Self {
        Self { detail: 1.0 }
    }
}

const NAMES: [(&str, [f32; 3]); 9] = [
    ("wall", [0.78, 0.76, 0.70]),
    ("ceiling", [0.82, 0.82, 0.80]),
    ("floor", [0.42, 0.36, 0.30]),
    ("door", [0.20, 0.34, 0.30]),
    ("frame", [0.72, 0.70, 0.64]),
    ("radiator", [0.80, 0.80, 0.78]),
    ("picture", [0.60, 0.22, 0.12]),
    ("steel", [0.45, 0.45, 0.46]),
    ("lamp", [0.80, 0.80, 0.80]),
];
const WALL: u32 = 0;
const CEILING: u32 = 1;
const FLOOR: u32 = 2;
const DOOR: u32 = 3;
const FRAME: u32 = 4;
const RADIATOR: u32 = 5;
const PICTURE: u32 = 6;
const STEEL: u32 = 7;
const LAMP: u32 = 8;
const HIGH: f32 = 2.7;

/// Makes the corridor.
///
/// # Errors
/// When `detail` is out of range.
pub fn corridor(p: &CorridorParameters) -> Result<Generated, String> {
    if !(0.25..=8.0).contains(&p.detail) {
        return Err(format!("detail is {} but must lie from 0.25 to 8", p.detail));
    }
    let round = ((24.0 * p.detail).round() as u32).max(6);
    let mut s = Solids::default();
    shell(&mut s);
    for (i, x) in [1.6, 4.0, 6.4].into_iter().enumerate() {
        door(&mut s, Vec3::new(x, 0.0, 0.0), Vec3::X, Vec3::Z, round);
        if i < 2 {
            door(&mut s, Vec3::new(x + 1.2, 0.0, 2.0), Vec3::NEG_X, Vec3::NEG_Z, round);
        }
    }
    door(&mut s, Vec3::new(10.0, 0.0, 4.8), Vec3::Z, Vec3::NEG_X, round);
    for x in [0.35, 4.5, 6.2] {
        radiator(&mut s, Vec3::new(x, 0.0, 2.0), round);
    }
    for (x, wide) in [(3.2, 0.5), (5.55, 0.7), (7.9, 0.45)] {
        picture(&mut s, Vec3::new(x, 1.25, 0.0), wide);
    }
    // Handrails at the wall z = 2, and the pipe above.
    let tube = |s: &mut Solids, from: Vec3, to: Vec3, radius: f32| {
        let ring = |at: Vec3| {
            let angles = (0..round).map(|i| std::f32::consts::TAU * i as f32 / round as f32);
            angles.map(|a| at + radius * Vec3::new(0.0, a.cos(), a.sin())).collect()
        };
        s.tube(&[ring(from), ring(to)], false, STEEL);
    };
    tube(&mut s, Vec3::new(-0.01, 2.45, 0.12), Vec3::new(10.01, 2.45, 0.12), 0.045);
    tube(&mut s, Vec3::new(-0.01, 2.30, 0.10), Vec3::new(10.01, 2.30, 0.10), 0.025);
    // The lamp: a flat box whose lower face shines.
    let (low, high) = (Vec3::new(8.7, HIGH - 0.12, 6.4), Vec3::new(9.3, HIGH + 0.01, 7.6));
    s.cuboid(low, high, STEEL);
    let first = s.mesh.triangles.len() - 12;
    for t in first..s.mesh.triangles.len() {
        if s.mesh.triangles[t].iter().all(|&i| s.mesh.positions[i as usize].y == low.y) {
            s.mesh.materials[t] = LAMP;
        }
    }
    let mut materials = diffuse(&NAMES);
    materials[LAMP as usize].emission = Rgb::new(300.0, 270.0, 220.0);
    Ok(Generated { mesh: s.mesh, materials, ..Generated::default() })
}

/// Floor, walls and ceiling with thickness, skirting: the two legs are one hollow.
fn shell(s: &mut Solids) {
    let (xs, ys, zs) =
        ([-0.3, 0.0, 8.0, 10.0, 10.3], [-0.3, 0.0, HIGH, HIGH + 0.3], [-0.3, 0.0, 2.0, 9.0, 9.3]);
    let filled = |[i, j, k]: [usize; 3]| {
        let first = (i == 1 || i == 2) && k == 1;
        let second = i == 2 && k == 2;
        !(j == 1 && (first || second))
    };
    s.grid([&xs, &ys, &zs], filled, |_, n| {
        if n.y > 0.5 {
            FLOOR
        } else if n.y < -0.5 {
            CEILING
        } else {
            WALL
        }
    });
    let skirting: Vec<Vec2> =
        [(-0.01, -0.01), (0.02, -0.01), (0.02, 0.10), (0.008, 0.13), (-0.01, 0.13)]
            .map(Vec2::from)
            .into();
    for (from, to, out) in [
        ((-0.01, 2.0), (8.0, 2.0), Vec3::NEG_Z),
        ((8.0, 2.0), (8.0, 9.01), Vec3::X),
        ((10.0, -0.01), (10.0, 4.7), Vec3::NEG_X),
        ((10.0, 6.0), (10.0, 9.01), Vec3::NEG_X),
    ] {
        let at = |(x, z): (f32, f32)| Vec3::new(x, 0.0, z);
        s.bar(at(from), at(to), out, Vec3::Y, &skirting, FRAME);
    }
}

/// A panelled door 0.9 m wide with its frame and handle; `along` runs to the hinges, `out` into
/// the corridor.
fn door(s: &mut Solids, foot: Vec3, along: Vec3, out: Vec3, round: u32) {
    let mut block = |from: Vec3, to: Vec3, material: u32| {
        let at = |p: Vec3| foot + along * p.x + Vec3::Y * p.y + out * p.z;
        let (a, b) = (at(from), at(to));
        s.cuboid(a.min(b), a.max(b), material);
    };
    block(Vec3::new(0.0, -0.01, -0.05), Vec3::new(0.9, 2.05, 0.025), DOOR);
    block(Vec3::new(-0.09, -0.01, -0.05), Vec3::new(0.005, 2.055, 0.06), FRAME);
    block(Vec3::new(0.895, -0.01, -0.05), Vec3::new(0.99, 2.055, 0.06), FRAME);
    block(Vec3::new(-0.095, 2.045, -0.05), Vec3::new(0.995, 2.15, 0.062), FRAME);
    for (low, high) in [(0.18, 0.85), (1.0, 1.9)] {
        for (left, right) in [(0.1, 0.42), (0.48, 0.8)] {
            let (a, b) = (Vec3::new(left, low, 0.02), Vec3::new(right, high, 0.032));
            block(a, b, DOOR);
            let inset = Vec3::new(0.05, 0.05, -0.001);
            block(a + inset, b - inset + Vec3::Z * 0.012, DOOR);
        }
    }
    let knob = [(0.0, 0.0), (0.012, 0.0), (0.012, 0.03), (0.03, 0.04), (0.03, 0.06), (0.01, 0.075)];
    let (side, up) = (along, Vec3::Y);
    let center = foot + along * 0.82 + Vec3::Y * 0.98 + out * 0.02;
    let rings: Vec<Vec<Vec3>> = knob[1..]
        .iter()
        .map(|&(r, d)| {
            let angles = (0..round).map(|i| std::f32::consts::TAU * i as f32 / round as f32);
            angles.map(|a| center + out * d + r * (a.cos() * side + a.sin() * up)).collect()
        })
        .collect();
    s.tube(&rings, false, STEEL);
}

/// A radiator of columns below z = 2.
fn radiator(s: &mut Solids, foot: Vec3, round: u32) {
    let profile: Vec<Vec2> =
        [(0.022, 0.0), (0.03, 0.02), (0.03, 0.53), (0.022, 0.55)].map(Vec2::from).into();
    for i in 0..14 {
        let at = foot + Vec3::new(0.07 * i as f32, 0.12, -0.09);
        s.lathe(at, &profile, round.min(16), |_, _| 1.0, RADIATOR);
    }
    for y in [0.16, 0.58] {
        let at = foot + Vec3::new(-0.02, y, -0.1);
        s.cuboid(at, at + Vec3::new(0.95, 0.03, 0.02), RADIATOR);
    }
    s.cuboid(foot + Vec3::new(0.1, 0.3, -0.085), foot + Vec3::new(0.14, 0.33, 0.01), RADIATOR);
    s.cuboid(foot + Vec3::new(0.8, 0.3, -0.085), foot + Vec3::new(0.84, 0.33, 0.01), RADIATOR);
}

/// A framed picture at the wall z = 0.
fn picture(s: &mut Solids, corner: Vec3, wide: f32) {
    let high = 0.6;
    s.cuboid(
        corner + Vec3::new(0.02, 0.02, -0.01),
        corner + Vec3::new(wide - 0.02, high - 0.02, 0.012),
        PICTURE,
    );
    let profile: Vec<Vec2> =
        [(0.0, -0.01), (0.045, -0.01), (0.045, 0.015), (0.03, 0.03), (0.012, 0.034), (0.0, 0.02)]
            .map(Vec2::from)
            .into();
    s.frame(corner, Vec3::X * wide, Vec3::Y * high, &profile, FRAME);
}
