//! Reference images with or without half images, as they stand in files.

use std::path::{Path, PathBuf};

use super::errors::Halves;
use crate::error::{Error, Result};
use crate::film::{Film, read_exr};
use crate::radiometry::Rgb;

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
    /// Reflectance of what each pixel shows, in 0..=1, where it is known.
    pub albedo: Option<Vec<Rgb>>,
    /// Normal of what each pixel shows, where it is known.
    pub normal: Option<Vec<glam::Vec3>>,
    /// What a reader of the figures has to know of the file.
    pub notes: Vec<String>,
    /// Method and seed, where the file tells them.
    pub origin: Option<[String; 2]>,
}

/// Reads a reference: halves from its layers `half0`, `half1`, else from sibling files
/// `NAME.half0.exr`, `NAME.half1.exr`.
///
/// # Errors
/// [`Error::Image`] when a file is no image with R, G, B, or the halves have another size.
pub fn read_reference(path: &Path) -> Result<Reference> {
    let film = read_exr(path)?;
    let mean = beauty(&film, path)?;
    let mut notes = Vec::new();
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
        let one = |found: [bool; 2]| found[0] != found[1];
        if one(["half0", "half1"].map(|name| film.rgb(name).is_some()))
            || one([0, 1].map(|i| siblings[i].is_file()))
        {
            notes.push(format!(
                "{} has one half without the other: its noise counts as error",
                path.display()
            ));
        }
    }
    // Halves of one and the same sample are not independent.
    let halves = halves.filter(|Halves(a, b)| a != b);
    Ok(Reference {
        width: film.width,
        height: film.height,
        mean,
        halves,
        albedo: film.rgb("albedo"),
        normal: film.xyz("N"),
        notes,
        origin: origin(&film),
    })
}

/// Method and seed that a film's header tells.
pub(super) fn origin(film: &Film) -> Option<[String; 2]> {
    let of = |key: &str| film.header.get(key).cloned();
    Some([of("nearfar.method")?, of("nearfar.seed")?])
}

pub(super) fn beauty(film: &Film, path: &Path) -> Result<Vec<Rgb>> {
    film.rgb("").ok_or_else(|| Error::Image {
        path: path.into(),
        message: "has no channels R, G, B".into(),
    })
}

pub(super) fn same_size(film: &Film, width: u32, height: u32, path: &Path) -> Result<()> {
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
