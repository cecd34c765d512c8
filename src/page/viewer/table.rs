//! The points of a PLY file with all their numbers, each in its own type.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use glam::Vec3;

use crate::cloud::ply_header::{Header, Kind, header};
use crate::error::{Error, Result};

/// Points and their numbers, as the file has them.
#[derive(Debug)]
pub struct Table {
    /// Lines that the file says about itself.
    pub comments: Vec<String>,
    header: Header,
    rows: Vec<u8>,
}

/// One number of every point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column<'a> {
    pub name: &'a str,
    pub kind: Kind,
    offset: usize,
}

impl Kind {
    /// Letter and bytes: `f4` a float, `u1` a byte.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::U8 => "u1",
            Self::I8 => "i1",
            Self::U16 => "u2",
            Self::I16 => "i2",
            Self::U32 => "u4",
            Self::I32 => "i4",
            Self::F32 => "f4",
            Self::F64 => "f8",
        }
    }
}

impl Table {
    /// Reads a binary little-endian PLY file whose first element is `vertex`.
    ///
    /// # Errors
    /// [`Error::Io`] when the file cannot be read, [`Error::Input`] when it is no such file, is cut
    /// short, has no points, or points without a place.
    pub fn read(path: &Path) -> Result<Self> {
        let io = |source| Error::Io { path: path.into(), source };
        let bad = |line: Option<usize>, message: String| Error::input(path, line, message);
        let file = File::open(path).map_err(io)?;
        let length = file.metadata().map_err(io)?.len();
        let mut input = BufReader::new(file);
        let mut header = header(&mut input).map_err(|(line, message)| bad(line, message))?;
        let bytes = header.row as u64 * header.count as u64;
        if bytes > length {
            return Err(bad(
                None,
                format!(
                    "is cut short: {} points of {} B do not fit {length} B",
                    header.count, header.row
                ),
            ));
        }
        if header.count == 0 {
            return Err(bad(None, "has no points: there is nothing to show".into()));
        }
        let mut rows = Vec::with_capacity(bytes as usize);
        input.take(bytes).read_to_end(&mut rows).map_err(io)?;
        if rows.len() as u64 != bytes {
            return Err(bad(None, "is cut short".into()));
        }
        let comments = std::mem::take(&mut header.comments);
        let table = Self { comments, header, rows };
        if let Some(missing) = ["x", "y", "z"].iter().find(|n| table.floats(n).is_none()) {
            return Err(bad(
                None,
                format!("has no property \"{missing}\": points need x, y and z"),
            ));
        }
        if let Some(i) = table.places().iter().position(|p| !p.is_finite()) {
            return Err(bad(
                None,
                format!("point {i} (counted from 0) has a place that is not finite"),
            ));
        }
        Ok(table)
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.header.count
    }
    /// Never: files without points are refused.
    pub fn is_empty(&self) -> bool {
        self.header.count == 0
    }

    pub(super) fn columns(&self) -> impl Iterator<Item = Column<'_>> {
        self.header.properties.iter().map(|p| Column {
            name: &p.name,
            kind: p.kind,
            offset: p.offset,
        })
    }

    /// Bytes of a column, points in the given order.
    pub(super) fn sorted(&self, column: &Column<'_>, order: &[u32]) -> Vec<u8> {
        let (row, size) = (self.header.row, column.kind.size());
        let mut bytes = Vec::with_capacity(order.len() * size);
        for &i in order {
            let at = i as usize * row + column.offset;
            bytes.extend_from_slice(&self.rows[at..at + size]);
        }
        bytes
    }

    fn floats(&self, name: &str) -> Option<Vec<f32>> {
        let property = self.header.properties.iter().find(|p| p.name == name)?;
        Some(self.rows.chunks_exact(self.header.row).map(|row| property.read(row)).collect())
    }
    fn vectors(&self, names: [&str; 3]) -> Option<Vec<Vec3>> {
        let [x, y, z] = names.map(|n| self.floats(n));
        Some(x?.into_iter().zip(y?).zip(z?).map(|((x, y), z)| Vec3::new(x, y, z)).collect())
    }

    pub(super) fn places(&self) -> Vec<Vec3> {
        self.vectors(["x", "y", "z"]).unwrap_or_default()
    }
    pub(super) fn has_normals(&self) -> bool {
        ["nx", "ny", "nz"].iter().all(|n| self.header.properties.iter().any(|p| p.name == *n))
    }
    pub(super) fn normals(&self) -> Option<Vec<Vec3>> {
        self.vectors(["nx", "ny", "nz"])
    }
    /// Areas of the discs, scene units squared.
    pub(super) fn areas(&self) -> Option<Vec<f32>> {
        let of = |r: f32| std::f32::consts::PI * r * r;
        self.floats("_area")
            .or_else(|| Some(self.floats("radius")?.into_iter().map(of).collect()))
            .or_else(|| {
                let (along, across) = (self.floats("radius_along")?, self.floats("radius_across")?);
                Some(
                    along
                        .into_iter()
                        .zip(across)
                        .map(|(a, b)| std::f32::consts::PI * a * b)
                        .collect(),
                )
            })
    }
}
