//! Hair and fur: [`Curves`] → triangles that do not depend on the camera.
//!
//! A curve is sampled at `segments` places a span (control points alone where it is linear). Its
//! frame is carried along with least rotation by double reflection `[WJZL08]`. From it are made
//! * a **tube** of k sides, closed by caps or a point. Its radius is larger by `(π/k)/sin(π/k)`, so
//!   that a straight tube's side has the area `2 π r L` of the round one, and with it, convex as it
//!   is, the same mean projected area;
//! * a **ribbon** as wide as the curve, whose normal is a given direction made perpendicular to the
//!   curve, else the carried frame turned by an angle of the curve's own;
//! * a **cross** of two ribbons at right angles.
//!
//! Input   [`Curves`] in world space. Output  a [`Mesh`]: u across or around, v from root to tip;
//!         tubes closed, ribbons open.
//! Guarantees  the same for any thread count; more than [`MAX_TRIANGLES`] are refused before
//!             anything is allocated; widths below 0 count as 0.
//! Not         mitred bends: a tube is thinner where a linear curve turns sharply.
//! Cost    triangles a segment: 2 k, 2, 4; 36 B a triangle and about 32 B a vertex.
//! Knobs   [`CurveSettings`]: shape (tube), sides (5), segments a span (4), normal (none).

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::MAX_TRIANGLES;
use crate::math::Frame;
use crate::sampling::{Rng, Stream};
use crate::scene::{Basis, Curves, Mesh};

/// What stands for a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CurveShape {
    /// A closed tube.
    #[default]
    Tube,
    /// A flat band.
    Ribbon,
    /// Two bands at right angles.
    Cross,
}

/// How curves are tessellated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveSettings {
    /// What stands for a curve.
    pub shape: CurveShape,
    /// Sides of a tube, 3–64.
    pub sides: u32,
    /// Segments a span of a cubic curve, 1–64.
    pub segments: u32,
    /// Normal of ribbons, made perpendicular to the curve.
    pub normal: Option<Vec3>,
}

impl Default for CurveSettings {
    fn default() -> Self {
        Self { shape: CurveShape::default(), sides: 5, segments: 4, normal: None }
    }
}

impl CurveSettings {
    fn triangles(&self, samples: u64) -> u64 {
        let segments = samples - 1;
        match self.shape {
            CurveShape::Tube => {
                2 * u64::from(self.sides) * segments + 2 * (u64::from(self.sides) - 2)
            }
            CurveShape::Ribbon => 2 * segments,
            CurveShape::Cross => 4 * segments,
        }
    }
}

/// A place on a curve.
#[derive(Clone, Copy, Debug)]
struct Sample {
    p: DVec3,
    tangent: DVec3,
    radius: f64,
    /// Growth of the radius per length.
    slope: f64,
}

const BLOCK: usize = 1024;

/// The triangles of all curves.
///
/// # Errors
/// A message when a setting is out of range, a curve has a number of points its basis does not
/// allow, or the mesh would not fit.
pub fn tessellate_curves(curves: &Curves, settings: &CurveSettings) -> Result<Mesh, String> {
    if !(3..=64).contains(&settings.sides) || !(1..=64).contains(&settings.segments) {
        return Err("sides must lie from 3 to 64, segments from 1 to 64".into());
    }
    if settings.normal.is_some_and(|n| !n.is_finite() || n == Vec3::ZERO) {
        return Err("normal must be finite and not zero".into());
    }
    let segments = if curves.basis == Basis::Linear { 1 } else { settings.segments as usize };
    let mut triangles = 0u64;
    for i in 0..curves.len() {
        let points = curves.curve(i).len();
        let Some(spans) = curves.basis.spans(points) else {
            let (name, needs) = (curves.basis.name(), curves.basis.needs());
            return Err(format!(
                "curve {} has {points} points, but a {name} curve needs {needs}; correct it or \
                 choose another basis",
                i + 1
            ));
        };
        triangles += settings.triangles((spans * segments) as u64 + 1);
    }
    if triangles > MAX_TRIANGLES {
        return Err(format!(
            "{} curves would make {triangles} triangles, more than {MAX_TRIANGLES}; use ribbons, \
             fewer sides or fewer segments",
            curves.len()
        ));
    }
    let blocks: Vec<Mesh> = (0..curves.len().div_ceil(BLOCK))
        .into_par_iter()
        .map(|b| {
            let mut mesh = Mesh::default();
            for i in b * BLOCK..(b * BLOCK + BLOCK).min(curves.len()) {
                one_curve(&mut mesh, &samples(curves, i, segments), settings, i as u64);
            }
            mesh
        })
        .collect();
    let mut out = Mesh { name: curves.name.clone(), ..Mesh::default() };
    for block in blocks {
        let base = out.positions.len() as u32;
        out.triangles.extend(block.triangles.iter().map(|t| t.map(|i| i + base)));
        out.positions.extend(block.positions);
        out.normals.extend(block.normals);
        out.uvs.extend(block.uvs);
    }
    out.materials = vec![curves.material; out.triangles.len()];
    Ok(out)
}

/// Weights of four control values at `t` of a span, and their derivatives.
fn weights(basis: Basis, t: f64) -> [[f64; 4]; 2] {
    let s = 1.0 - t;
    match basis {
        Basis::Linear => [[0.0, s, t, 0.0], [0.0, -1.0, 1.0, 0.0]],
        Basis::CatmullRom => [
            [
                -0.5 * t * s * s,
                1.0 + t * t * (1.5 * t - 2.5),
                1.0 + s * s * (1.5 * s - 2.5),
                -0.5 * s * t * t,
            ],
            [-0.5 * s * s + t * s, t * (4.5 * t - 5.0), -s * (4.5 * s - 5.0), 0.5 * t * t - t * s],
        ],
        Basis::Bspline => [
            [
                s * s * s / 6.0,
                (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
                (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
                t * t * t / 6.0,
            ],
            [
                -s * s / 2.0,
                (3.0 * t * t - 4.0 * t) / 2.0,
                (4.0 * s - 3.0 * s * s) / 2.0,
                t * t / 2.0,
            ],
        ],
        Basis::Bezier => [
            [s * s * s, 3.0 * t * s * s, 3.0 * t * t * s, t * t * t],
            [-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t],
        ],
    }
}

fn samples(curves: &Curves, curve: usize, segments: usize) -> Vec<Sample> {
    let range = curves.curve(curve);
    let (points, widths) = (&curves.points[range.clone()], &curves.widths[range]);
    let n = points.len() as isize;
    let at = |i: isize| -> (DVec3, f64) {
        let get = |i: isize| (points[i as usize].as_dvec3(), f64::from(widths[i as usize]));
        // Beyond the ends the curve goes on by reflection.
        let mirror = |end: isize, inner: isize| {
            let ((p, w), (q, v)) = (get(end), get(inner));
            (p * 2.0 - q, 2.0 * w - v)
        };
        if i < 0 {
            mirror(0, 1)
        } else if i >= n {
            mirror(n - 1, n - 2)
        } else {
            get(i)
        }
    };
    let spans = curves.basis.spans(points.len()).unwrap_or(0);
    let (stride, first) = match curves.basis {
        Basis::Bezier => (3, 0),
        Basis::Bspline => (1, 0),
        Basis::Linear | Basis::CatmullRom => (1, -1),
    };
    let mut list: Vec<Sample> = (0..=spans * segments)
        .map(|k| {
            let span = (k / segments).min(spans - 1);
            let t = (k - span * segments) as f64 / segments as f64;
            let controls = [0, 1, 2, 3].map(|j| at((span * stride) as isize + first + j));
            let [value, slope] = weights(curves.basis, t).map(|w| {
                let sum = |f: fn(&(DVec3, f64)) -> DVec3| {
                    (0..4).map(|j| f(&controls[j]) * w[j]).sum::<DVec3>()
                };
                (sum(|c| c.0), (0..4).map(|j| controls[j].1 * w[j]).sum::<f64>())
            });
            let speed = slope.0.length();
            Sample {
                p: value.0,
                tangent: slope.0.normalize_or_zero(),
                radius: (value.1 * 0.5).max(0.0),
                slope: if speed > 0.0 { slope.1 * 0.5 / speed } else { 0.0 },
            }
        })
        .collect();
    if curves.basis == Basis::Linear {
        // At a bend the direction is the mean of both sides'; the control points are then met by
        // rings in the bisecting plane.
        let directions: Vec<DVec3> =
            list.windows(2).map(|w| (w[1].p - w[0].p).normalize_or_zero()).collect();
        for i in 1..list.len() - 1 {
            list[i].tangent = (directions[i - 1] + directions[i]).normalize_or(directions[i]);
        }
    }
    // Where the derivative vanishes: the direction before, or the next one there is.
    let mut last = list.iter().map(|s| s.tangent).find(|t| *t != DVec3::ZERO).unwrap_or(DVec3::Z);
    for s in &mut list {
        if s.tangent == DVec3::ZERO {
            s.tangent = last;
        }
        last = s.tangent;
    }
    list
}

/// Normals along the curve, turning as little as can be: double reflection.
fn carried(samples: &[Sample], start: DVec3) -> Vec<DVec3> {
    let mut list = vec![start];
    for w in samples.windows(2) {
        let r = list[list.len() - 1];
        let reflect = |v: DVec3, axis: DVec3| {
            let c = axis.length_squared();
            if c > 0.0 { v - axis * (2.0 * axis.dot(v) / c) } else { v }
        };
        let step = w[1].p - w[0].p;
        let (r1, t1) = (reflect(r, step), reflect(w[0].tangent, step));
        let next = reflect(r1, w[1].tangent - t1);
        list.push((next - w[1].tangent * next.dot(w[1].tangent)).normalize_or(r));
    }
    list
}

fn one_curve(mesh: &mut Mesh, samples: &[Sample], settings: &CurveSettings, key: u64) {
    let Some(root) = samples.first() else { return };
    let frame = Frame::from_normal(root.tangent.as_vec3());
    let (s, t) = (frame.s.as_dvec3(), frame.t.as_dvec3());
    if settings.shape == CurveShape::Tube {
        tube(mesh, samples, &carried(samples, s), settings.sides as usize);
        return;
    }
    let (sin, cos) =
        f64::from(Rng::new(0, Stream::Scene, key, 0).next_f32() * std::f32::consts::TAU).sin_cos();
    let mut normals = carried(samples, s * cos + t * sin);
    if let Some(given) = settings.normal {
        let given = given.as_dvec3().normalize();
        for (n, sample) in normals.iter_mut().zip(samples) {
            let across = given - sample.tangent * given.dot(sample.tangent);
            if across.length() > 1e-6 {
                *n = across.normalize();
            }
        }
    }
    ribbon(mesh, samples, &normals);
    if settings.shape == CurveShape::Cross {
        let turned: Vec<DVec3> =
            normals.iter().zip(samples).map(|(n, s)| s.tangent.cross(*n)).collect();
        ribbon(mesh, samples, &turned);
    }
}

fn along(i: usize, samples: &[Sample]) -> f32 {
    i as f32 / (samples.len() - 1) as f32
}

/// The two triangles between the pairs of vertices (a, b) and (c, d), but for those that have no
/// width.
fn strip(mesh: &mut Mesh, [a, b, c, d]: [u32; 4]) {
    let at = |i: u32| mesh.positions[i as usize];
    let pointed = [at(a) == at(b), at(c) == at(d)];
    if !pointed[0] {
        mesh.triangles.push([a, b, d]);
    }
    if !pointed[1] {
        mesh.triangles.push([a, d, c]);
    }
}

fn ribbon(mesh: &mut Mesh, samples: &[Sample], normals: &[DVec3]) {
    let base = mesh.positions.len() as u32;
    for (i, (s, n)) in samples.iter().zip(normals).enumerate() {
        let side = n.cross(s.tangent) * s.radius;
        for (u, p) in [(0.0, s.p - side), (1.0, s.p + side)] {
            mesh.positions.push(p.as_vec3());
            mesh.normals.push(n.as_vec3());
            mesh.uvs.push(Vec2::new(u, along(i, samples)));
        }
    }
    // side = n × t, so across × along = (n × t) × t = −n: the fronts need the strip's pairs in
    // turn.
    for i in 0..samples.len() as u32 - 1 {
        let a = base + 2 * i;
        strip(mesh, [a + 1, a, a + 3, a + 2]);
    }
}

fn tube(mesh: &mut Mesh, samples: &[Sample], normals: &[DVec3], sides: usize) {
    let half_angle = std::f64::consts::PI / sides as f64;
    let growth = half_angle / half_angle.sin();
    let base = mesh.positions.len() as u32;
    let ring = sides as u32 + 1;
    for (i, (s, n)) in samples.iter().zip(normals).enumerate() {
        let b = s.tangent.cross(*n);
        for j in 0..=sides {
            // The last vertex is the first again, bit for bit, with its own u.
            let (sin, cos) = (2.0 * half_angle * (j % sides) as f64).sin_cos();
            let out = *n * cos + b * sin;
            mesh.positions.push((s.p + out * (s.radius * growth)).as_vec3());
            mesh.normals.push((out - s.tangent * s.slope).normalize_or(out).as_vec3());
            mesh.uvs.push(Vec2::new(j as f32 / sides as f32, along(i, samples)));
        }
    }
    for i in 0..samples.len() as u32 - 1 {
        for j in 0..ring - 1 {
            let a = base + i * ring + j;
            strip(mesh, [a, a + 1, a + ring, a + ring + 1]);
        }
    }
    for (sample, front) in [(0, false), (samples.len() - 1, true)] {
        if samples[sample].radius > 0.0 {
            cap(mesh, base + sample as u32 * ring, ring - 1, front);
        }
    }
}

/// A flat end; its vertices have no normals, which means the face's.
fn cap(mesh: &mut Mesh, from: u32, sides: u32, front: bool) {
    let base = mesh.positions.len() as u32;
    for i in from..from + sides {
        mesh.positions.push(mesh.positions[i as usize]);
        mesh.normals.push(Vec3::ZERO);
        mesh.uvs.push(mesh.uvs[i as usize]);
    }
    for j in 1..sides - 1 {
        let (a, b) = if front { (j, j + 1) } else { (j + 1, j) };
        mesh.triangles.push([base, base + a, base + b]);
    }
}
