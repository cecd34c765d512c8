//! `nearfar show`: layers of images as one PNG, side by side.
//!
//! Colour layers are shown as they are, vectors from −1..1 mapped to 0..1, ids in hashed colours
//! and other scalars grey from their least to their greatest value.

use std::path::{Path, PathBuf};

use clap::Args;

use super::{check_png, parse_finite};
use crate::error::{Error, Result};
use crate::film::{Film, read_exr, write_png_rgb};
use crate::radiometry::Rgb;
use crate::sampling::hash64;

/// Options of `nearfar show`.
#[derive(Debug, Args)]
pub(super) struct ShowArgs {
    /// Images: OpenEXR, of equal height.
    #[arg(required = true, value_name = "FILE")]
    images: Vec<PathBuf>,
    /// Picture to write.
    #[arg(short, long, value_name = "OUT.png")]
    output: Option<PathBuf>,
    /// Layer to show: a colour layer (`far`), a vector (`N`), or one channel (`cluster.id`,
    /// `depth.Z`) in false colours; default the beauty.
    #[arg(long, default_value = "", value_name = "LAYER")]
    layer: String,
    /// Brighten by this many stops (colour layers).
    #[arg(
        long,
        default_value_t = 0.0,
        allow_hyphen_values = true,
        value_name = "STOPS",
        value_parser = parse_finite
    )]
    exposure: f32,
    /// Mark the places where this layer is not zero, such as `location`: the sample locations.
    #[arg(long, value_name = "LAYER")]
    dots: Option<String>,
}

/// # Errors
/// Unreadable images, unknown layers, unequal heights.
pub(super) fn show(args: &ShowArgs) -> Result<()> {
    if let Some(path) = args.images.iter().find(|path| has_extension(path, "ply")) {
        return Err(Error::Usage(format!(
            "{}: points (PLY) are shown by nearfar cloud show",
            path.display()
        )));
    }
    let Some(output) = &args.output else {
        return Err(Error::Usage("images become one picture: name it with -o OUT.png".into()));
    };
    if has_extension(output, "html") {
        return Err(Error::Usage(format!(
            "{}: only points (PLY) become a page; name a picture, such as -o OUT.png",
            output.display()
        )));
    }
    check_png(output)?;
    let (mut width, mut height, mut rows) = (0, 0, Vec::new());
    for path in &args.images {
        let film = read_exr(path)?;
        let unknown = |layer: &str| {
            let known: Vec<&str> = film.channels.keys().map(String::as_str).collect();
            Error::Usage(format!(
                "{}: no layer \"{layer}\"; channels are {}",
                path.display(),
                known.join(", ")
            ))
        };
        if height != 0 && film.height != height {
            return Err(Error::Usage(format!(
                "{} is {} pixels high, the images before it {height}",
                path.display(),
                film.height
            )));
        }
        let mut pixels = pixels(&film, &args.layer).ok_or_else(|| unknown(&args.layer))?;
        if let Some(dots) = &args.dots {
            let marks = film.channels.get(dots).ok_or_else(|| unknown(dots))?;
            mark(&mut pixels, marks, args.exposure);
        }
        height = film.height;
        rows.resize(height as usize, Vec::new());
        for (row, part) in rows.iter_mut().zip(pixels.chunks(film.width as usize)) {
            row.extend_from_slice(part);
        }
        width += film.width;
    }
    write_png_rgb(&rows.concat(), width, height, output, args.exposure)
}

pub(super) fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// Puts a dot where a mark is not zero, of one colour at every exposure.
pub(super) fn mark(pixels: &mut [Rgb], marks: &[f32], exposure: f32) {
    for (pixel, _) in pixels.iter_mut().zip(marks).filter(|(_, m)| **m != 0.0) {
        *pixel = Rgb::new(1.0, 0.02, 0.02) * (-exposure).exp2();
    }
}

/// A colour layer as it is, a vector from −1..1 to 0..1, a scalar in false colours: ids hashed,
/// anything else grey from its least to its greatest.
fn pixels(film: &Film, layer: &str) -> Option<Vec<Rgb>> {
    if let Some(colour) = film.rgb(layer) {
        return Some(colour);
    }
    let [x, y, z] = ["X", "Y", "Z"].map(|c| film.channels.get(&format!("{layer}.{c}")));
    if let (Some(x), Some(y), Some(z)) = (x, y, z) {
        return Some(
            x.iter()
                .zip(y)
                .zip(z)
                .map(|((&x, &y), &z)| Rgb::new(x, y, z) * 0.5 + Rgb::splat(0.5))
                .collect(),
        );
    }
    let values = film.channels.get(layer)?;
    if layer.ends_with("id") {
        let hue = |v: f32| {
            let h = hash64(u64::from(v as u32) + 1);
            Rgb::new((h & 255) as f32, (h >> 8 & 255) as f32, (h >> 16 & 255) as f32) / 255.0
        };
        return Some(values.iter().map(|&v| if v < 0.0 { Rgb::ZERO } else { hue(v) }).collect());
    }
    let (low, high) = values
        .iter()
        .filter(|v| v.is_finite())
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
    let span = (high - low).max(f32::MIN_POSITIVE);
    Some(
        values
            .iter()
            .map(|&v| Rgb::splat(if v.is_finite() { (v - low) / span } else { 1.0 }))
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_of_every_kind() {
        let mut film = Film::new(2, 1);
        film.set_rgb("", &[Rgb::ONE, Rgb::ZERO]);
        film.set_xyz("N", &[glam::Vec3::Z, -glam::Vec3::X]);
        film.set("depth.Z", vec![1.0, 3.0]);
        film.set("cluster.id", vec![-1.0, 7.0]);
        assert_eq!(pixels(&film, "").unwrap()[0], Rgb::ONE);
        assert_eq!(pixels(&film, "N").unwrap()[1], Rgb::new(0.0, 0.5, 0.5));
        assert_eq!(pixels(&film, "depth.Z").unwrap(), vec![Rgb::ZERO, Rgb::ONE]);
        assert_eq!(pixels(&film, "cluster.id").unwrap()[0], Rgb::ZERO);
        assert!(pixels(&film, "nothing").is_none());
    }
}
