//! Reading: the points of any file row by row, and nearfar's own files with columns that are known.

use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use crc32fast::Hasher;

use super::{CHECKSUM, Columns, Element, Header, Rows};
use crate::error::{Error, Result};
use crate::input_file;

/// Bytes of a checksum.
const SIZE: u64 = 4;

/// An open file, read up to its first row.
#[derive(Debug)]
pub struct Reader {
    path: PathBuf,
    header: Header,
    input: BufReader<File>,
    /// Bytes of the file but its checksum.
    length: u64,
    /// Whether it has one.
    has_checksum: bool,
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
        let mut header = header;
        let has_checksum = header.elements.last().is_some_and(|e| e.name == CHECKSUM);
        if has_checksum {
            header.elements.pop();
        }
        let length = length - if has_checksum { SIZE.min(length) } else { 0 };
        Ok(Self { path: path.into(), header, input, length, has_checksum })
    }

    /// Holds the file against its checksum, before the first row is read.
    fn check(&mut self) -> Result<()> {
        if !self.has_checksum {
            let own = self.header.comments.iter().any(|c| c.starts_with("nearfar "));
            let message = "has no checksum: it is damaged, or of an earlier version; make it again";
            return if own { Err(self.fault(message.into())) } else { Ok(()) };
        }
        let io = |source| Error::Io { path: self.path.clone(), source };
        let at = self.input.stream_position().map_err(io)?;
        self.input.rewind().map_err(io)?;
        let (mut sum, mut rest) = (Hasher::new(), (&mut self.input).take(self.length));
        loop {
            let bytes = rest.fill_buf().map_err(io)?;
            let read = bytes.len();
            if read == 0 {
                break;
            }
            sum.update(bytes);
            rest.consume(read);
        }
        let mut there = [0; SIZE as usize];
        let ended = self.input.read_exact(&mut there);
        if ended.is_err() || u32::from_le_bytes(there) != sum.finalize() {
            let message = "is cut short or damaged: its content is not what its checksum says; \
                           make it again";
            return Err(self.fault(message.into()));
        }
        self.input.seek(SeekFrom::Start(at)).map_err(io).map(drop)
    }

    /// What the file says before its rows.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The element `vertex`, once it is known that its rows fit the file, and that the file is what
    /// its checksum says.
    ///
    /// # Errors
    /// [`Error::Input`] when they do not, or it is not.
    pub fn points(&mut self) -> Result<Element> {
        let element = self.header.elements[0].clone();
        if element.bytes() > self.length {
            return Err(self.fault(format!(
                "is cut short: {} points of {} B do not fit {} B",
                element.count, element.row, self.length
            )));
        }
        self.check()?;
        Ok(element)
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
    reader.check()?;
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
