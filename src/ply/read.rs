//! Reading: the points of any file row by row, and nearfar's own files with columns that are known.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};

use super::{Columns, Element, Header, Rows};
use crate::error::{Error, Result};
use crate::input_file;

/// An open file, read up to its first row.
#[derive(Debug)]
pub struct Reader {
    path: PathBuf,
    header: Header,
    input: BufReader<File>,
    /// Bytes of the file.
    length: u64,
}

impl Reader {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// [`Error::Io`] when the file cannot be opened, [`Error::Input`] when it is no binary
    /// little-endian PLY whose first element is `vertex`, with the line of the header.
    pub fn open(path: &Path) -> Result<Self> {
        let io = |source| Error::Io { path: path.into(), source };
        let file = input_file::open(path)?;
        let length = file.metadata().map_err(io)?.len();
        let mut input = BufReader::with_capacity(1 << 18, file);
        let header = Header::read(&mut input)
            .map_err(|(line, message)| Error::input(path, line, message))?;
        Ok(Self { path: path.into(), header, input, length })
    }

    /// What the file says before its rows.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The element `vertex`, once it is known that its rows fit the file.
    ///
    /// # Errors
    /// [`Error::Input`] when they do not.
    pub fn points(&self) -> Result<Element> {
        let element = &self.header.elements[0];
        if element.bytes() > self.length {
            return Err(self.fault(format!(
                "is cut short: {} points of {} B do not fit {} B",
                element.count, element.row, self.length
            )));
        }
        Ok(element.clone())
    }

    /// Fills `row` with what comes next.
    ///
    /// # Errors
    /// [`Error::Input`] when the file ends before, [`Error::Io`] when the system refuses.
    pub fn row(&mut self, row: &mut [u8]) -> Result<()> {
        self.input.read_exact(row).map_err(|source| match source.kind() {
            ErrorKind::UnexpectedEof => self.fault("is cut short".into()),
            _ => Error::Io { path: self.path.clone(), source },
        })
    }

    /// An [`Error::Input`] about this file.
    pub fn fault(&self, message: String) -> Error {
        Error::input(&self.path, None, message)
    }

    /// Bytes that are left.
    fn rest(&mut self) -> Result<u64> {
        use std::io::Seek;
        let at = self
            .input
            .stream_position()
            .map_err(|source| Error::Io { path: self.path.clone(), source })?;
        Ok(self.length - at.min(self.length))
    }
}

/// Reads a file that was written with these columns; `refuse` sees the header's comments first and
/// may say why the file will not do.
///
/// # Errors
/// [`Error::Io`] when the file cannot be read; [`Error::Input`] when it is refused, is no such
/// file, has other columns, is cut short or too long.
pub fn read_elements(
    path: &Path,
    refuse: impl Fn(&[String]) -> Option<String>,
    columns: &[Columns],
) -> Result<Vec<Rows>> {
    let mut reader = Reader::open(path)?;
    if let Some(reason) = refuse(&reader.header.comments) {
        return Err(reader.fault(reason));
    }
    let elements = std::mem::take(&mut reader.header.elements);
    if elements.len() != columns.len() || !columns.iter().zip(&elements).all(|(c, e)| c.are_of(e)) {
        let message = "has other columns than this program writes; save it again";
        return Err(reader.fault(message.into()));
    }
    let whole = elements.iter().fold(0u64, |sum, e| sum.saturating_add(e.bytes()));
    let rest = reader.rest()?;
    if whole != rest {
        return Err(reader.fault(format!(
            "is cut short or too long: {rest} B after the header, not {whole}; save it again"
        )));
    }
    let read = |element: &Element| {
        let mut rows = vec![0; element.bytes() as usize];
        reader.row(&mut rows).map(|()| Rows(rows))
    };
    elements.iter().map(read).collect()
}
