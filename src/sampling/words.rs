//! A running hash of 64-bit words, for keys that files keep: the same numbers on every machine.
//!
//! ```text
//! h ← hash64(rotate(h, 5) ⊕ word) + 0x9e3779b97f4a7c15
//! ```
//! Not a cryptographic hash: it tells apart what differs by accident. About 1 ns a word.

use super::hash64;

/// Hash of the words so far; begins with any number.
#[derive(Clone, Copy, Debug)]
pub struct Words(pub u64);

impl Words {
    /// Adds a word.
    pub fn add(&mut self, word: u64) {
        self.0 = hash64(self.0.rotate_left(5) ^ word).wrapping_add(0x9e37_79b9_7f4a_7c15);
    }
    /// Adds the bits of numbers.
    pub fn floats<const N: usize>(&mut self, v: [f32; N]) {
        v.into_iter().for_each(|x| self.add(u64::from(x.to_bits())));
    }
    /// Adds bytes and how many they are.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.add(bytes.len() as u64);
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.add(u64::from_le_bytes(word));
        }
    }
}

impl std::fmt::Write for Words {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        text.bytes().for_each(|byte| self.add(u64::from(byte)));
        Ok(())
    }
}
