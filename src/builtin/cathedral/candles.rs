//! Candles on hanging hoops, standing candelabra, the altar and votive racks: bodies always, flames
//! when lit.
//!
//! A flame is a small closed lens that emits.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::sweep::block;
use super::{AISLE_FACE, AISLE_SPRING, BAY, BAYS, BRASS, FLAME, Segments, VAULT_SPRING, WAX, WOOD};
use crate::builtin::solid::Solids;

/// Height of the hanging hoops.
const HOOP: f32 = 5.9;

struct Candles<'a> {
    s: &'a mut Solids,
    segments: &'a Segments,
    lit: bool,
}

impl Candles<'_> {
    /// Coarsely, every second candle with a larger flame.
    fn step(&self) -> usize {
        if self.segments.coarse() { 2 } else { 1 }
    }

    fn candle(&mut self, foot: Vec3, height: f32) {
        let (r, around) = (0.019, self.segments.of(9).max(3));
        if self.segments.coarse() {
            self.s.lathe(
                foot,
                &[Vec2::new(r, -0.01), Vec2::new(0.8 * r, height)],
                3,
                |_, _| 1.0,
                WAX,
            );
            if self.lit {
                let flame = [(0.032, 0.022), (0.020, 0.12)].map(Vec2::from);
                self.s.lathe(foot + Vec3::Y * height, &flame, 3, |_, _| 1.0, FLAME);
            }
            return;
        }
        self.s.lathe(
            foot,
            &[Vec2::new(r, -0.01), Vec2::new(r, height - 0.004), Vec2::new(0.7 * r, height)],
            around,
            |_, _| 1.0,
            WAX,
        );
        if self.segments.of(9) > 3 {
            let dish =
                [(0.012, -0.03), (0.04, -0.012), (0.045, 0.006), (0.02, 0.012)].map(Vec2::from);
            self.s.lathe(foot, &dish, around, |_, _| 1.0, BRASS);
        }
        if self.lit {
            let flame =
                [(0.004, 0.022), (0.022, 0.05), (0.016, 0.08), (0.002, 0.125)].map(Vec2::from);
            self.s.lathe(foot + Vec3::Y * height, &flame, around.min(8), |_, _| 1.0, FLAME);
        }
    }

    /// A rod from `from` to `to`, not along x.
    fn rod(&mut self, from: Vec3, to: Vec3, r: f32) {
        let along = (to - from).normalize();
        let u = along.cross(if along.x.abs() < 0.9 { Vec3::X } else { Vec3::Z }).normalize();
        let v = along.cross(u);
        let n = self.segments.of(9).max(3);
        let ring = |at: Vec3| {
            (0..n)
                .map(|i| Vec2::from_angle(TAU * i as f32 / n as f32) * r)
                .map(|p| at + u * p.x + v * p.y)
                .collect()
        };
        self.s.tube(&[ring(from), ring(to)], false, BRASS);
    }

    /// A flat hoop with candles on it, hung from a chain.
    fn hoop(&mut self, center: Vec3, radius: f32, candles: u32, ceiling: f32) {
        let n = self.segments.of(48).max(12);
        let section = [
            (-0.012, -0.06),
            (0.006, -0.06),
            (0.014, -0.045),
            (0.006, -0.03),
            (0.006, 0.03),
            (0.014, 0.045),
            (0.006, 0.06),
            (-0.012, 0.06),
        ];
        let section = if self.segments.coarse() {
            vec![(-0.012, -0.06), (0.01, -0.06), (0.01, 0.06), (-0.012, 0.06)]
        } else {
            section.to_vec()
        };
        let ring = |i: u32| {
            let d = Vec2::from_angle(TAU * i as f32 / n as f32);
            section
                .iter()
                .map(|&(r, y)| center + Vec3::new(d.x * (radius + r), y, d.y * (radius + r)))
                .collect()
        };
        self.s.tube(&(0..n).map(ring).collect::<Vec<_>>(), true, BRASS);
        let knot = center + Vec3::Y * (radius * 1.3);
        for i in (0..6).step_by(self.step()) {
            let d = Vec2::from_angle(TAU * (i as f32 + 0.25) / 6.0);
            self.rod(center + Vec3::new(d.x, 0.0, d.y) * radius, knot, 0.011);
            self.rod(center + Vec3::new(d.x, 0.0, d.y) * radius, center - Vec3::Y * 0.1, 0.011);
        }
        let drop: Vec<Vec2> =
            [(0.004, -0.34), (0.05, -0.22), (0.09, -0.10), (0.05, 0.0), (0.02, 0.06)]
                .map(Vec2::from)
                .into();
        self.s.lathe(center, &drop, self.segments.of(16), |_, _| 1.0, BRASS);
        self.rod(knot - Vec3::Y * 0.05, Vec3::new(center.x, ceiling, center.z), 0.016);
        for i in (0..candles).step_by(self.step()) {
            let d = Vec2::from_angle(TAU * (i as f32 + 0.5) / candles as f32);
            self.candle(center + Vec3::new(d.x * radius, 0.08, d.y * radius), 0.20);
        }
    }

    /// A standing candelabrum: foot, stem with knops, two arcs of arms.
    fn stand(&mut self, foot: Vec3, height: f32, arms: u32) {
        let k = height / 1.7;
        let stem: Vec<Vec2> = [
            (0.20, 0.0),
            (0.19, 0.03),
            (0.10, 0.07),
            (0.035, 0.14),
            (0.025, 0.5),
            (0.055, 0.55),
            (0.055, 0.60),
            (0.025, 0.65),
            (0.02, 1.1),
            (0.045, 1.15),
            (0.02, 1.2),
            (0.018, 1.66),
            (0.03, 1.7),
        ]
        .map(|(r, y)| Vec2::new(r, y * k + 0.001))
        .into();
        let around = self.segments.of(14).max(4);
        self.s.lathe(foot, &stem, around, |_, _| 1.0, BRASS);
        self.candle(foot + Vec3::Y * (height + 0.01), 0.24);
        for i in (0..arms).step_by(self.step()) {
            let d = Vec2::from_angle(TAU * (i as f32 + 0.3) / arms as f32);
            let out = Vec3::new(d.x, 0.0, d.y);
            let n = self.segments.of(7).max(if self.segments.coarse() { 1 } else { 2 });
            let mut last = foot + Vec3::Y * (1.15 * k);
            for j in 1..=n {
                let a = 0.5 * std::f32::consts::PI * j as f32 / n as f32;
                let at =
                    foot + out * (0.30 * a.sin()) + Vec3::Y * (1.15 * k + 0.28 * (1.0 - a.cos()));
                // The pieces reach a little into each other.
                let more = (at - last).normalize() * 0.004;
                self.rod(last - more, at + more, 0.011);
                last = at;
            }
            self.candle(last + Vec3::Y * 0.012, 0.20);
        }
    }

    /// A stepped rack of small lights before an aisle's wall; `out` looks away from the wall.
    fn rack(&mut self, foot: Vec3, out: f32) {
        for step in 0..3 {
            let (y, z) = (0.75 + 0.16 * step as f32, foot.z - out * 0.17 * step as f32);
            block(
                self.s,
                Vec3::new(foot.x - 0.95, y - 0.04, z - 0.1),
                Vec3::new(foot.x + 0.95, y, z + 0.1),
                0.01,
                WOOD,
            );
            for i in (0..11).step_by(self.step()) {
                self.candle(
                    Vec3::new(
                        foot.x + (i as f32 - 5.0) * 0.165 + 0.02 * (step as f32 - 1.0),
                        y + 0.012,
                        z,
                    ),
                    0.07 + 0.05 * (((i * 7 + step * 5) % 4) as f32),
                );
            }
        }
        for x in [-0.86, 0.86] {
            let (a, b) = (foot.z - out * 0.40, foot.z + out * 0.06);
            block(
                self.s,
                Vec3::new(foot.x + x - 0.03, -0.01, a.min(b)),
                Vec3::new(foot.x + x + 0.03, 0.73, a.max(b)),
                0.008,
                WOOD,
            );
        }
    }
}

/// All of them.
pub(super) fn candles(s: &mut Solids, lit: bool, segments: &Segments) {
    let mut c = Candles { s, segments, lit };
    for bay in 1..BAYS - 1 {
        let x = (bay as f32 + 0.5) * BAY;
        c.hoop(Vec3::new(x, HOOP, 0.0), 1.15, 24, VAULT_SPRING + 6.7);
        for side in [-1.0, 1.0] {
            c.hoop(Vec3::new(x, 3.7, side * 7.72), 0.6, 10, AISLE_SPRING + 3.5);
        }
    }
    for i in 1..BAYS {
        for side in [-1.0, 1.0] {
            c.stand(Vec3::new(i as f32 * BAY, 0.0, side * 3.72), 1.75, 6);
        }
    }
    for bay in [1, 3, 5] {
        for side in [-1.0, 1.0] {
            c.rack(Vec3::new((bay as f32 + 0.5) * BAY, 0.0, side * (AISLE_FACE - 0.55)), -side);
        }
    }
    for z in [-1.45, -1.2, -0.8, 0.8, 1.2, 1.45] {
        c.candle(Vec3::new(32.75, 1.56, z), 0.45);
    }
    for side in [-1.0, 1.0] {
        c.stand(Vec3::new(31.2, 0.48, side * 2.4), 2.0, 8);
    }
}
