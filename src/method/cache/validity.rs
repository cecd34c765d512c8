//! How far a record reaches, and with what weight.
//!
//! | Mode | Radius | Weight |
//! |---|---|---|
//! | `hessian` | by curvature, see below | hats of the ellipse, the angle, the plane distance |
//! | `production-2006` | κ R, see below | 1 − max(d / r, √(1 − n·n_i) / √(1 − cos angle)) |
//! | `split-sphere` | a R, R harmonic mean distance | 1 / (d / R + √(1 − n·n_i)) − 1 / a |
//!
//! `hessian`: per axis r_k = (4 ε A / (π abs λ_k))^¼, at most E / abs g_k; the longer at most
//! `aspect` times the shorter; both at most κ R, with R the smallest distance, clamped by
//! neighbours. `production-2006`: R = min(smallest distance, E / abs g_c), clamped by neighbours.
//!
//! All radii lie in \[`min_spacing`, `max_spacing`\] pixel footprints of the record. Records in
//! front of the point, (p − p_i)·(n + n_i)/2 < 0 by more than a twentieth of the radius, are left
//! out `[Ward88]`, softly. Sources: `[Schwarzhaupt12]` as in Radiance, `[Tabellion04]`, `[Ward88]`.
//! Corral: where something low stands within the radius in the azimuth of the point, one test ray
//! from the record, 20° above its plane towards the point, must be free.
//! Guarantees  weights are continuous and zero at the border, except for the shadow of the test
//!             ray.

use glam::Vec3;

use super::measure::{Derivatives, Measured, SECTORS};
use super::record::CacheRecord;
use super::settings::{Allocation, CacheSettings, Mode};
use crate::math::{Frame, Ray};
use crate::shading::World;

/// Share of the radius by which a record may be in front.
const FRONT: f32 = 0.05;
/// Tangent of 20°.
const TEST_RAY_SLOPE: f32 = 0.364;

/// The settings, made ready for one picture.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    mode: Mode,
    allocation: Allocation,
    /// Lengths relative to those of `error` = 0.1.
    scale: f32,
    min_spacing: f32,
    max_spacing: f32,
    max_radius: f32,
    /// Reach over R.
    kappa: f32,
    aspect: f32,
    /// Largest √(2 (1 − n·n_i)).
    chord: f32,
    plane: f32,
    leak_guard: bool,
    pixels: f32,
    extent: f32,
}

impl Rule {
    /// For a picture of so many pixels in a world of the given extent.
    pub fn new(settings: &CacheSettings, pixels: u32, extent: f32) -> Self {
        let relative = settings.error / 0.1;
        let scale = if settings.mode == Mode::Hessian { relative.sqrt() } else { relative };
        Self {
            mode: settings.mode,
            allocation: settings.allocation,
            scale,
            min_spacing: settings.min_spacing * scale.min(1.0),
            max_spacing: settings.max_spacing,
            max_radius: settings.max_radius.resolve(extent),
            kappa: match settings.mode {
                Mode::Hessian => settings.clearance * scale,
                Mode::Production2006 => 0.5 * scale,
                Mode::SplitSphere => 0.2 * scale,
            },
            aspect: settings.aspect,
            chord: 2.0 * (settings.angle.to_radians() * 0.5 * scale.min(1.0)).sin(),
            plane: settings.plane,
            leak_guard: settings.leak_guard && settings.mode == Mode::Hessian,
            pixels: pixels as f32,
            extent,
        }
    }

    /// What a record of this mode needs.
    pub fn derivatives(&self) -> Derivatives {
        match self.mode {
            Mode::Hessian => Derivatives::OcclusionHessian,
            Mode::Production2006 => Derivatives::WardHeckbert,
            Mode::SplitSphere => Derivatives::None,
        }
    }

    /// Whether neighbours limit one another.
    pub fn clamps_neighbours(&self) -> bool {
        self.mode != Mode::SplitSphere && self.kappa < f32::INFINITY
    }

    fn limits(&self, footprint: f32) -> [f32; 2] {
        let high = (self.max_spacing * footprint).min(self.max_radius);
        [(self.min_spacing * footprint).min(high), high]
    }

    /// The record of a measurement at `p` with shading normal `n`.
    pub fn record(&self, measured: &Measured, p: Vec3, n: Vec3, footprint: f32) -> CacheRecord {
        let limits = self.limits(footprint);
        let mut record = CacheRecord {
            p,
            n,
            irradiance: measured.irradiance,
            gradient_rotation: measured.gradient_rotation,
            gradient_translation: measured.gradient_translation,
            axis: measured.curvature_axis,
            radius: [0.0; 2],
            clearance: 0.0,
            floor: limits[0],
            corral: 0,
            standard_error: measured.standard_error,
        };
        match self.mode {
            Mode::Hessian => {
                self.ellipse(&mut record, measured, limits, footprint);
                if self.clamps_neighbours() {
                    record.clearance = measured.distance_min.min(limits[1] / self.kappa);
                    self.shorten(&mut record);
                }
            }
            Mode::Production2006 | Mode::SplitSphere => {
                let mut distance = if self.mode == Mode::SplitSphere {
                    measured.distance_harmonic
                } else {
                    measured.distance_min
                };
                for c in 0..3 {
                    let slope = record.gradient_translation[c].length();
                    if record.irradiance[c] > 0.0 && slope > 0.0 {
                        distance = distance.min(record.irradiance[c] / slope);
                    }
                }
                record.clearance = distance.min(limits[1] / self.kappa);
                self.fit_clearance(&mut record);
            }
        }
        if self.leak_guard {
            let reach = record.radius_max();
            record.corral = (0..SECTORS)
                .filter(|&k| measured.low_occluder[k] < 2.0 * reach)
                .fold(0, |mask, k| mask | 1 << k);
        }
        record
    }

    /// The circle that follows from the clearance; gradients are damped where the floor lifted it.
    fn fit_clearance(&self, record: &mut CacheRecord) {
        let wanted = self.kappa * record.clearance;
        record.radius = [wanted.max(record.floor); 2];
        if wanted < record.floor {
            record.gradient_translation =
                record.gradient_translation.map(|g| g * (wanted / record.floor));
        }
    }

    /// The ellipse within the circle that the clearance allows.
    fn shorten(&self, record: &mut CacheRecord) {
        let longest = (self.kappa * record.clearance).max(record.floor);
        record.radius = record.radius.map(|r| r.min(longest));
    }

    /// Lowers the clearance to `bound` if it is above; gradients that the floor had damped stay
    /// damped as much as the new clearance asks.
    pub fn clamp(&self, record: &mut CacheRecord, bound: f32) {
        if bound < record.clearance {
            if self.mode == Mode::Hessian {
                record.clearance = bound;
                return self.shorten(record);
            }
            let before = (self.kappa * record.clearance / record.floor).min(1.0);
            record.clearance = bound;
            record.gradient_translation = record.gradient_translation.map(|g| g / before.max(1e-6));
            self.fit_clearance(record);
        }
    }

    fn ellipse(
        &self,
        record: &mut CacheRecord,
        measured: &Measured,
        [low, high]: [f32; 2],
        footprint: f32,
    ) {
        let area = match self.allocation {
            Allocation::Pixel => self.pixels * footprint * footprint,
            Allocation::Area => self.extent * self.extent,
        };
        let epsilon = (0.003 * self.scale * self.scale).powi(2);
        let across = record.n.cross(record.axis);
        let mean = record.irradiance.element_sum().max(f32::MIN_POSITIVE);
        let gradient = (record.gradient_translation[0]
            + record.gradient_translation[1]
            + record.gradient_translation[2])
            / mean;
        let radius = |curvature: f32, axis: Vec3| {
            let r = (4.0 * epsilon * area
                / (std::f32::consts::PI * curvature.max(f32::MIN_POSITIVE)))
            .sqrt()
            .sqrt();
            let slope = gradient.dot(axis).abs();
            if slope * r > 1.0 { 1.0 / slope } else { r }
        };
        let mut wanted =
            [radius(measured.curvature[0], record.axis), radius(measured.curvature[1], across)];
        let longest = self.aspect * wanted[0].min(wanted[1]);
        wanted = wanted.map(|r| r.min(longest).min(high));
        // A slope measured for less than the floor is none to follow over all of it.
        let damp = wanted.map(|r| (r / low).min(1.0));
        let along = [record.axis, across];
        record.gradient_translation = record.gradient_translation.map(|g| {
            along[0] * (g.dot(along[0]) * damp[0]) + along[1] * (g.dot(along[1]) * damp[1])
        });
        let r = wanted.map(|r| r.max(low));
        record.radius = if r.iter().all(|r| r.is_finite()) { r } else { [low; 2] };
    }

    /// Weight of a record for a point, without the test ray. `reach` 1 in the fill, more in the
    /// final pass.
    pub fn weight(&self, record: &CacheRecord, p: Vec3, n: Vec3, reach: f32) -> f32 {
        let offset = p - record.p;
        let [r0, r1] = record.radius;
        let turned = (1.0 - record.n.dot(n)).max(0.0);
        let lift = offset.dot(record.n + n) * 0.5;
        if self.mode == Mode::Hessian {
            let (x, y) =
                (offset.dot(record.axis) / r0, offset.dot(record.n.cross(record.axis)) / r1);
            let ellipse = 1.0 - (x * x + y * y).sqrt() / reach;
            let angle = 1.0 - (2.0 * turned).sqrt() / (self.chord * reach);
            let plane = 1.0 - lift.abs() / (self.plane * r0.min(r1) * reach);
            return if ellipse > 0.0 && angle > 0.0 && plane > 0.0 {
                ellipse * angle * plane
            } else {
                0.0
            };
        }
        let front = (2.0 + lift / (FRONT * r0)).clamp(0.0, 1.0);
        let distance = offset.length() / r0;
        let angle = (2.0 * turned).sqrt() / self.chord;
        let weight = match self.mode {
            Mode::SplitSphere => 1.0 / (distance + angle).max(1e-3) - 1.0 / reach,
            _ => 1.0 - distance.max(angle) / reach,
        };
        weight.max(0.0) * front
    }

    /// Whether the corral's test ray from the record towards `p` is blocked; counts the ray.
    pub fn leaks(&self, world: &World, record: &CacheRecord, p: Vec3, rays: &mut u64) -> bool {
        if !self.leak_guard || record.corral == 0 {
            return false;
        }
        let frame = Frame::from_normal(record.n);
        let offset = p - record.p;
        let (x, y) = (offset.dot(frame.s), offset.dot(frame.t));
        let distance = x.hypot(y);
        if distance <= 0.1 * record.floor {
            return false;
        }
        let turn = (y.atan2(x) / std::f32::consts::TAU + 1.0).fract();
        let sector = ((turn * SECTORS as f32) as usize).min(SECTORS - 1) as u32;
        // The sector itself or a neighbour: a thin post may have been missed by a few rays.
        if record.corral.rotate_right(sector).rotate_left(1) & 0b111 == 0 {
            return false;
        }
        *rays += 1;
        let ray = Ray {
            origin: record.p,
            t_min: 0.0,
            dir: offset + record.n * (TEST_RAY_SLOPE * distance),
            t_max: 1.0,
        };
        world.rays.occluded(&ray)
    }

    /// Radius of the sphere outside of which a record has no weight.
    pub fn sphere(&self, record: &CacheRecord, reach: f32) -> f32 {
        record.radius_max() * reach * 1.05
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radiometry::Rgb;

    const MODES: [Mode; 3] = [Mode::Hessian, Mode::Production2006, Mode::SplitSphere];

    fn measured(distance: f32, curvature: [f32; 2], slope: f32) -> Measured {
        Measured {
            irradiance: Rgb::splat(2.0),
            gradient_rotation: [Vec3::ZERO; 3],
            gradient_translation: [Vec3::X * slope; 3],
            distance_harmonic: 2.0 * distance,
            distance_min: distance,
            curvature_axis: Vec3::X,
            curvature,
            low_occluder: [f32::INFINITY; SECTORS],
            rays: 512,
            standard_error: 0.0,
        }
    }

    fn rule(mode: Mode) -> Rule {
        Rule::new(&CacheSettings { mode, ..CacheSettings::default() }, 10_000, 10.0)
    }

    /// Footprint 0.01: radii lie between the least and the greatest spacing of so many pixels.
    fn made(rule: &Rule, m: &Measured) -> CacheRecord {
        rule.record(m, Vec3::ZERO, Vec3::Z, 0.01)
    }

    #[test]
    fn weights_fall_continuously_to_zero_at_the_border() {
        for mode in MODES {
            let rule = rule(mode);
            let record = made(&rule, &measured(0.5, [4.0, 0.5], 0.0));
            let border = rule.sphere(&record, 1.0);
            let along = |t: f32| rule.weight(&record, Vec3::X * (t * border), Vec3::Z, 1.0);
            assert!(along(0.0) > 0.0 && along(1.0) == 0.0, "{mode:?}");
            let steps: Vec<f32> = (1..=2000).map(|i| along(i as f32 / 2000.0)).collect();
            assert!(steps.windows(2).all(|w| w[1] <= w[0]), "{mode:?}");
            let last = steps.iter().rposition(|w| *w > 0.0).unwrap();
            assert!(steps[last] < 0.01 * steps[0], "{mode:?}: jumps from {} to zero", steps[last]);
            // Turning the normal away ends it as well, and a smaller reach never gives more.
            assert_eq!(rule.weight(&record, Vec3::ZERO, Vec3::X, 1.0), 0.0, "{mode:?}");
            assert!(
                rule.weight(&record, Vec3::X * (0.5 * border), Vec3::Z, 1.5) >= along(0.5),
                "{mode:?}"
            );
        }
    }

    #[test]
    fn records_in_front_of_the_point_are_left_out() {
        for mode in MODES {
            let rule = rule(mode);
            let record = made(&rule, &measured(0.5, [1.0, 1.0], 0.0));
            let behind = Vec3::Z * (-0.6 * record.radius_max());
            assert_eq!(rule.weight(&record, behind, Vec3::Z, 1.0), 0.0, "{mode:?}");
        }
    }

    #[test]
    fn radii_follow_curvature_clearance_slope_and_footprint() {
        let settings = CacheSettings { clearance: f32::INFINITY, ..CacheSettings::default() };
        let free = Rule::new(&settings, 10_000, 10.0);
        let [r, r4] = [0.1, 1.6].map(|c| made(&free, &measured(1.0, [c, c], 0.0)).radius[0]);
        assert!((r / r4 - 2.0).abs() < 1e-3, "fourth root: {r} {r4}");
        let long = made(&free, &measured(1.0, [1.0, 1e-6], 0.0)).radius;
        assert!(long[1] <= settings.aspect * long[0] * 1.0001 && long[1] > long[0]);
        let steep = made(&free, &measured(1.0, [0.1, 0.1], 40.0));
        assert!(
            (steep.radius[0] - 0.05).abs() < 1e-6 && r > 0.05 && steep.radius[1] > steep.radius[0],
            "only along the slope"
        );
        for mode in MODES {
            let rule = rule(mode);
            let tiny = made(&rule, &measured(1e-9, [1e20, 1e20], 10.0));
            assert_eq!(tiny.radius, [tiny.floor; 2], "{mode:?}");
            assert!(
                mode == Mode::SplitSphere || tiny.gradient_translation[0].length() < 1e-3,
                "{mode:?}: no slope over more than it was measured for"
            );
            let huge = made(&rule, &measured(1e9, [0.0, 0.0], 0.0));
            let limit = (0.01 * CacheSettings::default().max_spacing)
                .min(CacheSettings::default().max_radius.resolve(10.0));
            assert!(
                huge.radius[0] <= limit * 1.0001 && huge.radius[0] > 0.9 * limit,
                "{mode:?} {:?}",
                huge.radius
            );
        }
    }

    #[test]
    fn neighbours_shorten_one_another_but_never_below_the_floor() {
        for mode in [Mode::Hessian, Mode::Production2006] {
            let rule = rule(mode);
            let mut record = made(&rule, &measured(0.5, [1e-6, 1e-6], 0.0));
            let before = record.radius[0];
            rule.clamp(&mut record, 1.0);
            assert_eq!(record.radius[0], before, "a neighbour with more room changes nothing");
            rule.clamp(&mut record, 0.25);
            assert!(record.radius[0] <= before && record.clearance == 0.25, "{mode:?}");
            rule.clamp(&mut record, 0.0);
            assert_eq!(record.radius, [record.floor; 2], "{mode:?}");
        }
    }
}
