//! A column as text: bytes of equal weight together, DEFLATE (zlib), base64.

use std::io::Write;

use base64::prelude::{BASE64_STANDARD, Engine as _};
use flate2::Compression;
use flate2::write::ZlibEncoder;

/// `bytes` holds numbers of `size` bytes each.
pub(super) fn column(bytes: &[u8], size: usize) -> String {
    let planes: Vec<u8> =
        (0..size).flat_map(|k| bytes.iter().skip(k).step_by(size).copied()).collect();
    let mut encoder = ZlibEncoder::new(Vec::with_capacity(planes.len() / 2), Compression::new(4));
    // Writing to memory cannot fail.
    let packed = encoder.write_all(&planes).and_then(|()| encoder.finish()).unwrap_or_default();
    BASE64_STANDARD.encode(packed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn planes_come_back() {
        let bytes: Vec<u8> = (0..40_000u32).flat_map(|i| (i as f32).sqrt().to_le_bytes()).collect();
        let text = column(&bytes, 4);
        let mut planes = Vec::new();
        flate2::read::ZlibDecoder::new(&BASE64_STANDARD.decode(&text).unwrap()[..])
            .read_to_end(&mut planes)
            .unwrap();
        let back: Vec<u8> = (0..bytes.len()).map(|i| planes[i % 4 * 40_000 + i / 4]).collect();
        assert_eq!(back, bytes);
        assert!(text.len() < bytes.len() * 4 / 5, "{}", text.len());
        assert_eq!(BASE64_STANDARD.decode(column(&[], 4)).unwrap().len(), 8);
    }
}
