//! From a model and two independent halves to the picture and its certificate; the equations are on
//! the module's page.

use glam::Vec3;

use super::pyramid::Guide;
use super::{ConvergeSettings, Weight};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::radiometry::Rgb;

/// Albedo below which light is not demodulated.
const DARK: f32 = 0.02;

/// Standard errors by which a band's signal must exceed zero.
const SIGNIFICANT: f64 = 3.0;
/// Estimated relMSE, each mean over pixels and channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Certificate {
    /// The picture.
    #[serde(rename = "converge_relmse")]
    pub relmse: f64,
    /// Its share that more samples of equal weights would not take away.
    #[serde(rename = "converge_bias")]
    pub bias: f64,
    /// Its share of noise.
    #[serde(rename = "converge_noise")]
    pub noise: f64,
    /// The model alone.
    #[serde(rename = "converge_model")]
    pub model: f64,
    /// The samples alone.
    #[serde(rename = "converge_path")]
    pub path: f64,
}

fn layer(film: &Film, name: &str) -> Result<Vec<Rgb>> {
    film.rgb(name).ok_or_else(|| Error::Render(format!("converge: the film has no layer {name:?}")))
}

fn vectors(film: &Film, name: &str) -> Result<Vec<Vec3>> {
    let channel = |axis: &str| {
        film.channels
            .get(&format!("{name}.{axis}"))
            .ok_or_else(|| Error::Render(format!("converge: the model has no layer {name}")))
    };
    let (x, y, z) = (channel("X")?, channel("Y")?, channel("Z")?);
    Ok(x.iter().zip(y).zip(z).map(|((&x, &y), &z)| Vec3::new(x, y, z)).collect())
}

fn mean_samples(film: &Film) -> f64 {
    film.channels
        .get("samples")
        .map_or(1.0, |s| s.iter().map(|&n| f64::from(n)).sum::<f64>() / s.len().max(1) as f64)
}

/// b² / (b² + σ²), one where neither is known.
pub(super) fn wiener(signal: f32, noise: f32) -> f32 {
    let signal = signal.max(0.0);
    if signal + noise > 0.0 { signal / (signal + noise) } else { 1.0 }
}

/// The picture and its certificate.
///
/// # Errors
/// [`Error::Render`] when the model lacks one of beauty, albedo, N, P, or a half its own halves.
pub fn combine(
    model: &Film,
    halves: [&Film; 2],
    settings: &ConvergeSettings,
) -> Result<(Vec<Rgb>, Certificate)> {
    let base = layer(model, "")?;
    let albedo = layer(model, "albedo")?;
    let guide = Guide {
        width: model.width as usize,
        normal: vectors(model, "N")?,
        position: vectors(model, "P")?,
    };
    let scale: Vec<Rgb> = albedo
        .iter()
        .map(|a| Rgb::from_array(a.to_array().map(|a| if a > DARK { a } else { 1.0 })))
        .collect();
    let quarters = [
        layer(halves[0], "half0")?,
        layer(halves[0], "half1")?,
        layer(halves[1], "half0")?,
        layer(halves[1], "half1")?,
    ];
    let residual = |i: usize| {
        let mut out = [0.0f32; 12];
        for (q, quarter) in quarters.iter().enumerate() {
            out[3 * q..3 * q + 3].copy_from_slice(&((quarter[i] - base[i]) / scale[i]).to_array());
        }
        out
    };
    let counts = halves.map(mean_samples);
    let share = [0, 1].map(|h| (counts[h] / (counts[0] + counts[1])) as f32);

    let level = base.iter().map(|p| p.element_sum()).sum::<f32>() / (3.0 * base.len() as f32);
    // Relative error of the picture, in units of the demodulated residual.
    let relative = |(p, s): (&Rgb, &Rgb)| {
        s.length_squared() / (p.length_squared() + 0.03 * level * level).max(f32::MIN_POSITIVE)
    };
    let norm: Vec<f32> = base.iter().zip(&scale).map(relative).collect();
    let mut kept = vec![[0.0f32; 12]; base.len()];
    guide.bands((0..base.len()).map(residual).collect(), settings.levels, |level, band| {
        let weights = match settings.weight {
            Weight::One => [1.0f32; 2],
            Weight::Shrink => weights(band, &norm, level, share),
        };
        for (kept, band) in kept.iter_mut().zip(band) {
            for c in 0..12 {
                // Half 0 with the weight that half 1 chose, and the other way round.
                kept[c] += band[c] * weights[1 - c / 6];
            }
        }
    });
    let picture: Vec<Rgb> = (0..base.len())
        .map(|i| {
            let mean = |h: usize| {
                (Rgb::from_slice(&kept[i][6 * h..]) + Rgb::from_slice(&kept[i][6 * h + 3..])) * 0.5
            };
            base[i] + scale[i] * (mean(0) * share[0] + mean(1) * share[1])
        })
        .collect();
    let certificate = certificate(&picture, &base, &quarters, &kept, &scale, share.map(f64::from));
    Ok((picture, certificate))
}

/// The weight that each half finds for a band, from its own two quarters: one for the whole
/// picture, by relative error.
///
/// Local weights would follow the model's faults more closely, but need local noise, which few
/// samples do not tell: two quarters that both missed the light agree. Over the picture, S = Σ b₀b₁
/// counts only beyond what noise alone would bring.
fn weights(band: &[[f32; 12]], norm: &[f32], level: u32, share: [f32; 2]) -> [f32; 2] {
    // Pixels that the bands below have already joined are no independent values.
    let joined = 4.0f64.powi(level as i32 + 1).min(band.len() as f64);
    [0, 1].map(|h| {
        let (mut signal, mut noise, mut spread) = (0.0f64, 0.0f64, 0.0f64);
        for (b, &norm) in band.iter().zip(norm) {
            let (mut product, mut difference) = (0.0f32, 0.0f32);
            for c in 6 * h..6 * h + 3 {
                product += b[c] * b[c + 3];
                difference += (b[c] - b[c + 3]).powi(2) * 0.25;
            }
            signal += f64::from(product * norm);
            noise += f64::from(difference * norm);
            spread += f64::from(difference * norm).powi(2);
        }
        let doubt = SIGNIFICANT * (joined * spread).sqrt();
        wiener((signal - doubt) as f32, noise as f32 * share[h])
    })
}

fn certificate(
    picture: &[Rgb],
    base: &[Rgb],
    quarters: &[Vec<Rgb>; 4],
    kept: &[[f32; 12]],
    scale: &[Rgb],
    share: [f64; 2],
) -> Certificate {
    let values = 3.0 * picture.len() as f64;
    let level = picture.iter().map(|p| f64::from(p.element_sum())).sum::<f64>() / values;
    let mut sums = [0.0f64; 4];
    for i in 0..picture.len() {
        for c in 0..3 {
            let of = |v: &[Rgb]| f64::from(v[i][c]);
            let [a0, a1, b0, b1] = [0, 1, 2, 3].map(|q| of(&quarters[q]));
            let (o, m, a, b) = (of(picture), of(base), 0.5 * (a0 + a1), 0.5 * (b0 + b1));
            let filtered = |h: usize| {
                0.5 * f64::from(scale[i][c])
                    * (f64::from(kept[i][6 * h + c]) - f64::from(kept[i][6 * h + 3 + c]))
                    * share[h]
            };
            let (fa, fb) = (filtered(0), filtered(1));
            let norm = o * o + 0.01 * level * level;
            if norm > 0.0 {
                sums[0] += ((o - a) * (o - b) + fa * 0.5 * (a0 - a1) + fb * 0.5 * (b0 - b1)) / norm;
                sums[1] += (fa * fa + fb * fb) / norm;
                sums[2] += (m - a) * (m - b) / norm;
                sums[3] += (a - b).powi(2) * share[0] * share[1] / norm;
            }
        }
    }
    let [relmse, noise, model, path] = sums.map(|s| (s / values).max(0.0));
    Certificate { relmse, bias: (relmse - noise).max(0.0), noise, model, path }
}
