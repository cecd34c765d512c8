//! The directions of one cell: a table over the hemisphere, in the coordinates of cosine rays.
//!
//! ```text
//! (u, v) = (sin² θ, φ / 2π): a cosine ray is uniform over the unit square
//! p(wi) = cos θ / π · h(bin) / mean(h)
//! ```

use glam::{Vec2, Vec3};

use super::cells::Seen;
use crate::math::{Frame, Ray};
use crate::proxy::Proxy;
use crate::radiometry::luminance;
use crate::sampling::{Sobol, Stream, pdf_cosine_hemisphere, sample_cosine_hemisphere};
use crate::shading::World;

/// Bins along sin² θ and along φ.
const BINS: [usize; 2] = [16, 48];
const COUNT: usize = BINS[0] * BINS[1];
/// Rays that the mean of the hemisphere stands for in every bin.
const PRIOR: f32 = 0.25;
/// Rays of the cell that a bright place stands for which others saw.
const HEARSAY: f32 = 0.1;
/// How many of these there are.
const BRIGHT: usize = 256;

/// Hits of all cells, drawn by luminance.
pub(super) fn bright(found: &[Vec<Found>]) -> Vec<Found> {
    let met = || found.iter().flatten().filter(|f| f.hit.is_some());
    let whole: f64 = met().map(|f| f64::from(f.luminance)).sum();
    let (mut drawn, mut sum) = (Vec::with_capacity(BRIGHT), 0.0);
    for hit in met() {
        sum += f64::from(hit.luminance);
        while drawn.len() < BRIGHT && sum * BRIGHT as f64 > (drawn.len() as f64 + 0.5) * whole {
            drawn.push(*hit);
        }
    }
    drawn
}

/// What a ray found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    wi: Vec3,
    /// Where it ended, and the normal there; none for the sky.
    hit: Option<(Vec3, Vec3)>,
    /// Luminance that arrives along it.
    luminance: f32,
}

/// Cosine rays from `members`, `rays` of them.
pub(super) fn shoot(
    world: &World,
    proxy: &Proxy,
    members: &[Seen],
    (rays, seed, element): (u32, u64, u64),
) -> Vec<Found> {
    let sobol = Sobol::new(seed, Stream::Guide, element);
    let one = |r: u32| {
        let pick = (sobol.sample_1d(r, 0) * members.len() as f32) as usize;
        let from = members[pick.min(members.len() - 1)];
        let local = sample_cosine_hemisphere(sobol.sample_2d(r, 1));
        let wi = Frame::from_normal(from.ns).world_from_local(local);
        if wi.dot(from.ng) <= 0.0 {
            return None;
        }
        let incident = proxy.incident(world, &Ray::new(from.p, wi));
        let hit = incident.t.is_finite().then(|| (from.p + wi * incident.t, incident.normal));
        Some(Found { wi, hit, luminance: luminance(incident.radiance) })
    };
    (0..rays).filter_map(one).collect()
}

/// A density of directions.
#[derive(Debug)]
pub struct Directions {
    frame: Frame,
    /// Running sum of the table, divided by its whole.
    cdf: Box<[f32; COUNT]>,
}

fn bin(local: Vec3) -> usize {
    let u = local.x * local.x + local.y * local.y;
    let turn = local.y.atan2(local.x) * std::f32::consts::FRAC_1_PI * 0.5;
    let v = if turn < 0.0 { turn + 1.0 } else { turn };
    let at = |x: f32, bins: usize| ((x * bins as f32) as usize).min(bins - 1);
    at(u, BINS[0]) * BINS[1] + at(v, BINS[1])
}

impl Directions {
    /// From sets of rays, each with its weight, seen from `center`. What is `bright` is taken into
    /// account where no ray of the sets met it: it may be hidden from most of the cell only.
    pub(super) fn learn<'a>(
        center: &Seen,
        sets: impl Iterator<Item = (&'a [Found], f32)>,
        bright: &[Found],
    ) -> Self {
        let frame = Frame::from_normal(center.ns);
        let mut sums = vec![[0.0f32; 2]; COUNT];
        let mut whole = [0.0f32; 2];
        for (rays, weight) in sets {
            for ray in rays {
                let wi = match ray.hit {
                    Some((y, _)) => (y - center.p).normalize_or(ray.wi),
                    None => ray.wi,
                };
                let local = frame.local_from_world(wi);
                if local.z <= 0.0 {
                    continue;
                }
                let sum = &mut sums[bin(local)];
                sum[0] += weight * ray.luminance * ray.luminance;
                sum[1] += weight;
                whole[0] += weight * ray.luminance;
                whole[1] += weight;
            }
        }
        for ray in bright {
            let Some((y, normal)) = ray.hit else { continue };
            let wi = (y - center.p).normalize_or(ray.wi);
            let local = frame.local_from_world(wi);
            if local.z > 0.0 && wi.dot(normal) < 0.0 {
                let sum = &mut sums[bin(local)];
                sum[0] += HEARSAY * ray.luminance * ray.luminance;
                sum[1] += HEARSAY;
            }
        }
        let mean = whole[0] / whole[1].max(f32::MIN_POSITIVE);
        let mut cdf = Box::new([0.0; COUNT]);
        let mut total = 0.0;
        for (slot, [squares, weight]) in cdf.iter_mut().zip(sums) {
            let square = (squares + PRIOR * mean * mean) / (weight + PRIOR);
            total += square.sqrt();
            *slot = total;
        }
        if total > 0.0 {
            cdf.iter_mut().for_each(|x| *x /= total);
        } else {
            cdf.iter_mut().zip(1..).for_each(|(x, i)| *x = i as f32 / COUNT as f32);
        }
        Self { frame, cdf }
    }

    /// Share of all rays that go to a bin.
    fn share(&self, bin: usize) -> f32 {
        self.cdf[bin] - if bin == 0 { 0.0 } else { self.cdf[bin - 1] }
    }

    /// A unit direction in world space, for two uniform numbers.
    pub fn sample(&self, u: Vec2) -> Vec3 {
        let mut bin = self.cdf.partition_point(|&c| c <= u.x).min(COUNT - 1);
        while bin > 0 && self.share(bin) <= 0.0 {
            bin -= 1;
        }
        let before = if bin == 0 { 0.0 } else { self.cdf[bin - 1] };
        let rest = ((u.x - before) / self.share(bin).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        let sin2 = ((bin / BINS[1]) as f32 + u.y) / BINS[0] as f32;
        let phi = ((bin % BINS[1]) as f32 + rest) / BINS[1] as f32 * std::f32::consts::TAU;
        let (sin_phi, cos_phi) = phi.sin_cos();
        let (sin, cos) = (sin2.sqrt(), (1.0 - sin2).max(0.0).sqrt());
        self.frame.world_from_local(Vec3::new(sin * cos_phi, sin * sin_phi, cos))
    }

    /// Density of [`Directions::sample`], per steradian.
    pub fn pdf_solid_angle(&self, wi: Vec3) -> f32 {
        let local = self.frame.local_from_world(wi);
        if local.z <= 0.0 {
            return 0.0;
        }
        pdf_cosine_hemisphere(local.z) * COUNT as f32 * self.share(bin(local))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn learned() -> Directions {
        let center = Seen { p: Vec3::ZERO, ng: Vec3::Y, ns: Vec3::Y };
        let bright = Vec3::new(0.6, 0.7, -0.2).normalize();
        let sobol = Sobol::new(1, Stream::Test, 3);
        let rays: Vec<Found> = (0..4096)
            .map(|i| {
                let local = sample_cosine_hemisphere(sobol.sample_2d(i, 0));
                let wi = Frame::from_normal(Vec3::Y).world_from_local(local);
                let luminance = if wi.dot(bright) > 0.95 { 50.0 } else { 0.2 };
                Found { wi, hit: None, luminance }
            })
            .collect();
        Directions::learn(&center, std::iter::once((rays.as_slice(), 1.0)), &[])
    }

    #[test]
    fn density_integrates_to_one_and_is_that_of_the_samples() {
        let directions = learned();
        let sobol = Sobol::new(2, Stream::Test, 4);
        let count = 200_000;
        let (mut integral, mut cap, mut cap_of_samples) = (0.0f64, 0.0f64, 0.0f64);
        let axis = Vec3::new(0.5, 0.8, 0.0).normalize();
        for i in 0..count {
            let local = sample_cosine_hemisphere(sobol.sample_2d(i, 0));
            let wi = Frame::from_normal(Vec3::Y).world_from_local(local);
            let ratio = f64::from(directions.pdf_solid_angle(wi) / pdf_cosine_hemisphere(local.z));
            integral += ratio;
            cap += if wi.dot(axis) > 0.9 { ratio } else { 0.0 };
            let drawn = directions.sample(sobol.sample_2d(i, 1));
            cap_of_samples += f64::from(u8::from(drawn.dot(axis) > 0.9));
        }
        assert!((integral / f64::from(count) - 1.0).abs() < 0.01, "{integral}");
        assert!((cap / cap_of_samples - 1.0).abs() < 0.02, "{cap} {cap_of_samples}");
    }

    #[test]
    fn most_samples_go_where_most_light_is() {
        let directions = learned();
        let bright = Vec3::new(0.6, 0.7, -0.2).normalize();
        let sobol = Sobol::new(3, Stream::Test, 5);
        let met = (0..1000)
            .filter(|&i| directions.sample(sobol.sample_2d(i, 0)).dot(bright) > 0.9)
            .count();
        assert!(met > 800, "{met}");
    }

    #[test]
    fn without_light_the_density_is_the_cosine() {
        let center = Seen { p: Vec3::ZERO, ng: Vec3::Y, ns: Vec3::Y };
        let directions = Directions::learn(&center, std::iter::empty(), &[]);
        let pdf = directions.pdf_solid_angle(Vec3::new(0.6, 0.8, 0.0));
        assert!((pdf - pdf_cosine_hemisphere(0.8)).abs() < 1e-4, "{pdf}");
    }
}
