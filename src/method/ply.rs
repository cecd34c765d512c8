//! Points with named properties as binary little-endian PLY: one element `vertex` from a struct, or
//! several with columns known at run time.

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
    let bytes = serde_ply::to_bytes(&Points { vertex: rows }, options)
        .map_err(|e| io(std::io::Error::other(e.to_string())))?;
    write_whole(path, &bytes)
}

/// Whole or not at all: a run that is killed leaves the earlier file.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let part = path.with_file_name(name);
    std::fs::write(&part, bytes).and_then(|()| std::fs::rename(&part, path)).map_err(|source| {
        drop(std::fs::remove_file(&part));
        Error::Io { path: path.into(), source }
    })
}

/// Columns of one element: 32-bit floats first, then bytes, all by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    /// Name of the element: `vertex` for what viewers show.
    pub element: &'static str,
    /// Names of the floats.
    pub floats: Vec<String>,
    /// Names of the bytes.
    pub bytes: Vec<&'static str>,
}

/// Rows of one element as they stand in the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows(Vec<u8>);

impl Rows {
    /// Adds one row.
    pub fn push(&mut self, floats: impl IntoIterator<Item = f32>, bytes: &[u8]) {
        floats.into_iter().for_each(|v| self.0.extend(v.to_le_bytes()));
        self.0.extend(bytes);
    }
    /// Rows of so many floats and bytes.
    pub fn iter(&self, floats: usize, bytes: usize) -> impl Iterator<Item = (Vec<f32>, &[u8])> {
        self.0.chunks_exact(4 * floats + bytes).map(move |row| {
            let (values, rest) = row.split_at(4 * floats);
            (
                values
                    .chunks_exact(4)
                    .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
                    .collect(),
                rest,
            )
        })
    }
}

impl Columns {
    fn size(&self) -> usize {
        4 * self.floats.len() + self.bytes.len()
    }
    fn header(&self, rows: usize) -> String {
        let floats: String = self.floats.iter().map(|n| format!("property float {n}\n")).collect();
        let bytes: String = self.bytes.iter().map(|n| format!("property uchar {n}\n")).collect();
        format!("element {} {rows}\n{floats}{bytes}", self.element)
    }
}

const BEGIN: &str = "ply\nformat binary_little_endian 1.0\n";
const END: &str = "end_header\n";

/// Writes several elements, whose columns are known only when the program runs.
///
/// # Errors
/// [`Error::Io`] when the system refuses.
pub fn write_elements(
    path: &Path,
    comments: &[String],
    elements: &[(Columns, Rows)],
) -> Result<()> {
    let mut bytes = BEGIN.as_bytes().to_vec();
    comments.iter().for_each(|c| bytes.extend(format!("comment {c}\n").bytes()));
    elements.iter().for_each(|(columns, rows)| {
        bytes.extend(columns.header(rows.0.len() / columns.size()).bytes())
    });
    bytes.extend(END.bytes());
    elements.iter().for_each(|(_, rows)| bytes.extend(&rows.0));
    write_whole(path, &bytes)
}

/// Reads elements that [`write_elements`] wrote with the same columns; `refuse` sees the header's
/// comments first.
///
/// # Errors
/// [`Error::Io`] when the file cannot be read, [`Error::Input`] when it is no such file, cut short
/// or too long.
pub fn read_elements(
    path: &Path,
    refuse: impl Fn(&[String]) -> Option<String>,
    columns: &[Columns],
) -> Result<Vec<Rows>> {
    let file = std::fs::read(path).map_err(|source| Error::Io { path: path.into(), source })?;
    let bad = |message: String| Error::input(path, None, message);
    let end = file
        .windows(END.len())
        .position(|w| w == END.as_bytes())
        .filter(|_| file.starts_with(b"ply\n"));
    let Some(header) = end.and_then(|end| std::str::from_utf8(&file[..end]).ok()) else {
        return Err(bad("is not a PLY file, or is cut short".into()));
    };
    let comments: Vec<String> =
        header.lines().filter_map(|l| l.strip_prefix("comment ")).map(str::to_owned).collect();
    if let Some(reason) = refuse(&comments) {
        return Err(bad(reason));
    }
    let counts: Vec<usize> = header
        .lines()
        .filter_map(|l| l.strip_prefix("element ")?.split_whitespace().nth(1)?.parse().ok())
        .collect();
    let expected: String = columns.iter().zip(&counts).map(|(c, &n)| c.header(n)).collect();
    let found: String = header[BEGIN.len().min(header.len())..]
        .lines()
        .filter(|l| !l.starts_with("comment "))
        .map(|l| format!("{l}\n"))
        .collect();
    if !header.starts_with(BEGIN) || counts.len() != columns.len() || found != expected {
        return Err(bad("has other columns than this program writes; save it again".into()));
    }
    let mut rest = &file[header.len() + END.len()..];
    let whole = columns
        .iter()
        .zip(&counts)
        .try_fold(0usize, |sum, (c, n)| sum.checked_add(c.size().checked_mul(*n)?));
    if whole != Some(rest.len()) {
        let needed = whole.map_or_else(|| "more".into(), |n| n.to_string());
        return Err(bad(format!(
            "is cut short or too long: {} B after the header, not {needed}; save it again",
            rest.len()
        )));
    }
    let mut rows = Vec::new();
    for (c, n) in columns.iter().zip(counts) {
        let (own, after) = rest.split_at(c.size() * n);
        rows.push(Rows(own.to_vec()));
        rest = after;
    }
    Ok(rows)
}

/// Reads the rows of element `vertex`; `refuse` sees the header's comments and may say why the file
/// will not do.
///
/// # Errors
/// [`Error::Io`] when the file cannot be opened, [`Error::Input`] when it is no such file or cut
/// short.
pub fn read<T: DeserializeOwned>(
    path: &Path,
    refuse: impl Fn(&[String]) -> Option<String>,
) -> Result<Vec<T>> {
    let io = |source| Error::Io { path: path.into(), source };
    let bad = |message: String| Error::input(path, None, message);
    let file = File::open(path).map_err(io)?;
    let length = file.metadata().map_err(io)?.len();
    let mut reader = PlyReader::from_reader(BufReader::new(file))
        .map_err(|e| bad(format!("is not a PLY file: {e}")))?;
    let header = reader.header();
    if let Some(reason) = refuse(&header.comments) {
        return Err(bad(reason));
    }
    let element = header
        .elem_defs
        .first()
        .filter(|e| e.name == "vertex")
        .ok_or_else(|| bad("its first element is not \"vertex\"".into()))?;
    let size = |p: &PropertyType| match p {
        PropertyType::Scalar(s) => size_of_scalar(*s),
        PropertyType::List { .. } => 1,
    };
    let row: u64 = element.properties.iter().map(|p| size(&p.property_type)).sum();
    // Known before anything is allocated.
    if row.saturating_mul(element.count as u64) > length {
        return Err(bad(format!(
            "is cut short: {} points of {row} B do not fit {length} B",
            element.count
        )));
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
    let (sum, count) =
        values.fold((0.0f64, 0.0f64), |(s, n), v| (s + f64::from(v.element_sum() / 3.0), n + 1.0));
    if sum > 0.0 { (0.2 * count / sum) as f32 } else { 1.0 }
}

/// The colour that a viewer shows for a value.
pub fn colour(value: Rgb, scale: f32) -> [u8; 3] {
    (value * scale).to_array().map(|v| (v.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0 + 0.5) as u8)
}
