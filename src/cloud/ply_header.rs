//! The header of a binary little-endian PLY file whose first element is `vertex`: what its numbers
//! are called and where they stand in a row.

use std::io::{BufRead, Read};

/// Longest header.
const MAX_HEADER: u64 = 1 << 16;

/// A number of every point.
#[derive(Clone, Debug)]
pub(crate) struct Property {
    pub name: String,
    /// Bytes before it in a row.
    pub offset: usize,
    pub kind: Kind,
}

/// Types of PLY.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F32,
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

/// Of the first element, which is `vertex`.
#[derive(Debug)]
pub(crate) struct Header {
    pub count: usize,
    /// Bytes of a row.
    pub row: usize,
    pub properties: Vec<Property>,
    pub comments: Vec<String>,
}

/// Reads up to the first row; errors come with the line, where there is one.
pub(crate) fn header(
    input: &mut impl BufRead,
) -> std::result::Result<Header, (Option<usize>, String)> {
    let mut limited = input.take(MAX_HEADER);
    let mut header = Header { count: 0, row: 0, properties: Vec::new(), comments: Vec::new() };
    let (mut line, mut number, mut elements) = (Vec::new(), 0, 0);
    loop {
        line.clear();
        number += 1;
        let fail = |message: &str| Err((Some(number), message.to_owned()));
        let got =
            limited.read_until(b'\n', &mut line).map_err(|e| (Some(number), e.to_string()))?;
        let text = String::from_utf8_lossy(&line);
        let words: Vec<&str> = text.split_whitespace().collect();
        if number == 1 && words != ["ply"] {
            return fail("is not a PLY file");
        }
        if got == 0 {
            return fail("the header has no end");
        }
        match words.as_slice() {
            ["format", format, _] if *format != "binary_little_endian" => {
                return fail(&format!(
                    "format \"{format}\" cannot be read; convert it to binary_little_endian"
                ));
            }
            ["element", name, count] => {
                elements += 1;
                if elements == 1 {
                    if *name != "vertex" {
                        return fail("the first element must be \"vertex\"");
                    }
                    header.count = count.parse().map_err(|_| {
                        (Some(number), format!("\"{count}\" is not a number of elements"))
                    })?;
                }
            }
            ["property", "list", ..] if elements == 1 => {
                return fail("a list cannot be a property of a point");
            }
            ["property", kind, name] if elements == 1 => {
                let kind = Kind::parse(kind)
                    .ok_or_else(|| (Some(number), format!("\"{kind}\" is not a type of PLY")))?;
                header.properties.push(Property { name: (*name).into(), offset: header.row, kind });
                header.row += kind.size();
            }
            ["comment", ..] => {
                header.comments.push(text.trim_start_matches("comment").trim().to_owned())
            }
            ["end_header"] => break,
            _ => {}
        }
    }
    if elements == 0 { Err((None, "has no element \"vertex\"".into())) } else { Ok(header) }
}
