//! The edge-aware à-trous pyramid that splits an image into scales.
//!
//! ```text
//! D_0 = D,   D_{j+1}(i) = Σ_k h_k g(i, i + 2^j k) D_j(i + 2^j k) / Σ_k h_k g(i, i + 2^j k)
//!            h_k: B3 spline, 5 × 5
//! D   = Σ_{j<J} (D_j − D_{j+1}) + D_J
//! g   = max(0, n·n')^16 · max(0, 1 − (16 h)² / |p − p'|²)
//!            h: larger distance from the other's plane
//! ```
//! The sum telescopes, so it gives D back whatever g is. Where nothing is seen, g joins background
//! to background alone.
//!
//! Cost  25 taps a pixel and level.

use glam::Vec3;
use rayon::prelude::*;

/// Levels of steepness below which a neighbour counts as of the same plane.
const PLANE_SLOPE: f32 = 16.0;
const SPLINE: [f32; 5] = [1.0 / 16.0, 0.25, 0.375, 0.25, 1.0 / 16.0];

/// What the kernel is guided by, pixel by pixel.
#[derive(Clone, Debug)]
pub struct Guide {
    /// Columns.
    pub width: usize,
    /// Unit normal; zero where nothing is seen.
    pub normal: Vec<Vec3>,
    /// World position.
    pub position: Vec<Vec3>,
}

impl Guide {
    fn likeness(&self, i: usize, k: usize) -> f32 {
        let (n, m) = (self.normal[i], self.normal[k]);
        if i == k || (n == Vec3::ZERO && m == Vec3::ZERO) {
            return 1.0;
        }
        let away = self.position[k] - self.position[i];
        let height = away.dot(n).abs().max(away.dot(m).abs()) * PLANE_SLOPE;
        let plane = (1.0 - height * height / away.length_squared().max(f32::MIN_POSITIVE)).max(0.0);
        plane * n.dot(m).max(0.0).powi(16)
    }

    /// One smoothing with holes of `step` pixels.
    pub fn smooth<const N: usize>(&self, values: &[[f32; N]], step: usize) -> Vec<[f32; N]> {
        let (width, height) = (self.width as isize, (values.len() / self.width) as isize);
        let at = |i: usize| {
            let (x, y) = (i as isize % width, i as isize / width);
            let (mut sum, mut total) = ([0.0f32; N], 0.0f32);
            for (dy, &hy) in (-2isize..).zip(&SPLINE) {
                for (dx, &hx) in (-2isize..).zip(&SPLINE) {
                    let (u, v) = (x + dx * step as isize, y + dy * step as isize);
                    if u < 0 || v < 0 || u >= width || v >= height {
                        continue;
                    }
                    let k = (v * width + u) as usize;
                    let weight = hx * hy * self.likeness(i, k);
                    if weight > 0.0 {
                        total += weight;
                        sum.iter_mut().zip(&values[k]).for_each(|(s, v)| *s += weight * v);
                    }
                }
            }
            sum.map(|s| s / total)
        };
        (0..values.len()).into_par_iter().with_min_len(256).map(at).collect()
    }

    /// Visits the `levels` bands from fine to coarse, then what remains, with their number.
    pub fn bands<const N: usize>(
        &self,
        mut values: Vec<[f32; N]>,
        levels: u32,
        mut visit: impl FnMut(u32, &[[f32; N]]),
    ) {
        for level in 0..levels {
            let coarse = self.smooth(&values, 1 << level);
            for (fine, coarse) in values.iter_mut().zip(&coarse) {
                fine.iter_mut().zip(coarse).for_each(|(f, c)| *f -= c);
            }
            visit(level, &values);
            values = coarse;
        }
        visit(levels, &values);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two planes that meet in an edge at column 8, and two rows of background.
    fn guide() -> Guide {
        let at = |i: usize| (i % 16, i / 16);
        let normal = |i| match at(i) {
            (_, y) if y > 13 => Vec3::ZERO,
            (x, _) if x < 8 => Vec3::Z,
            _ => Vec3::X,
        };
        let position = |i| match at(i) {
            (x, y) if x < 8 => Vec3::new(x as f32, y as f32, 0.0),
            (x, y) => Vec3::new(8.0, y as f32, x as f32 - 8.0),
        };
        Guide {
            width: 16,
            normal: (0..256).map(normal).collect(),
            position: (0..256).map(position).collect(),
        }
    }

    #[test]
    fn the_bands_sum_to_the_image() {
        let values: Vec<[f32; 2]> =
            (0..256).map(|i| [(i as f32 * 0.7).sin() * 5.0, (i % 13) as f32]).collect();
        let (mut sum, mut seen) = (vec![[0.0f32; 2]; 256], 0);
        guide().bands(values.clone(), 5, |_, band| {
            seen += 1;
            sum.iter_mut().zip(band).for_each(|(s, b)| (0..2).for_each(|c| s[c] += b[c]));
        });
        assert_eq!(seen, 6);
        for (s, v) in sum.iter().zip(&values) {
            assert!((s[0] - v[0]).abs() < 1e-5 && (s[1] - v[1]).abs() < 1e-5, "{s:?} {v:?}");
        }
    }

    #[test]
    fn nothing_crosses_an_edge_and_constants_stay() {
        let guide = guide();
        let sides: Vec<[f32; 1]> = guide.normal.iter().map(|n| [n.x * 3.0 + n.z * 7.0]).collect();
        guide.bands(sides.clone(), 4, |level, band| {
            for (b, s) in band.iter().zip(&sides) {
                assert!((b[0] - if level == 4 { s[0] } else { 0.0 }).abs() < 1e-5);
            }
        });
    }
}
