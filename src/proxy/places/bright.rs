//! Bright surfaces: where direct light falls together on little, and rays that are aimed there.
//!
//! ```text
//! p(wi) = (1 − a) cos θ / π + a Σ_k q_k d² / (A_k cos θ_k)   over the squares k that wi meets
//! q_k ∝ Φ_k cos θ cos θ_k / (d² + A_k),  Φ_k = Σ E_direct size²
//! a = ½ S / (S + mean E_direct)
//! S: irradiance that all squares would send if nothing were before them
//! ```
//!
//! A patch of sun in a dark room lights all of it, and one cosine ray in hundreds finds it: what
//! parts know of their indirect light is then a matter of luck. Parts with much more direct light
//! than the mean are gathered into at most [`MOST`] squares of the grids, and part of the rays of
//! every part go to points on these, weighed by the density of both kinds `[Veach97]` §9.2. What
//! the rays meet is what counts: a square may be hidden, or larger than what is lit of it. How many
//! rays of a part are aimed is settled beforehand: the weights of a part's rays then sum to about
//! their number, as those of cosine rays do, and the linear system of parts stays a contraction.
//!
//! Input   the parts that views asked for, their direct light. Output  [`Bright::aim`]: directions
//!         from a point, and their density.
//! Guarantees  the density is that of the directions, and positive wherever a cosine ray may go:
//!         no choice of squares makes an error other than noise.
//! Not     light that is bright after two reflections: cosine rays find it.
//! Cost    a few hundred flops a ray. Without bright parts nothing changes, to the bit.

use glam::{Vec2, Vec3};

use super::cover::{NewPart, Point};
use super::key::Grids;
use crate::math::Frame;
use crate::radiometry::{Rgb, luminance};
use crate::sampling::{pdf_cosine_hemisphere, sample_cosine_hemisphere};

/// Direct irradiance that is bright, over the mean of all landings.
const BRIGHT: f32 = 3.0;
/// Most squares.
const MOST: usize = 32;
/// Levels by which squares are larger than places, at most.
const COARSEST: i32 = 5;
/// Share of aimed rays where all light is bright.
const SHARE: f32 = 0.5;

/// A square with light on it.
#[derive(Clone, Copy, Debug)]
struct Square {
    corner: Vec3,
    sides: [Vec3; 2],
    /// Vectors whose products with a vector from the corner are its shares of the sides.
    duals: [Vec3; 2],
    /// Unit normal of the lit side.
    normal: Vec3,
    area: f32,
    /// Luminance of the direct irradiance times the area of its parts.
    flux: f32,
}

impl Square {
    fn new([corner, b, a, _]: [Vec3; 4], normal: Vec3) -> Self {
        let sides = [a - corner, b - corner];
        let n = sides[0].cross(sides[1]);
        let duals = [sides[1].cross(n), n.cross(sides[0])].map(|d| d / n.length_squared());
        Self { corner, sides, duals, normal, area: n.length(), flux: 0.0 }
    }

    fn middle(&self) -> Vec3 {
        self.corner + 0.5 * (self.sides[0] + self.sides[1])
    }

    /// Density per steradian of a uniform point on it, seen from `p` along `wi`; zero where the ray
    /// passes by or meets the other side.
    fn pdf_solid_angle(&self, p: Vec3, wi: Vec3) -> f32 {
        let cos = -wi.dot(self.normal);
        if cos <= 0.0 {
            return 0.0;
        }
        let t = (p - self.corner).dot(self.normal) / cos;
        if t <= 0.0 {
            return 0.0;
        }
        let at = p + wi * t - self.corner;
        let inside = self.duals.iter().all(|dual| (0.0..1.0).contains(&at.dot(*dual)));
        if inside { t * t / (self.area * cos) } else { 0.0 }
    }
}

/// What is bright, as it is known after direct light.
#[derive(Clone, Debug, Default)]
pub(super) struct Bright {
    squares: Vec<Square>,
    /// Luminance of the mean direct irradiance.
    mean: f32,
}

impl Bright {
    /// Of the parts `new`, which have the direct irradiance `direct`.
    pub fn new<'a>(grids: &Grids, lit: impl Iterator<Item = (&'a NewPart, Rgb)> + Clone) -> Self {
        let (mut sum, mut landings) = (0.0f64, 0.0f64);
        for (part, direct) in lit.clone() {
            sum += f64::from(part.landings) * f64::from(luminance(direct));
            landings += f64::from(part.landings);
        }
        let mean = (sum / landings.max(1.0)) as f32;
        let bright: Vec<(&NewPart, f32)> = lit
            .map(|(part, direct)| (part, luminance(direct)))
            .filter(|&(_, e)| e > BRIGHT * mean && mean > 0.0)
            .collect();
        let mut squares = Vec::new();
        for up in 0..=COARSEST {
            squares = gathered(grids, &bright, up);
            if squares.len() <= MOST {
                break;
            }
        }
        squares.sort_by(|a, b| b.flux.total_cmp(&a.flux));
        squares.truncate(MOST);
        Self { squares, mean }
    }

    /// Rays from a point.
    pub fn aim(&self, at: &Point) -> Aim<'_> {
        let mut aim = Aim {
            bright: self,
            frame: Frame::from_normal(at.ns),
            p: at.p,
            at: [0.0; MOST],
            share: 0.0,
        };
        let mut sum = 0.0;
        for (square, up_to) in self.squares.iter().zip(&mut aim.at) {
            let way = square.middle() - at.p;
            let d2 = way.length_squared();
            let wi = way / d2.sqrt().max(f32::MIN_POSITIVE);
            let cosines = wi.dot(at.ns).max(0.0) * (-wi.dot(square.normal)).max(0.0);
            sum += square.flux * cosines / (d2 + square.area);
            *up_to = sum;
        }
        if sum > 0.0 {
            aim.at.iter_mut().for_each(|up_to| *up_to /= sum);
            let sent = sum * std::f32::consts::FRAC_1_PI;
            aim.share = SHARE * sent / (sent + self.mean);
        }
        aim
    }
}

/// Bright parts by square, `up` levels above their places. In the order of the parts.
fn gathered(grids: &Grids, bright: &[(&NewPart, f32)], up: i32) -> Vec<Square> {
    let mut index = std::collections::HashMap::new();
    let mut squares: Vec<Square> = Vec::new();
    for (part, e) in bright {
        let level = part.level + up;
        let size = grids.size_at(part.level);
        let number = *index.entry(grids.key(&part.spot, level)).or_insert(squares.len());
        if number == squares.len() {
            squares.push(Square::new(grids.corners(&part.spot, level), part.spot.normal));
        }
        squares[number].flux += e * size * size;
    }
    squares
}

/// Directions from a point, some of them aimed.
#[derive(Debug)]
pub(super) struct Aim<'a> {
    bright: &'a Bright,
    frame: Frame,
    p: Vec3,
    /// Running sum of the shares of the squares.
    at: [f32; MOST],
    /// Share of aimed rays.
    share: f32,
}

impl Aim<'_> {
    /// How many of `count` rays are best aimed: at most half, so that cosine rays reach what is
    /// not known. `pick` rounds.
    pub fn rays(&self, count: u32, pick: f32) -> u32 {
        ((self.share * count as f32 + pick) as u32).min(count / 2)
    }

    /// A unit direction, and the density of a cosine ray over that of rays of which this share is
    /// aimed; none where it is below the surface.
    pub fn sample(&self, aimed: bool, share: f32, uv: Vec2) -> Option<(Vec3, f32)> {
        let wi = if aimed {
            let squares = &self.bright.squares;
            let ends = &self.at[..squares.len()];
            let k = ends.partition_point(|&x| x <= uv.x).min(squares.len() - 1);
            let before = if k == 0 { 0.0 } else { ends[k - 1] };
            let x = ((uv.x - before) / (ends[k] - before)).clamp(0.0, 1.0);
            let Square { corner, sides, .. } = squares[k];
            (corner + sides[0] * x + sides[1] * uv.y - self.p).try_normalize()?
        } else {
            self.frame.world_from_local(sample_cosine_hemisphere(uv))
        };
        let cos = wi.dot(self.frame.n);
        (cos > 0.0).then(|| (wi, self.weight(wi, cos, share)))
    }

    fn weight(&self, wi: Vec3, cos: f32, share: f32) -> f32 {
        if share == 0.0 {
            return 1.0;
        }
        let cosine = pdf_cosine_hemisphere(cos);
        let mut before = 0.0;
        let aimed = self.bright.squares.iter().zip(&self.at).map(|(square, &up_to)| {
            let chance = up_to - before;
            before = up_to;
            if chance > 0.0 { chance * square.pdf_solid_angle(self.p, wi) } else { 0.0 }
        });
        cosine / ((1.0 - share) * cosine + share * aimed.sum::<f32>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream};

    /// Two squares, one of them slanted, over a point.
    fn bright() -> Bright {
        let square = |corner: Vec3, a: Vec3, b: Vec3, flux: f32| {
            let normal = b.cross(a).normalize();
            Square { flux, ..Square::new([corner, corner + b, corner + a, corner + a + b], normal) }
        };
        let squares = vec![
            square(Vec3::new(0.2, 0.1, 1.0), Vec3::X * 0.5, Vec3::Y * 0.4, 3.0),
            square(Vec3::new(-0.9, 0.1, 0.5), Vec3::new(0.3, 0.1, 0.2), Vec3::Y * 0.4, 1.0),
        ];
        assert!(squares.iter().all(|s| s.middle().dot(s.normal) < 0.0));
        Bright { squares, mean: 0.1 }
    }

    /// What rays find with their weights is what cosine rays find: of all directions, and of those
    /// in cones, whether there are squares or not.
    #[test]
    fn weights_are_those_of_the_density() {
        let bright = bright();
        let at = Point { p: Vec3::ZERO, ng: Vec3::Z, ns: Vec3::new(0.1, 0.0, 1.0).normalize() };
        let aim = bright.aim(&at);
        let aimed = aim.rays(10, 0.5);
        assert!(aimed > 2 && aimed < 6, "{aimed}");
        let mut rng = Rng::new(1, Stream::Test, 9, 0);
        let axes = [Vec3::new(0.45, 0.3, 1.0), Vec3::new(-0.75, 0.35, 0.6), Vec3::X];
        let cones = axes.map(|axis| (axis.normalize(), 0.95));
        let (mut found, mut expected) = ([0.0f64; 4], [0.0f64; 4]);
        let count = 200_000;
        for i in 0..count {
            let uv = rng.next_2d();
            let add = |sums: &mut [f64; 4], wi: Vec3, weight: f32| {
                let inside = cones.iter().map(|(axis, cos)| wi.dot(*axis) > *cos);
                let inside = std::iter::once(true).chain(inside);
                sums.iter_mut().zip(inside).filter(|s| s.1).for_each(|s| *s.0 += f64::from(weight));
            };
            let sample = aim.sample(i % 10 < aimed, aimed as f32 / 10.0, uv);
            if let Some((wi, weight)) = sample {
                add(&mut found, wi, weight);
            }
            add(&mut expected, at.cosine_direction(uv), 1.0);
        }
        for (found, expected) in found.into_iter().zip(expected) {
            // Five standard deviations of both counts.
            let tolerance = 5.0 * (2.0 * expected).sqrt();
            assert!((found - expected).abs() < tolerance, "{found} {expected}");
        }
    }

    #[test]
    fn without_squares_rays_are_cosine_rays() {
        let at = Point { p: Vec3::ZERO, ng: Vec3::Z, ns: Vec3::Z };
        let uv = Vec2::new(0.3, 0.7);
        let bright = Bright::default();
        let aim = bright.aim(&at);
        assert_eq!(aim.rays(1000, 0.9), 0);
        let (wi, weight) = aim.sample(false, 0.0, uv).unwrap();
        assert!(weight == 1.0 && wi == at.cosine_direction(uv));
    }
}
