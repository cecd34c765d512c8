//! The micro-buffer: a raster of the hemisphere around a receiver, filled from near to far
//! `[Christensen08]`.
//!
//! The hemisphere is flattened by the equal-area and the concentric map into N × N cells of equal
//! solid angle Ω = 2π / N². A deposit that covers the share α of a cell adds to the cell's current
//! layer
//!
//! ```text
//! a = min(α, 1 − c)        c += a,   W += a cos θ,   C += a cos θ L
//! ```
//!
//! Deposits that follow one another in distance belong to one layer; a new layer begins at a gap (a
//! quarter farther) or on the other side of surfaces. When a layer closes, its covered share c,
//! which above 0.7 is stretched to c̃ so that it reaches 1 at 0.78, dims what is behind it:
//!
//! ```text
//! T ← T (1 − c̃),   W and C of the layer weighted by T c̃ / c
//! o = T W + (1 − T)² w̄                                        w̄: mean cosine of the cell
//! E = Ω Σ C o / W,   occlusion = Ω Σ o / π,   open = Ω Σ (w̄ − o)
//! ```
//!
//! so that a full cell weighs what it does, and a part of one what its elements do. An element is a
//! square of its own solid angle around its place. The map keeps areas, so what a surface covers is
//! exact in the mean, whatever the gaps between discs; elements seen large are tested cell by cell,
//! as discs with a soft rim that close these gaps. Shares of one layer add up until a cell is full;
//! layers behind one another cover what was left, as things do that know nothing of each other.
//!
//! A full raster gives E = π L and occlusion 1 exactly; occlusion never exceeds 1, and values at
//! any distance are finite. The order of things within a cell is lost. A cell takes 64 bytes, and a
//! deposit touches the cells under its square.

use glam::{Vec2, Vec3};

use crate::journal::stored;
use crate::radiometry::Rgb;
use crate::shading::Sky;

/// What is fixed about a raster of a size.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    pub side: usize,
    /// Directions of the cells' centres, local frame.
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    /// Mean cosine of the cells, zero outside the cone; Ω Σ = π sin² of the cone's angle.
    mean_cos: Vec<f32>,
    total: f32,
}

/// Sums over deposits: of a layer, or of all that are done.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    light: Rgb,
    /// W.
    weight: f32,
    /// W with the fall-off.
    occlusion: f32,
    /// W over the distance.
    inverse: f32,
}

#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
struct Cell {
    done: Sums,
    layer: Sums,
    /// c: share that the layer covers.
    covered: f32,
    /// Share that earlier layers leave.
    open: f32,
    /// Distance of the latest deposit.
    distance: f32,
    /// What the layer shows.
    face: Face,
}

impl Cell {
    const EMPTY: Self = Self {
        done: Sums::ZERO,
        layer: Sums::ZERO,
        covered: 0.0,
        open: 1.0,
        distance: 0.0,
        face: Face::Mixed,
    };

    /// Ends the layer.
    fn close(&mut self) {
        if self.covered > 0.0 {
            let above = (self.covered - KNEE).max(0.0);
            let covered = (self.covered + above * ((1.0 - KNEE) / (FILLED - KNEE) - 1.0)).min(1.0);
            let gain = self.open * covered / self.covered;
            self.done.light += self.layer.light * gain;
            self.done.weight += self.layer.weight * gain;
            self.done.occlusion += self.layer.occlusion * gain;
            self.done.inverse += self.layer.inverse * gain;
            self.open *= 1.0 - covered;
            self.layer = Sums::ZERO;
            self.covered = 0.0;
        }
    }
}

impl Sums {
    const ZERO: Self = Self { light: Rgb::ZERO, weight: 0.0, occlusion: 0.0, inverse: 0.0 };
}

/// What a receiver's hemisphere holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gathered {
    /// Cosine-weighted share of the hemisphere (or cone) that is occluded, with the fall-off; 0 to
    /// 1.
    pub occlusion: f32,
    /// ∫ cos θ over the open directions, 0 to π: irradiance per radiance of a constant sky.
    pub open: f32,
    /// Cosine-weighted mean of the open directions, world space, not unit; zero when all is
    /// occluded.
    pub bent_normal: Vec3,
    /// Irradiance from the elements, W·m⁻²; a constant sky's is `open` times its radiance.
    pub irradiance: Rgb,
    /// Cosine-weighted harmonic mean distance to what is seen, open directions included as
    /// infinitely far; infinite without elements and for the plain sums.
    pub distance: f32,
    /// Irradiance from a map of the sky through the open directions; zero without one.
    pub from_map: Rgb,
}

stored!(Gathered { occlusion, open, bent_normal, irradiance, distance, from_map });

impl Gathered {
    /// Irradiance of the sky that it was gathered under.
    pub fn from_sky(&self, sky: &Sky) -> Rgb {
        sky.constant * self.open + self.from_map
    }
}

#[derive(Clone, Debug)]
pub(super) struct Raster {
    cells: Vec<Cell>,
    /// Bits of the cells that are not full, a word a row.
    rows: Vec<u32>,
    /// Cells that are full.
    full: usize,
    alpha: Vec<f32>,
    distance: Vec<f32>,
}

/// Shares below this leave a cell full.
const FULL: f32 = 1.0 - 1e-3;

/// atan on [−1, 1], error below 1e-5.
fn atan(t: f32) -> f32 {
    let s = t * t;
    t * (0.999_866_0
        + s * (-0.330_299_5 + s * (0.180_141_0 + s * (-0.085_133_0 + s * 0.020_835_1))))
}

/// From a local direction of the upper hemisphere to the unit square.
fn square_from_direction(w: Vec3) -> Vec2 {
    let r = ((w.x * w.x + w.y * w.y) / (1.0 + w.z)).sqrt();
    let p = if w.x.abs() >= w.y.abs() {
        if w.x == 0.0 {
            return Vec2::splat(0.5);
        }
        let a = r.copysign(w.x);
        Vec2::new(a, a * (4.0 * std::f32::consts::FRAC_1_PI) * atan(w.y / w.x))
    } else {
        let a = r.copysign(w.y);
        Vec2::new(a * (4.0 * std::f32::consts::FRAC_1_PI) * atan(w.x / w.y), a)
    };
    p * 0.5 + 0.5
}

fn direction_from_square(u: Vec2) -> Vec3 {
    let d = crate::sampling::sample_disc(u);
    let r2 = d.length_squared();
    (d * (2.0 - r2).max(0.0).sqrt()).extend(1.0 - r2)
}

impl Shape {
    /// `cone_cos`: cosine of the half angle that counts.
    pub fn new(side: usize, cone_cos: f32) -> Self {
        let mut shape = Self {
            side,
            x: Vec::new(),
            y: Vec::new(),
            z: Vec::new(),
            mean_cos: Vec::new(),
            total: 0.0,
        };
        const SUB: usize = 8;
        for row in 0..side {
            for column in 0..side {
                let at = |x: f32, y: f32| {
                    direction_from_square(Vec2::new(
                        (column as f32 + x) / side as f32,
                        (row as f32 + y) / side as f32,
                    ))
                };
                let center = at(0.5, 0.5);
                shape.x.push(center.x);
                shape.y.push(center.y);
                shape.z.push(center.z);
                let mut sum = 0.0;
                for i in 0..SUB * SUB {
                    let z = at(
                        ((i % SUB) as f32 + 0.5) / SUB as f32,
                        ((i / SUB) as f32 + 0.5) / SUB as f32,
                    )
                    .z;
                    sum += if z >= cone_cos { z } else { 0.0 };
                }
                shape.mean_cos.push(sum / (SUB * SUB) as f32);
            }
        }
        let exact = std::f32::consts::PI * (1.0 - cone_cos * cone_cos);
        let sum: f32 = shape.mean_cos.iter().sum::<f32>() * shape.solid_angle();
        if sum > 0.0 {
            shape.mean_cos.iter_mut().for_each(|c| *c *= exact / sum);
        } else {
            // A cone narrower than a cell: the four cells around the normal.
            let half = side / 2;
            for (row, column) in
                [(half - 1, half - 1), (half - 1, half), (half, half - 1), (half, half)]
            {
                shape.mean_cos[row * side + column] = exact / (4.0 * shape.solid_angle());
            }
        }
        shape.total = exact;
        shape
    }

    /// Of a cell.
    pub fn solid_angle(&self) -> f32 {
        2.0 * std::f32::consts::PI / (self.side * self.side) as f32
    }
}

/// An element or a group as the raster takes it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Splat {
    /// Unit direction, local frame, z > 0.
    pub w: Vec3,
    pub solid_angle: f32,
    pub radiance: Rgb,
    /// Of the fall-off.
    pub occlusion: f32,
    pub distance: f32,
    /// Which side is seen.
    pub face: Face,
}

/// An element that is seen large, in the local frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct LargeDisc {
    pub center: Vec3,
    /// Unit, of the front.
    pub normal: Vec3,
    pub radius: f32,
    /// Of the front and of the back; none for sides that are not there.
    pub radiance: [Option<Rgb>; 2],
}

/// The side of a deposit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Face {
    /// Of several planes.
    #[default]
    Mixed,
    Front,
    Back,
}

impl Raster {
    pub fn new(shape: &Shape) -> Self {
        let cells = shape.side * shape.side;
        Self {
            cells: vec![Cell::default(); cells],
            rows: vec![0; shape.side],
            full: 0,
            alpha: vec![0.0; cells],
            distance: vec![0.0; cells],
        }
    }

    /// Empties it; directions below the plane of `ng` (local frame) are black and full, those
    /// outside the cone as well.
    pub fn reset(&mut self, shape: &Shape, ng: Vec3) {
        self.cells.fill(Cell::EMPTY);
        self.rows.fill(u32::MAX >> (32 - shape.side));
        self.full = 0;
        let tilted = ng.z < 0.999_99;
        if tilted || shape.total < 0.999 * std::f32::consts::PI {
            for i in 0..self.cells.len() {
                if shape.mean_cos[i] == 0.0
                    || (tilted && shape.x[i] * ng.x + shape.y[i] * ng.y + shape.z[i] * ng.z <= 0.0)
                {
                    let w = shape.mean_cos[i];
                    self.cells[i] = Cell {
                        done: Sums { weight: w, occlusion: w, ..Sums::ZERO },
                        open: 0.0,
                        ..Cell::EMPTY
                    };
                    self.rows[i / shape.side] &= !(1 << (i % shape.side));
                    self.full += 1;
                }
            }
        }
    }

    /// True when all that lies within `angle` (radians) of a local direction is full; the direction
    /// may lie below the horizon by as much.
    pub fn is_full(&self, shape: &Shape, w: Vec3, angle: f32) -> bool {
        // Seldom true while most is open.
        if self.full * 4 < self.cells.len() {
            return false;
        }
        let side = shape.side as f32;
        let at = square_from_direction(if w.z >= 0.0 {
            w
        } else {
            Vec3::new(w.x, w.y, 0.0).normalize_or(Vec3::X)
        }) * side;
        // A radian is at most 0.75 of a side (concentric map).
        let reach = angle * 0.75 * side + 0.01;
        let clamp = |v: f32| (v.max(0.0) as usize).min(shape.side - 1);
        let (x0, x1, y0, y1) =
            (clamp(at.x - reach), clamp(at.x + reach), clamp(at.y - reach), clamp(at.y + reach));
        let mask = (u32::MAX >> (31 - (x1 - x0) as u32)) << x0;
        self.rows[y0..=y1].iter().all(|row| row & mask == 0)
    }

    /// True when no cell is open.
    pub fn is_closed(&self) -> bool {
        self.full == self.cells.len()
    }

    fn deposit(&mut self, shape: &Shape, cell: usize, alpha: f32, cos: f32, splat: &Splat) {
        let c = &mut self.cells[cell];
        let turned = splat.face != c.face && splat.face != Face::Mixed && c.face != Face::Mixed;
        if turned || splat.distance > GAP * c.distance {
            c.close();
            c.face = splat.face;
        } else if c.face == Face::Mixed {
            c.face = splat.face;
        }
        c.distance = c.distance.max(splat.distance);
        let a = alpha.min(1.0 - c.covered);
        c.covered += a;
        let w = a * cos;
        c.layer.weight += w;
        c.layer.occlusion += w * splat.occlusion;
        c.layer.inverse += w / splat.distance;
        c.layer.light += splat.radiance * w;
        if c.open * (1.0 - c.covered / FILLED) < 1.0 - FULL {
            let (row, bit) = (&mut self.rows[cell / shape.side], 1 << (cell % shape.side));
            self.full += usize::from(*row & bit != 0);
            *row &= !bit;
        }
    }

    /// A square of the element's solid angle.
    pub fn splat(&mut self, shape: &Shape, splat: &Splat) {
        let n = shape.side as f32;
        let at = square_from_direction(splat.w) * n;
        let true_side = (splat.solid_angle * (0.5 * std::f32::consts::FRAC_1_PI)).sqrt() * n;
        let side = (SPREAD * true_side).clamp(LEAST_SIDE, n);
        let dense = (true_side / side).powi(2).min(1.0);
        let half = 0.5 * side;
        let low = (at - half).clamp(Vec2::ZERO, Vec2::splat(n - side));
        let high = low + side;
        let last = shape.side - 1;
        let (x0, x1) = (low.x as usize, (high.x as usize).min(last));
        let (y0, y1) = (low.y as usize, (high.y as usize).min(last));
        for y in y0..=y1 {
            let dy = (high.y.min((y + 1) as f32) - low.y.max(y as f32)).max(0.0);
            let row = self.rows[y];
            for x in x0..=x1 {
                if row >> x & 1 == 0 {
                    continue;
                }
                let share = dy * (high.x.min((x + 1) as f32) - low.x.max(x as f32)).max(0.0);
                let cell = y * shape.side + x;
                let cos = splat.w.z + (shape.z[cell] - splat.w.z) * share;
                self.deposit(shape, cell, share * dense, cos, splat);
            }
        }
    }

    /// A disc seen large, cell by cell. `occlusion` gives the fall-off at a distance; farther than
    /// `most` is not there.
    pub fn disc(
        &mut self,
        shape: &Shape,
        disc: &LargeDisc,
        most: f32,
        occlusion: impl Fn(f32) -> f32,
    ) {
        let &LargeDisc { center: d, normal: n, radius: r, radiance } = disc;
        let height = d.dot(n);
        let inverse = 1.0 / (r * r);
        let cells = self.cells.len();
        for i in 0..cells {
            let (x, y, z) = (shape.x[i], shape.y[i], shape.z[i]);
            let t = height / (x * n.x + y * n.y + z * n.z);
            let (dx, dy, dz) = (x * t - d.x, y * t - d.y, z * t - d.z);
            let q = (FADE - (dx * dx + dy * dy + dz * dz) * inverse) * FADE_SLOPE;
            self.alpha[i] = if t > 0.0 && t <= most { q.clamp(0.0, 1.0) } else { 0.0 };
            self.distance[i] = t;
        }
        for i in 0..cells {
            if self.alpha[i] <= 0.0 || self.rows[i / shape.side] >> (i % shape.side) & 1 == 0 {
                continue;
            }
            let cos = shape.x[i] * n.x + shape.y[i] * n.y + shape.z[i] * n.z;
            let Some(light) = radiance[usize::from(cos > 0.0)] else { continue };
            let (alpha, distance) = (self.alpha[i], self.distance[i]);
            let splat = Splat {
                w: Vec3::Z,
                solid_angle: 0.0,
                radiance: light,
                occlusion: occlusion(distance),
                distance,
                face: if cos > 0.0 { Face::Back } else { Face::Front },
            };
            self.deposit(shape, i, alpha, shape.z[i], &splat);
        }
    }

    /// What it holds; `bent_normal` in the local frame. `sky` is the radiance of open local
    /// directions; its irradiance comes second.
    pub fn result(&self, shape: &Shape, sky: Option<&dyn Fn(Vec3) -> Rgb>) -> (Gathered, Rgb) {
        let (mut light, mut occluded, mut inverse, mut open, mut bent, mut from_sky) =
            (Rgb::ZERO, 0.0, 0.0, 0.0, Vec3::ZERO, Rgb::ZERO);
        for (i, c) in self.cells.iter().enumerate() {
            let w = shape.mean_cos[i];
            let mut c = *c;
            c.close();
            let covered = 1.0 - c.open;
            let o = if w == 0.0 {
                0.0
            } else {
                (c.open * c.done.weight + covered * covered * w).clamp(0.0, w)
            };
            if c.done.weight > 0.0 {
                light += c.done.light * (o / c.done.weight);
                occluded += c.done.occlusion * (o / c.done.weight);
                inverse += c.done.inverse * (o / c.done.weight);
            }
            let direction = Vec3::new(shape.x[i], shape.y[i], shape.z[i]);
            open += w - o;
            bent += direction * (w - o);
            if let (Some(sky), true) = (sky, w > o) {
                from_sky += sky(direction) * (w - o);
            }
        }
        let omega = shape.solid_angle();
        let gathered = Gathered {
            occlusion: (occluded * omega / shape.total).clamp(0.0, 1.0),
            open: open * omega,
            bent_normal: if open > 0.0 { bent / open } else { Vec3::ZERO },
            irradiance: light * omega,
            from_map: Rgb::ZERO,
            distance: shape.total / (inverse * omega),
        };
        (gathered, from_sky * omega)
    }
}

/// A deposit this many times as far away as the latest one begins a new layer.
const GAP: f32 = 1.25;
/// Squares are this much wider than their solid angle asks for, and as much thinner: groups of one
/// surface then cover it evenly. Measured.
const SPREAD: f32 = 1.4;
/// Smallest side of a splat, in cells: smaller ones are spread, so that cells fill evenly.
const LEAST_SIDE: f32 = 1.0;
/// A layer that covers this much of a cell is taken to cover all: what discs and squares of a whole
/// surface leave of a cell when their excess over others is cut. Measured.
const FILLED: f32 = 0.78;
/// Shares below this are taken as they are; in between the share grows evenly to 1.
const KNEE: f32 = 0.7;
/// Elements seen large cover fully to about their radius and fade out to √1.6 of it: discs of one
/// plane leave gaps, these do not.
const FADE: f32 = 1.6;
/// How fast, in squared radii.
const FADE_SLOPE: f32 = 1.5;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream, sample_uniform_hemisphere};

    #[test]
    fn the_map_and_its_inverse() {
        let mut rng = Rng::new(1, Stream::Test, 3, 0);
        for _ in 0..10_000 {
            let w = sample_uniform_hemisphere(rng.next_2d());
            assert!(direction_from_square(square_from_direction(w)).distance(w) < 1e-3, "{w}");
        }
        assert_eq!(square_from_direction(Vec3::Z), Vec2::splat(0.5));
        let shape = Shape::new(16, 0.0);
        assert!(
            (shape.mean_cos.iter().sum::<f32>() * shape.solid_angle() - std::f32::consts::PI).abs()
                < 1e-4
        );
    }

    #[test]
    fn full_and_empty() {
        let shape = Shape::new(12, 0.0);
        let mut raster = Raster::new(&shape);
        raster.reset(&shape, Vec3::Z);
        let empty = raster.result(&shape, None).0;
        assert!(
            empty.occlusion == 0.0
                && (empty.open - std::f32::consts::PI).abs() < 1e-4
                && empty.bent_normal.z > 0.6
        );
        let mut rng = Rng::new(1, Stream::Test, 4, 0);
        for _ in 0..20_000 {
            let w = sample_uniform_hemisphere(rng.next_2d());
            raster.splat(
                &shape,
                &Splat {
                    w,
                    solid_angle: 0.02,
                    radiance: Rgb::splat(2.0),
                    occlusion: 1.0,
                    distance: 1.0,
                    face: Face::Mixed,
                },
            );
        }
        assert!(raster.is_closed() && raster.is_full(&shape, Vec3::X, 1.0));
        let full = raster.result(&shape, None).0;
        assert!(
            (full.occlusion - 1.0).abs() < 1e-3
                && full.open.abs() < 2e-3
                && (full.irradiance.x / (2.0 * std::f32::consts::PI) - 1.0).abs() < 2e-3
        );
    }

    #[test]
    fn a_disc_seen_large_covers_itself_and_little_more() {
        let shape = Shape::new(32, 0.0);
        let mut raster = Raster::new(&shape);
        let disc = |height: f32, normal: Vec3| LargeDisc {
            center: Vec3::Z * height,
            normal,
            radius: 0.5,
            radiance: [Some(Rgb::ONE), None],
        };
        for h in [0.25f32, 0.5, 1.0, 1.5] {
            raster.reset(&shape, Vec3::Z);
            raster.disc(&shape, &disc(h, -Vec3::Z), f32::INFINITY, |_| 1.0);
            let exact = 0.25 / (0.25 + h * h);
            let got = raster.result(&shape, None).0;
            assert!(
                got.occlusion > exact && got.occlusion < 1.4 * exact,
                "{h}: {} for {exact}",
                got.occlusion
            );
            assert!((got.irradiance.x / std::f32::consts::PI / got.occlusion - 1.0).abs() < 1e-4);
        }
        // Seen from behind, its back is not there.
        raster.reset(&shape, Vec3::Z);
        raster.disc(&shape, &disc(1.0, Vec3::Z), f32::INFINITY, |_| 1.0);
        assert_eq!(raster.result(&shape, None).0.occlusion, 0.0);
    }
}
