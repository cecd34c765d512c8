//! Groin vaults over the ground floor's galleries, with moulded ribs between the bays and consoles
//! that carry them.
//!
//! A bay's ceiling is the upper of two barrels, y = spring + rise · max(√(1 − (u/a)²), √(1 −
//! (v/a)²)); the grid's diagonals follow the groins.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::parts::banded;
use super::{BAY, COURT, LIMESTONE, MARBLE, PLASTER, SANDSTONE, STOREYS, Side, UPPER_FLOOR};
use crate::builtin::solid::Solids;

/// From the arcade's middle to that of the gallery's clear width.
const MIDDLE: f32 = 1.6;
/// Half the span of both barrels, and their height.
const SPAN: f32 = 1.40;
const RISE: f32 = 1.385;
const RIB: f32 = 1.24;

/// All vaults, ribs and consoles.
pub(super) fn vaults(s: &mut Solids, segments: &impl Fn(u32) -> u32) {
    for side in Side::all() {
        let at = |u: f32, out: f32| side.from + side.along * u - side.inwards() * out;
        for bay in 0..side.bays {
            groin(s, at((bay as f32 + 0.5) * BAY, MIDDLE), side.along, segments);
        }
        for edge in 0..=side.bays {
            rib(s, at(edge as f32 * BAY, 0.0), &side, segments);
        }
    }
    for (x, z) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
        groin(
            s,
            Vec3::new(x * (COURT[0] + MIDDLE), 0.0, z * (COURT[1] + MIDDLE)),
            Vec3::X,
            segments,
        );
    }
}

/// One bay about `center` on the floor: vaulted below, flat inside the slab above.
fn groin(s: &mut Solids, center: Vec3, along: Vec3, segments: &impl Fn(u32) -> u32) {
    let half = segments(18).max(3);
    let n = 2 * half;
    let (reach_u, reach_v) = (1.452, 1.443);
    let across = along.cross(Vec3::Y);
    let barrel = |t: f32| (1.0 - (t / SPAN).powi(2)).max(0.0).sqrt();
    // Steps in the angle: even arcs; the last ones lie in the walls.
    let step = |i: u32, reach: f32| {
        if i == 0 || i == n {
            reach * (i as f32 / half as f32 - 1.0)
        } else {
            -SPAN * (PI * i as f32 / n as f32).cos()
        }
    };
    let mut positions: Vec<Vec3> = Vec::new();
    for k in 0..=n {
        for i in 0..=n {
            let (u, v) = (step(i, reach_u), step(k, reach_v));
            positions.push(
                center
                    + along * u
                    + across * v
                    + Vec3::Y * (STOREYS[0].spring + RISE * barrel(u).max(barrel(v))),
            );
        }
    }
    let id = |i: u32, k: u32| k * (n + 1) + i;
    let mut triangles = Vec::new();
    for k in 0..n {
        for i in 0..n {
            let (a, b, c, d) = (id(i, k), id(i + 1, k), id(i + 1, k + 1), id(i, k + 1));
            triangles.extend(if (i < half) == (k < half) {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            });
        }
    }
    let rim: Vec<u32> = (0..n)
        .map(|i| id(i, 0))
        .chain((0..n).map(|k| id(n, k)))
        .chain((0..n).map(|i| id(n - i, n)))
        .chain((0..n).map(|k| id(0, n - k)))
        .collect();
    let (first, m) = (positions.len() as u32, rim.len() as u32);
    let top = UPPER_FLOOR - 0.37;
    positions.extend(rim.iter().map(|&r| positions[r as usize].with_y(top)).collect::<Vec<_>>());
    positions.push(center.with_y(top));
    for i in 0..m {
        let (a, b, c, d) =
            (rim[i as usize], rim[((i + 1) % m) as usize], first + (i + 1) % m, first + i);
        triangles.extend([[b, a, d], [b, d, c], [c, d, first + m]]);
    }
    let faces = triangles.len();
    s.solid(&positions, triangles, &vec![PLASTER; faces]);
}

/// The rib over the boundary of two bays, of blocks in two stones, and its console on the arcade.
fn rib(s: &mut Solids, foot: Vec3, side: &Side, segments: &impl Fn(u32) -> u32) {
    let (along, out, spring) = (side.along, -side.inwards(), STOREYS[0].spring);
    // (radius, along the gallery)
    let moulded =
        [(1.462, 0.205), (1.30, 0.205), (1.285, 0.185), (1.285, 0.15), (1.25, 0.135), (RIB, 0.11)];
    let plain = [moulded[0], (1.27, 0.205)];
    // Coarse ribs have no mouldings.
    let half: &[(f32, f32)] = if segments(36) < 9 { &plain } else { &moulded };
    let profile: Vec<(f32, f32)> =
        half.iter().copied().chain(half.iter().rev().map(|&(r, w)| (r, -w))).collect();
    let n = segments(26).max(4);
    let ring = |angle: f32, drop: f32| -> Vec<Vec3> {
        profile
            .iter()
            .map(|&(r, w)| {
                foot + out * (MIDDLE - r * angle.cos())
                    + along * w
                    + Vec3::Y * (spring + r * angle.sin() - drop)
            })
            .collect()
    };
    let mut rings = vec![ring(0.0, 0.05)];
    rings.extend((0..=n).map(|i| ring(PI * i as f32 / n as f32, 0.0)));
    rings.push(ring(PI, 0.05));
    banded(s, &rings, |k| {
        if ((k as f32 / n as f32 * 13.0) as u32).is_multiple_of(2) { LIMESTONE } else { SANDSTONE }
    });
    let slab = |s: &mut Solids, from: f32, to: f32, half: f32, low: f32, high: f32| {
        let (p, q) = (
            foot + out * from - along * half + Vec3::Y * (spring + low),
            foot + out * to + along * half + Vec3::Y * (spring + high),
        );
        s.cuboid(p.min(q), p.max(q), MARBLE);
    };
    slab(s, 0.11, 0.405, 0.235, -0.085, 0.004);
    slab(s, 0.12, 0.375, 0.215, -0.135, -0.08);
    let bracket: Vec<Vec2> =
        [(0.13, -0.13), (0.36, -0.13), (0.35, -0.20), (0.30, -0.28), (0.25, -0.36), (0.13, -0.42)]
            .map(Vec2::from)
            .into();
    s.bar(
        foot - along * 0.17 + Vec3::Y * spring,
        foot + along * 0.17 + Vec3::Y * spring,
        out,
        Vec3::Y,
        &bracket,
        MARBLE,
    );
}
