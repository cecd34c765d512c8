//! The points of a PLY file with all their numbers, each in its own type.

use std::path::Path;

use glam::Vec3;

use crate::error::Result;
use crate::ply::{Element, Kind, Reader};

/// Points and their numbers, as the file has them.
#[derive(Debug)]
pub struct Table {
    /// Lines that the file says about itself.
    pub comments: Vec<String>,
    points: Element,
    rows: Vec<u8>,
}

/// One number of every point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column<'a> {
    pub name: &'a str,
    pub kind: Kind,
    offset: usize,
}

impl Column<'_> {
    /// Letter and bytes of its type: `f4` a float, `u1` a byte.
    pub(super) fn type_code(&self) -> &'static str {
        match self.kind {
            Kind::U8 => "u1",
            Kind::I8 => "i1",
            Kind::U16 => "u2",
            Kind::I16 => "i2",
            Kind::U32 => "u4",
            Kind::I32 => "i4",
            Kind::F32 => "f4",
            Kind::F64 => "f8",
        }
    }
}

impl Table {
    /// Reads a binary little-endian PLY file whose first element is `vertex`.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] when the file cannot be read, [`crate::error::Error::Input`]
    /// when it is no such file, is cut short, has no points, or points without a place.
    pub fn read(path: &Path) -> Result<Self> {
        let mut reader = Reader::open(path)?;
        let points = reader.points()?;
        if points.count == 0 {
            return Err(reader.fault("has no points: there is nothing to show".into()));
        }
        let mut rows = vec![0; points.row * points.count];
        reader.row(&mut rows)?;
        let table = Self { comments: reader.header().comments.clone(), points, rows };
        if let Some(missing) = ["x", "y", "z"].iter().find(|n| table.floats(n).is_none()) {
            return Err(
                reader.fault(format!("has no property \"{missing}\": points need x, y and z"))
            );
        }
        if let Some(i) = table.places().iter().position(|p| !p.is_finite()) {
            return Err(
                reader.fault(format!("point {i} (counted from 0) has a place that is not finite"))
            );
        }
        Ok(table)
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.count
    }
    /// Never: files without points are refused.
    pub fn is_empty(&self) -> bool {
        self.points.count == 0
    }

    pub(super) fn columns(&self) -> impl Iterator<Item = Column<'_>> {
        self.points.properties.iter().map(|p| Column {
            name: &p.name,
            kind: p.kind,
            offset: p.offset,
        })
    }

    /// Bytes of a column, points in the given order.
    pub(super) fn sorted(&self, column: &Column<'_>, order: &[u32]) -> Vec<u8> {
        let (row, size) = (self.points.row, column.kind.size());
        let mut bytes = Vec::with_capacity(order.len() * size);
        for &i in order {
            let at = i as usize * row + column.offset;
            bytes.extend_from_slice(&self.rows[at..at + size]);
        }
        bytes
    }

    fn floats(&self, name: &str) -> Option<Vec<f32>> {
        let property = self.points.properties.iter().find(|p| p.name == name)?;
        Some(self.rows.chunks_exact(self.points.row).map(|row| property.read(row)).collect())
    }
    fn vectors(&self, names: [&str; 3]) -> Option<Vec<Vec3>> {
        let [x, y, z] = names.map(|n| self.floats(n));
        Some(x?.into_iter().zip(y?).zip(z?).map(|((x, y), z)| Vec3::new(x, y, z)).collect())
    }

    pub(super) fn places(&self) -> Vec<Vec3> {
        self.vectors(["x", "y", "z"]).unwrap_or_default()
    }
    pub(super) fn has_normals(&self) -> bool {
        ["nx", "ny", "nz"].iter().all(|n| self.points.properties.iter().any(|p| p.name == *n))
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
