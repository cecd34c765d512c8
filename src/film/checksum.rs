//! The checksum of a film as stored: a CRC-32 over size, header and channels.
//!
//! It stands in the header under [`CHECKSUM`], over everything but itself. Whoever takes a picture
//! for progress (`super::read_whole_exr`) asks for it; for looking at pictures it does not matter,
//! since other programs keep the header while they change pixels.
//!
//! Guarantee  whatever single bit of a size, a text, a channel's name or a value is another, the
//! checksum is.

use std::collections::BTreeMap;

use crc32fast::Hasher;

/// Header attribute of the checksum.
pub(super) const CHECKSUM: &str = "nearfar.checksum";

/// A checksum that channels are added to, in the order of their names.
pub(super) struct Checksum(Hasher);

impl Checksum {
    /// Of a film of this size and header.
    pub(super) fn new(size: (u32, u32), header: &BTreeMap<String, String>) -> Self {
        let mut sum = Self(Hasher::new());
        sum.0.update(&size.0.to_le_bytes());
        sum.0.update(&size.1.to_le_bytes());
        for (key, value) in header.iter().filter(|(key, _)| *key != CHECKSUM) {
            sum.text(key);
            sum.text(value);
        }
        sum
    }

    fn text(&mut self, text: &str) {
        self.0.update(&(text.len() as u64).to_le_bytes());
        self.0.update(text.as_bytes());
    }

    /// Adds a channel.
    pub(super) fn channel(&mut self, name: &str, values: impl Iterator<Item = f32>) {
        self.text(name);
        let mut bytes = Vec::with_capacity(4096);
        for value in values {
            bytes.extend(value.to_le_bytes());
            if bytes.len() == 4096 {
                self.0.update(&bytes);
                bytes.clear();
            }
        }
        self.0.update(&bytes);
    }

    /// As the header has it.
    pub(super) fn finish(self) -> String {
        format!("{:08x}", self.0.finalize())
    }
}
