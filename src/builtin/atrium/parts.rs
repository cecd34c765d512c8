//! What stands on the floors: arcades, columns, balustrades, drapes, the fountain and its pots.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Vec2, Vec3};

use super::{
    BAY, LIMESTONE, MARBLE, OCHRE, PLASTER, POMPEIAN, SANDSTONE, Side, Storey, TILE_DARK,
    UPPER_FLOOR,
};
use crate::builtin::cloth::cloth;
use crate::builtin::solid::Solids;

/// Half the thickness of an arcade's wall.
const HALF_WALL: f32 = 0.22;
const ARCH_RADIUS: f32 = 1.2;

/// A tube through `rings` with open ends closed, `material(k)` between ring k and the next.
pub(super) fn banded(s: &mut Solids, rings: &[Vec<Vec3>], material: impl Fn(usize) -> u32) {
    let start = s.mesh.materials.len();
    s.tube(rings, false, material(0));
    for (k, band) in s.mesh.materials[start..].chunks_mut(2 * rings[0].len()).enumerate() {
        band.fill(material(k.min(rings.len() - 2)));
    }
}

/// The wall over a side's columns with its arches, the archivolts, and the pier at the side's first
/// corner.
pub(super) fn arcade(s: &mut Solids, side: &Side, storey: &Storey, segments: &impl Fn(u32) -> u32) {
    let n = segments(24);
    let at = |u: f32, y: f32, out: f32| {
        side.from + side.along * u + Vec3::Y * (storey.floor + y) + side.inwards() * out
    };
    let arch = |bay: u32, i: u32| {
        let angle = PI * i as f32 / n as f32;
        Vec2::new(
            (bay as f32 + 0.5) * BAY - ARCH_RADIUS * angle.cos(),
            storey.spring + ARCH_RADIUS * angle.sin(),
        )
    };
    let mut outline = vec![Vec2::new(0.05, storey.spring)];
    for bay in 0..side.bays {
        outline.extend((0..=n).map(|i| arch(bay, i)));
    }
    outline.push(Vec2::new(side.length() - 0.05, storey.spring));
    let ring = |p: &Vec2| {
        vec![
            at(p.x, p.y, -HALF_WALL),
            at(p.x, storey.top, -HALF_WALL),
            at(p.x, storey.top, HALF_WALL),
            at(p.x, p.y, HALF_WALL),
        ]
    };
    s.tube(&outline.iter().map(ring).collect::<Vec<_>>(), false, PLASTER);
    // (across the arch's radius, out of the wall)
    let moulding: &[Vec2] = if segments(36) < 9 {
        &[(-0.015, -0.03), (-0.015, 0.03), (0.16, 0.05), (0.17, -0.03)].map(Vec2::from)
    } else {
        &[
            (-0.015, -0.03),
            (-0.015, 0.02),
            (0.05, 0.025),
            (0.055, 0.04),
            (0.11, 0.045),
            (0.13, 0.06),
            (0.16, 0.055),
            (0.17, -0.03),
        ]
        .map(Vec2::from)
    };
    for bay in 0..side.bays {
        for face in [-1.0, 1.0] {
            let ring = |i: u32| {
                let angle = PI * i as f32 / n as f32;
                let radial = Vec2::new(-angle.cos(), angle.sin());
                let center = Vec2::new((bay as f32 + 0.5) * BAY, storey.spring);
                moulding
                    .iter()
                    .map(|m| {
                        let p = center + radial * (ARCH_RADIUS + m.x);
                        at(p.x, p.y, face * (HALF_WALL + m.y))
                    })
                    .collect()
            };
            // Voussoirs in two stones.
            banded(s, &(0..=n).map(ring).collect::<Vec<_>>(), |k| {
                if (k as u32 * 15 / n).is_multiple_of(2) { LIMESTONE } else { SANDSTONE }
            });
        }
    }
    let pier = |s: &mut Solids, half: f32, low: f32, high: f32, material| {
        let c = side.from + Vec3::Y * storey.floor;
        s.cuboid(c + Vec3::new(-half, low, -half), c + Vec3::new(half, high, half), material);
    };
    pier(s, 0.30, -0.03, storey.top + 0.01, PLASTER);
    pier(s, 0.36, -0.04, 0.25, MARBLE);
    pier(s, 0.35, storey.spring - 0.14, storey.spring + 0.02, LIMESTONE);
}

/// Points of a half-round moulding: from height `low`, `tall`, on radius `r`, bulging by `out`.
fn torus(profile: &mut Vec<Vec2>, n: u32, low: f32, tall: f32, r: f32, out: f32) {
    profile.extend((0..=n).map(|i| {
        let a = PI * i as f32 / n as f32;
        Vec2::new(r + out * a.sin(), low + 0.5 * tall * (1.0 - a.cos()))
    }));
}

/// A fluted column with base and leafed capital.
pub(super) fn column(s: &mut Solids, foot: Vec3, storey: &Storey, segments: &impl Fn(u32) -> u32) {
    let (r, low, top) = (storey.radius, storey.column_foot, storey.spring);
    let square = |s: &mut Solids, half: f32, from: f32, to: f32, material| {
        s.cuboid(foot + Vec3::new(-half, from, -half), foot + Vec3::new(half, to, half), material);
    };
    if low > 0.0 {
        square(s, 0.24, -0.03, low - 0.05, MARBLE);
        square(s, 0.28, -0.04, 0.12, MARBLE);
        square(s, 0.27, low - 0.09, low + 0.005, MARBLE);
    }
    square(s, 1.45 * r, low - 0.02, low + 0.4 * r, MARBLE);
    let mut base = vec![Vec2::new(1.2 * r, low + 0.3 * r)];
    torus(&mut base, segments(7), low + 0.42 * r, 0.36 * r, 1.27 * r, 0.12 * r);
    torus(&mut base, segments(5), low + 0.84 * r, 0.16 * r, 1.2 * r, -0.07 * r);
    torus(&mut base, segments(6), low + 1.05 * r, 0.26 * r, 1.15 * r, 0.09 * r);
    base.push(Vec2::new(0.8 * r, low + 1.5 * r));
    let around = segments(36);
    s.lathe(foot, &base, around, |_, _| 1.0, MARBLE);

    let capital = 2.3 * r;
    let (shaft_low, shaft_high) = (low + 1.38 * r, top - 0.12 - capital);
    let rings = segments(14);
    let shaft: Vec<Vec2> = (0..=rings)
        .map(|i| {
            let t = i as f32 / rings as f32;
            Vec2::new(
                r * (1.0 + 0.02 * (PI * t).sin() - 0.15 * t),
                shaft_low + (shaft_high - shaft_low) * t,
            )
        })
        .collect();
    let flute = |a: f32, p: Vec2| {
        let ends = ((p.y - shaft_low) / 0.1).min((shaft_high - p.y) / 0.1).clamp(0.0, 1.0);
        1.0 - 0.08 * (0.5 + 0.5 * (20.0 * a).cos()).sqrt() * ends.sqrt()
    };
    s.lathe(foot, &shaft, segments(80), flute, LIMESTONE);

    let bell_foot = shaft_high - 0.02;
    let mut bell = vec![Vec2::new(0.7 * r, bell_foot - 0.03)];
    torus(&mut bell, segments(5), bell_foot, 0.18 * r, 0.86 * r, 0.1 * r);
    let n = segments(22);
    bell.extend((0..=n).map(|i| {
        let t = i as f32 / n as f32;
        Vec2::new(
            r * (0.84 + 0.14 * t + 0.42 * t.powi(4)),
            bell_foot + 0.2 * r + (capital - 0.2 * r) * t,
        )
    }));
    bell.push(Vec2::new(r, top - 0.1));
    // Two rows of eight leaves that lean outwards to their tips.
    let leaves = |a: f32, p: Vec2| {
        let t = ((p.y - bell_foot - 0.2 * r) / (capital - 0.2 * r)).clamp(0.0, 1.0);
        let row = |from: f32, to: f32, phase: f32| {
            let h = ((t - from) / (to - from)).clamp(0.0, 1.0);
            let wide = (0.5 + 0.5 * (8.0 * a + phase).cos()).powf(0.6 + 1.5 * h);
            if t > from && t < to { wide * (0.07 + 0.26 * h * h) * (1.0 - h.powi(12)) } else { 0.0 }
        };
        1.0 + row(0.0, 0.42, 0.0).max(row(0.15, 0.75, PI))
    };
    s.lathe(foot, &bell, segments(96), leaves, LIMESTONE);
    // Coarse columns have no volutes.
    for corner in 0..if segments(36) < 9 { 0 } else { 4 } {
        scroll(s, foot + Vec3::Y * (top - 0.12), FRAC_PI_2 * (corner as f32 + 0.5), r, segments);
    }
    square(s, 1.42 * r, top - 0.125, top - 0.07, LIMESTONE);
    square(s, 0.29, top - 0.08, top + 0.03, LIMESTONE);
}

/// A volute under a corner of the abacus: a tapering band rolled up in the vertical plane of
/// `angle`.
fn scroll(s: &mut Solids, center: Vec3, angle: f32, r: f32, segments: &impl Fn(u32) -> u32) {
    let (out, across) =
        (Vec3::new(angle.cos(), 0.0, angle.sin()), Vec3::new(-angle.sin(), 0.0, angle.cos()));
    let eye = center + out * (1.55 * r) - Vec3::Y * (0.42 * r);
    let n = segments(36);
    let rings: Vec<Vec<Vec3>> = (0..=n)
        .map(|i| {
            let t = i as f32 / n as f32;
            let turn = 1.1 * PI - 1.75 * TAU * t;
            let radial = out * turn.cos() + Vec3::Y * turn.sin();
            let (reach, thick, wide) =
                (r * (0.40 - 0.32 * t), r * (0.075 - 0.04 * t), r * (0.17 - 0.05 * t));
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(u, v): (f32, f32)| eye + radial * (reach + thick * u) + across * (wide * v))
                .into()
        })
        .collect();
    s.tube(&rings, false, LIMESTONE);
}

/// Rail, plinth and turned balusters between two columns of the upper storey.
pub(super) fn balustrade(s: &mut Solids, side: &Side, bay: u32, segments: &impl Fn(u32) -> u32) {
    let at = |u: f32| side.from + side.along * (bay as f32 * BAY + u) + Vec3::Y * UPPER_FLOOR;
    let rail: Vec<Vec2> = [
        (-0.12, 0.80),
        (0.12, 0.80),
        (0.15, 0.84),
        (0.15, 0.89),
        (0.11, 0.93),
        (-0.11, 0.93),
        (-0.15, 0.89),
        (-0.15, 0.84),
    ]
    .map(Vec2::from)
    .into();
    let plinth: Vec<Vec2> =
        [(-0.13, -0.02), (0.13, -0.02), (0.13, 0.08), (0.10, 0.12), (-0.10, 0.12), (-0.13, 0.08)]
            .map(Vec2::from)
            .into();
    // Each bay's moulding ends inside the pedestals.
    let (from, to) = (at(0.20), at(BAY - 0.20));
    s.bar(from, to, side.inwards(), Vec3::Y, &rail, MARBLE);
    s.bar(from, to, side.inwards(), Vec3::Y, &plinth, MARBLE);
    let rings = segments(20);
    let profile: Vec<Vec2> = (0..=rings)
        .map(|i| {
            let t = i as f32 / rings as f32;
            let belly = 0.045 * (-((t - 0.33) / 0.17).powi(2)).exp();
            let collar = 0.018
                * ((-((t - 0.06) / 0.04).powi(2)).exp()
                    + (-((t - 0.70) / 0.035).powi(2)).exp()
                    + (-((t - 0.95) / 0.05).powi(2)).exp());
            Vec2::new(0.030 + belly + collar, 0.11 + 0.70 * t)
        })
        .collect();
    let count = segments(36).min(11);
    for i in 0..count {
        let u = 0.32 + (BAY - 0.64) * (i as f32 + 0.5) / count as f32;
        s.lathe(at(u), &profile, segments(12), |_, _| 1.0, MARBLE);
    }
}

/// A cloth hung in an arch, gathered into folds, its lower edge in the storey's upper half.
pub(super) fn drape(
    s: &mut Solids,
    side: &Side,
    bay: u32,
    storey: &Storey,
    material: u32,
    segments: &impl Fn(u32) -> u32,
) {
    let (columns, rows) = (segments(90), segments(24));
    let (top, length) = (storey.spring + 0.05, if storey.floor > 0.0 { 1.25 } else { 1.85 });
    let half = 1.02;
    // Every cloth falls differently.
    let own = 1.7 * bay as f32 + 2.3 * (side.from.x + side.from.z) + storey.floor;
    let point = |i: u32, k: u32, side_of: f32| {
        let (u, v) = (2.0 * i as f32 / columns as f32 - 1.0, k as f32 / rows as f32);
        let phase =
            9.0 * PI * u + 1.1 * (2.0 * v + 1.7 * u + own).sin() + 0.5 * (4.3 * u + own).cos();
        // Folds gather at the pole, open downwards and differ in depth.
        let fold = (0.025 + 0.055 * v) * (1.0 + 0.35 * (2.6 * u + own).sin());
        let sag = 0.05 * (1.0 - u * u) + 0.05 * (5.0 * u + own).sin() * v;
        let p = side.from
            + side.along * ((bay as f32 + 0.5) * BAY + half * u * (1.0 - 0.10 * (PI * v).sin()));
        p + Vec3::Y * (storey.floor + top - length * v - sag * (0.15 + v))
            + side.inwards() * (fold * phase.sin() + 0.004 * side_of)
    };
    cloth(s, [columns, rows], point, material);
    let pole = |from: f32, to: f32| {
        let at = |u: f32| {
            side.from
                + side.along * ((bay as f32 + 0.5) * BAY + u)
                + Vec3::Y * (storey.floor + top - 0.03)
        };
        let profile: Vec<Vec2> =
            (0..8).map(|i| Vec2::from_angle(TAU * i as f32 / 8.0) * 0.022).collect();
        (at(from), at(to), profile)
    };
    let (from, to, profile) = pole(-1.35, 1.35);
    s.bar(from, to, side.inwards(), Vec3::Y, &profile, TILE_DARK);
}

/// A basin on a pedestal in the middle of the court.
pub(super) fn fountain(s: &mut Solids, segments: &impl Fn(u32) -> u32) {
    let foot = Vec3::new(0.0, -0.02, 0.0);
    let pool = [
        (1.55, 0.0),
        (1.55, 0.16),
        (1.48, 0.20),
        (1.48, 0.42),
        (1.56, 0.46),
        (1.58, 0.50),
        (1.54, 0.55),
        (1.36, 0.55),
        (1.34, 0.50),
        (1.34, 0.22),
    ];
    s.lathe(foot, &pool.map(Vec2::from), segments(64), |_, _| 1.0, LIMESTONE);
    let n = segments(28);
    let stem: Vec<Vec2> = (0..=n)
        .map(|i| {
            let t = i as f32 / n as f32;
            Vec2::new(
                0.12 + 0.20 * (1.0 - t).powi(6)
                    + 0.07 * (-((t - 0.55) / 0.1).powi(2)).exp()
                    + 0.12 * t.powi(9),
                0.20 + 0.92 * t,
            )
        })
        .collect();
    s.lathe(
        foot,
        &stem,
        segments(40),
        |a, p| 1.0 + 0.05 * (10.0 * a).cos() * (1.0 - (p.y - 0.66).abs() * 2.0).max(0.0),
        MARBLE,
    );
    let bowl = |from: f32, to: f32, inset: f32| {
        (0..=n).map(move |i| {
            let t = from + (to - from) * i as f32 / n as f32;
            Vec2::new(
                0.16 + 0.66 * (t * FRAC_PI_2).sin() - inset,
                1.10 + 0.34 * t.powf(1.6) + inset,
            )
        })
    };
    let basin: Vec<Vec2> = bowl(0.0, 1.0, 0.0).chain(bowl(1.0, 0.0, 0.035)).collect();
    s.lathe(
        foot,
        &basin,
        segments(72),
        |a, p| 1.0 + 0.025 * (16.0 * a).cos() * ((p.x - 0.3) * 2.0).clamp(0.0, 1.0),
        MARBLE,
    );
}

/// Vases along the court's edge.
pub(super) fn pots(s: &mut Solids, segments: &impl Fn(u32) -> u32) {
    let n = segments(30);
    let outer: Vec<Vec2> = (0..=n)
        .map(|i| {
            let t = i as f32 / n as f32;
            Vec2::new(
                0.16 + 0.16 * (-((t - 0.6) / 0.3).powi(2)).exp() + 0.09 * t.powi(10),
                -0.01 + 0.75 * t,
            )
        })
        .collect();
    let inner =
        outer.iter().rev().take(n as usize * 2 / 3).map(|p| Vec2::new(p.x - 0.03, p.y + 0.004));
    let profile: Vec<Vec2> = outer.iter().copied().chain(inner).collect();
    for (i, x) in [-6.0, -3.0, 3.0, 6.0].into_iter().enumerate() {
        for z in [-3.55, 3.55] {
            let material = if (i + usize::from(z > 0.0)) % 2 == 0 { OCHRE } else { POMPEIAN };
            let bands = |a: f32, p: Vec2| {
                1.0 + 0.015 * (18.0 * a).cos() * (-((p.y - 0.45) / 0.12).powi(2)).exp()
            };
            s.lathe(Vec3::new(x, 0.0, z), &profile, segments(44), bands, material);
        }
    }
}
