//! The light from far away, the one place that all methods ask: a constant and the two parts of an
//! environment map.
//!
//! ```text
//! L(ω) = constant + smooth(ω)   found by rays that meet nothing, counted as indirect
//!      + bright(ω)              sampled as a light like the suns, counted as direct
//! ```
//!
//! [`crate::scene::Environment`] says how a map is split. Both parts are drawn texel by texel in
//! proportion to luminance times solid angle; the bright part is constant over a texel, so its
//! density is exactly proportional to its luminance; photons of the smooth part are drawn by the
//! largest of a texel and its neighbours, which bounds its interpolated values. Cost 44 B a texel.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::radiometry::{Rgb, luminance};
use crate::sampling::{Grid, hash64};
use crate::scene::Environment;

/// One part of a map with its densities.
#[derive(Clone)]
pub(super) struct Part {
    /// The part's texels, and the map's rotation.
    map: Environment,
    grid: Grid,
    /// ∫ L dω.
    integral: Rgb,
}

impl std::fmt::Debug for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let hash = self
            .map
            .texels
            .iter()
            .flat_map(|c| c.to_array())
            .fold(0, |h, v| hash64(h ^ u64::from(v.to_bits())));
        write!(
            f,
            "map {}×{} {hash:016x} {:?}",
            self.map.width, self.map.height, self.map.world_from_map
        )
    }
}

impl Part {
    fn new(map: Environment, spread: bool) -> Self {
        let (w, h) = (map.width as usize, map.height as usize);
        let value = |x: usize, y: usize| luminance(map.texels[y * w + x]);
        let largest = |x: usize, y: usize| {
            let rows = y.saturating_sub(1)..=(y + 1).min(h - 1);
            rows.flat_map(|r| [x, (x + 1) % w, (x + w - 1) % w].map(|c| value(c, r)))
                .fold(0.0, f32::max)
        };
        let weights: Vec<f64> = (0..w * h)
            .map(|i| {
                f64::from(if spread { largest(i % w, i / w) } else { value(i % w, i / w) })
                    * map.solid_angle(i / w)
            })
            .collect();
        Self { grid: Grid::new(w, &weights), integral: map.integral(), map }
    }

    pub(super) fn integral(&self) -> Rgb {
        self.integral
    }

    /// A unit direction and its density per steradian.
    pub(super) fn sample(&self, u: Vec2) -> Option<(Vec3, f32)> {
        let (x, y, at) = self.grid.sample(u)?;
        let dir = self.map.direction(x, y, at);
        let pdf = self.pdf(x, y);
        (pdf > 0.0).then_some((dir, pdf))
    }

    fn pdf(&self, x: usize, y: usize) -> f32 {
        (f64::from(self.grid.probability(x, y)) / self.map.solid_angle(y)) as f32
    }

    /// Density of [`Part::sample`] at `dir`, per steradian.
    pub(super) fn pdf_solid_angle(&self, dir: Vec3) -> f32 {
        let (x, y) = self.map.texel(dir);
        self.pdf(x, y)
    }

    /// Radiance of the texel around `dir`.
    pub(super) fn texel(&self, dir: Vec3) -> Rgb {
        let (x, y) = self.map.texel(dir);
        self.map.texels[y * self.map.width as usize + x]
    }

    /// Radiance interpolated between texels.
    fn bilinear(&self, dir: Vec3) -> Rgb {
        let (w, h) = (self.map.width as i64, self.map.height as i64);
        let at = self.map.position(dir) - 0.5;
        let (x0, y0) = (at.x.floor(), at.y.floor());
        let (fx, fy) = (at.x - x0, at.y - y0);
        let texel = |dx: i64, dy: i64| {
            self.map.texels
                [((y0 as i64 + dy).clamp(0, h - 1) * w + (x0 as i64 + dx).rem_euclid(w)) as usize]
        };
        (texel(0, 0) * (1.0 - fx) + texel(1, 0) * fx) * (1.0 - fy)
            + (texel(0, 1) * (1.0 - fx) + texel(1, 1) * fx) * fy
    }
}

/// Light of directions that meet no surface, without suns and without a map's bright part.
#[derive(Clone, Debug, Default)]
pub struct Sky {
    /// Radiance of all directions, beside the map's.
    pub constant: Rgb,
    map: Option<Arc<Part>>,
}

/// The bright part of a map, as a source of direct light.
#[derive(Clone, Debug)]
pub(super) struct Bright {
    pub(super) part: Arc<Part>,
    /// Middle of its light, unit; zero when it comes evenly from all sides.
    axis: Vec3,
    /// Sine of the half angle of the cone around `axis` that holds it; above 1: more than a
    /// hemisphere.
    reach: f32,
    /// ∫ L dω, channels added.
    strength: f32,
}

impl Sky {
    /// Without a map.
    pub fn new(constant: Rgb) -> Self {
        Self { constant, map: None }
    }

    /// Takes the smooth part of a map; returns the bright one, if there is any.
    pub(super) fn set_map(&mut self, map: &Environment) -> Option<Bright> {
        let (smooth, bright) = map.split();
        self.map = Some(Arc::new(Part::new(Environment { texels: smooth, ..map.clone() }, true)));
        let part = Part::new(Environment { texels: bright, ..map.clone() }, false);
        (!part.grid.is_empty()).then(|| Bright::new(part))
    }

    /// True when a map makes the sky depend on direction.
    pub fn has_map(&self) -> bool {
        self.map.is_some()
    }

    /// True when no light comes from it.
    pub fn is_dark(&self) -> bool {
        self.constant == Rgb::ZERO && self.map.as_ref().is_none_or(|m| m.grid.is_empty())
    }

    /// Radiance from the unit direction `dir`.
    pub fn radiance(&self, dir: Vec3) -> Rgb {
        self.constant + self.from_map(dir)
    }

    /// Radiance of the map alone from the unit direction `dir`.
    pub fn from_map(&self, dir: Vec3) -> Rgb {
        self.map.as_ref().map_or(Rgb::ZERO, |m| m.bilinear(dir))
    }

    /// ∫ L dω over the sphere.
    pub fn integral(&self) -> Rgb {
        self.constant * (4.0 * std::f32::consts::PI)
            + self.map.as_ref().map_or(Rgb::ZERO, |m| m.integral)
    }

    /// A unit direction drawn about in proportion to luminance, and radiance over its density per
    /// steradian. `pick` chooses between the constant and the map. `None` when that choice is dark.
    pub(super) fn sample(&self, pick: f32, u: Vec2) -> Option<(Vec3, Rgb)> {
        let uniform = |share: f32| {
            let dir = crate::sampling::sample_uniform_sphere(u);
            (dir, self.constant * (4.0 * std::f32::consts::PI / share))
        };
        let Some(map) = &self.map else { return Some(uniform(1.0)) };
        let constant = luminance(self.constant) * 4.0 * std::f32::consts::PI;
        let share = constant / (constant + luminance(map.integral)).max(f32::MIN_POSITIVE);
        if pick < share {
            return Some(uniform(share));
        }
        let (dir, pdf) = map.sample(u)?;
        Some((dir, map.bilinear(dir) / (pdf * (1.0 - share))))
    }
}

impl Bright {
    fn new(part: Part) -> Self {
        let (w, map) = (part.map.width as usize, &part.map);
        let lit = || {
            map.texels
                .iter()
                .enumerate()
                .filter(|(_, c)| luminance(**c) > 0.0)
                .map(|(i, c)| (i % w, i / w, luminance(*c)))
        };
        let middle = |x: usize, y: usize| map.direction(x, y, Vec2::splat(0.5));
        let axis = lit()
            .map(|(x, y, l)| middle(x, y) * (l * map.solid_angle(y) as f32))
            .sum::<Vec3>()
            .normalize_or_zero();
        // No corner of a texel is farther from its middle than its sides are long.
        let margin = std::f32::consts::PI * 2.0 / map.height as f32;
        let angle =
            lit().map(|(x, y, _)| middle(x, y).angle_between(axis)).fold(0.0f32, f32::max) + margin;
        let reach = if axis == Vec3::ZERO || angle >= std::f32::consts::FRAC_PI_2 {
            2.0
        } else {
            angle.sin()
        };
        Self { strength: part.integral.element_sum(), part: Arc::new(part), axis, reach }
    }

    /// About the unoccluded irradiance of a surface with unit normal `n`, channels added; zero only
    /// when it is zero.
    pub(super) fn estimate(&self, n: Vec3) -> f32 {
        let cos = n.dot(self.axis);
        if cos <= -self.reach { 0.0 } else { self.strength * cos.max(self.reach.min(0.5)) }
    }
}
