//! What stands on the floor, and the floor itself: tiles, pews, the altar on its steps.

use glam::{Vec2, Vec3};

use super::masonry::chance;
use super::sweep::block;
use super::{AISLE_FACE, CLOTH, LENGTH, NAVE, OAK, Segments, TILES, TINTS, WOOD};
use crate::builtin::solid::Solids;

/// Bevelled tiles: chequered in the nave, mixed stone in the aisles.
pub(super) fn floor(s: &mut Solids, detail: f32) {
    let pitch = 0.5 / detail.clamp(0.2, 1.6);
    let (nx, nz) = ((LENGTH / pitch).round() as u32, (2.0 * AISLE_FACE / pitch).round() as u32);
    let (px, pz) = (LENGTH / nx as f32, 2.0 * AISLE_FACE / nz as f32);
    let (joint, bevel) = (0.004, 0.007);
    for i in 0..nx {
        for k in 0..nz {
            let c = Vec3::new((i as f32 + 0.5) * px, 0.0, (k as f32 + 0.5) * pz - AISLE_FACE);
            let luck = |n: i64| chance(i64::from(i), i64::from(k), n);
            let y = 0.003 * (luck(1) - 0.5);
            let ring = |y: f32, inset: f32| -> Vec<Vec3> {
                let (x, z) = (0.5 * px - inset, 0.5 * pz - inset);
                [(-x, -z), (x, -z), (x, z), (-x, z)].map(|(x, z)| c + Vec3::new(x, y, z)).into()
            };
            let pair = if c.z.abs() < NAVE - 0.8 {
                [[0, 1], [2, 3]][((i + k) % 2) as usize]
            } else {
                [4, 5]
            };
            let material = TILES + pair[usize::from(luck(2) < 0.4)];
            s.tube(
                &[ring(y - 0.05, joint), ring(y - bevel, joint), ring(y, joint + bevel)],
                false,
                material,
            );
        }
    }
}

/// A flat board of any outline (x, y) at `at`, its edges bevelled; thickness along z.
fn board(s: &mut Solids, at: Vec3, outline: &[Vec2], half: f32, material: u32) {
    let center = outline.iter().sum::<Vec2>() / outline.len() as f32;
    let ring = |z: f32, shrink: f32| {
        outline
            .iter()
            .map(|p| at + (center + (*p - center) * shrink).extend(0.0) + Vec3::Z * z)
            .collect()
    };
    let b = 0.3 * half;
    s.tube(
        &[ring(-half, 0.97), ring(b - half, 1.0), ring(half - b, 1.0), ring(half, 0.97)],
        false,
        material,
    );
}

/// Two blocks of pews that face east, a way between them.
pub(super) fn pews(s: &mut Solids, segments: &Segments) {
    let n = segments.of(8);
    let rows = if segments.of(20) < 6 { 10 } else { 20 };
    // An end: straight back, scrolled shoulder, arm.
    let mut outline: Vec<Vec2> = [(-0.27, 0.0), (0.27, 0.0), (0.27, 0.50)].map(Vec2::from).into();
    outline.extend(
        (0..=n).map(|i| Vec2::new(0.20, 0.58) + 0.07 * Vec2::from_angle(2.4 * i as f32 / n as f32)),
    );
    outline.extend((0..=n).map(|i| {
        Vec2::new(-0.18, 0.98)
            + Vec2::new(0.10, 0.12) * Vec2::from_angle(-0.3 + 3.2 * i as f32 / n as f32)
    }));
    let block = |s: &mut Solids, a: Vec3, b: Vec3, bevel: f32, material: u32| {
        if segments.coarse() { s.cuboid(a, b, material) } else { block(s, a, b, bevel, material) }
    };
    for row in 0..rows {
        let x = 7.6 + (row as f32) * 21.0 / rows as f32;
        for side in [-1.0, 1.0] {
            let (low, high) = if side > 0.0 { (1.05, 3.35) } else { (-3.35, -1.05) };
            let at = |p: [f32; 3], q: [f32; 3]| {
                (Vec3::from(p) + Vec3::X * x, Vec3::from(q) + Vec3::X * x)
            };
            let (a, b) = at([-0.22, 0.43, low], [0.22, 0.475, high]);
            block(s, a, b, 0.012, OAK);
            let (a, b) = at([-0.245, 0.50, low], [-0.20, 0.95, high]);
            block(s, a, b, 0.01, WOOD);
            for z in [low - 0.02, high + 0.02] {
                board(
                    s,
                    Vec3::new(x, 0.001, z),
                    &outline,
                    0.035,
                    if (row + u32::from(z > low)) % 3 == 0 { OAK } else { WOOD },
                );
            }
            if segments.coarse() {
                continue;
            }
            let (a, b) = at([-0.265, 0.93, low], [-0.17, 0.985, high]);
            block(s, a, b, 0.015, OAK);
            let (a, b) = at([-0.19, 0.12, low], [-0.15, 0.44, high]);
            block(s, a, b, 0.01, WOOD);
            let (a, b) = at([-0.42, 0.70, low], [-0.235, 0.735, high]);
            block(s, a, b, 0.01, OAK);
        }
    }
}

/// Steps, the altar with its cloth, and a reredos of small gables behind.
pub(super) fn altar(s: &mut Solids, segments: &Segments) {
    for (i, (x, half)) in [(29.6, 4.0), (30.0, 3.6), (30.4, 3.2)].into_iter().enumerate() {
        let y = 0.16 * (i + 1) as f32;
        block(
            s,
            Vec3::new(x, y - 0.24, -half),
            Vec3::new(LENGTH - 0.9 - 0.1 * i as f32, y, half),
            0.025,
            TINTS[i + 1],
        );
    }
    block(s, Vec3::new(31.9, 0.46, -1.5), Vec3::new(32.9, 1.45, 1.5), 0.03, TINTS[2]);
    block(s, Vec3::new(31.8, 1.43, -1.65), Vec3::new(33.0, 1.53, 1.65), 0.03, TINTS[0]);
    block(s, Vec3::new(31.78, 1.50, -1.0), Vec3::new(33.02, 1.545, 1.0), 0.01, CLOTH);
    // The frontal hangs in folds.
    let n = segments.of(60);
    let ring = |y: f32, fold: f32| -> Vec<Vec3> {
        let point = |i: u32, d: f32| {
            let u = i as f32 / n as f32;
            Vec3::new(31.83 - d - fold * (0.5 + 0.5 * (60.0 * u).sin()), y, -1.0 + 2.0 * u)
        };
        (0..=n).map(|i| point(i, 0.0)).chain((0..=n).rev().map(|i| point(i, 0.012))).collect()
    };
    let rows = segments.of(10);
    let rings: Vec<Vec<Vec3>> = (0..=rows)
        .map(|k| k as f32 / rows as f32)
        .map(|t| ring(0.62 + 0.9 * t, 0.05 * (1.0 - t)))
        .collect();
    s.tube(&rings, false, CLOTH);
}
