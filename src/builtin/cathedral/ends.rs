//! The ends of nave and aisles: three lancets under a rose in the east, a rose over a portal in the
//! west.

use glam::{Vec2, Vec3};

use super::arch::{Pointed, circle};
use super::sweep::{Plane, block, moulding, panel, roll};
use super::wall::{opening, voussoirs};
use super::window::{lights, rose};
use super::{
    AISLE_FACE, AISLE_ROOF, HALF_WALL, LENGTH, MARBLE, NAVE, ROOF, STONE, Segments, TINTS, WOOD,
    column,
};
use crate::builtin::solid::Solids;

/// Height of the joint between the lower and the upper half.
const MIDDLE: f32 = 11.7;
const ROSE: (f32, f32) = (16.25, 3.25);

/// One end; `east` is 1 or −1.
pub(super) fn end(s: &mut Solids, east: f32, segments: &Segments) {
    let at = |behind: f32| Vec3::X * if east > 0.0 { LENGTH + behind } else { -behind };
    let plane =
        Plane { origin: at(HALF_WALL - 0.06), across: Vec3::Z * east, out: Vec3::NEG_X * east };
    let (center, radius) = (Vec2::new(0.0, ROSE.0), ROSE.1);
    let around = segments.of(72).max(24);
    let hole = |offset: f32| circle(center, radius + offset, around);
    let h = HALF_WALL;
    let wide = NAVE - h + 0.2;
    panel(
        s,
        &plane,
        [Vec2::new(-wide, MIDDLE + 0.02), Vec2::new(wide, ROOF - 0.12)],
        &[
            (hole(0.3), h),
            (hole(0.24), h - 0.1),
            (hole(0.0), 0.1),
            (hole(0.0), -0.1),
            (hole(0.2), -h),
        ],
        STONE,
    );
    rose(s, &plane, center, radius, segments);
    let slab = |s: &mut Solids, low: Vec3, high: Vec3, bevel: f32, material: u32| {
        let corner = |p: Vec3| plane.at(Vec2::new(p.x, p.y), p.z);
        let (a, b) = (corner(low), corner(high));
        block(s, a.min(b), a.max(b), bevel, material);
    };
    // String course, also over the joint.
    slab(
        s,
        Vec3::new(-wide - 0.05, MIDDLE - 0.14, -h - 0.05),
        Vec3::new(wide + 0.05, MIDDLE + 0.12, h + 0.12),
        0.05,
        TINTS[1],
    );
    if east > 0.0 {
        for (x, half) in [(-3.13, 1.53), (0.0, 1.46), (3.13, 1.53)] {
            let window = Pointed { half: 0.98, sharp: 2.1 };
            // The outer lancets stand off their panels' middles, clear of the wall shafts.
            let foot = Vec2::new(x * 0.96, if x == 0.0 { 8.3 } else { 7.6 });
            opening(
                s,
                &plane,
                [Vec2::new(x - half, -0.3), Vec2::new(x + half, MIDDLE - 0.02)],
                window,
                foot,
                3.4,
                segments,
            );
            lights(s, &plane, window, foot, 3.4, segments);
        }
        for x in [-1.53, 1.53] {
            let (a, b) = (
                plane.at(Vec2::new(x - 0.17, -0.2), -h - 0.1),
                plane.at(Vec2::new(x + 0.17, MIDDLE - 0.05), h + 0.08),
            );
            s.cuboid(a.min(b), a.max(b), STONE);
            column::triple(
                s,
                plane.at(Vec2::new(x, 0.0), h + 0.08),
                MIDDLE - 0.1,
                plane.out,
                &[3.2, 7.4],
                segments,
            );
        }
    } else {
        let (a, b) = (
            plane.at(Vec2::new(-wide - 0.01, -0.3), -h),
            plane.at(Vec2::new(wide + 0.01, MIDDLE - 0.02), h),
        );
        s.cuboid(a.min(b), a.max(b), STONE);
        portal(s, &plane, segments);
    }
    for side in [-1.0, 1.0] {
        let aisle = Plane { origin: at(HALF_WALL - 0.11), ..plane };
        let x = side * 0.5 * (NAVE + h + AISLE_FACE);
        let half = 0.5 * (AISLE_FACE - NAVE - h) + 0.55;
        let window = Pointed { half: 1.05, sharp: 2.1 };
        let foot = Vec2::new(x, 5.2);
        opening(
            s,
            &aisle,
            [Vec2::new(x - half, -0.28), Vec2::new(x + half, AISLE_ROOF - 0.12)],
            window,
            foot,
            2.3,
            segments,
        );
        lights(s, &aisle, window, foot, 2.3, segments);
    }
}

/// A blind doorway: recessed orders of rolls on shafts, boards behind.
fn portal(s: &mut Solids, plane: &Plane, segments: &Segments) {
    let n = segments.of(12);
    for k in 0..4 {
        let arch = Pointed { half: 1.2 + 0.24 * k as f32, sharp: 1.8 };
        let foot = Vec2::new(0.0, 2.9);
        let depth = HALF_WALL + 0.40 - 0.10 * k as f32;
        moulding(
            s,
            plane,
            &arch.curve(foot, n, 0.0),
            &roll(Vec2::new(0.0, depth - 0.15), 0.14, segments.of(12)),
            false,
            voussoirs(k as f32),
        );
        for x in [-arch.half, arch.half] {
            column::shaft(
                s,
                plane.at(Vec2::new(x, -0.01), depth - 0.15),
                foot.y + 0.02,
                0.085,
                &[],
                if k % 2 == 0 { MARBLE } else { TINTS[2] },
                segments,
            );
        }
    }
    for k in 0..6 {
        let x = (k as f32 - 2.5) * 0.4;
        let (a, b) = (
            plane.at(Vec2::new(x - 0.195, 0.02), HALF_WALL - 0.1),
            plane.at(Vec2::new(x + 0.195, 4.2 - 0.55 * (k as f32 - 2.5).abs()), HALF_WALL + 0.06),
        );
        block(s, a.min(b), a.max(b), 0.02, WOOD);
    }
}
