//! One record: irradiance, its derivatives and what bounds its reach, from one set of rays.
//!
//! Input   a [`Site`]. Output  [`Measured`]. Keyed by the site: the same bits on any thread.
//! Cost    `rays` rays; the gradients and the Hessian add at most 5 % to them.
//!
//! **Noise.** A record noisier than `noise` is measured again with as many further rays as it has,
//! in a hemisphere of their own, all hemispheres weighted by their strata, until it is quiet or has
//! `noise_rays_max` times its rays. Stopping by what was found darkens the mean, for records that
//! miss a bright thing stay as they are: in the built-in interior by 0.1 to 0.3 %, at 1.3 times the
//! rays, with the error per ray of plain sampling and a shorter tail; in the worst case of the
//! tests, one record in four hitting a patch that sends a quarter of the light, by 10 % while the
//! error halves. Infinite `noise` is unbiased. Further rays in the strata that differ most from
//! their neighbours (Radiance's way) were tried: 2 to 3 % too dark in that interior, and no better
//! per ray.

use glam::{DVec3, Vec3};

use super::hemisphere::{Grid, Hemisphere, Site};
use super::{hessian, ward};
use crate::math::Frame;
use crate::proxy::Proxy;
use crate::radiometry::Rgb;
use crate::shading::World;

/// What is measured beside irradiance and distances.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Derivatives {
    /// Nothing.
    None,
    /// Ward–Heckbert gradients.
    WardHeckbert,
    /// Occlusion-aware gradient and Hessian.
    OcclusionHessian,
}

/// Azimuth sectors of [`Measured::low_occluder`].
pub const SECTORS: usize = 32;

/// Sine of the elevation under which a hit is low (30°).
const LOW: f32 = 0.5;

/// Rays closer than 10° to the tangent plane do not count for the smallest distance: sin 10°.
const GRAZING: f32 = 0.173_648_18;

/// One record.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// On the plane with the shading normal, W·m⁻².
    pub irradiance: Rgb,
    /// Per channel: E(N) ≈ E + (ns × N) · g.
    pub gradient_rotation: [Vec3; 3],
    /// Per channel, tangent to ns, per unit length.
    pub gradient_translation: [Vec3; 3],
    /// N / Σ 1/t; infinite when nothing is hit.
    pub distance_harmonic: f32,
    /// Smallest t, rays within 10° of the tangent plane left out; infinite when nothing is hit.
    pub distance_min: f32,
    /// Unit tangent, direction of the larger |λ|.
    pub curvature_axis: Vec3,
    /// |λ1| ≥ |λ2| of the relative irradiance, 1/length²; zero unless
    /// [`Derivatives::OcclusionHessian`].
    pub curvature: [f32; 2],
    /// Per azimuth sector about `Frame::from_normal(ns)`: distance of the nearest hit less than 30°
    /// above the tangent plane; infinite: none.
    pub low_occluder: [f32; SECTORS],
    /// Rays shot.
    pub rays: u32,
    /// Relative standard error of the irradiance (mean of channels), from differences of
    /// neighbouring strata.
    pub standard_error: f32,
}

/// What is measured at a record, and how it is kept from noise.
#[derive(Clone, Copy, Debug)]
pub struct MeasureSettings {
    /// Rays of a quiet record.
    pub rays: u32,
    /// What is measured beside irradiance and distances.
    pub derivatives: Derivatives,
    /// Relative standard error above which a record is measured with further rays.
    pub noise: f32,
    /// Most rays of a record, in units of `rays`.
    pub noise_rays_max: u32,
}

impl MeasureSettings {
    /// With the usual bounds of noise: 10 % from at most four times the rays.
    pub fn new(rays: u32, derivatives: Derivatives) -> Self {
        Self { rays, derivatives, noise: 0.1, noise_rays_max: 4 }
    }
}

/// Measures the record at a site.
pub fn measure(world: &World, proxy: &Proxy, site: &Site, settings: &MeasureSettings) -> Measured {
    let frame = Frame::from_normal(site.ns);
    let limit = f64::from(settings.rays) * f64::from(settings.noise_rays_max);
    let mut sum = Sum::default();
    for round in 0.. {
        let rays = if round == 0 { settings.rays } else { sum.strata as u32 };
        let grid = Grid::new(rays);
        let hemisphere = Hemisphere::shoot(world, proxy, site, &frame, grid, round);
        sum.add(&hemisphere, settings.derivatives);
        if sum.standard_error() <= settings.noise || 2.0 * sum.strata > limit {
            break;
        }
    }
    sum.finish(&frame, settings.derivatives)
}

/// The record of one hemisphere.
pub fn summarise(hemisphere: &Hemisphere, frame: &Frame, derivatives: Derivatives) -> Measured {
    let mut sum = Sum::default();
    sum.add(hemisphere, derivatives);
    sum.finish(frame, derivatives)
}

/// Hemispheres of one point, each weighted by its strata; local frame.
#[derive(Debug)]
struct Sum {
    strata: f64,
    rays: u32,
    irradiance: DVec3,
    /// Σ squares of (strata · standard error of the sum of channels).
    variance: f64,
    rotation: [Vec3; 3],
    translation: [Vec3; 3],
    /// Of the irradiance summed over channels.
    hessian: [f32; 3],
    inverse_distance: f64,
    inverse_nearest: f32,
    low_occluder: [f32; SECTORS],
}

impl Default for Sum {
    fn default() -> Self {
        Self {
            strata: 0.0,
            rays: 0,
            irradiance: DVec3::ZERO,
            variance: 0.0,
            rotation: [Vec3::ZERO; 3],
            translation: [Vec3::ZERO; 3],
            hessian: [0.0; 3],
            inverse_distance: 0.0,
            inverse_nearest: 0.0,
            low_occluder: [f32::INFINITY; SECTORS],
        }
    }
}

impl Sum {
    fn add(&mut self, hemisphere: &Hemisphere, derivatives: Derivatives) {
        let n = hemisphere.radiance.len() as f32;
        self.strata += f64::from(n);
        self.rays += hemisphere.above.iter().filter(|&&above| above).count() as u32;
        let irradiance = hemisphere.irradiance();
        self.irradiance += irradiance.as_dvec3() * f64::from(n);
        self.variance += (f64::from(n) * standard_error(hemisphere)).powi(2);
        for (wi, &k) in hemisphere.direction.iter().zip(&hemisphere.inverse_distance) {
            self.inverse_distance += f64::from(k);
            if wi.z > GRAZING {
                self.inverse_nearest = self.inverse_nearest.max(k);
            }
            if wi.z < LOW && k > 0.0 {
                let turn = wi.y.atan2(wi.x) / std::f32::consts::TAU;
                let sector = (((turn + 1.0).fract() * SECTORS as f32) as usize).min(SECTORS - 1);
                self.low_occluder[sector] = self.low_occluder[sector].min(1.0 / k);
            }
        }
        let add = |sum: &mut [Vec3; 3], g: [Vec3; 3]| {
            for (sum, g) in sum.iter_mut().zip(g) {
                *sum += g * n;
            }
        };
        if derivatives != Derivatives::None {
            add(&mut self.rotation, hemisphere.gradient_rotation());
        }
        match derivatives {
            Derivatives::None => {}
            Derivatives::WardHeckbert => {
                add(&mut self.translation, ward::gradient_translation(hemisphere))
            }
            Derivatives::OcclusionHessian => {
                let found = hessian::derivatives(hemisphere);
                add(&mut self.translation, found.gradient);
                for (sum, h) in self.hessian.iter_mut().zip(found.hessian) {
                    *sum += h * n * irradiance.element_sum();
                }
            }
        }
    }

    /// Relative.
    fn standard_error(&self) -> f32 {
        let sum = self.irradiance.element_sum();
        if sum > 0.0 { (self.variance.sqrt() / sum) as f32 } else { 0.0 }
    }

    fn finish(&self, frame: &Frame, derivatives: Derivatives) -> Measured {
        let share = 1.0 / self.strata as f32;
        let world = |g: [Vec3; 3]| g.map(|g| frame.world_from_local(g * share));
        let scale = self.irradiance.element_sum() as f32;
        let (curvature, axis) =
            hessian::eigen(if scale > 0.0 { self.hessian.map(|h| h / scale) } else { [0.0; 3] });
        Measured {
            irradiance: (self.irradiance / self.strata).as_vec3(),
            gradient_rotation: world(self.rotation),
            gradient_translation: world(self.translation),
            distance_harmonic: (self.strata / self.inverse_distance) as f32,
            distance_min: 1.0 / self.inverse_nearest,
            curvature_axis: if derivatives == Derivatives::OcclusionHessian {
                frame.world_from_local(axis.extend(0.0))
            } else {
                frame.s
            },
            curvature: curvature.map(f32::abs),
            low_occluder: self.low_occluder,
            rays: self.rays,
            standard_error: self.standard_error(),
        }
    }
}

/// Of the irradiance summed over channels: half the mean square between neighbouring strata is
/// their variance.
fn standard_error(hemisphere: &Hemisphere) -> f64 {
    let n = hemisphere.radiance.len();
    let value = |i: usize| f64::from(hemisphere.radiance[i].element_sum());
    let (mut squares, mut count) = (0.0, 0u32);
    for i in 0..n {
        for j in hemisphere.grid.next(i).into_iter().flatten() {
            squares += (value(i) - value(j)).powi(2);
            count += 1;
        }
    }
    std::f64::consts::PI * (squares / (2.0 * f64::from(count)) / n as f64).sqrt()
}
