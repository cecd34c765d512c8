//! Clustered columns: a core of drums with shafts around it, bases, annulets and capitals; and the
//! shafts on the walls.

use std::f32::consts::{FRAC_PI_4, PI};

use glam::{Vec2, Vec3};

use super::masonry::chance;
use super::{MARBLE, RIB_TINTS, Segments, TINTS};
use crate::builtin::solid::Solids;

/// Points of a half-round moulding: from height `low`, `tall`, on radius `r`, bulging by `out`.
fn torus(profile: &mut Vec<Vec2>, n: u32, low: f32, tall: f32, r: f32, out: f32) {
    profile.extend((0..=n).map(|i| {
        let a = PI * i as f32 / n as f32;
        Vec2::new(r + out * a.sin(), low + 0.5 * tall * (1.0 - a.cos()))
    }));
}

/// A round shaft from `foot` to `top`, with base, annulets at `rings` (heights) and a leafed
/// capital.
pub(super) fn shaft(
    s: &mut Solids,
    foot: Vec3,
    top: f32,
    r: f32,
    rings: &[f32],
    material: u32,
    segments: &Segments,
) {
    let around = segments.of((20.0 + 60.0 * r) as u32).max(4);
    let height = top - foot.y;
    let capital = (3.6 * r).min(0.62);
    if segments.coarse() {
        let low = height - capital;
        let plain = [(1.5, -0.02), (1.0, 1.1 * r), (1.0, low), (1.6, height - 0.02 * capital)];
        s.lathe(foot, &plain.map(|(k, y)| Vec2::new(k * r, y)), around, |_, _| 1.0, material);
        return;
    }
    let mut base = vec![Vec2::new(1.5 * r, -0.02)];
    torus(&mut base, segments.of(6), 0.04 * r, 0.7 * r, 1.4 * r, 0.22 * r);
    torus(&mut base, segments.of(4), 0.80 * r, 0.25 * r, 1.3 * r, -0.13 * r);
    torus(&mut base, segments.of(5), 1.1 * r, 0.45 * r, 1.14 * r, 0.16 * r);
    base.push(Vec2::new(0.85 * r, 1.75 * r));
    s.lathe(foot, &base, around, |_, _| 1.0, RIB_TINTS[1]);
    s.lathe(
        foot,
        &[Vec2::new(r, 1.5 * r), Vec2::new(r, height - 0.9 * capital)],
        around,
        |_, _| 1.0,
        material,
    );
    for at in rings {
        let mut ring = vec![Vec2::new(0.8 * r, at - foot.y - 0.5 * r)];
        torus(&mut ring, segments.of(6), at - foot.y - 0.45 * r, 0.9 * r, 1.06 * r, 0.28 * r);
        ring.push(Vec2::new(0.8 * r, at - foot.y + 0.5 * r));
        s.lathe(foot, &ring, around, |_, _| 1.0, RIB_TINTS[2]);
    }
    let low = height - capital;
    let mut bell = vec![Vec2::new(0.8 * r, low - 0.12 * capital)];
    torus(&mut bell, segments.of(5), low - 0.1 * capital, 0.16 * capital, 1.02 * r, 0.16 * r);
    let n = segments.of(14);
    bell.extend((1..=n).map(|i| {
        let t = i as f32 / n as f32;
        Vec2::new(
            r * (1.04 + 0.1 * t) + 0.34 * capital * t.powi(3),
            low + 0.07 * capital + 0.9 * capital * t,
        )
    }));
    bell.push(Vec2::new(0.9 * r, height - 0.02 * capital));
    // Stiff leaves: two rows, the tips lean out.
    let leaf = |a: f32, p: Vec2| {
        let t = ((p.y - low) / capital).clamp(0.0, 1.0);
        let row = |from: f32, to: f32, phase: f32| {
            let h = ((t - from) / (to - from)).clamp(0.0, 1.0);
            let wide = (0.5 + 0.5 * (6.0 * a + phase).cos()).powf(0.5 + h);
            if t > from && t < to { wide * (0.03 + 0.2 * h * h) * (1.0 - h.powi(10)) } else { 0.0 }
        };
        1.0 + row(0.08, 0.55, 0.0).max(row(0.2, 0.95, PI))
    };
    s.lathe(foot, &bell, segments.of(48), leaf, RIB_TINTS[0]);
}

/// Measures of a moulded slab: from height `low`, `tall`, inner radius `r`, wider by `out` at the
/// top (or the foot, when `tall` is negative).
struct Slab {
    low: f32,
    tall: f32,
    r: f32,
    out: f32,
}

/// A moulded polygonal slab.
fn slab(s: &mut Solids, foot: Vec3, measures: &Slab, material: u32, segments: &Segments) {
    let &Slab { low, tall, r, out } = measures;
    if segments.coarse() {
        let middle = low + 0.5 * tall;
        let plain = [Vec2::new(r, low), Vec2::new(r + out, middle), Vec2::new(r + out, low + tall)];
        s.lathe(foot, &plain, 8, |_, _| 1.0, material);
        return;
    }
    let n = segments.of(5);
    let mut profile = vec![Vec2::new(r, low)];
    profile.extend((0..=n).map(|i| {
        let a = 0.5 * PI * i as f32 / n as f32;
        Vec2::new(r + out * (0.35 + 0.5 * (1.0 - a.cos())), low + tall * (0.25 + 0.3 * a.sin()))
    }));
    profile.extend([
        Vec2::new(r + out, low + tall * 0.6),
        Vec2::new(r + out, low + tall * 0.92),
        Vec2::new(r + out * 0.9, low + tall),
    ]);
    // Turned by half a side, so that flats look along the axes.
    let octagon = |a: f32, _: Vec2| {
        let b = (a + 0.5 * FRAC_PI_4).rem_euclid(FRAC_PI_4) - 0.5 * FRAC_PI_4;
        1.0 / b.cos()
    };
    s.lathe(foot, &profile, 16, octagon, material);
}

/// A clustered column of the arcade, its abacus at `top`.
pub(super) fn clustered(s: &mut Solids, foot: Vec3, top: f32, segments: &Segments) {
    slab(s, foot, &Slab { low: 0.42, tall: -0.45, r: 0.88, out: 0.12 }, TINTS[1], segments);
    slab(s, foot, &Slab { low: 0.60, tall: -0.22, r: 0.80, out: 0.07 }, TINTS[3], segments);
    let rise = top - 0.22;
    // Drums (none of `STONE`, of which the masonry would cut some and not their neighbours), the
    // core as eight shallow lobes.
    let drums = segments.of(9).min(16);
    let around = segments.of(64).max(8);
    let (from, to) = (foot.y + 0.5, foot.y + rise - 0.4);
    let rings: Vec<Vec<Vec3>> = (0..=drums)
        .map(|k| {
            let y = from + (to - from) * k as f32 / drums as f32;
            (0..around)
                .map(|i| {
                    let a = 2.0 * PI * i as f32 / around as f32;
                    let r = 0.52 + 0.05 * (8.0 * a + PI).cos();
                    Vec3::new(foot.x + r * a.cos(), y, foot.z - r * a.sin())
                })
                .collect()
        })
        .collect();
    let key = (foot.x * 10.0) as i64 * 31 + (foot.z * 10.0) as i64;
    s.tube_by(&rings, false, |k| {
        TINTS[1 + (chance(key, k as i64, 1) * (TINTS.len() - 1) as f32) as usize]
    });
    let middle = 0.5 * (from + to);
    for i in (0..8).step_by(if segments.coarse() { 2 } else { 1 }) {
        let a = i as f32 * FRAC_PI_4;
        let (r, out, material) =
            if i % 2 == 0 { (0.155, 0.56, MARBLE) } else { (0.105, 0.55, TINTS[2]) };
        let at = foot + Vec3::new(out * a.cos(), 0.575, out * a.sin());
        shaft(s, at, foot.y + rise, r, &[middle], material, segments);
    }
    let core = [
        Vec2::new(0.45, rise - 0.65),
        Vec2::new(0.60, rise - 0.2),
        Vec2::new(0.74, rise + 0.03),
        Vec2::new(0.5, rise + 0.06),
    ];
    s.lathe(foot, &core, segments.of(40), |_, _| 1.0, RIB_TINTS[1]);
    slab(s, foot, &Slab { low: rise, tall: 0.225, r: 0.80, out: 0.13 }, TINTS[0], segments);
}

/// Three shafts on a wall, from `foot` (in the wall's face) to `top`, with a half abacus; `out`
/// looks out of the wall.
pub(super) fn triple(
    s: &mut Solids,
    foot: Vec3,
    top: f32,
    out: Vec3,
    rings: &[f32],
    segments: &Segments,
) {
    let along = Vec3::Y.cross(out);
    shaft(s, foot + out * 0.13, top - 0.14, 0.125, rings, MARBLE, segments);
    for side in [-1.0, 1.0] {
        shaft(
            s,
            foot + out * 0.03 + along * (0.2 * side),
            top - 0.14,
            0.08,
            rings,
            TINTS[2],
            segments,
        );
    }
    let center = Vec3::new(foot.x, 0.0, foot.z) + out * 0.02;
    slab(s, center, &Slab { low: top - 0.15, tall: 0.17, r: 0.38, out: 0.08 }, TINTS[1], segments);
}
