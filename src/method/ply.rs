//! Points with named properties as binary little-endian PLY, one element `vertex`.

use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_ply::{PlyReader, PropertyType, ScalarType, SerializeOptions};

use crate::error::{Error, Result};
use crate::radiometry::Rgb;

#[derive(Serialize, Deserialize)]
struct Points<T> {
    vertex: Vec<T>,
}

/// Writes `rows` with header comments (one line each).
///
/// # Errors
/// [`Error::Io`] when the system refuses.
pub fn write<T: Serialize>(path: &Path, comments: Vec<String>, rows: Vec<T>) -> Result<()> {
    let io = |source| Error::Io { path: path.into(), source };
    let options = SerializeOptions::binary_le().with_comments(comments);
    let bytes = serde_ply::to_bytes(&Points { vertex: rows }, options).map_err(|e| io(std::io::Error::other(e.to_string())))?;
    // Whole or not at all: a run that is killed leaves the earlier file.
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let part = path.with_file_name(name);
    std::fs::write(&part, bytes).and_then(|()| std::fs::rename(&part, path)).map_err(|source| {
        drop(std::fs::remove_file(&part));
        io(source)
    })
}

/// Reads the rows of element `vertex`; `refuse` sees the header's comments and may say why the file will not do.
///
/// # Errors
/// [`Error::Io`] when the file cannot be opened, [`Error::Input`] when it is no such file or cut short.
pub fn read<T: DeserializeOwned>(path: &Path, refuse: impl Fn(&[String]) -> Option<String>) -> Result<Vec<T>> {
    let io = |source| Error::Io { path: path.into(), source };
    let bad = |message: String| Error::input(path, None, message);
    let file = File::open(path).map_err(io)?;
    let length = file.metadata().map_err(io)?.len();
    let mut reader = PlyReader::from_reader(BufReader::new(file)).map_err(|e| bad(format!("is not a PLY file: {e}")))?;
    let header = reader.header();
    if let Some(reason) = refuse(&header.comments) {
        return Err(bad(reason));
    }
    let element = header.elem_defs.first().filter(|e| e.name == "vertex").ok_or_else(|| bad("its first element is not \"vertex\"".into()))?;
    let size = |p: &PropertyType| match p {
        PropertyType::Scalar(s) => size_of_scalar(*s),
        PropertyType::List { .. } => 1,
    };
    let row: u64 = element.properties.iter().map(|p| size(&p.property_type)).sum();
    // Known before anything is allocated.
    if row.saturating_mul(element.count as u64) > length {
        return Err(bad(format!("is cut short: {} points of {row} B do not fit {length} B", element.count)));
    }
    reader.next_element().map_err(|e| match e.0.kind() {
        ErrorKind::UnexpectedEof => bad("is cut short".into()),
        _ => bad(format!("cannot be read: {e}")),
    })
}

fn size_of_scalar(scalar: ScalarType) -> u64 {
    match scalar {
        ScalarType::I8 | ScalarType::U8 => 1,
        ScalarType::I16 | ScalarType::U16 => 2,
        ScalarType::I32 | ScalarType::U32 | ScalarType::F32 => 4,
        ScalarType::F64 => 8,
    }
}

/// Scale that brings the mean of the values to middle grey.
pub fn colour_scale(values: impl Iterator<Item = Rgb>) -> f32 {
    let (sum, count) = values.fold((0.0f64, 0.0f64), |(s, n), v| (s + f64::from(v.element_sum() / 3.0), n + 1.0));
    if sum > 0.0 { (0.2 * count / sum) as f32 } else { 1.0 }
}

/// The colour that a viewer shows for a value.
pub fn colour(value: Rgb, scale: f32) -> [u8; 3] {
    (value * scale).to_array().map(|v| (v.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0 + 0.5) as u8)
}
