//! A ball of thin curled hairs in an open box: everything near a hair is hidden behind other hairs.
//!
//! Box of 3 × 2.6 × 3 units, open to the camera (+z), left wall warm, right wall cool; the ball of
//! radius 0.8 floats at (0, 1.15, 0). A hair starts near the ball's centre and wanders outwards; at
//! the ball's surface it turns back in. Each is a closed tube of three sides, so that no ray slips
//! between front and back.
//! Knobs  `hairs` 500, `thickness` 0.008 (radius of a hair), `detail` 1 (segments a unit of length,
//!        times 28).

use glam::Vec3;
use serde::Deserialize;

use super::solid::Solids;
use super::{Generated, diffuse};
use crate::math::Frame;
use crate::sampling::{Rng, Stream, sample_uniform_sphere};

/// Parameters of the hairball.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HairballParameters {
    /// Number of hairs, 1–100 000.
    pub hairs: u32,
    /// Radius of a hair, scene units, above 0 up to 0.1.
    pub thickness: f32,
    /// Multiplies the segments along a hair, 0.1–16.
    pub detail: f32,
}

impl Default for HairballParameters {
    fn default() -> Self {
        Self { hairs: 500, thickness: 0.008, detail: 1.0 }
    }
}

const CENTRE: Vec3 = Vec3::new(0.0, 1.15, 0.0);
const RADIUS: f32 = 0.8;
/// Length of a hair.
const LENGTH: f32 = 1.4;

/// Makes the box and the ball.
///
/// # Errors
/// When a parameter is out of range.
pub fn hairball(p: &HairballParameters) -> Result<Generated, String> {
    let in_range = (1..=100_000).contains(&p.hairs)
        && p.thickness > 0.0
        && p.thickness <= 0.1
        && (0.1..=16.0).contains(&p.detail);
    if !in_range {
        return Err(
            "hairs must lie from 1 to 100000, thickness between 0 and 0.1, detail from 0.1 to 16"
                .into(),
        );
    }
    let colors: [(&str, [f32; 3]); 6] = [
        ("white", [0.75; 3]),
        ("warm", [0.7, 0.25, 0.15]),
        ("cool", [0.2, 0.3, 0.65]),
        ("straw", [0.75, 0.65, 0.42]),
        ("copper", [0.7, 0.42, 0.25]),
        ("silver", [0.68, 0.7, 0.72]),
    ];
    let mut s = Solids::default();
    let lines: [&[f32]; 3] = [&[-1.6, -1.5, 1.5, 1.6], &[-0.1, 0.0, 2.6, 2.7], &[-1.6, -1.5, 1.5]];
    s.grid(
        lines,
        |[i, j, k]| i != 1 || j != 1 || k == 0,
        |c, n| {
            let side = c.x.abs() < 1.55 && n.x.abs() > 0.5;
            if side { if n.x > 0.0 { 1 } else { 2 } } else { 0 }
        },
    );
    let steps = ((28.0 * LENGTH * p.detail).round() as u32).max(2);
    for hair in 0..p.hairs {
        let rings: Vec<Vec<Vec3>> = tube_rings(&path(hair, steps), p.thickness);
        s.tube(&rings, false, 3 + hair % 3);
    }
    Ok(Generated { mesh: s.mesh, materials: diffuse(&colors), ..Generated::default() })
}

/// Points along one hair.
fn path(hair: u32, steps: u32) -> Vec<Vec3> {
    let mut rng = Rng::new(11, Stream::Scene, 2, u64::from(hair));
    let mut dir = sample_uniform_sphere(rng.next_2d());
    let mut at = dir * (0.1 * RADIUS);
    let step = LENGTH / steps as f32;
    // A hair curls about a slowly turning axis of its own.
    let axis = sample_uniform_sphere(rng.next_2d());
    let curl = 1.5 + 4.0 * rng.next_f32();
    let mut out = vec![CENTRE + at];
    for _ in 0..steps {
        let outside = (at.length() / RADIUS - 0.92).max(0.0);
        let jitter = sample_uniform_sphere(rng.next_2d()) * 1.2;
        let turn = axis.cross(dir) * curl + jitter - at.normalize_or(dir) * (outside * 120.0);
        dir = (dir + turn * step).normalize_or(dir);
        at += dir * step;
        out.push(CENTRE + at);
    }
    out
}

/// Triangular rings about the points, carried along without twist.
fn tube_rings(points: &[Vec3], radius: f32) -> Vec<Vec<Vec3>> {
    let tangent = |i: usize| {
        (points[(i + 1).min(points.len() - 1)] - points[i.saturating_sub(1)]).normalize()
    };
    let mut side = Frame::from_normal(tangent(0)).world_from_local(Vec3::X);
    (0..points.len())
        .map(|i| {
            let t = tangent(i);
            side = (side - t * t.dot(side))
                .normalize_or(Frame::from_normal(t).world_from_local(Vec3::X));
            let up = t.cross(side);
            // cos and sin of 0, 120 and 240 degrees.
            [(1.0, 0.0), (-0.5, 0.866_025_4), (-0.5, -0.866_025_4)]
                .map(|(c, s)| points[i] + (side * c + up * s) * radius)
                .to_vec()
        })
        .collect()
}
