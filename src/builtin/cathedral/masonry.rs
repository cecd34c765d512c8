//! Stone by stone: cuts finished solids along courses and joints, and gives every block its own
//! tint.
//!
//! The cuts are whole planes (heights `k · course`, and `k · joint` along x and z), so neighbouring
//! triangles are cut at equal points and closed solids stay closed. Blocks are two joints long;
//! every other course is shifted by one.

use std::collections::HashMap;

use glam::Vec3;

use crate::sampling::hash64;
use crate::scene::Mesh;

/// Corners nearer than this to a plane lie on it, in metres.
const ON: f32 = 2e-4;

/// A number in \[0, 1) for a block.
pub(super) fn chance(a: i64, b: i64, c: i64) -> f32 {
    let bits = hash64(hash64(hash64(a as u64) ^ (b as u64)) ^ (c as u64));
    (bits >> 40) as f32 / (1u64 << 24) as f32
}

struct Cutter<'a> {
    positions: &'a mut Vec<Vec3>,
    ids: HashMap<[u32; 3], u32>,
}

impl Cutter<'_> {
    fn point(&mut self, p: Vec3) -> u32 {
        *self.ids.entry(p.to_array().map(f32::to_bits)).or_insert_with(|| {
            self.positions.push(p);
            self.positions.len() as u32 - 1
        })
    }

    /// The part of a triangle below a plane goes to `done`, the rest back to `above`.
    fn cut(
        &mut self,
        triangle: [u32; 3],
        axis: usize,
        plane: f32,
        below: &mut Vec<[u32; 3]>,
        above: &mut Vec<[u32; 3]>,
    ) {
        let side = triangle.map(|i| {
            let d = self.positions[i as usize][axis] - plane;
            if d.abs() <= ON { 0 } else { d.signum() as i32 }
        });
        if side.iter().all(|&s| s <= 0) {
            below.push(triangle);
            return;
        }
        if side.iter().all(|&s| s >= 0) {
            above.push(triangle);
            return;
        }
        let (mut low, mut high) = (Vec::with_capacity(4), Vec::with_capacity(4));
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            if side[k] <= 0 {
                low.push(a);
            }
            if side[k] >= 0 {
                high.push(a);
            }
            if side[k] * side[(k + 1) % 3] < 0 {
                // From the lower end: both triangles of an edge find the same point.
                let (p, q) = if side[k] < 0 { (a, b) } else { (b, a) };
                let (p, q) = (self.positions[p as usize], self.positions[q as usize]);
                let mut m = p.lerp(q, (plane - p[axis]) / (q[axis] - p[axis]));
                m[axis] = plane;
                let m = self.point(m);
                low.push(m);
                high.push(m);
            }
        }
        for (polygon, out) in [(low, below), (high, above)] {
            // Where two edges cross the plane at one point, the sliver between them closes up.
            out.extend(
                (2..polygon.len())
                    .map(|i| [polygon[0], polygon[i - 1], polygon[i]])
                    .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]),
            );
        }
    }
}

/// Cuts the triangles for which `pitch(material)` is the (joint, course) in metres; `tint(block
/// chance, material)` is a block's material.
pub(super) fn lay(
    mesh: &mut Mesh,
    pitch: impl Fn(u32) -> Option<[f32; 2]>,
    tint: impl Fn(f32, u32) -> u32,
) {
    let (triangles, materials) =
        (std::mem::take(&mut mesh.triangles), std::mem::take(&mut mesh.materials));
    let mut cutter = Cutter { positions: &mut mesh.positions, ids: HashMap::new() };
    for (triangle, material) in triangles.into_iter().zip(materials) {
        let Some([joint, course]) = pitch(material) else {
            mesh.triangles.push(triangle);
            mesh.materials.push(material);
            continue;
        };
        let mut pieces = vec![triangle];
        for (axis, step) in [joint, course, joint].into_iter().enumerate() {
            let ends = triangle.map(|i| cutter.positions[i as usize][axis]);
            let (low, high) = (
                ends.iter().copied().fold(f32::INFINITY, f32::min),
                ends.iter().copied().fold(f32::NEG_INFINITY, f32::max),
            );
            let mut done = Vec::new();
            for k in (low / step).floor() as i32..=(high / step).ceil() as i32 {
                let mut above = Vec::new();
                pieces
                    .drain(..)
                    .for_each(|t| cutter.cut(t, axis, k as f32 * step, &mut done, &mut above));
                pieces = above;
            }
            done.append(&mut pieces);
            pieces = done;
        }
        for t in pieces {
            let c = t.iter().map(|&i| cutter.positions[i as usize]).sum::<Vec3>() / 3.0;
            let row = (c.y / course).floor() as i64;
            let block = |v: f32| ((v / joint).floor() as i64 + row.rem_euclid(2)).div_euclid(2);
            mesh.triangles.push(t);
            mesh.materials.push(tint(chance(block(c.x), row, block(c.z)), material));
        }
    }
}
