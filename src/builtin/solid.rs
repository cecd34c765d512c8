//! Closed solids for generated scenes: every part is a watertight, outward-wound component,
//! wherever it stands.
//!
//! Parts that touch are sunk into each other (never laid face on face), so that no two surfaces
//! coincide.

use std::collections::HashMap;
use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use crate::scene::Mesh;

/// A mesh under construction.
#[derive(Debug, Default)]
pub struct Solids {
    /// What has been made.
    pub mesh: Mesh,
}

impl Solids {
    /// Adds one closed component; flips it when its volume is negative.
    pub fn solid(&mut self, positions: &[Vec3], mut triangles: Vec<[u32; 3]>, materials: &[u32]) {
        let p = |i: u32| positions[i as usize].as_dvec3();
        let volume: f64 = triangles.iter().map(|t| p(t[0]).dot(p(t[1]).cross(p(t[2])))).sum();
        if volume < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let base = self.mesh.positions.len() as u32;
        self.mesh.positions.extend_from_slice(positions);
        self.mesh.triangles.extend(triangles.into_iter().map(|t| t.map(|i| i + base)));
        self.mesh.materials.extend_from_slice(materials);
    }

    /// A tube through rings of equally many points: `rings[k][i]` to `rings[k + 1][i]`; `closed`
    /// joins the last ring to the first, else flat fans close both ends.
    pub fn tube(&mut self, rings: &[Vec<Vec3>], closed: bool, material: u32) {
        self.tube_by(rings, closed, |_| material);
    }

    /// [`Self::tube`] with `material(k)` between ring k and the next; the ends take their
    /// neighbour's.
    pub fn tube_by(&mut self, rings: &[Vec<Vec3>], closed: bool, material: impl Fn(usize) -> u32) {
        let (n, m) = (rings[0].len() as u32, rings.len() as u32);
        let mut positions: Vec<Vec3> = rings.iter().flatten().copied().collect();
        let (mut triangles, mut materials) = (Vec::new(), Vec::new());
        for k in 0..(if closed { m } else { m - 1 }) {
            for i in 0..n {
                let (a, b) = (k * n + i, k * n + (i + 1) % n);
                let (c, d) = ((k + 1) % m * n + i, (k + 1) % m * n + (i + 1) % n);
                triangles.extend([[a, b, d], [a, d, c]]);
                materials.extend([material(k as usize); 2]);
            }
        }
        if !closed {
            for (start, ring, first) in
                [(0, &rings[0], true), ((m - 1) * n, &rings[m as usize - 1], false)]
            {
                let center = positions.len() as u32;
                positions.push(ring.iter().sum::<Vec3>() / n as f32);
                for i in 0..n {
                    let (a, b) = (start + i, start + (i + 1) % n);
                    triangles.push(if first { [center, b, a] } else { [center, a, b] });
                    materials.push(material(if first { 0 } else { m as usize - 2 }));
                }
            }
        }
        self.solid(&positions, triangles, &materials);
    }

    /// An axis-aligned box.
    pub fn cuboid(&mut self, min: Vec3, max: Vec3, material: u32) {
        let ring = |y: f32| {
            vec![
                Vec3::new(min.x, y, min.z),
                Vec3::new(max.x, y, min.z),
                Vec3::new(max.x, y, max.z),
                Vec3::new(min.x, y, max.z),
            ]
        };
        let rings = [ring(min.y), ring(max.y)];
        let positions: Vec<Vec3> = rings.iter().flatten().copied().collect();
        let quads =
            [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7], [3, 2, 1, 0], [4, 5, 6, 7]];
        let triangles: Vec<[u32; 3]> =
            quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        self.solid(&positions, triangles, &[material; 12]);
    }

    /// A body of revolution about the vertical through `foot`: `profile` holds (radius, height),
    /// `around` segments; the radius is multiplied by `flute(angle, radius, height)`.
    pub fn lathe(
        &mut self,
        foot: Vec3,
        profile: &[Vec2],
        around: u32,
        flute: impl Fn(f32, Vec2) -> f32,
        material: u32,
    ) {
        let rings: Vec<Vec<Vec3>> = profile
            .iter()
            .map(|&p| {
                (0..around)
                    .map(|i| {
                        let angle = TAU * i as f32 / around as f32;
                        let r = p.x * flute(angle, p);
                        foot + Vec3::new(r * angle.cos(), p.y, r * angle.sin())
                    })
                    .collect()
            })
            .collect();
        self.tube(&rings, false, material);
    }

    /// A moulding around a rectangle (corner, two edge vectors), mitred: `profile` is a closed
    /// polygon of (distance inwards from the edge, height along `edge1 × edge2`).
    pub fn frame(
        &mut self,
        corner: Vec3,
        edge1: Vec3,
        edge2: Vec3,
        profile: &[Vec2],
        material: u32,
    ) {
        let (x, y) = (edge1.normalize(), edge2.normalize());
        let n = x.cross(y);
        let corners = [
            (corner, x + y),
            (corner + edge1, y - x),
            (corner + edge1 + edge2, -x - y),
            (corner + edge2, x - y),
        ];
        let rings: Vec<Vec<Vec3>> = corners
            .iter()
            .map(|&(c, inwards)| profile.iter().map(|p| c + inwards * p.x + n * p.y).collect())
            .collect();
        self.tube(&rings, true, material);
    }

    /// A straight moulding from `from` to `to`: `profile` is a closed convex polygon of (along
    /// `out`, along `up`).
    pub fn bar(
        &mut self,
        from: Vec3,
        to: Vec3,
        out: Vec3,
        up: Vec3,
        profile: &[Vec2],
        material: u32,
    ) {
        let ring = |at: Vec3| profile.iter().map(|p| at + out * p.x + up * p.y).collect();
        self.tube(&[ring(from), ring(to)], false, material);
    }

    /// The union of the cells of a grid that `filled(i, j, k)` names: cell i of an axis lies
    /// between its lines i and i + 1. No edge may be met by filled cells only across it. `material`
    /// chooses by a face's centre and outward normal.
    pub fn grid(
        &mut self,
        lines: [&[f32]; 3],
        filled: impl Fn([usize; 3]) -> bool,
        material: impl Fn(Vec3, Vec3) -> u32,
    ) {
        let cells = lines.map(|l| l.len() - 1);
        let mut ids: HashMap<[usize; 3], u32> = HashMap::new();
        let (mut positions, mut triangles, mut materials) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..cells[0] {
            for j in 0..cells[1] {
                for k in 0..cells[2] {
                    let cell = [i, j, k];
                    if !filled(cell) {
                        continue;
                    }
                    for axis in 0..3 {
                        for far in [false, true] {
                            let mut neighbour = cell;
                            let outside =
                                if far { cell[axis] + 1 == cells[axis] } else { cell[axis] == 0 };
                            if !outside {
                                neighbour[axis] = if far { cell[axis] + 1 } else { cell[axis] - 1 };
                                if filled(neighbour) {
                                    continue;
                                }
                            }
                            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                            let order = if far {
                                [(0, 0), (1, 0), (1, 1), (0, 1)]
                            } else {
                                [(0, 0), (0, 1), (1, 1), (1, 0)]
                            };
                            let mut center = Vec3::ZERO;
                            let quad = order.map(|(du, dv)| {
                                let mut at = cell;
                                at[axis] += usize::from(far);
                                at[u] += du;
                                at[v] += dv;
                                let p =
                                    Vec3::new(lines[0][at[0]], lines[1][at[1]], lines[2][at[2]]);
                                center += p * 0.25;
                                *ids.entry(at).or_insert_with(|| {
                                    positions.push(p);
                                    positions.len() as u32 - 1
                                })
                            });
                            let normal = Vec3::AXES[axis] * if far { 1.0 } else { -1.0 };
                            let m = material(center, normal);
                            triangles
                                .extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
                            materials.extend([m, m]);
                        }
                    }
                }
            }
        }
        self.solid(&positions, triangles, &materials);
    }
}
