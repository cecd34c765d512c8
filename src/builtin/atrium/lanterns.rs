//! Lanterns on chains under every bay of the galleries: six glazing bars between a base and a cap,
//! a glowing globe within.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::{BAY, COURT, GALLERY, GLOW, IRON, ROOF, Side, UPPER_FLOOR};
use crate::builtin::solid::Solids;

/// Height of the globes above their floor.
const HUNG: f32 = 2.75;
const GLOBE: f32 = 0.075;

/// A lantern in the middle of every gallery bay, corners included, on both floors: 44.
pub(super) fn lanterns(s: &mut Solids, segments: &impl Fn(u32) -> u32) {
    let middle = 0.5 * GALLERY + 0.11;
    for (floor, hook) in [(0.0, UPPER_FLOOR - 0.4), (UPPER_FLOOR, ROOF)] {
        for side in Side::all() {
            for bay in 0..side.bays {
                let foot =
                    side.from + side.along * ((bay as f32 + 0.5) * BAY) - side.inwards() * middle;
                lantern(s, foot + Vec3::Y * (floor + HUNG), hook, segments);
            }
        }
        for (x, z) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let corner = Vec3::new(x * (COURT[0] + middle), floor + HUNG, z * (COURT[1] + middle));
            lantern(s, corner, hook, segments);
        }
    }
}

/// One lantern about the globe's centre `at`, hung from height `hook`.
fn lantern(s: &mut Solids, at: Vec3, hook: f32, segments: &impl Fn(u32) -> u32) {
    let n = segments(4).min(12);
    let globe: Vec<Vec2> = (0..=n)
        .map(|i| {
            let a = PI * (0.04 + 0.92 * i as f32 / n as f32);
            Vec2::new(GLOBE * a.sin(), -GLOBE * a.cos())
        })
        .collect();
    s.lathe(at, &globe, segments(8).clamp(6, 32), |_, _| 1.0, GLOW);
    let round = |s: &mut Solids, profile: &[(f32, f32)]| {
        let profile: Vec<Vec2> = profile.iter().copied().map(Vec2::from).collect();
        s.lathe(at, &profile, 6, |_, _| 1.0, IRON);
    };
    round(
        s,
        &[
            (0.05, -0.235),
            (0.095, -0.225),
            (0.125, -0.20),
            (0.125, -0.185),
            (0.10, -0.175),
            (0.03, -0.17),
            (0.025, -0.09),
        ],
    );
    round(
        s,
        &[
            (0.16, 0.185),
            (0.205, 0.185),
            (0.215, 0.205),
            (0.185, 0.225),
            (0.13, 0.27),
            (0.06, 0.33),
            (0.035, 0.37),
            (0.045, 0.39),
            (0.015, 0.42),
        ],
    );
    // The pendant under the base.
    round(s, &[(0.004, -0.31), (0.022, -0.29), (0.026, -0.265), (0.012, -0.245), (0.03, -0.23)]);
    for k in 0..6 {
        let out = Vec3::new((TAU * k as f32 / 6.0).cos(), 0.0, (TAU * k as f32 / 6.0).sin());
        let square =
            [(-0.007, -0.007), (0.007, -0.007), (0.007, 0.007), (-0.007, 0.007)].map(Vec2::from);
        s.bar(
            at + out * 0.113 + Vec3::Y * -0.192,
            at + out * 0.185 + Vec3::Y * 0.195,
            out,
            Vec3::Y.cross(out),
            &square,
            IRON,
        );
    }
    let links = segments(20).clamp(4, 60);
    let chain: Vec<Vec2> = (0..=2 * links)
        .map(|i| {
            Vec2::new(
                if i % 2 == 0 { 0.005 } else { 0.013 },
                0.41 + (hook + 0.03 - at.y - 0.41) * i as f32 / (2 * links) as f32,
            )
        })
        .collect();
    s.lathe(at, &chain, 6, |_, _| 1.0, IRON);
    let rose: Vec<Vec2> = [(0.02, -0.05), (0.06, -0.03), (0.09, -0.01), (0.09, 0.03)]
        .map(|(r, h): (f32, f32)| Vec2::new(r, hook - at.y + h))
        .into();
    s.lathe(at, &rose, segments(12), |_, _| 1.0, IRON);
}
