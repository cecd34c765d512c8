//! The light that arrives at a record, as a jittered grid of directions.
//!
//! ```text
//! E = π / N · Σ L(wi)                     wi cosine-distributed, one a stratum
//! ```
//! | [`Grid`] | Strata | For |
//! |---|---|---|
//! | `Polar` | M rings of equal sin², N sectors, N ≈ π M | Ward–Heckbert gradients |
//! | `Square` | n × n of the concentric map: compact cells, neighbours in a plane grid | triangles of hit points |
//!
//! Input   a point lifted off its surface, its geometric normal, the frame of its shading normal. Output  [`Hemisphere`]: per stratum the
//!         local direction, the radiance and the inverse distance of what was met. The sky has inverse distance 0: it stays where it is however the point moves.
//! Guarantees  keyed by (seed, element, round), never by thread. Directions below the geometric horizon are not shot: no light, no hit.

use glam::{Vec2, Vec3};

use crate::math::{Frame, Ray};
use crate::photon::Proxy;
use crate::radiometry::Rgb;
use crate::sampling::{Rng, Stream, sample_cosine_hemisphere};
use crate::shading::World;

/// How the hemisphere is cut into strata of equal cosine-weighted solid angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grid {
    /// Rings from the pole out, each of `sectors` strata; index `ring · sectors + sector`.
    Polar {
        /// M.
        rings: usize,
        /// N.
        sectors: usize,
    },
    /// Concentric square map; index `row · side + column`.
    Square {
        /// n.
        side: usize,
    },
}

impl Grid {
    /// Polar grid of about `rays` strata, at least 4 × 12.
    pub fn polar(rays: u32) -> Self {
        let rings = ((f64::from(rays) / std::f64::consts::PI).sqrt().round() as usize).max(4);
        Self::Polar { rings, sectors: (rays as usize / rings).max(12) }
    }
    /// Square grid of at most `rays` strata, at least 7 × 7.
    pub fn square(rays: u32) -> Self {
        Self::Square { side: (f64::from(rays).sqrt() as usize).max(7) }
    }
    /// Strata.
    pub fn len(self) -> usize {
        match self {
            Self::Polar { rings, sectors } => rings * sectors,
            Self::Square { side } => side * side,
        }
    }
    /// Never: grids have strata.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }
    /// Local direction of point `jitter` (unit square) of a stratum.
    pub fn direction(self, stratum: usize, jitter: Vec2) -> Vec3 {
        match self {
            Self::Polar { rings, sectors } => {
                let sin2 = ((stratum / sectors) as f32 + jitter.x) / rings as f32;
                let (s, c) = (std::f32::consts::TAU * ((stratum % sectors) as f32 + jitter.y) / sectors as f32).sin_cos();
                let sin = sin2.sqrt();
                Vec3::new(sin * c, sin * s, (1.0 - sin2).max(0.0).sqrt())
            }
            Self::Square { side } => {
                let corner = Vec2::new((stratum % side) as f32, (stratum / side) as f32);
                sample_cosine_hemisphere((corner + jitter) / side as f32)
            }
        }
    }
    /// Local direction of a corner of square strata, 0..=side each; the zenith for other grids.
    pub fn corner(self, x: usize, y: usize) -> Vec3 {
        match self {
            Self::Square { side } => {
                let rim = x % side == 0 || y % side == 0;
                let wi = sample_cosine_hemisphere(Vec2::new(x as f32, y as f32) / side as f32);
                if rim { wi.with_z(0.0) } else { wi }
            }
            Self::Polar { .. } => Vec3::Z,
        }
    }
    /// Strata beside a stratum.
    pub fn neighbours(self, stratum: usize) -> [Option<usize>; 4] {
        match self {
            Self::Polar { rings, sectors } => {
                let (ring, sector) = (stratum / sectors, stratum % sectors);
                [
                    Some(ring * sectors + (sector + 1) % sectors),
                    Some(ring * sectors + (sector + sectors - 1) % sectors),
                    (ring > 0).then(|| stratum - sectors),
                    (ring + 1 < rings).then_some(stratum + sectors),
                ]
            }
            Self::Square { side } => {
                let (x, y) = (stratum % side, stratum / side);
                [(x > 0).then(|| stratum - 1), (x + 1 < side).then_some(stratum + 1), (y > 0).then(|| stratum - side), (y + 1 < side).then_some(stratum + side)]
            }
        }
    }
    /// Range of sin θ of a stratum (of its square ring for [`Grid::Square`]).
    pub fn sin_range(self, stratum: usize) -> [f32; 2] {
        match self {
            Self::Polar { rings, sectors } => {
                let ring = (stratum / sectors) as f32;
                [(ring / rings as f32).sqrt(), ((ring + 1.0) / rings as f32).sqrt()]
            }
            Self::Square { side } => {
                let off = |i: usize| (2 * i + 1).abs_diff(side);
                let ring = off(stratum % side).max(off(stratum / side)) as f32;
                [(ring - 1.0).max(0.0) / side as f32, (ring + 1.0) / side as f32]
            }
        }
    }
}

/// The samples of one hemisphere, one a stratum.
#[derive(Clone, Debug)]
pub struct Hemisphere {
    /// Their strata.
    pub grid: Grid,
    /// Unit directions, local: z is the shading normal.
    pub direction: Vec<Vec3>,
    /// Radiance; zero below the geometric horizon.
    pub radiance: Vec<Rgb>,
    /// 1 / distance of the hit; 0 for the sky and below the geometric horizon.
    pub inverse_distance: Vec<f32>,
    /// False below the geometric horizon.
    pub above: Vec<bool>,
}

impl Hemisphere {
    /// Shoots one ray a stratum.
    pub fn shoot(world: &World, proxy: Proxy<'_>, p: Vec3, ng: Vec3, frame: &Frame, grid: Grid, seed: u64, element: u64, round: u64) -> Self {
        let mut rng = Rng::new(seed, Stream::Cache, element, round);
        Self::from_fn(grid, &mut rng, |local| {
            let wi = frame.world_from_local(local);
            (wi.dot(ng) > 0.0).then(|| {
                let incident = proxy.incident(world, &Ray::new(p, wi));
                (incident.radiance, 1.0 / incident.t)
            })
        })
    }

    /// Samples of any environment: radiance and inverse distance by local direction; none below the geometric horizon.
    pub fn from_fn(grid: Grid, rng: &mut Rng, mut environment: impl FnMut(Vec3) -> Option<(Rgb, f32)>) -> Self {
        let n = grid.len();
        let mut out = Self {
            grid,
            direction: Vec::with_capacity(n),
            radiance: Vec::with_capacity(n),
            inverse_distance: Vec::with_capacity(n),
            above: Vec::with_capacity(n),
        };
        for stratum in 0..n {
            let wi = grid.direction(stratum, rng.next_2d());
            let seen = environment(wi);
            let (radiance, inverse_distance) = seen.unwrap_or((Rgb::ZERO, 0.0));
            out.direction.push(wi);
            out.radiance.push(radiance);
            out.inverse_distance.push(inverse_distance);
            out.above.push(seen.is_some());
        }
        out
    }

    /// Shoots `extra` further rays into every stratum that differs from a neighbour by more than `share` of the irradiance, and keeps the
    /// mean radiance and the smallest distance of all its rays; at most `limit` rays, the strata that differ most first. Rays shot.
    pub fn supersample(&mut self, world: &World, proxy: Proxy<'_>, p: Vec3, ng: Vec3, frame: &Frame, share: f32, extra: u32, limit: u32, rng: &mut Rng) -> u32 {
        let n = self.radiance.len();
        let threshold = share * self.radiance.iter().map(|l| f64::from(l.element_sum())).sum::<f64>() as f32;
        let mut chosen: Vec<(f32, usize)> = (0..n)
            .map(|i| {
                let here = self.radiance[i].element_sum();
                let most = self.grid.neighbours(i).into_iter().flatten().map(|j| (self.radiance[j].element_sum() - here).abs()).fold(0.0, f32::max);
                (most, i)
            })
            .filter(|&(most, i)| most > threshold && self.above[i])
            .collect();
        chosen.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        chosen.truncate((limit / extra.max(1)) as usize);
        for &(_, i) in &chosen {
            for already in 1..=extra {
                let wi = frame.world_from_local(self.grid.direction(i, rng.next_2d()));
                let (radiance, inverse) = if wi.dot(ng) > 0.0 {
                    let incident = proxy.incident(world, &Ray::new(p, wi));
                    (incident.radiance, 1.0 / incident.t)
                } else {
                    (Rgb::ZERO, 0.0)
                };
                let weight = 1.0 / (already + 1) as f32;
                let (l, k) = (self.radiance[i], self.inverse_distance[i]);
                self.radiance[i] = l + (radiance - l) * weight;
                self.inverse_distance[i] = k.max(inverse);
            }
        }
        chosen.len() as u32 * extra
    }

    /// Irradiance.
    pub fn irradiance(&self) -> Rgb {
        let sum: glam::DVec3 = self.radiance.iter().map(|l| l.as_dvec3()).sum();
        (sum * (std::f64::consts::PI / self.radiance.len() as f64)).as_vec3()
    }

    /// Mean radiance of the directions above the geometric horizon; exactly the radiance of a constant environment.
    pub fn mean_above(&self) -> Rgb {
        let count = self.above.iter().filter(|&&above| above).count();
        let sum: glam::DVec3 = self.radiance.iter().map(|l| l.as_dvec3()).sum();
        (sum / count.max(1) as f64).as_vec3()
    }

    /// Rotational gradient, local, per channel: E(N) ≈ E + (n × N) · g.
    ///
    /// `g = n × ∫ L wi dω`, the weight tan θ taken as its mean over the stratum: the sampled one has no finite variance at the horizon.
    pub fn gradient_rotation(&self) -> [Vec3; 3] {
        let mut sums = [Vec3::ZERO; 3];
        for (stratum, (&wi, &l)) in self.direction.iter().zip(&self.radiance).enumerate() {
            if l == Rgb::ZERO {
                continue;
            }
            let azimuth = Vec2::new(wi.x, wi.y).normalize_or_zero() * mean_tan(self.grid.sin_range(stratum));
            let rotated = Vec3::new(-azimuth.y, azimuth.x, 0.0);
            for (sum, value) in sums.iter_mut().zip(l.to_array()) {
                *sum += rotated * value;
            }
        }
        sums.map(|s| s * (std::f32::consts::PI / self.radiance.len() as f32))
    }
}

/// Mean of tan θ over a range of sin θ with sin² θ uniform: [θ − sin θ cos θ] / [sin² θ].
fn mean_tan([a, b]: [f32; 2]) -> f32 {
    let primitive = |s: f32| s.asin() - s * (1.0 - s * s).max(0.0).sqrt();
    (primitive(b) - primitive(a)) / (b * b - a * a)
}
