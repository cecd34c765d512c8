//! Where a vertex of a Catmull–Clark surface ends after infinitely many levels, and the normals
//! there.
//!
//! A vertex and its ring of edge ends eᵢ and face corners fᵢ (all faces quads) map to the next
//! level's ring by a fixed matrix; limit position and tangents are its left eigenvectors `[HKD93]`.
//! With k faces around, θ = 2π/k inside and π/k between two creases:
//!
//! ```text
//! smooth  position  (k² v + 4 Σ eᵢ + Σ fᵢ) / (k (k + 5))
//!         tangents  Σ a cos(iθ) eᵢ + (cos(iθ) + cos((i+1)θ)) fᵢ,  and the same with sin
//! crease  position  (e₀ + 4 v + e_k) / 6
//!         tangents  e₀ − e_k
//!                   l_v v + l₀ (e₀ + e_k) + Σ a sin(iθ) eᵢ + Σ (sin(iθ) + sin((i+1)θ)) fᵢ
//! corner  position  v
//!         tangents  e₀ − v,  e_k − v
//! ```
//!
//! with `a = 1 + cos θ + cos(θ/2) √(2 (9 + cos θ)) = 16 λ − 4`. The crease's cross tangent is that
//! of the unmodified rules, derived like `[HKD93]`'s: from `l M = λ l` in the column of e₀ and from
//! `Σ l = 0`, with C = cot(θ/2), `l₀ = (sin θ (a + 4) − 2 C (a + 2)) / a`, `l_v = −2 l₀ − C (a +
//! 2)`. Edges still semi-sharp are first refined until they no longer are, in the ring alone. A
//! dart (one sharp edge) has no such formula: its ring is refined until it has shrunk to the point.
//!
//! Guarantees  positions exact to rounding whatever the level. Not  normals where there are none:
//!             at corners whose edges are in line, at closed cones, and for rings without area the
//!             mean of the ring's face normals stands in.

use glam::DVec3;

use super::half_edges::{HalfEdges, VertexSums, edge_point, fade};
use crate::scene::INFINITE_SHARPNESS;

/// A vertex with its ring: `k` faces counter-clockwise; face i lies between spokes i and i + 1.
/// Closed rings have `k` spokes, open ones `k + 1`.
#[derive(Clone, Debug)]
pub(super) struct Ring {
    v: DVec3,
    spokes: Vec<DVec3>,
    sharpness: Vec<f32>,
    faces: Vec<DVec3>,
    vertex_sharpness: f32,
    closed: bool,
}

/// Levels after which a dart's ring has shrunk to a point in double precision.
const DART_LEVELS: u32 = 64;
/// Levels after which a dart's ring is flat.
const DART_FLAT_LEVELS: u32 = 16;

fn is_infinite(s: f32) -> bool {
    s >= INFINITE_SHARPNESS
}

impl Ring {
    /// The ring of the start vertex of `fan`'s corners (see [`HalfEdges::fan`]); all faces must be
    /// quads.
    pub fn new(mesh: &HalfEdges, fan: &[u32], closed: bool) -> Self {
        let at = |c: u32| mesh.positions[mesh.vertex[c as usize] as usize];
        let v = mesh.vertex[fan[0] as usize] as usize;
        let mut spokes: Vec<DVec3> = fan.iter().map(|&c| at(mesh.next(c))).collect();
        let mut sharpness: Vec<f32> =
            fan.iter().map(|&c| mesh.edge_sharpness[mesh.edge[c as usize] as usize]).collect();
        if !closed {
            let last = mesh.prev(fan[fan.len() - 1]);
            spokes.push(at(last));
            sharpness.push(mesh.edge_sharpness[mesh.edge[last as usize] as usize]);
        }
        let faces = fan.iter().map(|&c| at(mesh.next(mesh.next(c)))).collect();
        Self {
            v: mesh.positions[v],
            spokes,
            sharpness,
            faces,
            vertex_sharpness: mesh.vertex_sharpness[v],
            closed,
        }
    }

    fn spoke_after(&self, face: usize) -> usize {
        (face + 1) % self.spokes.len()
    }

    fn face_before(&self, spoke: usize) -> Option<usize> {
        match spoke.checked_sub(1) {
            None => self.closed.then(|| self.faces.len() - 1),
            before => before,
        }
    }

    /// The ring one level on.
    fn refined(&self) -> Self {
        let faces: Vec<DVec3> = (0..self.faces.len())
            .map(|i| {
                (self.v + self.spokes[i] + self.spokes[self.spoke_after(i)] + self.faces[i]) * 0.25
            })
            .collect();
        let mut sums = VertexSums::default();
        let spokes = (0..self.spokes.len())
            .map(|i| {
                sums.add_edge(self.spokes[i], self.sharpness[i]);
                let beside = self.face_before(i).zip((i < faces.len()).then_some(i));
                edge_point(
                    [self.v, self.spokes[i]],
                    beside.map(|(a, b)| [faces[a], faces[b]]),
                    self.sharpness[i],
                )
            })
            .collect();
        faces.iter().for_each(|&f| sums.add_face(f));
        Self {
            v: sums.point(self.v, self.vertex_sharpness),
            spokes,
            sharpness: self.sharpness.iter().map(|&s| fade(s)).collect(),
            faces,
            vertex_sharpness: fade(self.vertex_sharpness),
            closed: self.closed,
        }
    }

    /// The ring at the level from which on every sharp edge stays sharp.
    fn settled(mut self) -> Self {
        let fading = |s: f32| s > 0.0 && !is_infinite(s);
        while fading(self.vertex_sharpness) || self.sharpness.iter().any(|&s| fading(s)) {
            self = self.refined();
        }
        self
    }

    fn sharp_spokes(&self) -> Vec<usize> {
        (0..self.spokes.len()).filter(|&i| is_infinite(self.sharpness[i])).collect()
    }

    /// Limit position of a settled ring with these sharp spokes.
    fn position(&self, sharp: &[usize]) -> DVec3 {
        match sharp {
            _ if is_infinite(self.vertex_sharpness) => self.v,
            [] => {
                let k = self.faces.len() as f64;
                let (e, f): (DVec3, DVec3) = (self.spokes.iter().sum(), self.faces.iter().sum());
                (self.v * (k * k) + e * 4.0 + f) / (k * (k + 5.0))
            }
            [_] => {
                let mut ring = self.clone();
                for _ in 0..DART_LEVELS {
                    ring = ring.refined();
                }
                ring.v
            }
            [a, b] => (self.spokes[*a] + self.v * 4.0 + self.spokes[*b]) / 6.0,
            _ => self.v,
        }
    }

    /// Limit position and one normal per face of the fan, in its order.
    pub fn limit(self) -> (DVec3, Vec<DVec3>) {
        let ring = self.settled();
        let sharp = ring.sharp_spokes();
        let k = ring.faces.len();
        let corner = is_infinite(ring.vertex_sharpness) || sharp.len() > 2;
        let position = ring.position(&sharp);
        let all = |n: DVec3| vec![n; k];
        let normals = match &sharp[..] {
            [] if corner => all(ring.mean_normal(0, k)),
            [] => all(ring.smooth_normal()),
            [_] if !corner => {
                let mut flat = ring.clone();
                for _ in 0..DART_FLAT_LEVELS {
                    flat = flat.refined();
                }
                all(flat.mean_normal(0, k))
            }
            _ => {
                let mut normals = vec![DVec3::ZERO; k];
                for (i, &first) in sharp.iter().enumerate() {
                    let count = match sharp.get(i + 1) {
                        Some(&second) => second - first,
                        None if ring.closed => sharp[0] + k - first,
                        None => continue,
                    };
                    let n = ring.sector_normal(first, count, corner);
                    (first..first + count).for_each(|f| normals[f % k] = n);
                }
                normals
            }
        };
        (position, normals)
    }

    fn mean_normal(&self, first: usize, count: usize) -> DVec3 {
        let k = self.faces.len();
        let spoke = |i: usize| self.spokes[i % self.spokes.len()] - self.v;
        let sum: DVec3 = (first..first + count)
            .map(|i| {
                let across = self.faces[i % k] - self.v;
                spoke(i).cross(across) + across.cross(spoke(i + 1))
            })
            .sum();
        sum.normalize_or_zero()
    }

    /// The cross product of two tangents, or the mean normal where they are parallel within
    /// rounding.
    fn normal_of(&self, a: DVec3, b: DVec3, first: usize, count: usize) -> DVec3 {
        let n = a.cross(b);
        if n.length() > 1e-9 * a.length() * b.length() && n.length() > 0.0 {
            n.normalize()
        } else {
            self.mean_normal(first, count)
        }
    }

    fn smooth_normal(&self) -> DVec3 {
        let k = self.faces.len();
        let theta = 2.0 * std::f64::consts::PI / k as f64;
        let a = edge_weight(theta);
        let tangent = |wave: fn(f64) -> f64| -> DVec3 {
            (0..k)
                .map(|i| {
                    let (here, there) = (wave(i as f64 * theta), wave((i + 1) as f64 * theta));
                    self.spokes[i] * (a * here) + self.faces[i] * (here + there)
                })
                .sum()
        };
        self.normal_of(tangent(f64::cos), tangent(f64::sin), 0, k)
    }

    /// Normal of the `count` faces from `first` on, between two sharp edges.
    fn sector_normal(&self, first: usize, count: usize, corner: bool) -> DVec3 {
        let spoke = |i: usize| self.spokes[(first + i) % self.spokes.len()];
        let (start, end) = (spoke(0), spoke(count));
        let mean = || self.mean_normal(first, count);
        if corner || count == 1 {
            let (a, b) = (start - self.v, end - self.v);
            let n = a.cross(b);
            if n.length() < 1e-6 * a.length() * b.length() {
                return mean();
            }
            // A reflex corner turns the other way.
            return if n.dot(mean()) < 0.0 { -n.normalize() } else { n.normalize() };
        }
        let theta = std::f64::consts::PI / count as f64;
        let a = edge_weight(theta);
        let (sin, cot) = (theta.sin(), (theta * 0.5).tan().recip());
        let l0 = (sin * (a + 4.0) - 2.0 * cot * (a + 2.0)) / a;
        let lv = -2.0 * l0 - cot * (a + 2.0);
        let mut across = self.v * lv + (start + end) * l0;
        for i in 0..count {
            let (here, there) = ((i as f64 * theta).sin(), ((i + 1) as f64 * theta).sin());
            let face = self.faces[(first + i) % self.faces.len()];
            across += spoke(i) * (a * here) + face * (here + there);
        }
        self.normal_of(start - end, across, first, count)
    }
}

/// Weight of the edge ends beside weight 1 of the face corners: 16 λ − 4.
fn edge_weight(theta: f64) -> f64 {
    1.0 + theta.cos() + (theta * 0.5).cos() * (2.0 * (9.0 + theta.cos())).sqrt()
}
