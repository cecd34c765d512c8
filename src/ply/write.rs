//! Writing: row by row for what need not be in memory at once, or from rows that are; the checksum
//! comes last.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use crc32fast::Hasher;

use super::{CHECKSUM, Columns, Rows};
use crate::atomic_file;
use crate::error::Result;

/// Takes the rows of a file, in the order of its elements.
#[derive(Debug)]
pub struct RowWriter<'a> {
    out: &'a mut BufWriter<File>,
    /// Bytes so far.
    written: u64,
    /// Of everything so far, the header included.
    checksum: Hasher,
}

impl RowWriter<'_> {
    /// Bytes as they are.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn bytes(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.written += bytes.len() as u64;
        self.checksum.update(bytes);
        self.out.write_all(bytes)
    }
    /// 32-bit floats.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn floats(&mut self, values: impl IntoIterator<Item = f32>) -> io::Result<()> {
        values.into_iter().try_for_each(|v| self.bytes(&v.to_le_bytes()))
    }
    /// An unsigned 32-bit integer.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn integer(&mut self, value: u32) -> io::Result<()> {
        self.bytes(&value.to_le_bytes())
    }
    /// A row of [`Columns::triangles`].
    ///
    /// # Errors
    /// When the system refuses.
    pub fn triangle(&mut self, vertices: [u32; 3]) -> io::Result<()> {
        self.bytes(&[3])?;
        vertices.into_iter().try_for_each(|v| self.integer(v))
    }
}

/// Writes a file of elements with so many rows, which `body` writes, and its checksum; header
/// comments of several lines become several.
///
/// # Errors
/// [`crate::error::Error::Write`] when the system refuses, or `body` writes more or less than is
/// due.
pub fn write(
    path: &Path,
    comments: &[String],
    elements: &[(Columns, usize)],
    body: impl FnOnce(&mut RowWriter<'_>) -> io::Result<()>,
) -> Result<()> {
    put(path, comments, elements, true, body)
}

/// As [`write()`], for other programs: without comments and checksum.
///
/// # Errors
/// As [`write()`].
pub fn write_for_others(
    path: &Path,
    elements: &[(Columns, usize)],
    body: impl FnOnce(&mut RowWriter<'_>) -> io::Result<()>,
) -> Result<()> {
    put(path, &[], elements, false, body)
}

fn put(
    path: &Path,
    comments: &[String],
    elements: &[(Columns, usize)],
    own: bool,
    body: impl FnOnce(&mut RowWriter<'_>) -> io::Result<()>,
) -> Result<()> {
    atomic_file::write(path, |out| {
        let mut header = String::from("ply\nformat binary_little_endian 1.0\n");
        for line in comments.iter().flat_map(|c| c.lines()) {
            header += &format!("comment {line}\n");
        }
        for (columns, rows) in elements {
            header += &columns.header(*rows);
        }
        if own {
            header += &Columns::new(CHECKSUM).integers(["crc32"]).header(1);
        }
        header += "end_header\n";
        let mut rows = RowWriter { out, written: 0, checksum: Hasher::new() };
        rows.bytes(header.as_bytes())?;
        rows.written = 0;
        body(&mut rows)?;
        let expected: u64 = elements.iter().map(|(c, rows)| (c.row() * rows) as u64).sum();
        if rows.written != expected {
            let message = format!("{} B of rows where {expected} were due", rows.written);
            return Err(io::Error::other(message));
        }
        let checksum = rows.checksum.clone().finalize();
        if own { rows.integer(checksum) } else { Ok(()) }
    })
}

/// Writes a file from rows that are in memory.
///
/// # Errors
/// As `write`.
pub fn write_elements(
    path: &Path,
    comments: &[String],
    elements: &[(Columns, Rows)],
) -> Result<()> {
    let counts: Vec<(Columns, usize)> =
        elements.iter().map(|(c, rows)| (c.clone(), rows.0.len() / c.row().max(1))).collect();
    write(path, comments, &counts, |out| {
        elements.iter().try_for_each(|(_, rows)| out.bytes(&rows.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ply::{Reader, read_elements};

    fn path(name: &str) -> std::path::PathBuf {
        std::env::temp_dir().join(format!("nearfar-ply-{}-{name}.ply", std::process::id()))
    }

    #[test]
    fn elements_are_read_back_bit_for_bit() {
        let path = path("elements");
        let columns = [
            Columns::new("vertex").floats(["x", "y"]).integers(["id"]).bytes(["red"]),
            Columns::new("cell").floats(["value"]),
        ];
        let (mut vertex, mut cell) = (Rows::default(), Rows::default());
        vertex.push([1.5, f32::MIN_POSITIVE], &[1, 0, 0, 0x80, 7]);
        cell.push([-0.0], &[]);
        cell.push([0.1], &[]);
        let [of_vertex, of_cell] = columns.clone();
        let elements = [(of_vertex, vertex.clone()), (of_cell, cell.clone())];
        write_elements(&path, &["one\ntwo".into()], &elements).unwrap();
        let seen = |comments: &[String]| (comments != ["one", "two"]).then(|| "comments".into());
        let rows = read_elements(&path, seen, &columns).unwrap();
        assert_eq!(rows, [vertex, cell]);
        let first: Vec<_> = rows[0].iter(&columns[0]).collect();
        assert_eq!(first, [(vec![1.5, f32::MIN_POSITIVE], &[1, 0, 0, 0x80, 7][..])]);
        let fault = |columns: &[Columns], refuse: Option<&str>| {
            let refuse = |_: &[String]| refuse.map(str::to_owned);
            read_elements(&path, refuse, columns).unwrap_err().to_string()
        };
        assert!(fault(&columns, Some("is another's")).ends_with(".ply: is another's"));
        assert!(fault(&columns[..1], None).contains("other columns"));
        let swapped = [Columns::new("vertex").floats(["y", "x"]), columns[1].clone()];
        assert!(fault(&swapped, None).contains("other columns"));
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
        assert!(fault(&columns, None).contains("is cut short or damaged"));
        for at in 0..8 * bytes.len() {
            let mut flipped = bytes.clone();
            flipped[at / 8] ^= 1 << (at % 8);
            std::fs::write(&path, &flipped).unwrap();
            let error = fault(&columns, None);
            assert!(error.contains("elements.ply"), "bit {at}: {error}");
        }
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn rows_that_do_not_make_up_the_header_are_no_file() {
        let path = path("short");
        let points = [(Columns::new("vertex").floats(["x"]), 2)];
        let error = write(&path, &[], &points, |out| out.floats([1.0])).unwrap_err();
        assert!(error.to_string().contains("4 B of rows where 8 were due") && !path.exists());
    }

    #[test]
    fn triangles_follow_points() {
        let path = path("triangles");
        let elements = [(Columns::new("vertex").floats(["x"]), 1), (Columns::triangles(), 1)];
        write(&path, &[], &elements, |out| {
            out.floats([2.0])?;
            out.triangle([0, 0, 0])
        })
        .unwrap();
        let mut reader = Reader::open(&path).unwrap();
        let points = reader.points().unwrap();
        assert!(reader.header().elements[1].has_lists && points.count == 1);
        let mut row = [0; 4];
        reader.row(&mut row).unwrap();
        assert_eq!(points.property("x").unwrap().read(&row), 2.0);
        std::fs::remove_file(&path).unwrap();
    }
}
