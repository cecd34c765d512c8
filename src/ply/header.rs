//! The header of a PLY file as read: which elements there are, what their numbers are called and
//! where they stand in a row.

use std::io::{BufRead, Read};

/// Longest header, bytes.
const MAX_HEADER: u64 = 1 << 16;

/// Types of PLY.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Unsigned byte.
    U8,
    /// Signed byte.
    I8,
    /// Unsigned, 16 bits.
    U16,
    /// Signed, 16 bits.
    I16,
    /// Unsigned, 32 bits.
    U32,
    /// Signed, 32 bits.
    I32,
    /// Float, 32 bits.
    F32,
    /// Float, 64 bits.
    F64,
}

impl Kind {
    fn parse(word: &str) -> Option<Self> {
        Some(match word {
            "uchar" | "uint8" => Self::U8,
            "char" | "int8" => Self::I8,
            "ushort" | "uint16" => Self::U16,
            "short" | "int16" => Self::I16,
            "uint" | "uint32" => Self::U32,
            "int" | "int32" => Self::I32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }
    /// The name that is written.
    pub fn name(self) -> &'static str {
        match self {
            Self::U8 => "uchar",
            Self::I8 => "char",
            Self::U16 => "ushort",
            Self::I16 => "short",
            Self::U32 => "uint",
            Self::I32 => "int",
            Self::F32 => "float",
            Self::F64 => "double",
        }
    }
    /// Bytes.
    pub fn size(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// A number of every row.
#[derive(Clone, Debug)]
pub struct Property {
    /// As in the file.
    pub name: String,
    /// Bytes before it in a row.
    pub offset: usize,
    /// Its type.
    pub kind: Kind,
}

impl Property {
    /// The nearest float to its value in a row.
    pub fn read(&self, row: &[u8]) -> f32 {
        let mut b = [0u8; 8];
        b[..self.kind.size()].copy_from_slice(&row[self.offset..self.offset + self.kind.size()]);
        let (two, four) = ([b[0], b[1]], [b[0], b[1], b[2], b[3]]);
        match self.kind {
            Kind::U8 => f32::from(b[0]),
            Kind::I8 => f32::from(b[0] as i8),
            Kind::U16 => f32::from(u16::from_le_bytes(two)),
            Kind::I16 => f32::from(i16::from_le_bytes(two)),
            Kind::U32 => u32::from_le_bytes(four) as f32,
            Kind::I32 => i32::from_le_bytes(four) as f32,
            Kind::F32 => f32::from_le_bytes(four),
            Kind::F64 => f64::from_le_bytes(b) as f32,
        }
    }
}

/// One element.
#[derive(Clone, Debug)]
pub struct Element {
    /// As in the file.
    pub name: String,
    /// Rows.
    pub count: usize,
    /// Bytes of a row, lists left out.
    pub row: usize,
    /// The numbers of a row, lists left out.
    pub properties: Vec<Property>,
    /// Rows hold lists too: their length is not known.
    pub has_lists: bool,
}

impl Element {
    /// Bytes of all rows, without lists; as many as there can be when they cannot be counted.
    pub fn bytes(&self) -> u64 {
        (self.row as u64).saturating_mul(self.count as u64)
    }
    /// A number by its name.
    pub fn property(&self, name: &str) -> Option<&Property> {
        self.properties.iter().find(|p| p.name == name)
    }
}

/// What a file says before its rows.
#[derive(Clone, Debug, Default)]
pub struct Header {
    /// Lines that the file says about itself.
    pub comments: Vec<String>,
    /// Its elements, `vertex` first.
    pub elements: Vec<Element>,
}

/// What is wrong with a header, and its line where there is one.
pub(super) type Fault = (Option<usize>, String);

impl Header {
    /// Reads up to the first row.
    pub(super) fn read(input: &mut impl BufRead) -> Result<Self, Fault> {
        let mut limited = input.take(MAX_HEADER);
        let (mut header, mut line, mut number) = (Self::default(), Vec::new(), 0);
        loop {
            line.clear();
            number += 1;
            let fail = |message: String| (Some(number), message);
            let got = limited.read_until(b'\n', &mut line).map_err(|e| fail(e.to_string()))?;
            let text = String::from_utf8_lossy(&line);
            let text = text.trim_end_matches(['\n', '\r']);
            if number == 1 && text.trim() != "ply" {
                return Err(fail("is not a PLY file".into()));
            }
            if got == 0 {
                return Err(fail("the PLY header has no end: the file is cut short".into()));
            }
            if text.trim() == "end_header" {
                break;
            }
            header.line(text).map_err(fail)?;
        }
        if header.elements.is_empty() {
            return Err((None, "has no element \"vertex\"".into()));
        }
        Ok(header)
    }

    /// Takes in a line between the first and the last.
    fn line(&mut self, text: &str) -> Result<(), String> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let in_points = self.elements.len() == 1;
        match (words.as_slice(), self.elements.last_mut()) {
            (["format", format, _], _) if *format != "binary_little_endian" => Err(format!(
                "format \"{format}\" cannot be read; convert it to binary_little_endian"
            )),
            (["element", name, _], None) if *name != "vertex" => {
                Err("the first element must be \"vertex\"".into())
            }
            (["element", name, count], _) => {
                let count = count
                    .parse()
                    .map_err(|_| format!("\"{count}\" is not a number of elements"))?;
                self.elements.push(Element {
                    name: (*name).into(),
                    count,
                    row: 0,
                    properties: Vec::new(),
                    has_lists: false,
                });
                Ok(())
            }
            (["property", "list", ..], Some(_)) if in_points => {
                Err("a list cannot be a property of a point".into())
            }
            (["property", "list", ..], Some(element)) => {
                element.has_lists = true;
                Ok(())
            }
            (["property", kind, name], Some(element)) => {
                let kind =
                    Kind::parse(kind).ok_or_else(|| format!("\"{kind}\" is not a type of PLY"))?;
                let property = Property { name: (*name).into(), offset: element.row, kind };
                element.row += kind.size();
                element.properties.push(property);
                Ok(())
            }
            (["comment", ..], _) => {
                let comment = text.trim_start().strip_prefix("comment").unwrap_or_default();
                self.comments.push(comment.trim().to_owned());
                Ok(())
            }
            _ => Ok(()),
        }
    }
}
