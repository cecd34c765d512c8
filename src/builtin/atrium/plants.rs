//! Potted palms: arching fronds as cards of a few quads with texture coordinates, for a cut-out
//! mask on the material `frond`.
//!
//! Without a mask the cards are whole strips. Open sheets: the only parts of the atrium that are
//! not closed.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::{COURT, EARTH, FROND, GALLERY, UPPER_FLOOR, WOOD};
use crate::builtin::solid::Solids;
use crate::sampling::{Rng, Stream};

/// Feet and sizes: in the court's vases, and tubs of their own in the galleries' corners.
fn places() -> impl Iterator<Item = (Vec3, f32, bool)> {
    let vases = [-6.0, -3.0, 3.0, 6.0]
        .into_iter()
        .flat_map(|x| [-3.55, 3.55].map(|z| (Vec3::new(x, 0.0, z), 1.0, false)));
    let (x, z) = (COURT[0] + GALLERY - 0.62, COURT[1] + GALLERY - 0.62);
    let corners = [(-x, z), (x, z), (x, -z)]
        .into_iter()
        .flat_map(|(x, z)| [0.0, UPPER_FLOOR].map(|y| (Vec3::new(x, y, z), 1.35, true)));
    vases.chain(corners)
}

/// All plants with what holds them.
pub(super) fn plants(s: &mut Solids, segments: &impl Fn(u32) -> u32) {
    let lathe = |s: &mut Solids, foot: Vec3, profile: &[(f32, f32)], material| {
        let profile: Vec<Vec2> = profile.iter().copied().map(Vec2::from).collect();
        s.lathe(foot, &profile, segments(36), |_, _| 1.0, material);
    };
    for (number, (foot, size, tub)) in places().enumerate() {
        let earth = if tub {
            let staves = [
                (0.24, -0.01),
                (0.25, 0.10),
                (0.27, 0.12),
                (0.27, 0.15),
                (0.26, 0.16),
                (0.29, 0.38),
                (0.32, 0.40),
                (0.32, 0.45),
                (0.28, 0.45),
                (0.27, 0.33),
            ];
            lathe(s, foot, &staves, WOOD);
            (0.40, 0.276)
        } else {
            (0.63, 0.243)
        };
        lathe(
            s,
            foot + Vec3::Y * earth.0,
            &[(earth.1, -0.03), (earth.1, 0.0), (0.12, 0.02), (0.03, 0.03)],
            EARTH,
        );
        let mut rng = Rng::new(13, Stream::Scene, 8, number as u64);
        let count = segments(22).clamp(9, 48);
        for i in 0..count {
            let turn = TAU * (i as f32 * 0.381_966 + 0.06 * rng.next_f32());
            // Inner fronds stand, outer ones arch over.
            let age = (i as f32 + rng.next_f32()) / count as f32;
            let root = foot + Vec3::new(0.04 * turn.cos(), earth.0 + 0.02, 0.04 * turn.sin());
            frond(
                s,
                root,
                turn,
                size * (0.72 + 0.3 * rng.next_f32()),
                0.25 + 1.05 * age,
                segments(8).clamp(3, 40),
            );
        }
    }
}

/// A strip of `n` cells from `root` towards the angle `turn`, `long` in all, that leans by `lean`
/// radians at its root and more to its tip.
fn frond(s: &mut Solids, root: Vec3, turn: f32, long: f32, lean: f32, n: u32) {
    let (out, across) =
        (Vec3::new(turn.cos(), 0.0, turn.sin()), Vec3::new(-turn.sin(), 0.0, turn.cos()));
    let first = s.mesh.positions.len() as u32;
    let mut at = root;
    for k in 0..=n {
        let t = k as f32 / n as f32;
        let angle = lean * (0.35 + 1.25 * t);
        let (along, face) =
            (out * angle.sin() + Vec3::Y * angle.cos(), out * angle.cos() - Vec3::Y * angle.sin());
        // The blade is folded along its midrib.
        let half = 0.155 * long;
        for (u, fold) in [(0.0, -1.0), (0.5, 0.0), (1.0, -1.0)] {
            s.mesh
                .positions
                .push(at + across * (half * (2.0 * u - 1.0)) - face * (0.22 * half * fold));
            s.mesh.uvs.resize(s.mesh.positions.len() - 1, Vec2::ZERO);
            s.mesh.uvs.push(Vec2::new(u, t));
        }
        at += along * (long / n as f32);
    }
    for k in 0..n {
        for side in 0..2 {
            let (a, b) = (first + 3 * k + side, first + 3 * k + side + 1);
            s.mesh.triangles.extend([[a, b, b + 3], [a, b + 3, a + 3]]);
            s.mesh.materials.extend([FROND; 2]);
        }
    }
}
