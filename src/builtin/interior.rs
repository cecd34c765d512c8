//! A hall and a gallery beside it, full of mouldings, lit only through the gallery's deep windows.
//!
//! Metres, y up. Hall x 0–8, y 0–4, z 0–5; behind it, three steps up, the gallery z 5.4–7.6 with
//! four windows in a wall 0.5 m thick. Between them a colonnade with fluted columns and
//! balustrades. Coffered ceiling, cornices, panelled walls. The shell is one closed solid with no
//! opening but the windows: with a high sun from +z no direct light reaches the hall, so indirect
//! light dominates there.
//! Knob  `detail` (default 1): multiplies the segments of all round parts; 1 makes about 90 000
//!       triangles, the count grows with its square.

use glam::{Vec2, Vec3};
use serde::Deserialize;

use super::solid::Solids;
use super::{Generated, diffuse};

/// Parameters of the interior.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct InteriorParameters {
    /// Multiplies the segments of round parts, 0.25–8.
    pub detail: f32,
}

impl Default for InteriorParameters {
    fn default() -> Self {
        Self { detail: 1.0 }
    }
}

const NAMES: [(&str, [f32; 3]); 7] = [
    ("plaster", [0.80, 0.77, 0.70]),
    ("paint", [0.55, 0.66, 0.58]),
    ("stone", [0.66, 0.60, 0.50]),
    ("floor", [0.55, 0.38, 0.24]),
    ("wood", [0.45, 0.28, 0.16]),
    ("red", [0.55, 0.10, 0.08]),
    ("outside", [0.50, 0.50, 0.50]),
];
const PLASTER: u32 = 0;
const PAINT: u32 = 1;
const STONE: u32 = 2;
const FLOOR: u32 = 3;
const WOOD: u32 = 4;
const RED: u32 = 5;
const OUTSIDE: u32 = 6;

const WINDOWS: [f32; 4] = [1.0, 3.0, 5.0, 7.0];
const COLUMNS: [f32; 4] = [1.0, 3.0, 5.0, 7.0];
const GALLERY_FLOOR: f32 = 0.45;

/// Makes the interior.
///
/// # Errors
/// When `detail` is out of range.
pub fn interior(p: &InteriorParameters) -> Result<Generated, String> {
    if !(0.25..=8.0).contains(&p.detail) {
        return Err(format!("detail is {} but must lie from 0.25 to 8", p.detail));
    }
    let segments = |n: u32| ((n as f32 * p.detail).round() as u32).max(4);
    let mut s = Solids::default();
    shell(&mut s);
    ceiling(&mut s, p.detail);
    walls(&mut s);
    for x in COLUMNS {
        column(&mut s, Vec3::new(x, GALLERY_FLOOR, 5.2), 3.3 - GALLERY_FLOOR, &segments);
    }
    for (from, to) in [(1.0, 3.0), (5.0, 7.0)] {
        balustrade(&mut s, from + 0.2, to - 0.2, &segments);
    }
    furniture(&mut s, &segments);
    Ok(Generated { mesh: s.mesh, materials: diffuse(&NAMES), ..Generated::default() })
}

/// Floor, walls with thickness, ceiling, steps: one solid on a grid.
fn shell(s: &mut Solids) {
    let mut xs = vec![-0.4, 0.0, 0.8, 3.2, 4.8, 7.2, 8.0, 8.4];
    for w in WINDOWS {
        xs.extend([w - 0.45, w + 0.45]);
    }
    xs.sort_by(f32::total_cmp);
    let ys = [-0.4, 0.0, 0.15, 0.3, GALLERY_FLOOR, 1.1, 3.3, 4.0, 4.5];
    let zs = [-0.4, 0.0, 4.1, 4.4, 4.7, 5.0, 5.4, 7.6, 8.1];
    let middle = |l: &[f32], i: usize| (l[i] + l[i + 1]) * 0.5;
    let filled = |[i, j, k]: [usize; 3]| {
        let (x, y, z) = (middle(&xs, i), middle(&ys, j), middle(&zs, k));
        let inside = x > 0.0 && x < 8.0 && y < 4.0;
        let hall = inside && y > 0.0 && z > 0.0 && z < 5.0;
        let gallery = inside && y > GALLERY_FLOOR && z > 5.4 && z < 7.6;
        let opening = x > 0.8 && x < 7.2 && y > GALLERY_FLOOR && y < 3.3 && z > 5.0 && z < 5.4;
        let window = WINDOWS.iter().any(|w| (x - w).abs() < 0.45) && y > 1.1 && y < 3.3 && z > 7.6;
        let steps = x > 3.2
            && x < 4.8
            && z < 5.0
            && ((z > 4.1 && y < 0.15) || (z > 4.4 && y < 0.3) || (z > 4.7 && y < GALLERY_FLOOR));
        !(hall && !steps || gallery || opening || window)
    };
    s.grid([&xs, &ys, &zs], filled, |c, n| {
        let outside =
            c.x < -0.3 || c.x > 8.3 || c.y < -0.3 || c.y > 4.4 || c.z < -0.3 || c.z > 8.05;
        if outside {
            OUTSIDE
        } else if n.y > 0.5 {
            if c.z < 4.05 || (c.z < 5.0 && c.y < 0.1) { FLOOR } else { STONE }
        } else if n.y < -0.5 || c.z > 5.05 {
            PLASTER
        } else if c.z > 4.0 && c.z < 4.95 && c.y < GALLERY_FLOOR && c.x > 3.0 && c.x < 5.0 {
            STONE
        } else {
            PAINT
        }
    });
}

/// A lattice of beams with a moulding in every coffer, and the cornice.
fn ceiling(s: &mut Solids, detail: f32) {
    let (nx, nz) = (
        ((6.0 * detail.sqrt()).round() as usize).max(2),
        ((4.0 * detail.sqrt()).round() as usize).max(2),
    );
    let beam = 0.22;
    let lines = |n: usize, length: f32| -> Vec<f32> {
        let pitch = (length - beam) / n as f32;
        let mut l = vec![-0.02];
        for i in 0..=n {
            let start = i as f32 * pitch;
            if i > 0 {
                l.push(start);
            }
            l.push(if i == n { length + 0.02 } else { start + beam });
        }
        l
    };
    let (xs, zs) = (lines(nx, 8.0), lines(nz, 5.0));
    s.grid([&xs, &[3.72, 4.02], &zs], |[i, _, k]| i % 2 == 0 || k % 2 == 0, |_, _| PLASTER);
    let profile: Vec<Vec2> = [
        (-0.01, -0.02),
        (-0.01, 0.12),
        (0.03, 0.12),
        (0.035, 0.09),
        (0.06, 0.07),
        (0.085, 0.06),
        (0.09, 0.03),
        (0.12, -0.02),
    ]
    .map(Vec2::from)
    .into();
    for i in (1..xs.len() - 1).step_by(2) {
        for k in (1..zs.len() - 1).step_by(2) {
            let (w, d) = (xs[i + 1] - xs[i], zs[k + 1] - zs[k]);
            s.frame(Vec3::new(xs[i], 4.0, zs[k]), Vec3::X * w, Vec3::Z * d, &profile, PLASTER);
            let rose = [
                (0.02, -0.02),
                (0.16, -0.02),
                (0.16, 0.02),
                (0.12, 0.04),
                (0.07, 0.045),
                (0.05, 0.07),
                (0.02, 0.08),
            ];
            let around = ((20.0 * detail).round() as u32).max(6);
            let rose: Vec<Vec2> =
                rose.iter().map(|&(r, h): &(f32, f32)| Vec2::new(r, -h)).collect();
            s.lathe(
                Vec3::new((xs[i] + xs[i + 1]) * 0.5, 4.0, (zs[k] + zs[k + 1]) * 0.5),
                &rose,
                around,
                |a, p| 1.0 + 0.12 * (p.x / 0.16) * (8.0 * a).cos(),
                PLASTER,
            );
        }
    }
    let cornice: Vec<Vec2> = [
        (-0.02, 0.27),
        (0.28, 0.27),
        (0.28, 0.33),
        (0.26, 0.35),
        (0.21, 0.37),
        (0.17, 0.42),
        (0.15, 0.48),
        (0.10, 0.50),
        (0.10, 0.53),
        (0.05, 0.56),
        (0.04, 0.62),
        (-0.02, 0.62),
    ]
    .map(Vec2::from)
    .into();
    s.frame(Vec3::new(0.0, 4.0, 0.0), Vec3::X * 8.0, Vec3::Z * 5.0, &cornice, PLASTER);
    s.frame(Vec3::new(0.0, 4.27, 5.4), Vec3::X * 8.0, Vec3::Z * 2.2, &cornice, PLASTER);
}

/// Panels framed by mouldings, skirting and dado rail on the three closed walls of the hall; window
/// bars.
fn walls(s: &mut Solids) {
    let panel: Vec<Vec2> = [
        (0.0, -0.02),
        (0.0, 0.02),
        (0.015, 0.035),
        (0.035, 0.04),
        (0.05, 0.03),
        (0.06, 0.015),
        (0.075, 0.012),
        (0.08, -0.02),
    ]
    .map(Vec2::from)
    .into();
    let field: Vec<Vec2> =
        [(0.13, -0.02), (0.13, 0.008), (0.15, 0.02), (0.17, 0.02), (0.18, -0.02)]
            .map(Vec2::from)
            .into();
    // Wall frames: (corner on the floor, direction along the wall, length); the room lies towards
    // along × up.
    let sides = [
        (Vec3::new(8.0, 0.0, 0.0), Vec3::NEG_X, 8.0, 6),
        (Vec3::ZERO, Vec3::Z, 5.0, 4),
        (Vec3::new(8.0, 0.0, 5.0), Vec3::NEG_Z, 5.0, 4),
    ];
    for (corner, along, length, count) in sides {
        let inwards = -along.cross(Vec3::Y);
        let pitch = (length - 0.2) / count as f32;
        for i in 0..count {
            for (low, high) in [(0.28, 0.92), (1.18, 3.2)] {
                let at = corner + along * (0.1 + i as f32 * pitch + 0.08) + Vec3::Y * low;
                let (e1, e2) = (along * (pitch - 0.16), Vec3::Y * (high - low));
                // The frame rises along edge1 × edge2, which must point into the room.
                let (at, e1) =
                    if e1.cross(e2).dot(inwards) > 0.0 { (at, e1) } else { (at + e1, -e1) };
                s.frame(at, e1, e2, &panel, WOOD);
                s.frame(at, e1, e2, &field, PLASTER);
            }
        }
        let skirting: Vec<Vec2> =
            [(-0.02, -0.02), (0.05, -0.02), (0.05, 0.13), (0.035, 0.16), (0.02, 0.2), (-0.02, 0.2)]
                .map(Vec2::from)
                .into();
        let dado: Vec<Vec2> = [
            (-0.02, 0.98),
            (0.03, 0.98),
            (0.05, 1.01),
            (0.07, 1.05),
            (0.05, 1.08),
            (0.02, 1.1),
            (-0.02, 1.1),
        ]
        .map(Vec2::from)
        .into();
        // Rails end inside the neighbouring walls' rails without lying on their faces.
        let (from, to) = (corner + along * 0.011, corner + along * (length - 0.013));
        s.bar(from, to, inwards, Vec3::Y, &skirting, WOOD);
        s.bar(from, to, inwards, Vec3::Y, &dado, WOOD);
    }
    for w in WINDOWS {
        s.cuboid(Vec3::new(w - 0.02, 1.08, 7.82), Vec3::new(w + 0.02, 3.32, 7.86), WOOD);
        for y in [1.65, 2.2, 2.75] {
            s.cuboid(
                Vec3::new(w - 0.47, y - 0.015, 7.825),
                Vec3::new(w + 0.47, y + 0.015, 7.855),
                WOOD,
            );
        }
    }
}

/// A fluted column with base and capital, `height` tall.
fn column(s: &mut Solids, foot: Vec3, height: f32, segments: &impl Fn(u32) -> u32) {
    let (radius, flutes) = (0.15, 20.0);
    s.cuboid(foot + Vec3::new(-0.195, -0.02, -0.195), foot + Vec3::new(0.195, 0.08, 0.195), STONE);
    s.cuboid(
        foot + Vec3::new(-0.195, height - 0.07, -0.195),
        foot + Vec3::new(0.195, height + 0.02, 0.195),
        STONE,
    );
    let mut base = vec![Vec2::new(0.185, 0.07)];
    let bulge = |from: f32, tall: f32, r: f32, out: f32, base: &mut Vec<Vec2>| {
        let n = segments(6);
        for i in 0..=n {
            let a = std::f32::consts::PI * i as f32 / n as f32;
            base.push(Vec2::new(r + out * a.sin(), from + tall * (1.0 - a.cos()) * 0.5));
        }
    };
    bulge(0.08, 0.07, 0.175, 0.015, &mut base);
    bulge(0.16, 0.03, 0.165, -0.01, &mut base);
    bulge(0.20, 0.05, 0.165, 0.012, &mut base);
    base.push(Vec2::new(0.12, 0.27));
    s.lathe(foot, &base, segments(48), |_, _| 1.0, STONE);
    let mut capital = vec![Vec2::new(0.11, height - 0.30)];
    bulge(height - 0.29, 0.03, 0.145, 0.012, &mut capital);
    bulge(height - 0.22, 0.02, 0.145, 0.008, &mut capital);
    let n = segments(8);
    for i in 0..=n {
        let t = i as f32 / n as f32;
        capital.push(Vec2::new(
            0.145 + 0.045 * (t * std::f32::consts::FRAC_PI_2).sin(),
            height - 0.18 + 0.10 * t,
        ));
    }
    capital.push(Vec2::new(0.17, height - 0.06));
    s.lathe(foot, &capital, segments(48), |_, _| 1.0, STONE);
    let rings = segments(24);
    let shaft: Vec<Vec2> = (0..=rings)
        .map(|i| {
            let t = i as f32 / rings as f32;
            Vec2::new(radius * (1.0 - 0.14 * t * t), 0.26 + (height - 0.54) * t)
        })
        .collect();
    let (low, high) = (0.26, height - 0.28);
    let flute = |a: f32, p: Vec2| {
        let ends = ((p.y - low) / 0.12).min((high - p.y) / 0.12).clamp(0.0, 1.0);
        1.0 - 0.075 * (0.5 + 0.5 * (flutes * a).cos()).sqrt() * ends.sqrt()
    };
    s.lathe(foot, &shaft, segments(120), flute, STONE);
}

/// Balusters under a rail from x = `from` to `to`.
fn balustrade(s: &mut Solids, from: f32, to: f32, segments: &impl Fn(u32) -> u32) {
    let (z, foot) = (5.2, GALLERY_FLOOR);
    let rail: Vec<Vec2> = [
        (-0.10, 0.72),
        (0.10, 0.72),
        (0.12, 0.76),
        (0.12, 0.80),
        (0.09, 0.84),
        (-0.09, 0.84),
        (-0.12, 0.80),
        (-0.12, 0.76),
    ]
    .map(Vec2::from)
    .into();
    let (start, end) = (Vec3::new(from - 0.1, foot, z), Vec3::new(to + 0.1, foot, z));
    s.bar(start, end, Vec3::Z, Vec3::Y, &rail, STONE);
    let plinth: Vec<Vec2> =
        [(-0.09, -0.02), (0.09, -0.02), (0.09, 0.06), (0.07, 0.09), (-0.07, 0.09), (-0.09, 0.06)]
            .map(Vec2::from)
            .into();
    s.bar(start, end, Vec3::Z, Vec3::Y, &plinth, STONE);
    let count = 9;
    let rings = segments(30);
    let profile: Vec<Vec2> = (0..=rings)
        .map(|i| {
            let t = i as f32 / rings as f32;
            let belly = 0.034 * (-((t - 0.32) / 0.17).powi(2)).exp();
            let collar = 0.014
                * ((-((t - 0.08) / 0.03).powi(2)).exp()
                    + (-((t - 0.72) / 0.03).powi(2)).exp()
                    + (-((t - 0.93) / 0.05).powi(2)).exp());
            Vec2::new(0.026 + belly + collar, 0.08 + 0.65 * t)
        })
        .collect();
    for i in 0..count {
        let x = from + (to - from) * (i as f32 + 0.5) / count as f32;
        s.lathe(Vec3::new(x, foot, z), &profile, segments(20), |_, _| 1.0, PLASTER);
    }
}

/// A vase on a pedestal, a bench, a table.
fn furniture(s: &mut Solids, segments: &impl Fn(u32) -> u32) {
    let foot = Vec3::new(6.6, 0.0, 1.5);
    s.cuboid(foot + Vec3::new(-0.3, -0.02, -0.3), foot + Vec3::new(0.3, 0.12, 0.3), STONE);
    s.cuboid(foot + Vec3::new(-0.23, 0.10, -0.23), foot + Vec3::new(0.23, 0.92, 0.23), STONE);
    s.cuboid(foot + Vec3::new(-0.29, 0.90, -0.29), foot + Vec3::new(0.29, 1.0, 0.29), STONE);
    let n = segments(48);
    let outer = (0..=n).map(|i| {
        let t = i as f32 / n as f32;
        let body = 0.21 * (-((t - 0.55) / 0.27).powi(2)).exp();
        Vec2::new(0.05 + body + 0.06 * (1.0 - t).powi(8) + 0.09 * t.powi(10), 0.98 + 0.72 * t)
    });
    let outer: Vec<Vec2> = outer.collect();
    let inner =
        outer.iter().rev().take(n as usize * 3 / 4).map(|p| Vec2::new(p.x - 0.018, p.y + 0.004));
    let vase: Vec<Vec2> = outer.iter().copied().chain(inner).collect();
    s.lathe(
        foot,
        &vase,
        segments(72),
        |a, p| {
            1.0 + 0.03
                * (24.0 * a).cos()
                * ((p.y - 1.1) * 4.0).clamp(0.0, 1.0)
                * ((1.6 - p.y) * 4.0).clamp(0.0, 1.0)
        },
        RED,
    );
    let bench = Vec3::new(4.3, 0.0, 0.55);
    s.cuboid(bench + Vec3::new(-0.9, 0.42, -0.22), bench + Vec3::new(0.9, 0.5, 0.22), RED);
    s.cuboid(bench + Vec3::new(-0.88, 0.36, -0.20), bench + Vec3::new(0.88, 0.43, 0.20), WOOD);
    let leg: Vec<Vec2> = (0..=segments(16))
        .map(|i| {
            let t = i as f32 / segments(16) as f32;
            Vec2::new(0.025 + 0.02 * (9.0 * t).sin().abs() * (1.0 - 0.5 * t), -0.01 + 0.39 * t)
        })
        .collect();
    for (x, z) in [(-0.8, -0.13), (0.8, -0.13), (-0.8, 0.13), (0.8, 0.13)] {
        s.lathe(bench + Vec3::new(x, 0.0, z), &leg, segments(16), |_, _| 1.0, WOOD);
    }
}
