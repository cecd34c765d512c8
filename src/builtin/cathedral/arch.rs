//! Pointed arches: two arcs whose centres lie beyond the middle, and the outlines of openings made
//! of them.

use glam::Vec2;

/// A pointed arch over the origin: half its span, and its arcs' radius as a multiple of that (1:
/// round, 2: equilateral).
#[derive(Clone, Copy, Debug)]
pub(super) struct Pointed {
    pub half: f32,
    pub sharp: f32,
}

impl Pointed {
    /// The point at `s` from −1 (left springing) over 0 (apex) to 1, on the curve `offset` outside
    /// the arch, and the direction outwards.
    pub(super) fn at(&self, s: f32, offset: f32) -> (Vec2, Vec2) {
        let (center, radius) = ((self.sharp - 1.0) * self.half, self.sharp * self.half + offset);
        let angle = (center / radius).acos() * (1.0 - s.abs());
        let radial = Vec2::new(angle.cos(), angle.sin());
        let mut p = radial * radius - Vec2::new(center, 0.0);
        if s == 0.0 {
            p.x = 0.0;
        }
        let mirror = Vec2::new(if s < 0.0 { -1.0 } else { 1.0 }, 1.0);
        (p * mirror, if s == 0.0 { Vec2::Y } else { radial * mirror })
    }

    /// `2 n + 1` points from left to right, springing at `foot`.
    pub(super) fn curve(&self, foot: Vec2, n: u32, offset: f32) -> Vec<(Vec2, Vec2)> {
        let at = |i: i32| self.at(i as f32 / n as f32, offset);
        (-(n as i32)..=n as i32).map(|i| (at(i).0 + foot, at(i).1)).collect()
    }

    /// Rise of the curve `offset` outside.
    pub(super) fn rise(&self, offset: f32) -> f32 {
        self.at(0.0, offset).0.y
    }

    /// A lancet: straight sides from `sill` up to the springing at `foot`, as a closed outline.
    pub(super) fn lancet(&self, foot: Vec2, sill: f32, n: u32, offset: f32) -> Vec<Vec2> {
        let half = self.half + offset;
        let mut outline: Vec<Vec2> =
            self.curve(foot, n, offset).iter().rev().map(|p| p.0).collect();
        outline.push(Vec2::new(foot.x - half, sill - offset));
        outline.push(Vec2::new(foot.x + half, sill - offset));
        outline
    }
}

/// A circle of `n` points.
pub(super) fn circle(center: Vec2, radius: f32, n: u32) -> Vec<Vec2> {
    (0..n)
        .map(|i| center + radius * Vec2::from_angle(std::f32::consts::TAU * i as f32 / n as f32))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equilateral_arch_rises_by_root_three_and_offsets_stay_apart() {
        let arch = Pointed { half: 2.0, sharp: 2.0 };
        assert!((arch.rise(0.0) - 2.0 * 3.0_f32.sqrt()).abs() < 1e-5);
        for (p, q) in arch.curve(Vec2::ZERO, 8, 0.0).iter().zip(arch.curve(Vec2::ZERO, 8, 0.3)) {
            assert!((q.0 - p.0).length() > 0.299, "{p:?} {q:?}");
        }
        assert_eq!(arch.at(1.0, 0.0).0, Vec2::new(2.0, 0.0));
    }
}
