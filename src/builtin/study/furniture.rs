//! The study's furniture.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::{
    BLUE, CREAM, CURTAIN, CUSHION, GREEN, ORANGE, PLASTER, RUG, RUG_BORDER, SOFA, WALNUT, block,
};
use crate::builtin::cloth::cloth;
use crate::builtin::solid::Solids;
use crate::sampling::{Rng, Stream};

/// Height of the boards' upper face, less what makes things sink in a little.
const FLOOR: f32 = 0.009;

/// A shelf of four boards with books, against the wall z = 0.
pub(super) fn shelf(s: &mut Solids) {
    let (x0, x1, depth, tall) = (3.55, 5.25, 0.32, 2.1);
    for x in [x0, x1 - 0.04] {
        block(s, Vec3::new(x, FLOOR, 0.03), Vec3::new(x + 0.04, tall, depth), 0.004, WALNUT);
    }
    block(
        s,
        Vec3::new(x0 + 0.02, 0.06, 0.035),
        Vec3::new(x1 - 0.02, tall - 0.02, 0.05),
        0.003,
        WALNUT,
    );
    block(
        s,
        Vec3::new(x0 - 0.05, tall - 0.01, 0.025),
        Vec3::new(x1 + 0.05, tall + 0.04, depth + 0.05),
        0.012,
        WALNUT,
    );
    let colors = [CURTAIN, GREEN, BLUE, CREAM, WALNUT, ORANGE, RUG, SOFA];
    for (row, y) in [0.08, 0.58, 1.05, 1.52].into_iter().enumerate() {
        block(
            s,
            Vec3::new(x0 + 0.03, y, 0.045),
            Vec3::new(x1 - 0.03, y + 0.03, depth - 0.01),
            0.003,
            WALNUT,
        );
        let mut rng = Rng::new(5, Stream::Scene, 6, row as u64);
        let mut x = x0 + 0.045;
        // A gap on every board; objects stand in two of them.
        let gap = x0 + [0.9, 0.2, 1.0, 0.55][row];
        loop {
            let (thick, high, deep) = (
                0.018 + 0.035 * rng.next_f32(),
                0.22 + 0.13 * rng.next_f32(),
                0.17 + 0.07 * rng.next_f32(),
            );
            if x < gap + 0.36 && x + thick > gap {
                x = gap + 0.36;
            }
            if x + thick > x1 - 0.045 {
                break;
            }
            block(
                s,
                Vec3::new(x, y + 0.028, depth - 0.03 - deep),
                Vec3::new(x + thick, y + 0.028 + high, depth - 0.03),
                0.003,
                colors[rng.below(8)],
            );
            x += thick + 0.0015 + 0.004 * rng.next_f32();
        }
    }
    vase(s, Vec3::new(x0 + 0.38, 0.608, 0.19), 0.3, 40, ORANGE);
    s.lathe(Vec3::new(x0 + 0.73, 1.548, 0.19), &ball(0.11, 20), 40, |_, _| 1.0, PLASTER);
}

/// The profile of a ball that stands in its foot.
fn ball(radius: f32, n: u32) -> Vec<Vec2> {
    let at = |i: u32| PI * (0.02 + 0.96 * i as f32 / n as f32);
    (0..=n).map(|i| Vec2::new(radius * at(i).sin(), radius * (1.0 - at(i).cos()))).collect()
}

/// A vase `tall` high, hollow to its neck.
fn vase(s: &mut Solids, foot: Vec3, tall: f32, n: u32, material: u32) {
    let outer =
        |t: f32| tall * (0.13 + 0.17 * (-((t - 0.45) / 0.28).powi(2)).exp() + 0.05 * t.powi(8));
    let out = (0..=n).map(|i| i as f32 / n as f32).map(|t| Vec2::new(outer(t), tall * t));
    let back = (0..n / 2)
        .map(|i| 1.0 - i as f32 / n as f32)
        .map(|t| Vec2::new(outer(t) - 0.02 * tall, tall * t + 0.003));
    s.lathe(foot, &out.chain(back).collect::<Vec<_>>(), 2 * n, |_, _| 1.0, material);
}

/// A turned leg.
fn leg(s: &mut Solids, foot: Vec3, tall: f32, segments: &impl Fn(u32) -> u32) {
    let n = segments(28);
    let profile: Vec<Vec2> = (0..=n)
        .map(|i| {
            let t = i as f32 / n as f32;
            let ring = |c: f32, w: f32| (-((t - c) / w).powi(2)).exp();
            Vec2::new(
                0.019
                    + 0.014 * t
                    + 0.012 * ring(0.72, 0.1)
                    + 0.009 * ring(0.1, 0.04)
                    + 0.008 * ring(0.9, 0.03),
                tall * t,
            )
        })
        .collect();
    s.lathe(foot, &profile, segments(20), |_, _| 1.0, WALNUT);
}

/// A desk against the wall x = 0, with books and a lamp on it, and a chair before it.
pub(super) fn desk(s: &mut Solids, segments: &impl Fn(u32) -> u32) {
    let (low, high) = (Vec3::new(0.03, 0.72, 2.1), Vec3::new(0.78, 0.76, 3.6));
    block(s, low, high, 0.01, WALNUT);
    block(
        s,
        low + Vec3::new(0.06, -0.11, 0.08),
        Vec3::new(high.x - 0.06, low.y + 0.005, high.z - 0.08),
        0.005,
        WALNUT,
    );
    for (x, z) in [(0.12, 2.2), (0.69, 2.2), (0.12, 3.5), (0.69, 3.5)] {
        leg(s, Vec3::new(x, FLOOR, z), 0.65, segments);
    }
    let mut y = 0.7585;
    for (i, (material, thick)) in
        [(BLUE, 0.035), (CURTAIN, 0.028), (CREAM, 0.04), (GREEN, 0.025)].into_iter().enumerate()
    {
        let shift = 0.018 * (i as f32 * 2.3).sin();
        block(
            s,
            Vec3::new(0.18 + shift, y, 2.25 - shift),
            Vec3::new(0.36 + shift, y + thick, 2.51 + 0.4 * shift),
            0.004,
            material,
        );
        y += thick - 0.0008;
    }
    vase(s, Vec3::new(0.24, 0.757, 3.32), 0.34, segments(40), GREEN);
    block(s, Vec3::new(0.42, 0.7585, 2.72), Vec3::new(0.63, 0.7635, 3.02), 0.001, CREAM);
    // The chair: seat, legs, back posts, slats.
    let (x, z) = (1.02, 2.86);
    block(
        s,
        Vec3::new(x - 0.21, 0.43, z - 0.22),
        Vec3::new(x + 0.22, 0.465, z + 0.22),
        0.01,
        WALNUT,
    );
    for (dx, dz) in [(-0.17, -0.18), (-0.17, 0.18), (0.18, -0.18), (0.18, 0.18)] {
        leg(s, Vec3::new(x + dx, FLOOR, z + dz), 0.43, segments);
    }
    for dz in [-0.18, 0.18] {
        block(
            s,
            Vec3::new(x + 0.165, 0.455, z + dz - 0.018),
            Vec3::new(x + 0.2, 0.98, z + dz + 0.018),
            0.004,
            WALNUT,
        );
    }
    for (low, tall) in [(0.60, 0.05), (0.72, 0.05), (0.86, 0.09)] {
        block(
            s,
            Vec3::new(x + 0.172, low, z - 0.175),
            Vec3::new(x + 0.192, low + tall, z + 0.175),
            0.003,
            WALNUT,
        );
    }
}

/// A sofa against the wall z = 0, on a rug with a border.
pub(super) fn sofa(s: &mut Solids, segments: &impl Fn(u32) -> u32) {
    block(s, Vec3::new(0.75, FLOOR - 0.001, 0.75), Vec3::new(3.25, 0.019, 2.45), 0.003, RUG_BORDER);
    block(s, Vec3::new(0.87, FLOOR, 0.87), Vec3::new(3.13, 0.0205, 2.33), 0.001, RUG);
    let (x0, x1) = (0.95, 3.05);
    block(s, Vec3::new(x0 + 0.05, 0.12, 0.09), Vec3::new(x1 - 0.05, 0.32, 0.93), 0.02, SOFA);
    block(s, Vec3::new(x0 + 0.04, 0.15, 0.07), Vec3::new(x1 - 0.04, 0.84, 0.27), 0.05, SOFA);
    for x in [x0, x1 - 0.2] {
        block(s, Vec3::new(x, 0.11, 0.08), Vec3::new(x + 0.2, 0.58, 0.95), 0.045, SOFA);
    }
    let middle = 0.5 * (x0 + x1);
    for (a, b) in [(x0 + 0.19, middle - 0.004), (middle + 0.004, x1 - 0.19)] {
        block(s, Vec3::new(a, 0.30, 0.25), Vec3::new(b, 0.45, 0.97), 0.035, SOFA);
    }
    for (x, z) in [(x0 + 0.1, 0.16), (x1 - 0.1, 0.16), (x0 + 0.1, 0.86), (x1 - 0.1, 0.86)] {
        s.lathe(
            Vec3::new(x, FLOOR, z),
            &[(0.022, 0.0), (0.03, 0.12)].map(Vec2::from),
            segments(16),
            |_, _| 1.0,
            WALNUT,
        );
    }
    cushion(s, Vec3::new(x0 + 0.42, 0.63, 0.38), CUSHION, segments);
    cushion(s, Vec3::new(x1 - 0.42, 0.63, 0.38), CREAM, segments);
}

/// A pillow that leans on the back: a superellipsoid with pinched corners.
fn cushion(s: &mut Solids, at: Vec3, material: u32, segments: &impl Fn(u32) -> u32) {
    let (n, m) = (segments(16), segments(32));
    let lean = Vec3::new(0.0, 0.93, -0.36);
    let thick = Vec3::new(0.0, 0.36, 0.93);
    let soft = |v: f32, e: f32| v.abs().powf(e) * v.signum();
    let ring = |k: u32| {
        let h = PI * (0.01 + 0.98 * k as f32 / n as f32);
        let point = |i: u32| {
            let a = TAU * i as f32 / m as f32;
            let r = h.sin().powf(0.55);
            at + Vec3::X * (0.22 * r * soft(a.cos(), 0.45))
                + lean * (0.21 * r * soft(a.sin(), 0.45))
                - thick * (0.075 * h.cos())
        };
        (0..m).map(point).collect()
    };
    s.tube(&(0..=n).map(ring).collect::<Vec<_>>(), false, material);
}

/// A round table with a bowl of fruit and a book.
pub(super) fn low_table(s: &mut Solids, segments: &impl Fn(u32) -> u32) {
    let foot = Vec3::new(2.05, 0.018, 1.62);
    let lathe = |s: &mut Solids, profile: &[(f32, f32)], at: Vec3, material| {
        s.lathe(
            at,
            &profile.iter().copied().map(Vec2::from).collect::<Vec<_>>(),
            segments(56),
            |_, _| 1.0,
            material,
        );
    };
    lathe(
        s,
        &[(0.40, 0.40), (0.46, 0.405), (0.475, 0.415), (0.475, 0.43), (0.465, 0.44), (0.02, 0.441)],
        foot,
        WALNUT,
    );
    lathe(
        s,
        &[(0.05, 0.10), (0.035, 0.16), (0.05, 0.26), (0.04, 0.34), (0.09, 0.405)],
        foot,
        WALNUT,
    );
    lathe(
        s,
        &[(0.26, 0.0), (0.265, 0.02), (0.20, 0.045), (0.08, 0.08), (0.05, 0.12)],
        foot,
        WALNUT,
    );
    let top = foot + Vec3::Y * 0.44;
    let bowl = [
        (0.05, 0.0),
        (0.055, 0.012),
        (0.10, 0.03),
        (0.145, 0.07),
        (0.155, 0.10),
        (0.15, 0.102),
        (0.135, 0.07),
        (0.09, 0.04),
        (0.02, 0.03),
    ];
    lathe(s, &bowl, top + Vec3::new(-0.08, -0.001, 0.02), PLASTER);
    for (i, (dx, dy, dz)) in
        [(-0.05, 0.045, 0.0), (0.045, 0.045, 0.035), (0.03, 0.046, -0.05), (0.0, 0.115, 0.0)]
            .into_iter()
            .enumerate()
    {
        let at = top + Vec3::new(-0.08 + dx, dy - 0.008, 0.02 + dz);
        s.lathe(
            at,
            &ball([0.042, 0.045, 0.04, 0.041][i], segments(14)),
            segments(28),
            |_, _| 1.0,
            [ORANGE, GREEN, ORANGE, RUG][i],
        );
    }
    block(s, top + Vec3::new(0.1, -0.001, 0.05), top + Vec3::new(0.27, 0.028, 0.24), 0.004, BLUE);
    s.lathe(
        top + Vec3::new(0.2, -0.001, -0.14),
        &ball(0.06, segments(16)),
        segments(32),
        |_, _| 1.0,
        PLASTER,
    );
}

/// A red curtain before the wall x = 0, in deep folds, on a rod.
pub(super) fn curtain(s: &mut Solids, segments: &impl Fn(u32) -> u32) {
    let (n, m) = (segments(24), segments(140));
    let point = |i: u32, k: u32, side: f32| {
        let (u, v) = (i as f32 / m as f32, k as f32 / n as f32);
        let gather = 0.045 + 0.02 * v;
        let phase = 15.0 * PI * u + 0.5 * (7.0 * u + 2.0 * v).sin();
        Vec3::new(
            0.12 + gather * phase.sin() + 0.003 * side,
            2.5 - 2.46 * v,
            0.35 + 1.2 * u + 0.01 * (5.0 * v + 9.0 * u).sin(),
        )
    };
    cloth(s, [m, n], point, CURTAIN);
    let rod: Vec<Vec2> = (0..12).map(|i| Vec2::from_angle(TAU * i as f32 / 12.0) * 0.016).collect();
    s.bar(Vec3::new(0.12, 2.52, 0.22), Vec3::new(0.12, 2.52, 1.68), Vec3::X, Vec3::Y, &rod, WALNUT);
}
