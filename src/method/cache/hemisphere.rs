//! The light that arrives at a record, as a jittered polar grid of directions.
//!
//! ```text
//! E = π / N · Σ L(wi)     wi cosine-distributed, one a stratum of equal weighted solid angle
//! ```
//! M rings of equal sin² θ, N ≈ π M sectors. A concentric square grid (compact strata) was tried:
//! its outermost strata reach higher above the horizon, and what is low and near, a rare hit of
//! much weight, makes gradients noisier (error of extrapolation in the built-in interior 0.26
//! against 0.17), irradiance a little.
//!
//! Input   a point lifted off its surface, its geometric normal, the frame of its shading normal.
//!         Output  [`Hemisphere`]: per stratum the local direction, the radiance and the inverse
//!         distance of what was met. The sky has inverse distance 0: it stays where it is however
//!         the point moves.
//! Guarantees  keyed by (seed, element, round), never by thread. Directions below the geometric
//!             horizon are not shot: no light, no hit.

use glam::{Vec2, Vec3};

use crate::math::{Frame, Ray};
use crate::proxy::Proxy;
use crate::radiometry::Rgb;
use crate::sampling::{Rng, Stream};
use crate::shading::World;

/// Strata of equal cosine-weighted solid angle; index `ring · sectors + sector`, rings from the
/// zenith out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// M.
    pub rings: usize,
    /// N.
    pub sectors: usize,
}

impl Grid {
    /// About `rays` strata, at least 4 × 12.
    pub fn new(rays: u32) -> Self {
        let rings = ((f64::from(rays) / std::f64::consts::PI).sqrt().round() as usize).max(4);
        Self { rings, sectors: (rays as usize / rings).max(12) }
    }
    /// Strata.
    pub fn strata(self) -> usize {
        self.rings * self.sectors
    }
    /// sin θ of the border under ring `ring`; ring 0 starts at the zenith.
    pub fn sin_border(self, ring: usize) -> f32 {
        (ring as f32 / self.rings as f32).sqrt()
    }
    /// Local direction where the borders of `ring` and `sector` meet.
    pub fn corner(self, ring: usize, sector: usize) -> Vec3 {
        self.at(ring as f32, sector as f32)
    }
    /// Local direction of point `jitter` (unit square) of a stratum.
    pub fn direction(self, stratum: usize, jitter: Vec2) -> Vec3 {
        self.at(
            (stratum / self.sectors) as f32 + jitter.x,
            (stratum % self.sectors) as f32 + jitter.y,
        )
    }
    fn at(self, ring: f32, sector: f32) -> Vec3 {
        let sin2 = ring / self.rings as f32;
        let (s, c) = (std::f32::consts::TAU * sector / self.sectors as f32).sin_cos();
        let sin = sin2.sqrt();
        Vec3::new(sin * c, sin * s, (1.0 - sin2).max(0.0).sqrt())
    }
    /// The strata after a stratum: the next sector's, and the next ring's if there is one.
    pub fn next(self, stratum: usize) -> [Option<usize>; 2] {
        let (ring, sector) = (stratum / self.sectors, stratum % self.sectors);
        [
            Some(ring * self.sectors + (sector + 1) % self.sectors),
            (ring + 1 < self.rings).then_some(stratum + self.sectors),
        ]
    }
}

/// A place on a surface, and what the random numbers there are keyed by.
#[derive(Clone, Copy, Debug)]
pub struct Site {
    /// Lifted off the surface.
    pub p: Vec3,
    /// Geometric normal, unit.
    pub ng: Vec3,
    /// Shading normal, unit.
    pub ns: Vec3,
    /// Of the run.
    pub seed: u64,
    /// Of the place, within the run.
    pub element: u64,
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
    /// Shoots one ray a stratum, about the frame of the site's shading normal; every `round` has
    /// rays of its own.
    pub fn shoot(
        world: &World,
        proxy: &Proxy,
        site: &Site,
        frame: &Frame,
        grid: Grid,
        round: u64,
    ) -> Self {
        let mut rng = Rng::new(site.seed, Stream::Cache, site.element, round);
        Self::from_fn(grid, &mut rng, |local| {
            let wi = frame.world_from_local(local);
            (wi.dot(site.ng) > 0.0).then(|| {
                let incident = proxy.incident(world, &Ray::new(site.p, wi));
                (incident.radiance, 1.0 / incident.t)
            })
        })
    }

    /// Samples of any environment: radiance and inverse distance by local direction; none below the
    /// geometric horizon.
    pub fn from_fn(
        grid: Grid,
        rng: &mut Rng,
        mut environment: impl FnMut(Vec3) -> Option<(Rgb, f32)>,
    ) -> Self {
        let n = grid.strata();
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

    /// Irradiance.
    pub fn irradiance(&self) -> Rgb {
        let sum: glam::DVec3 = self.radiance.iter().map(|l| l.as_dvec3()).sum();
        (sum * (std::f64::consts::PI / self.radiance.len() as f64)).as_vec3()
    }

    /// Rotational gradient, local, per channel: E(N) ≈ E + (n × N) · g.
    ///
    /// `g = n × ∫ L wi dω`, the weight tan θ taken as its mean over the stratum: the sampled one
    /// has no finite variance at the horizon.
    pub fn gradient_rotation(&self) -> [Vec3; 3] {
        let mut sums = [Vec3::ZERO; 3];
        let tangents: Vec<f32> = (0..self.grid.rings)
            .map(|j| mean_tan([j, j + 1].map(|j| self.grid.sin_border(j))))
            .collect();
        for (stratum, (&wi, &l)) in self.direction.iter().zip(&self.radiance).enumerate() {
            if l == Rgb::ZERO {
                continue;
            }
            let azimuth =
                Vec2::new(wi.x, wi.y).normalize_or_zero() * tangents[stratum / self.grid.sectors];
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strata_lie_between_their_corners() {
        for grid in [Grid::new(512), Grid::new(1), Grid::new(4096)] {
            let mut rng = Rng::new(1, Stream::Test, 0, 0);
            for i in 0..grid.strata() {
                let (ring, sector) = (i / grid.sectors, i % grid.sectors);
                let wi = grid.direction(i, rng.next_2d());
                let sin = Vec2::new(wi.x, wi.y).length();
                assert!(
                    sin > grid.sin_border(ring) - 1e-5 && sin < grid.sin_border(ring + 1) + 1e-5
                );
                assert!(wi.is_normalized() && wi.z >= 0.0);
                let (a, b) = (grid.corner(grid.rings, sector), grid.corner(grid.rings, sector + 1));
                assert!(
                    a.z == 0.0 && a.cross(wi).z > -1e-5 && wi.cross(b).z > -1e-5,
                    "{grid:?} {i}"
                );
            }
        }
    }

    #[test]
    fn rays_asked_for() {
        for rays in [64, 512, 1024, 4096] {
            let grid = Grid::new(rays);
            assert!(
                grid.strata() <= rays as usize && grid.strata() + grid.rings > rays as usize,
                "{rays}: {grid:?}"
            );
        }
    }
}
