//! A furry ball on a lawn's corner: hair of all directions close together, over skin and a white
//! floor.
//!
//! The unit of length is the ball's radius without its fur. Hairs stand on a Fibonacci lattice with
//! jitter, bend down and to one side, and taper to a point; blades of grass stand around on a
//! square patch of the floor. Both are Catmull–Rom curves of four points.
//! Knobs  `detail` 1: 30 000 hairs and 6 000 blades times this; `length` 0.35; `width` 0.012 at the
//!        root, thinner with more detail, so that what is covered stays the same.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use serde::Deserialize;

use super::solid::Solids;
use super::{Generated, diffuse};
use crate::math::Frame;
use crate::sampling::{Rng, Stream};
use crate::scene::{Basis, Curves};

/// Parameters of the fur.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FurParameters {
    /// Number of hairs and blades, times 30 000 and 6 000, 0.01–30.
    pub detail: f32,
    /// Length of a hair, 0.02–2.
    pub length: f32,
    /// Diameter of a hair at its root for `detail` 1, 0.0005–0.1.
    pub width: f32,
}

impl Default for FurParameters {
    fn default() -> Self {
        Self { detail: 1.0, length: 0.35, width: 0.012 }
    }
}

/// Makes the ball, its fur, the floor and the grass.
///
/// # Errors
/// When a parameter is out of range.
pub fn fur(p: &FurParameters) -> Result<Generated, String> {
    for (name, value, least, most) in [
        ("detail", p.detail, 0.01, 30.0),
        ("length", p.length, 0.02, 2.0),
        ("width", p.width, 0.0005, 0.1),
    ] {
        if !(least..=most).contains(&value) {
            return Err(format!("{name} is {value} but must lie from {least} to {most}"));
        }
    }
    let mut s = Solids::default();
    s.cuboid(Vec3::new(-5.0, -1.5, -5.0), Vec3::new(5.0, -1.0, 5.0), 0);
    let profile: Vec<Vec2> = (0..=32)
        .map(|i| PI * (0.01 + 0.98 * i as f32 / 32.0))
        .map(|a| Vec2::new(a.sin(), -a.cos()))
        .collect();
    s.lathe(Vec3::ZERO, &profile, 64, |_, _| 1.0, 1);
    let count = |per_detail: f32| (per_detail * p.detail).round().max(1.0) as u64;
    let width = p.width / p.detail.sqrt();
    let mut hairs = Curves { basis: Basis::CatmullRom, material: 2, ..Curves::default() };
    let total = count(30_000.0);
    for i in 0..total {
        let mut rng = Rng::new(0, Stream::Scene, i, 1);
        let z = 1.0 - (2.0 * i as f32 + 1.0) / total as f32;
        let angle = (i as f64 * 2.399_963_229_728_653 % f64::from(TAU)) as f32
            + (rng.next_f32() - 0.5) * 0.1;
        let (sin, cos) = angle.sin_cos();
        let flat = (1.0 - z * z).max(0.0).sqrt();
        let root = Vec3::new(flat * cos, z, flat * sin);
        let frame = Frame::from_normal(root);
        let jitter = (rng.next_2d() - 0.5) * 0.7;
        let comb = Vec3::new(0.5, -0.75, 0.3) + 0.5 * Vec3::Y.cross(root);
        let start = (root + frame.s * jitter.x + frame.t * jitter.y).normalize();
        let length = p.length * (0.6 + 0.4 * rng.next_f32());
        hairs.push_curve(strand(root * 0.99, start, comb, length, width));
    }
    let mut grass = Curves { basis: Basis::CatmullRom, material: 3, ..Curves::default() };
    for i in 0..count(6_000.0) {
        let mut rng = Rng::new(0, Stream::Scene, i, 2);
        let at = rng.next_2d() * 4.4 - 2.2;
        let lean = rng.next_2d() - 0.5;
        let height = 0.25 + 0.35 * rng.next_f32();
        let start = Vec3::new(lean.x, 1.6, lean.y).normalize();
        grass.push_curve(strand(
            Vec3::new(at.x, -1.01, at.y),
            start,
            Vec3::new(lean.x, -0.4, lean.y),
            height,
            width * 2.0,
        ));
    }
    let colors: [(&str, [f32; 3]); 4] = [
        ("floor", [0.7; 3]),
        ("skin", [0.6, 0.42, 0.34]),
        ("fur", [0.72, 0.5, 0.3]),
        ("grass", [0.25, 0.5, 0.12]),
    ];
    let materials = diffuse(&colors);
    Ok(Generated { mesh: s.mesh, curves: vec![hairs, grass], materials, ..Generated::default() })
}

/// Four points from a root, first along `start`, more and more along `bend`; (point, width).
fn strand(root: Vec3, start: Vec3, bend: Vec3, length: f32, width: f32) -> Vec<(Vec3, f32)> {
    let (mut p, mut list) = (root, vec![(root, width)]);
    for k in 1..=3 {
        let t = k as f32 / 3.0;
        p += (start + bend * (t * t * 0.8)).normalize_or(start) * (length / 3.0);
        list.push((p, width * (1.0 - t * t)));
    }
    list
}
