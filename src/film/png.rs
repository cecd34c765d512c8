//! The beauty as an 8-bit PNG: linear · 2^exposure, clamped, sRGB curve. No tone mapping. NaN
//! becomes magenta, so that it is seen.

use std::path::Path;

use super::Film;
use crate::atomic_file;
use crate::error::{Error, Result};
use crate::radiometry::{Rgb, srgb_from_linear};

/// An sRGB-encoded pixel of the linear colour `c` at `exposure` stops.
pub fn srgb8(c: Rgb, exposure: f32) -> [u8; 3] {
    if c.is_nan() {
        return [255, 0, 255];
    }
    (c * exposure.exp2()).to_array().map(|v| (srgb_from_linear(v) * 255.0).round() as u8)
}

/// Writes the beauty at `exposure` stops.
///
/// # Errors
/// [`Error::Image`] without a beauty layer or when the file cannot be written.
pub fn write_png(film: &Film, path: &Path, exposure: f32) -> Result<()> {
    let fail = |message: String| Error::Image { path: path.into(), message };
    let pixels = film.rgb("").ok_or_else(|| fail("the image has no R, G, B channels".into()))?;
    write_png_rgb(&pixels, film.width, film.height, path, exposure)
}

/// Writes linear pixels, row by row from the top, at `exposure` stops.
///
/// # Errors
/// [`Error::Image`] when the count does not match or the file cannot be written.
pub fn write_png_rgb(
    pixels: &[Rgb],
    width: u32,
    height: u32,
    path: &Path,
    exposure: f32,
) -> Result<()> {
    let fail = |message: String| Error::Image { path: path.into(), message };
    let bytes: Vec<u8> = pixels.iter().flat_map(|&c| srgb8(c, exposure)).collect();
    if bytes.len() != 3 * width as usize * height as usize {
        return Err(fail(format!("{} pixels for {width}×{height}", pixels.len())));
    }
    write_png_bytes(path, &bytes, (width, height), image::ExtendedColorType::Rgb8)
}

/// Writes bytes as they are, row by row from the top, as a PNG of `size`: width and height.
///
/// # Errors
/// [`Error::Write`] when the count does not match or the file cannot be written.
pub(crate) fn write_png_bytes(
    path: &Path,
    bytes: &[u8],
    size: (u32, u32),
    kind: image::ExtendedColorType,
) -> Result<()> {
    atomic_file::write(path, |out| {
        let png = image::ImageFormat::Png;
        image::write_buffer_with_format(out, bytes, size.0, size.1, kind, png).map_err(
            |e| match e {
                image::ImageError::IoError(e) => e,
                e => std::io::Error::other(e.to_string()),
            },
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curve_exposure_and_rows() {
        let mut film = Film::new(2, 1);
        film.set_rgb("", &[Rgb::new(0.25, 2.0, -1.0), Rgb::new(f32::NAN, 0.0, 0.0)]);
        let path = std::env::temp_dir().join(format!("nearfar-png-{}.png", std::process::id()));
        write_png(&film, &path, 1.0).unwrap();
        let back = image::open(&path).unwrap().to_rgb8();
        assert_eq!(back.get_pixel(0, 0).0, [188, 255, 0]);
        assert_eq!(back.get_pixel(1, 0).0, [255, 0, 255]);
        std::fs::remove_file(&path).unwrap();
        assert!(write_png(&Film::new(2, 1), &path, 0.0).is_err());
    }
}
