//! Where the error of a picture sits: by octave of size, and in plain regions.
//!
//! Computes   level f = relMSE after picture, halves and cleaned reference were averaged over f × f
//!            pixels, f = 1, 2, 4 … 32 (level 1 without the 0.1 % worst pixels). Octave f to 2f =
//!            level f − level 2f: what averaging over twice as many pixels takes away. The last
//!            octave, 32 and above, is level 32 itself. So the octaves sum to relMSE without the
//!            0.1 % worst.
//!            plain = root of the mean, over plain pixels and channels, of the product of both
//!            halves' (x − half) / √(c² + 0.01 m²) with that half's c, each averaged over 4 × 4 and
//!            less its average over 32 × 32 pixels: the relative error of clouds of 4 to 32 pixels,
//!            which a person sees as blotches. A pixel is plain where the standard deviation of
//!            ln(c + 0.02 m) (c the mean of its channels) over 17 × 17 pixels is at most the median
//!            of the picture.
//! Reading    1 to 2 pixels are edges, direct light and near rays; 4 to 32 clouds of interpolated
//!            light; 32 and above energy.
//! Not        defined beyond the picture: averages that would cross its right or lower border are
//!            left out; a picture smaller than 32 pixels has fewer octaves and no plain figure. A
//!            mean square below the reference's noise may come out negative; plain then carries the
//!            minus sign in front of the root.
//! Error      standard errors are those of means over blocks of the widest average; none with fewer
//!            than two blocks.

use glam::DVec3;

use super::blocks::ratio;
use super::errors::worst_left_out;
use super::truth::Truth;
use crate::radiometry::Rgb;

/// Widest average, in pixels.
const WIDEST: usize = 32;
/// The averages between whose sizes plain regions are judged.
const CLOUDS: [usize; 2] = [4, 32];
/// Pixels around the one whose contrast is wanted.
const CONTRAST_REACH: usize = 8;

/// Error of one octave of size.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Octave {
    /// Smallest size, in pixels.
    pub from: usize,
    /// Largest size, in pixels; none for all above.
    pub to: Option<usize>,
    /// Its share of relMSE.
    pub relmse: f64,
    /// Standard error of `relmse`.
    pub standard_error: Option<f64>,
}

/// Error by octave of size, and in plain regions.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Octaves {
    /// From small to large; they sum to relMSE without the 0.1 % worst pixels.
    pub bands: Vec<Octave>,
    /// RMS relative error at sizes of 4 to 32 pixels where the truth is plain.
    pub plain: Option<f64>,
    /// Standard error of `plain`.
    pub plain_standard_error: Option<f64>,
}

/// A picture and its truth in blocks of the widest average.
struct Judged<'a> {
    image: &'a [Rgb],
    truth: &'a Truth,
    width: usize,
    height: usize,
    widest: usize,
}

/// The octaves of a picture of the truth's size.
pub fn octaves(image: &[Rgb], truth: &Truth) -> Octaves {
    let (width, height) = (truth.reference.width as usize, truth.reference.height as usize);
    let mut widest = WIDEST;
    while widest > width.min(height).max(1) {
        widest /= 2;
    }
    let judged = Judged { image, truth, width, height, widest };
    let sizes: Vec<usize> =
        std::iter::successors(Some(1), |f| Some(2 * f)).take_while(|f| *f <= widest).collect();
    let levels: Vec<Level> = sizes.iter().map(|&f| judged.level(f)).collect();
    let mut bands = Vec::new();
    for (i, level) in levels.iter().enumerate() {
        let next = levels.get(i + 1);
        let differences: Vec<(f64, f64)> = (0..level.of_blocks.len())
            .filter_map(|b| {
                let upper = next.map_or(Some(0.0), |n| n.of_blocks[b]);
                Some((level.of_blocks[b]? - upper?, 1.0))
            })
            .collect();
        bands.push(Octave {
            from: sizes[i],
            to: next.map(|_| 2 * sizes[i]),
            relmse: level.mean - next.map_or(0.0, |n| n.mean),
            standard_error: (differences.len() > 1).then(|| ratio(&differences).standard_error),
        });
    }
    let (plain, plain_standard_error) = judged.plain().unzip();
    Octaves { bands, plain, plain_standard_error: plain_standard_error.flatten() }
}

/// relMSE at one size: of the picture, and of every whole block.
struct Level {
    mean: f64,
    of_blocks: Vec<Option<f64>>,
}

impl Judged<'_> {
    fn finite(&self, i: usize) -> bool {
        self.image[i].is_finite() && self.truth.is_finite(i)
    }

    fn pixels(&self, f: usize, column: usize, row: usize) -> impl Iterator<Item = usize> {
        let (width, corner) = (self.width, row * f * self.width + column * f);
        (0..f * f).map(move |k| corner + k / f * width + k % f)
    }

    fn level(&self, f: usize) -> Level {
        let (columns, rows) = (self.width / f, self.height / f);
        let side = self.widest / f;
        let (wide, high) = (self.width / self.widest, self.height / self.widest);
        let mut sums = vec![(0.0f64, 0.0f64); wide * high];
        let mut whole = (0.0f64, 0.0f64);
        let kept = if f == 1 { self.kept() } else { Vec::new() };
        for (column, row) in (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))) {
            if f == 1 && !kept[row * self.width + column] {
                continue;
            }
            let Some(error) = self.averaged(f, column, row) else { continue };
            whole = (whole.0 + error, whole.1 + 1.0);
            let (x, y) = (column / side, row / side);
            if x < wide && y < high {
                let sum = &mut sums[y * wide + x];
                *sum = (sum.0 + error, sum.1 + 1.0);
            }
        }
        Level {
            mean: if whole.1 > 0.0 { whole.0 / whole.1 } else { 0.0 },
            of_blocks: sums.iter().map(|s| (s.1 > 0.0).then(|| s.0 / s.1)).collect(),
        }
    }

    /// For each pixel whether it is finite and not among the worst.
    fn kept(&self) -> Vec<bool> {
        let finite: Vec<(usize, Rgb)> =
            (0..self.image.len()).filter(|&i| self.finite(i)).map(|i| (i, self.image[i])).collect();
        let mut kept = vec![false; self.image.len()];
        for ((i, _), keep) in finite.iter().zip(worst_left_out(&finite, self.truth)) {
            kept[*i] = keep;
        }
        kept
    }

    /// The error of one average; none where no pixel of it is finite.
    fn averaged(&self, f: usize, column: usize, row: usize) -> Option<f64> {
        let [a, b] = self.truth.pair();
        let (mut n, mut d, mut e, mut c) = (0.0, DVec3::ZERO, DVec3::ZERO, [DVec3::ZERO; 2]);
        for i in self.pixels(f, column, row).filter(|&i| self.finite(i)) {
            let x = self.image[i].as_dvec3();
            n += 1.0;
            d += x - a[i].as_dvec3();
            e += x - b[i].as_dvec3();
            for (c, half) in c.iter_mut().zip(&self.truth.cleaned_halves) {
                *c += half[i].as_dvec3();
            }
        }
        let square = d * e / (n * n);
        let [first, second] = c.map(|c| self.truth.relative_to(square, c / n));
        (n > 0.0).then_some(0.5 * (first + second))
    }

    /// The figure of plain regions with its standard error.
    fn plain(&self) -> Option<(f64, Option<f64>)> {
        let [small, large] = CLOUDS;
        if self.widest < large {
            return None;
        }
        let halves = self.truth.pair();
        let clouds = [0, 1].map(|k| {
            let (half, clean) = (halves[k], &self.truth.cleaned_halves[k]);
            let relative = |i: usize| {
                if !self.finite(i) {
                    return DVec3::ZERO;
                }
                let floor = self.truth.denominator(clean[i].as_dvec3());
                let d = self.image[i].as_dvec3() - half[i].as_dvec3();
                DVec3::from_array(
                    [0, 1, 2].map(|k| if d[k] == 0.0 { 0.0 } else { d[k] / floor[k].sqrt() }),
                )
            };
            let values: Vec<DVec3> = (0..self.image.len()).map(relative).collect();
            let [fine, coarse] = [small, large].map(|f| self.averages(&values, f));
            move |x: usize, y: usize| fine(x, y) - coarse(x, y)
        });
        let plain = self.plain_pixels();
        let (wide, high) = (self.width / large, self.height / large);
        let mut sums = vec![(0.0f64, 0.0f64); wide * high];
        for (x, y) in (0..high * large).flat_map(|y| (0..wide * large).map(move |x| (x, y))) {
            if plain[y * self.width + x] {
                let product = clouds[0](x, y) * clouds[1](x, y);
                let sum = &mut sums[y / large * wide + x / large];
                *sum = (sum.0 + product.element_sum() / 3.0, sum.1 + 1.0);
            }
        }
        let square = ratio(&sums);
        let root = square.value.abs().sqrt();
        let error = (sums.iter().filter(|s| s.1 > 0.0).count() > 1 && root > 0.0)
            .then(|| square.standard_error / (2.0 * root));
        Some((root.copysign(square.value), error))
    }

    /// Averages over f × f pixels, by pixel.
    fn averages(&self, values: &[DVec3], f: usize) -> impl Fn(usize, usize) -> DVec3 + use<> {
        let (columns, rows) = (self.width / f, self.height / f);
        let means: Vec<DVec3> = (0..columns * rows)
            .map(|i| {
                let sum: DVec3 = self.pixels(f, i % columns, i / columns).map(|p| values[p]).sum();
                sum / (f * f) as f64
            })
            .collect();
        move |x, y| means[y / f * columns + x / f]
    }

    /// The pixels of at most median local contrast.
    fn plain_pixels(&self) -> Vec<bool> {
        let contrast = self.contrast();
        let mut sorted = contrast.clone();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        let median = 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]);
        contrast.iter().map(|&c| c <= median).collect()
    }

    /// Standard deviation of the logarithm of the cleaned reference around every pixel, borders
    /// repeated outwards.
    fn contrast(&self) -> Vec<f64> {
        let (w, h, r) = (self.width, self.height, CONTRAST_REACH);
        let floor = (0.02 * self.truth.level).max(f64::MIN_POSITIVE);
        let log = |x: usize, y: usize| {
            let inside = |v: usize, n: usize| v.saturating_sub(r).min(n - 1);
            let c = self.truth.clean[inside(y, h) * w + inside(x, w)];
            let mean = f64::from(c.element_sum()) / 3.0;
            if mean.is_finite() { (mean + floor).ln() } else { floor.ln() }
        };
        // Sums of everything left of and above a place, of the logarithm and of its square.
        let stride = w + 2 * r + 1;
        let mut sums = vec![[0.0f64; 2]; stride * (h + 2 * r + 1)];
        for y in 0..h + 2 * r {
            let mut row = [0.0; 2];
            for x in 0..w + 2 * r {
                let v = log(x, y);
                row = [row[0] + v, row[1] + v * v];
                let above = sums[y * stride + x + 1];
                sums[(y + 1) * stride + x + 1] = [above[0] + row[0], above[1] + row[1]];
            }
        }
        let span = 2 * r + 1;
        (0..w * h)
            .map(|i| {
                let (x, y) = (i % w, i / w);
                let [mean, square] = [0, 1].map(|k| {
                    let at = |x: usize, y: usize| sums[y * stride + x][k];
                    let inside = at(x + span, y + span) - at(x, y + span) - at(x + span, y);
                    (inside + at(x, y)) / (span * span) as f64
                });
                (square - mean * mean).max(0.0).sqrt()
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::errors;
    use crate::sampling::{Rng, Stream};

    const W: u32 = 96;
    const H: u32 = 72;

    /// Octaves of a grey wall of 1 plus `error`.
    fn of(error: impl Fn(u32, u32) -> f32) -> Octaves {
        let image: Vec<Rgb> = (0..W * H).map(|i| Rgb::splat(1.0 + error(i % W, i / W))).collect();
        octaves(&image, &Truth::exact(W, H, &[Rgb::ONE; (W * H) as usize]))
    }

    fn only(found: &Octaves, from: usize, expected: f64) {
        for b in &found.bands {
            let want = if b.from == from { expected } else { 0.0 };
            assert!((b.relmse - want).abs() < 1e-7, "{from}: {found:?}");
        }
    }

    #[test]
    fn each_size_has_its_octave() {
        let full = 0.01 / 1.01;
        let signed = |s: u32| {
            move |x: u32, y: u32| if (x / s + y / s).is_multiple_of(2) { 0.1 } else { -0.1 }
        };
        only(&of(signed(1)), 1, full);
        only(&of(signed(4)), 4, full);
        only(&of(signed(16)), 16, full);
        only(&of(|_, _| 0.1), 32, full);
        // Squares of 8 pixels are clouds, a checkerboard of pixels and a shift are not.
        let plain = |o: Octaves| o.plain.unwrap();
        assert!((plain(of(signed(8))) - 0.1 / 1.01f64.sqrt()).abs() < 1e-6);
        assert!(plain(of(signed(1))).abs() < 1e-6 && plain(of(|_, _| 0.1)).abs() < 1e-6);
    }

    #[test]
    fn they_sum_to_the_whole() {
        let exact: Vec<Rgb> =
            (0..W * H).map(|i| Rgb::new(0.2, 0.5, 0.9) * (1.0 + (i % W) as f32)).collect();
        let mut rng = Rng::new(3, Stream::Test, 0, 0);
        let mut image: Vec<Rgb> = exact.iter().map(|&c| c * (0.8 + 0.5 * rng.next_f32())).collect();
        image[77] = Rgb::splat(1e4);
        let truth = Truth::exact(W, H, &exact);
        let found = octaves(&image, &truth);
        let sum: f64 = found.bands.iter().map(|b| b.relmse).sum();
        let whole = errors(&image, &truth).relmse_trimmed;
        assert!((sum - whole).abs() < 1e-12 * whole.abs(), "{sum} and {whole}");
        image[78].x = f32::NAN;
        assert!(octaves(&image, &truth).bands.iter().all(|b| b.relmse.is_finite()));
    }

    #[test]
    fn clouds_on_a_busy_wall_are_not_seen() {
        let busy = |x: u32| x >= W / 2;
        let exact: Vec<Rgb> = (0..W * H)
            .map(|i| Rgb::splat(if busy(i % W) && i.is_multiple_of(2) { 4.0 } else { 1.0 }))
            .collect();
        let cloud = |left: bool| {
            let image: Vec<Rgb> = (0..W * H)
                .map(|i| {
                    let sign = if (i % W / 8 + i / W / 8).is_multiple_of(2) { 1.1 } else { 0.9 };
                    exact[i as usize] * if busy(i % W) == left { 1.0 } else { sign }
                })
                .collect();
            octaves(&image, &Truth::exact(W, H, &exact)).plain.unwrap()
        };
        assert!(cloud(true) > 0.08 && cloud(false) < 0.03, "{} {}", cloud(true), cloud(false));
    }

    #[test]
    fn small_pictures_have_fewer() {
        let exact = [Rgb::ONE; 15];
        let found = octaves(&[Rgb::splat(2.0); 15], &Truth::exact(5, 3, &exact));
        let sizes: Vec<_> = found.bands.iter().map(|b| (b.from, b.to)).collect();
        assert_eq!(sizes, [(1, Some(2)), (2, None)]);
        assert!(found.plain.is_none() && (found.bands[1].relmse - 1.0 / 1.01).abs() < 1e-7);
    }
}
