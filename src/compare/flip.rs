//! LDR-FLIP: how different two sRGB pictures look when one flips between them.
//!
//! Source     Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: "FLIP: a difference
//!            evaluator for alternating images", HPG 2020; written from the paper's equations. 67
//!            pixels per degree.
//! Input      linear pixels, clamped to \[0, 1\] by the display. Output  one value in \[0, 1\] per
//!            pixel; 0 for equal pictures.
//! Cost       O(pixels · 21) per filter.

use std::f32::consts::PI;

use glam::{Mat3, Vec3};

use crate::radiometry::Rgb;

const PIXELS_PER_DEGREE: f32 = 67.0;
/// CIE white of the matrix below.
const WHITE: Vec3 = Vec3::new(0.950_428_5, 1.0, 1.088_900_4);

fn xyz_from_rgb() -> Mat3 {
    Mat3::from_cols(
        Vec3::new(0.412_386_56, 0.212_636_8, 0.019_330_62),
        Vec3::new(0.357_591_5, 0.715_183, 0.119_197_16),
        Vec3::new(0.180_450_5, 0.072_180_2, 0.950_372_6),
    )
}

/// Opponent space that is linear in light.
fn ycxcz_from_rgb(c: Rgb) -> Vec3 {
    let v = xyz_from_rgb() * c / WHITE;
    Vec3::new(116.0 * v.y - 16.0, 500.0 * (v.x - v.y), 200.0 * (v.y - v.z))
}

fn rgb_from_ycxcz(c: Vec3) -> Rgb {
    let y = (c.x + 16.0) / 116.0;
    xyz_from_rgb().inverse() * (Vec3::new(y + c.y / 500.0, y, y - c.z / 200.0) * WHITE)
}

/// CIELAB with Hunt's effect: colourfulness falls with lightness.
fn hunt_lab(c: Rgb) -> Vec3 {
    let f = |t: f32| {
        if t > (6.0f32 / 29.0).powi(3) {
            t.cbrt()
        } else {
            t / (3.0 * (6.0f32 / 29.0).powi(2)) + 4.0 / 29.0
        }
    };
    let v = xyz_from_rgb() * c / WHITE;
    let (x, y, z) = (f(v.x), f(v.y), f(v.z));
    let l = 116.0 * y - 16.0;
    Vec3::new(l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z))
}

fn hyab(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x.abs() + d.y.hypot(d.z)
}

/// Separable convolution with clamped borders; kernels of odd length.
fn convolve(
    image: &[f32],
    width: usize,
    height: usize,
    along_x: &[f32],
    along_y: &[f32],
) -> Vec<f32> {
    let pass = |from: &[f32],
                kernel: &[f32],
                step: &dyn Fn(usize, usize, isize) -> usize|
     -> Vec<f32> {
        let r = (kernel.len() / 2) as isize;
        (0..width * height)
            .map(|i| {
                (-r..=r).zip(kernel).map(|(d, &k)| k * from[step(i % width, i / width, d)]).sum()
            })
            .collect()
    };
    let rows =
        pass(image, along_x, &|x, y, d| y * width + x.saturating_add_signed(d).min(width - 1));
    pass(&rows, along_y, &|x, y, d| y.saturating_add_signed(d).min(height - 1) * width + x)
}

fn taps(radius: i32, f: impl Fn(f32) -> f32) -> Vec<f32> {
    (-radius..=radius).map(|i| f(i as f32)).collect()
}

/// Contrast sensitivity filters of the three opponent channels, then back to colours a display can
/// show.
fn as_seen(image: &[Rgb], width: usize, height: usize) -> Vec<Vec3> {
    // (weight, width) of the Gaussians of each channel; the widest one sets the radius.
    let filters: [&[(f32, f32)]; 3] =
        [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let opponent: Vec<Vec3> = image.iter().map(|&c| ycxcz_from_rgb(c)).collect();
    let mut filtered = vec![Vec3::ZERO; image.len()];
    for (channel, gaussians) in filters.into_iter().enumerate() {
        let plane: Vec<f32> = opponent.iter().map(|c| c[channel]).collect();
        let kernels: Vec<(f32, Vec<f32>)> = gaussians
            .iter()
            .map(|&(a, b)| {
                (
                    a * (PI / b).sqrt(),
                    taps(radius, |x| (-PI * PI * (x / PIXELS_PER_DEGREE).powi(2) / b).exp()),
                )
            })
            .collect();
        let total: f32 = kernels.iter().map(|(w, k)| w * k.iter().sum::<f32>().powi(2)).sum();
        for (w, k) in &kernels {
            for (out, v) in filtered.iter_mut().zip(convolve(&plane, width, height, k, k)) {
                out[channel] += v * w / total;
            }
        }
    }
    filtered.into_iter().map(|c| hunt_lab(rgb_from_ycxcz(c).clamp(Vec3::ZERO, Vec3::ONE))).collect()
}

/// Strength of edges and points at every pixel.
fn features(image: &[Rgb], width: usize, height: usize) -> Vec<(f32, f32)> {
    let sd = 0.5 * 0.082 * PIXELS_PER_DEGREE;
    let radius = (3.0 * sd).ceil() as i32;
    let smooth = taps(radius, |x| (-x * x / (2.0 * sd * sd)).exp());
    // Positive weights of the two-dimensional filter sum to 1, negative ones to −1.
    let balanced = |k: Vec<f32>| -> Vec<f32> {
        let across: f32 = smooth.iter().sum();
        let (p, n) = (
            k.iter().filter(|v| **v > 0.0).sum::<f32>() * across,
            -k.iter().filter(|v| **v < 0.0).sum::<f32>() * across,
        );
        k.into_iter().map(|v| if v > 0.0 { v / p } else { v / n }).collect()
    };
    let edge = balanced(taps(radius, |x| -x * (-x * x / (2.0 * sd * sd)).exp()));
    let point =
        balanced(taps(radius, |x| (x * x / (sd * sd) - 1.0) * (-x * x / (2.0 * sd * sd)).exp()));
    let y: Vec<f32> = image.iter().map(|&c| (ycxcz_from_rgb(c).x + 16.0) / 116.0).collect();
    let size = |kernel: &[f32]| -> Vec<f32> {
        let (a, b) = (
            convolve(&y, width, height, kernel, &smooth),
            convolve(&y, width, height, &smooth, kernel),
        );
        a.into_iter().zip(b).map(|(a, b)| a.hypot(b)).collect()
    };
    size(&edge).into_iter().zip(size(&point)).collect()
}

/// Per-pixel FLIP of two linear pictures of `width` · `height` pixels; empty for images of another
/// length.
pub fn flip(image: &[Rgb], reference: &[Rgb], width: usize, height: usize) -> Vec<f32> {
    if width * height == 0 || image.len() != width * height || reference.len() != image.len() {
        return Vec::new();
    }
    let shown = |c: &Rgb| c.clamp(Vec3::ZERO, Vec3::ONE);
    let (a, b): (Vec<Rgb>, Vec<Rgb>) =
        (image.iter().map(shown).collect(), reference.iter().map(shown).collect());
    let most = hyab(hunt_lab(Vec3::Y), hunt_lab(Vec3::Z)).powf(0.7);
    let (cut, top) = (0.4 * most, 0.95);
    let color =
        as_seen(&a, width, height).into_iter().zip(as_seen(&b, width, height)).map(|(a, b)| {
            let e = hyab(a, b).powf(0.7);
            if e < cut { e * top / cut } else { top + (e - cut) / (most - cut) * (1.0 - top) }
        });
    let feature = features(&a, width, height).into_iter().zip(features(&b, width, height));
    color
        .zip(feature)
        .map(|(c, (f, g))| {
            c.powf(1.0 - ((f.0 - g.0).abs().max((f.1 - g.1).abs()) / 2.0f32.sqrt()).sqrt())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spaces_round_trip() {
        let c = Vec3::new(0.2, 0.7, 0.4);
        assert!((rgb_from_ycxcz(ycxcz_from_rgb(c)) - c).length() < 1e-5);
        assert!((hunt_lab(Vec3::ONE) - Vec3::new(100.0, 0.0, 0.0)).length() < 0.01);
    }

    #[test]
    fn equal_is_zero_and_flat_pictures_follow_the_formula() {
        let (w, h) = (24, 24);
        let black = vec![Rgb::ZERO; w * h];
        let white = vec![Rgb::ONE; w * h];
        assert!(flip(&white, &white, w, h).iter().all(|&v| v == 0.0));
        let most = hyab(hunt_lab(Vec3::Y), hunt_lab(Vec3::Z)).powf(0.7);
        let e = 100.0f32.powf(0.7);
        let expected = 0.95 + (e - 0.4 * most) / (0.6 * most) * 0.05;
        assert!(
            flip(&white, &black, w, h).iter().all(|v| (v - expected).abs() < 1e-3),
            "flat pictures have no features"
        );
        assert!(flip(&white, &black[1..], w, h).is_empty());
    }

    #[test]
    fn more_different_is_more() {
        let (w, h) = (32, 32);
        let picture = |s: f32| -> Vec<Rgb> {
            (0..w * h)
                .map(|i| Rgb::splat(0.4 + s * f32::from((i % w / 4 + i / w / 4) as u8 % 2)))
                .collect()
        };
        let mean =
            |s: f32| flip(&picture(s), &picture(0.0), w, h).iter().sum::<f32>() / (w * h) as f32;
        assert!(mean(0.01) < mean(0.05) && mean(0.05) < mean(0.3) && mean(0.3) < 1.0);
    }
}
