//! One record: irradiance, its derivatives and what bounds its reach, from one set of rays.

use glam::Vec3;

use super::hemisphere::{Grid, Hemisphere};
use super::{hessian, ward};
use crate::math::Frame;
use crate::photon::Proxy;
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
    /// |λ1| ≥ |λ2| of the relative irradiance, 1/length²; zero unless [`Derivatives::OcclusionHessian`].
    pub curvature: [f32; 2],
    /// Per azimuth sector about `Frame::from_normal(ns)`: distance of the nearest hit less than 30° above the tangent plane; infinite: none.
    pub low_occluder: [f32; SECTORS],
    /// Rays shot.
    pub rays: u32,
    /// Relative standard error of the irradiance (mean of channels), from differences of neighbouring strata.
    pub standard_error: f32,
}

/// Measures the record at `p` (already lifted off the surface). Keyed by (seed, element).
pub fn measure(world: &World, proxy: Proxy<'_>, p: Vec3, ng: Vec3, ns: Vec3, rays: u32, derivatives: Derivatives, seed: u64, element: u64) -> Measured {
    let frame = Frame::from_normal(ns);
    let grid = if derivatives == Derivatives::WardHeckbert { Grid::polar(rays) } else { Grid::square(rays) };
    let hemisphere = Hemisphere::shoot(world, proxy, p, ng, &frame, grid, seed, element, 0);
    summarise(&hemisphere, &frame, derivatives)
}

/// The record of a hemisphere.
pub fn summarise(hemisphere: &Hemisphere, frame: &Frame, derivatives: Derivatives) -> Measured {
    let n = hemisphere.radiance.len();
    let world = |g: [Vec3; 3]| g.map(|g| frame.world_from_local(g));
    let (mut inverse_sum, mut nearest, mut low_occluder) = (0.0f64, 0.0f32, [f32::INFINITY; SECTORS]);
    for (wi, &k) in hemisphere.direction.iter().zip(&hemisphere.inverse_distance) {
        inverse_sum += f64::from(k);
        if wi.z > GRAZING {
            nearest = nearest.max(k);
        }
        if wi.z < LOW && k > 0.0 {
            let turn = wi.y.atan2(wi.x) / std::f32::consts::TAU;
            let sector = (((turn + 1.0).fract() * SECTORS as f32) as usize).min(SECTORS - 1);
            low_occluder[sector] = low_occluder[sector].min(1.0 / k);
        }
    }
    let mut out = Measured {
        irradiance: hemisphere.irradiance(),
        gradient_rotation: [Vec3::ZERO; 3],
        gradient_translation: [Vec3::ZERO; 3],
        distance_harmonic: (n as f64 / inverse_sum) as f32,
        distance_min: 1.0 / nearest,
        curvature_axis: frame.s,
        curvature: [0.0; 2],
        low_occluder,
        rays: n as u32,
        standard_error: standard_error(hemisphere),
    };
    if derivatives != Derivatives::None {
        out.gradient_rotation = world(hemisphere.gradient_rotation());
    }
    match derivatives {
        Derivatives::None => {}
        Derivatives::WardHeckbert => out.gradient_translation = world(ward::gradient_translation(hemisphere)),
        Derivatives::OcclusionHessian => {
            let found = hessian::derivatives(hemisphere);
            out.gradient_translation = world(found.gradient);
            let (values, axis) = hessian::eigen(found.hessian);
            out.curvature = values.map(f32::abs);
            out.curvature_axis = frame.world_from_local(axis.extend(0.0));
        }
    }
    out
}

fn standard_error(hemisphere: &Hemisphere) -> f32 {
    let row = match hemisphere.grid {
        Grid::Polar { sectors, .. } => sectors,
        Grid::Square { side } => side,
    };
    let n = hemisphere.radiance.len();
    let value = |i: usize| f64::from(hemisphere.radiance[i].element_sum());
    let (mut squares, mut count, mut sum) = (0.0, 0u32, 0.0);
    for i in 0..n {
        sum += value(i);
        if (i + 1) % row != 0 {
            squares += (value(i) - value(i + 1)).powi(2);
            count += 1;
        }
        if i + row < n {
            squares += (value(i) - value(i + row)).powi(2);
            count += 1;
        }
    }
    if sum == 0.0 { 0.0 } else { ((squares / (2.0 * f64::from(count)) * n as f64).sqrt() / sum) as f32 }
}
