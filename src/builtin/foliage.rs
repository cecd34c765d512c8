//! A tree whose crown is a cloud of leaves: open sheets, seen from both sides, that hide one
//! another.
//!
//! Units are metres, y up. Ground of 8 × 8; a trunk with branches; in an ellipsoid about (0, 1.9,
//! 0) every leaf is two triangles folded along its midrib. Leaves are denser towards the crown's
//! skin, as those of a tree are.
//! Knobs  `leaves` 6000, `size` 0.11 (length of a leaf), `detail` 1 (multiplies the number of
//!        leaves and shrinks them so that the leaf area stays).

use glam::Vec3;
use serde::Deserialize;

use super::solid::Solids;
use super::{Generated, diffuse};
use crate::math::Frame;
use crate::sampling::{Rng, Stream, sample_uniform_sphere};

/// Parameters of the foliage.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FoliageParameters {
    /// Number of leaves at detail 1, 1–1 000 000.
    pub leaves: u32,
    /// Length of a leaf at detail 1, metres, above 0 up to 1.
    pub size: f32,
    /// Multiplies the number of leaves, 0.01–100; their area in all stays.
    pub detail: f32,
}

impl Default for FoliageParameters {
    fn default() -> Self {
        Self { leaves: 6000, size: 0.11, detail: 1.0 }
    }
}

const CROWN: Vec3 = Vec3::new(0.0, 1.9, 0.0);
const CROWN_HALF: Vec3 = Vec3::new(1.15, 0.95, 1.15);

/// Makes the ground and the tree.
///
/// # Errors
/// When a parameter is out of range.
pub fn foliage(p: &FoliageParameters) -> Result<Generated, String> {
    let in_range = (1..=1_000_000).contains(&p.leaves)
        && p.size > 0.0
        && p.size <= 1.0
        && (0.01..=100.0).contains(&p.detail);
    if !in_range {
        return Err(
            "leaves must lie from 1 to 1000000, size between 0 and 1, detail from 0.01 to 100"
                .into(),
        );
    }
    let colors: [(&str, [f32; 3]); 5] = [
        ("ground", [0.55, 0.5, 0.42]),
        ("bark", [0.32, 0.24, 0.18]),
        ("leaf", [0.2, 0.45, 0.1]),
        ("young leaf", [0.4, 0.6, 0.15]),
        ("red leaf", [0.6, 0.25, 0.1]),
    ];
    let mut s = Solids::default();
    s.cuboid(Vec3::new(-4.0, -0.2, -4.0), Vec3::new(4.0, 0.0, 4.0), 0);
    limb(&mut s, Vec3::new(0.0, -0.05, 0.0), Vec3::new(0.05, 1.9, 0.02), 0.11, 0.05);
    for branch in 0..7u64 {
        let mut rng = Rng::new(11, Stream::Scene, 3, branch);
        let from = Vec3::new(0.02, 1.0 + 0.11 * branch as f32, 0.01);
        let out = sample_uniform_sphere(rng.next_2d());
        let to = CROWN + CROWN_HALF * Vec3::new(out.x, 0.4 * out.y + 0.2, out.z) * 0.75;
        limb(&mut s, from, to, 0.035, 0.012);
    }
    let count = (p.leaves as f32 * p.detail).round().max(1.0) as u64;
    let length = p.size / p.detail.sqrt();
    for leaf in 0..count {
        add_leaf(&mut s, leaf, length);
    }
    Ok(Generated { mesh: s.mesh, materials: diffuse(&colors), ..Generated::default() })
}

/// A tapering tube of six sides.
fn limb(s: &mut Solids, from: Vec3, to: Vec3, thick: f32, thin: f32) {
    let frame = Frame::from_normal((to - from).normalize());
    let ring = |at: Vec3, r: f32| {
        let corner = |(c, s): (f32, f32)| at + frame.world_from_local(Vec3::new(c * r, s * r, 0.0));
        [
            (1.0, 0.0),
            (0.5, 0.866_025_4),
            (-0.5, 0.866_025_4),
            (-1.0, 0.0),
            (-0.5, -0.866_025_4),
            (0.5, -0.866_025_4),
        ]
        .map(corner)
        .to_vec()
    };
    s.tube(
        &[ring(from, thick), ring((from + to) * 0.5, (thick + thin) * 0.5), ring(to, thin)],
        false,
        1,
    );
}

/// Two triangles that share the midrib.
fn add_leaf(s: &mut Solids, leaf: u64, length: f32) {
    let mut rng = Rng::new(11, Stream::Scene, 4, leaf);
    let out = sample_uniform_sphere(rng.next_2d());
    // Uniform in volume would be the cube root; the square root of that again thickens the skin.
    let at = CROWN + CROWN_HALF * out * rng.next_f32().powf(1.0 / 5.0);
    // Leaves hang outwards and down, with much scatter; their faces turn up.
    let along = (out + Vec3::new(0.0, -0.3, 0.0) + sample_uniform_sphere(rng.next_2d()) * 0.9)
        .normalize_or(Vec3::X);
    let face =
        (Vec3::Y + out * 0.5 + sample_uniform_sphere(rng.next_2d()) * 0.8).normalize_or(Vec3::Y);
    let across = along.cross(face).normalize_or(Vec3::Z);
    let up = across.cross(along);
    let half = across * (0.28 * length) + up * (0.07 * length);
    let other = -across * (0.28 * length) + up * (0.07 * length);
    let base = s.mesh.positions.len() as u32;
    let middle = at + along * (0.45 * length);
    s.mesh.positions.extend([at, middle + half, at + along * length, middle + other]);
    s.mesh.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
    s.mesh.materials.extend([[2, 2, 3, 2, 3, 4][rng.below(6)]; 2]);
}
