//! The attributes of an OpenEXR header in the order of their names: so that equal pictures are
//! equal files, byte for byte. The library that writes them has no order of its own.
//!
//! A header is a list of NAME 0 TYPE 0 SIZE VALUE, ended by a 0, after eight bytes of magic number
//! and version; offsets of pixels are counted from the file's beginning and stay as they are.

use std::io::{self, Read, Seek, SeekFrom, Write};

/// Bytes before the first attribute.
const BEFORE: u64 = 8;
/// Longest header.
const LONGEST: u64 = 1 << 20;

/// Sorts the header of a written file of one part; one that is longer or otherwise made stays.
pub(super) fn sort_attributes(file: &mut (impl Read + Write + Seek)) -> io::Result<()> {
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(BEFORE))?;
    Read::by_ref(file).take(LONGEST).read_to_end(&mut bytes)?;
    if let Some(sorted) = sorted(&bytes) {
        file.seek(SeekFrom::Start(BEFORE))?;
        file.write_all(&sorted)?;
    }
    Ok(())
}

fn sorted(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut attributes: Vec<&[u8]> = Vec::new();
    let mut rest = bytes;
    while *rest.first()? != 0 {
        let name = rest.iter().position(|&b| b == 0)?;
        let kind = rest[name + 1..].iter().position(|&b| b == 0)?;
        let size = name + kind + 2;
        let value = u32::from_le_bytes(rest.get(size..size + 4)?.try_into().ok()?);
        let (attribute, after) = rest.split_at_checked(size + 4 + value as usize)?;
        attributes.push(attribute);
        rest = after;
    }
    attributes.sort_unstable();
    Some(attributes.concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_are_sorted_and_the_rest_stays() {
        let attribute = |name: &str, value: &[u8]| {
            let size = (value.len() as u32).to_le_bytes();
            [name.as_bytes(), b"\0string\0", &size, value].concat()
        };
        let (a, b) = (attribute("a", b"x\0y"), attribute("b", b""));
        let file = |list: [&[u8]; 2]| [b"magic...", list[0], list[1], b"\0pixels"].concat();
        let mut made = io::Cursor::new(file([&b, &a]));
        sort_attributes(&mut made).unwrap();
        assert_eq!(made.into_inner(), file([&a, &b]));
        for odd in [&b"magic...name"[..], b"magic...", b"magic...a\0b\0\xff\xff\xff\xff"] {
            let mut made = io::Cursor::new(odd.to_vec());
            sort_attributes(&mut made).unwrap();
            assert_eq!(made.into_inner(), odd);
        }
    }
}
