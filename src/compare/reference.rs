//! A film against a reference with or without half images.

use std::path::{Path, PathBuf};

use super::flip;
use super::metrics::{Errors, Halves, errors};
use crate::error::{Error, Result};
use crate::film::{Film, read_exr};
use crate::radiometry::{Rgb, luminance};

/// A reference image.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Mean of all samples.
    pub mean: Vec<Rgb>,
    /// Two independent halves, where they are known.
    pub halves: Option<Halves>,
}

/// All figures of a comparison.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Comparison {
    /// relMSE and the like.
    #[serde(flatten)]
    pub errors: Errors,
    /// Mean LDR-FLIP at `exposure`.
    pub flip: f64,
    /// Stops that put the reference's log-average luminance at 0.18.
    pub exposure: f32,
    /// True when relMSE is free of the reference's noise.
    pub halves: bool,
}

/// Reads a reference: halves from its layers `half0`, `half1`, else from sibling files
/// `NAME.half0.exr`, `NAME.half1.exr`.
///
/// # Errors
/// [`Error::Image`] when a file is no image with R, G, B, or the halves have another size.
pub fn read_reference(path: &Path) -> Result<Reference> {
    let film = read_exr(path)?;
    let mean = beauty(&film, path)?;
    let mut halves = film.rgb("half0").zip(film.rgb("half1")).map(|(a, b)| Halves(a, b));
    if halves.is_none() {
        let siblings: [PathBuf; 2] = ["half0.exr", "half1.exr"].map(|e| path.with_extension(e));
        if siblings.iter().all(|p| p.is_file()) {
            let [a, b] = [read_exr(&siblings[0])?, read_exr(&siblings[1])?];
            for (half, at) in [&a, &b].into_iter().zip(&siblings) {
                same_size(half, film.width, film.height, at)?;
            }
            halves = Some(Halves(beauty(&a, &siblings[0])?, beauty(&b, &siblings[1])?));
        }
    }
    Ok(Reference { width: film.width, height: film.height, mean, halves })
}

fn beauty(film: &Film, path: &Path) -> Result<Vec<Rgb>> {
    film.rgb("").ok_or_else(|| Error::Image {
        path: path.into(),
        message: "has no channels R, G, B".into(),
    })
}

fn same_size(film: &Film, width: u32, height: u32, path: &Path) -> Result<()> {
    if (film.width, film.height) == (width, height) {
        return Ok(());
    }
    Err(Error::Image {
        path: path.into(),
        message: format!(
            "has {}×{} pixels, the reference {width}×{height}",
            film.width, film.height
        ),
    })
}

/// Stops of exposure that put the log-average luminance at 0.18; 0 for a black image.
pub fn exposure_of(pixels: &[Rgb]) -> f32 {
    let logs: Vec<f64> = pixels
        .iter()
        .map(|&c| luminance(c))
        .filter(|l| l.is_finite() && *l > 0.0)
        .map(|l| f64::from(l).ln())
        .collect();
    if logs.is_empty() {
        0.0
    } else {
        (0.18f64.ln() - logs.iter().sum::<f64>() / logs.len() as f64).exp().log2() as f32
    }
}

/// All figures of `image` (a film read from `path`) against `reference`.
///
/// # Errors
/// [`Error::Image`] when the film has no beauty or another size.
pub fn compare(image: &Film, path: &Path, reference: &Reference) -> Result<Comparison> {
    Ok(compare_with_flip(image, path, reference)?.0)
}

/// As [`compare`], with FLIP per pixel.
///
/// # Errors
/// As [`compare`].
pub fn compare_with_flip(
    image: &Film,
    path: &Path,
    reference: &Reference,
) -> Result<(Comparison, Vec<f32>)> {
    same_size(image, reference.width, reference.height, path)?;
    let pixels = beauty(image, path)?;
    let exposure = exposure_of(&reference.mean);
    let shown = |p: &[Rgb]| {
        p.iter()
            .map(|&c| if c.is_finite() { c * exposure.exp2() } else { Rgb::ZERO })
            .collect::<Vec<_>>()
    };
    let map = flip(
        &shown(&pixels),
        &shown(&reference.mean),
        reference.width as usize,
        reference.height as usize,
    );
    let found = Comparison {
        errors: errors(&pixels, &reference.mean, reference.halves.as_ref()),
        flip: map.iter().map(|&v| f64::from(v)).sum::<f64>() / map.len().max(1) as f64,
        exposure,
        halves: reference.halves.is_some(),
    };
    Ok((found, map))
}

/// |image − reference| · `amplify`, linear; NaN where either is.
pub fn difference(image: &[Rgb], reference: &[Rgb], amplify: f32) -> Vec<Rgb> {
    image.iter().zip(reference).map(|(a, b)| (*a - *b).abs() * amplify).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposure_puts_the_log_average_at_middle_grey() {
        assert!((exposure_of(&[Rgb::splat(0.09); 4]) - 1.0).abs() < 1e-5);
        assert!((exposure_of(&[Rgb::splat(0.045), Rgb::splat(0.18)]) - 1.0).abs() < 1e-5);
        assert_eq!(exposure_of(&[Rgb::ZERO]), 0.0);
    }

    #[test]
    fn halves_are_found_in_siblings_and_sizes_are_checked() {
        let folder = std::env::temp_dir().join(format!("nearfar-compare-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let write = |name: &str, width: u32, v: f32| {
            let mut film = Film::new(width, 2);
            film.set_rgb("", &vec![Rgb::splat(v); width as usize * 2]);
            crate::film::write_exr(&film, &folder.join(name), crate::film::Precision::Full)
                .unwrap();
            film
        };
        let film = write("a.exr", 2, 1.0);
        assert!(read_reference(&folder.join("a.exr")).unwrap().halves.is_none());
        write("a.half0.exr", 2, 0.5);
        write("a.half1.exr", 2, 1.5);
        let reference = read_reference(&folder.join("a.exr")).unwrap();
        let c = compare(&film, Path::new("a.exr"), &reference).unwrap();
        assert!(c.halves && (c.errors.relmse + 0.25 / 1.01).abs() < 1e-9 && c.flip == 0.0);
        let wide = write("w.exr", 3, 1.0);
        let error = compare(&wide, Path::new("w.exr"), &reference).unwrap_err().to_string();
        assert!(error.contains("has 3×2 pixels, the reference 2×2"), "{error}");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
