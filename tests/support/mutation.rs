//! Changed copies of good files: bytes flipped, replaced, cut out, doubled, and numbers made
//! extreme, in binary files as words, in texts as words of the text.

use nearfar::sampling::{Rng, Stream};

const WORDS: [u32; 8] = [0, 1, u32::MAX, 1 << 31, 0x7fff_ffff, 1 << 30, 0x7f80_0000, 0xffc0_0000];
const NUMBERS: [&str; 14] = [
    "0",
    "-0",
    "-1",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e39",
    "1e-45",
    "1e-320",
    "4294967296",
    "18446744073709551616",
    "0.1",
];
const BYTES: &[u8] = b"0123456789-+./ \n\tefvnaxi#\"'[]{}=$\\\0\xff";

/// A copy of `good` with one to six changes; the same for the same number of the case.
pub fn mutated(good: &[u8], case: u64) -> Vec<u8> {
    let mut bytes = good.to_vec();
    let mut rng = Rng::new(7, Stream::Test, case, 0);
    let text = std::str::from_utf8(good).is_ok();
    for _ in 0..=rng.below(6) {
        if bytes.len() < 8 {
            break;
        }
        let at = rng.below(bytes.len() - 4);
        let end = (at + 1 + rng.below(40)).min(bytes.len());
        match rng.below(7) {
            0 => bytes[at] ^= 1 << rng.below(8),
            1 if text => bytes[at] = BYTES[rng.below(BYTES.len())],
            1 => bytes[at] = rng.next_u64() as u8,
            2 if text => extreme(&mut bytes, at, NUMBERS[rng.below(NUMBERS.len())]),
            2 => bytes[at..at + 4].copy_from_slice(&WORDS[rng.below(WORDS.len())].to_le_bytes()),
            3 => drop(bytes.drain(at..end)),
            4 => {
                let again = bytes[at..end].to_vec();
                drop(bytes.splice(at..at, again));
            }
            5 => bytes.insert(at, BYTES[rng.below(BYTES.len())]),
            _ => bytes.truncate(at.max(bytes.len() / 2)),
        }
    }
    bytes
}

/// Replaces the first number at or after a place.
fn extreme(bytes: &mut Vec<u8>, at: usize, number: &str) {
    let of_number = |b: &u8| b.is_ascii_digit() || *b == b'.';
    if let Some(skip) = bytes[at..].iter().position(of_number) {
        let start = at + skip;
        let length = bytes[start..].iter().take_while(|b| of_number(b)).count();
        drop(bytes.splice(start..start + length, number.bytes()));
    }
}
