//! Running sums of a pixel, and the film they make.
//!
//! Every sum is an f64 rounded after each addition to what a pair of f32 (high, low) represents,
//! about 48 bits: so the two f32 channels of a file hold it exactly, and a resumed run adds to the
//! same number as one that never stopped.

use glam::Vec3;

use crate::film::{Film, Layer, layer};
use crate::radiometry::Rgb;

/// What one path brings back.
#[derive(Default)]
pub(super) struct Sample {
    /// Seen directly.
    pub(super) emission: Rgb,
    pub(super) direct: Rgb,
    pub(super) indirect: Rgb,
    pub(super) albedo: Rgb,
    pub(super) normal: Vec3,
    pub(super) position: Vec3,
    pub(super) depth: f32,
    pub(super) hit: bool,
}

/// Names of the sums, in the order of [`Pixel::sums`].
pub(super) const SUMS: [&str; SUM_COUNT] = [
    "half0.R",
    "half0.G",
    "half0.B",
    "half1.R",
    "half1.G",
    "half1.B",
    "emission.R",
    "emission.G",
    "emission.B",
    "direct.R",
    "direct.G",
    "direct.B",
    "indirect.R",
    "indirect.G",
    "indirect.B",
    "square.R",
    "square.G",
    "square.B",
    "albedo.R",
    "albedo.G",
    "albedo.B",
    "N.X",
    "N.Y",
    "N.Z",
    "P.X",
    "P.Y",
    "P.Z",
    "depth.Z",
    "hits",
];
const SUM_COUNT: usize = 29;
const HALVES: usize = 0;
const EMISSION: usize = 6;
const DIRECT: usize = 9;
const INDIRECT: usize = 12;
const SQUARE: usize = 15;
const ALBEDO: usize = 18;
const NORMAL: usize = 21;
const POSITION: usize = 24;
const DEPTH: usize = 27;
const HITS: usize = 28;

/// Sums over the samples of one pixel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pixel {
    pub(super) count: u32,
    pub(super) sums: [f64; SUM_COUNT],
}

impl Default for Pixel {
    fn default() -> Self {
        Self { count: 0, sums: [0.0; SUM_COUNT] }
    }
}

/// The two f32 whose exact sum is nearest to `v`.
pub(super) fn split(v: f64) -> (f32, f32) {
    let high = v as f32;
    (high, (v - f64::from(high)) as f32)
}

fn rounded(v: f64) -> f64 {
    let (high, low) = split(v);
    f64::from(high) + f64::from(low)
}

impl Pixel {
    pub(super) fn add(&mut self, half: u32, s: &Sample) {
        let total = (s.emission + s.direct + s.indirect).as_dvec3();
        let mut at = |start: usize, v: glam::DVec3| {
            for (sum, x) in self.sums[start..start + 3].iter_mut().zip(v.to_array()) {
                *sum = rounded(*sum + x);
            }
        };
        at(HALVES + 3 * half as usize, total);
        at(EMISSION, s.emission.as_dvec3());
        at(DIRECT, s.direct.as_dvec3());
        at(INDIRECT, s.indirect.as_dvec3());
        at(SQUARE, total * total);
        if s.hit {
            at(ALBEDO, s.albedo.as_dvec3());
            at(NORMAL, s.normal.as_dvec3());
            at(POSITION, s.position.as_dvec3());
            self.sums[DEPTH] = rounded(self.sums[DEPTH] + f64::from(s.depth));
            self.sums[HITS] += 1.0;
        }
        self.count += 1;
    }

    /// Adds the samples of another.
    pub(super) fn join(&mut self, other: &Self) {
        // Half 0 has the greater half of an odd number: two of them would be two ahead.
        let swapped = self.count % 2 == 1 && other.count % 2 == 1;
        for (i, sum) in self.sums.iter_mut().enumerate() {
            let from = if swapped && i < EMISSION { (i + EMISSION / 2) % EMISSION } else { i };
            *sum = rounded(*sum + other.sums[from]);
        }
        self.count += other.count;
    }

    /// Whether samples can add up to this: finite numbers, and no more hits than samples.
    pub(super) fn is_possible(&self) -> bool {
        let hits = self.sums[HITS];
        self.sums.iter().all(|s| s.is_finite())
            && (0.0..=f64::from(self.count)).contains(&hits)
            && (self.count > 0 || self.sums.iter().all(|&s| s == 0.0))
    }

    fn total(&self, c: usize) -> f64 {
        self.sums[HALVES + c] + self.sums[HALVES + 3 + c]
    }

    fn mean(&self, c: usize) -> f64 {
        self.total(c) / f64::from(self.count.max(1))
    }

    /// Mean of one half; the other half's while there is none.
    fn half(&self, half: usize, c: usize) -> f64 {
        let n = if half == 0 { self.count.div_ceil(2) } else { self.count / 2 };
        if n == 0 { self.mean(c) } else { self.sums[HALVES + 3 * half + c] / f64::from(n) }
    }

    /// Sample variance of the mean.
    fn variance(&self, c: usize) -> f64 {
        let n = f64::from(self.count);
        if self.count < 2 {
            0.0
        } else {
            ((self.sums[SQUARE + c] - self.total(c).powi(2) / n) / (n - 1.0)).max(0.0) / n
        }
    }
}

/// Estimated relMSE of the image's own noise: the variance of the mean is a quarter of the squared
/// difference of the two halves.
pub(super) fn noise(pixels: &[Pixel]) -> f64 {
    let n = (pixels.len() * 3) as f64;
    let mean = pixels.iter().map(|p| (0..3).map(|c| p.mean(c)).sum::<f64>()).sum::<f64>() / n;
    let of = |p: &Pixel, c| {
        (p.half(0, c) - p.half(1, c)).powi(2) / 4.0 / (p.mean(c).powi(2) + 0.01 * mean * mean)
    };
    if mean > 0.0 {
        pixels.iter().map(|p| (0..3).map(|c| of(p, c)).sum::<f64>()).sum::<f64>() / n
    } else {
        0.0
    }
}

/// Layers of `film`.
pub const LAYERS: [Layer; 11] = [
    Layer::rgb("half0", "mean of the even samples, W/(sr m²)"),
    Layer::rgb("half1", "mean of the odd samples, independent of half0, W/(sr m²)"),
    Layer::rgb("variance", "variance of the beauty's mean, an upper bound"),
    layer::EMISSION,
    layer::DIRECT,
    layer::INDIRECT,
    layer::ALBEDO,
    layer::NORMAL,
    layer::POSITION,
    layer::DEPTH,
    layer::SAMPLES,
];

/// The film of the sums; means, the variance of the mean, the number of samples.
pub(super) fn film(pixels: &[Pixel], width: u32, height: u32) -> Film {
    let mut film = Film::new(width, height);
    let rgb = |of: &dyn Fn(&Pixel, usize) -> f64| -> Vec<Rgb> {
        pixels.iter().map(|p| Rgb::new(of(p, 0) as f32, of(p, 1) as f32, of(p, 2) as f32)).collect()
    };
    let mean_of = |start: usize| rgb(&|p, c| p.sums[start + c] / f64::from(p.count.max(1)));
    let hit_mean_of = |start: usize| rgb(&|p, c| p.sums[start + c] / p.sums[HITS].max(1.0));
    film.set_rgb("", &rgb(&Pixel::mean));
    film.set_rgb("half0", &rgb(&|p, c| p.half(0, c)));
    film.set_rgb("half1", &rgb(&|p, c| p.half(1, c)));
    film.set_rgb("variance", &rgb(&Pixel::variance));
    film.set_rgb("emission", &mean_of(EMISSION));
    film.set_rgb("direct", &mean_of(DIRECT));
    film.set_rgb("indirect", &mean_of(INDIRECT));
    film.set_rgb("albedo", &mean_of(ALBEDO));
    film.set_xyz(
        "N",
        &hit_mean_of(NORMAL).iter().map(|n| n.normalize_or_zero()).collect::<Vec<_>>(),
    );
    film.set_xyz("P", &hit_mean_of(POSITION));
    film.set(
        "depth.Z",
        pixels.iter().map(|p| (p.sums[DEPTH] / p.sums[HITS].max(1.0)) as f32).collect(),
    );
    film.set("samples", pixels.iter().map(|p| p.count as f32).collect());
    film
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_floats_hold_every_sum() {
        let mut sum = 0.0f64;
        for i in 0..10_000 {
            sum = rounded(sum + (f64::from(i) * 0.37).sin().abs().powi(5) * 1e3);
            let (high, low) = split(sum);
            assert_eq!(f64::from(high) + f64::from(low), sum);
        }
    }

    #[test]
    fn joined_samples_are_those_of_one_longer_render() {
        for (n, m) in [(1u32, 1u32), (3, 2), (2, 5), (3, 5), (4, 4), (0, 3)] {
            let pixel = |from: u32, count: u32| {
                let mut p = Pixel::default();
                for i in 0..count {
                    let direct = Rgb::splat((from + i + 1) as f32);
                    p.add(i & 1, &Sample { direct, hit: i % 3 == 0, ..Sample::default() });
                }
                p
            };
            let (a, b) = (pixel(0, n), pixel(n, m));
            let mut sum = a.clone();
            sum.join(&b);
            let values: Vec<f64> = (1..=n + m).map(f64::from).collect();
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            assert!((sum.mean(0) - mean).abs() < 1e-12, "{n} {m}");
            let spread: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
            let variance = if count < 2.0 { 0.0 } else { spread / (count - 1.0) / count };
            assert!((sum.variance(0) - variance).abs() < 1e-9, "{n} {m}");
            // Whatever half a sample is in, the halves have all of them, each half its number.
            let of_halves = sum.half(0, 0) * f64::from((n + m).div_ceil(2))
                + sum.half(1, 0) * f64::from((n + m) / 2);
            let all = if n + m < 2 { 2.0 * mean } else { count * mean };
            assert!((of_halves - all).abs() < 1e-9 || n + m < 2, "{n} {m}");
            assert!(sum.is_possible());
        }
    }

    #[test]
    fn mean_halves_and_variance() {
        let mut p = Pixel::default();
        for (i, v) in [1.0f32, 2.0, 4.0, 5.0].into_iter().enumerate() {
            p.add(i as u32 & 1, &Sample { direct: Rgb::splat(v), ..Sample::default() });
        }
        assert_eq!((p.mean(0), p.half(0, 0), p.half(1, 0)), (3.0, 2.5, 3.5));
        assert!((p.variance(0) - (4.0 + 1.0 + 1.0 + 4.0) / 3.0 / 4.0).abs() < 1e-12);
        let expected = 0.25 / (9.0 + 0.09);
        assert!((noise(&[p]) - expected).abs() < 1e-12);
    }
}
