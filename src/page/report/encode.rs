//! Pictures as text for a page: half floats and bytes in PNG in base64.
//!
//! A colour is three half floats (11 significant bits, rounded to 9: 0.25 % of the value at worst,
//! said on the page). The PNG is twice the picture's height: above the high bytes of R, G, B, below
//! the low bytes. Every browser decodes an opaque 8-bit PNG without a colour profile to exactly
//! these bytes; an alpha channel would be premultiplied and lose them.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use half::f16;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _};

use crate::error::{Error, Result};
use crate::radiometry::Rgb;

fn png(bytes: &[u8], width: u32, height: u32, color: ExtendedColorType) -> Result<String> {
    let mut out = Vec::new();
    PngEncoder::new_with_quality(&mut out, CompressionType::Best, FilterType::Adaptive)
        .write_image(bytes, width, height, color)
        .map_err(|e| {
            Error::Render(format!("page: {width}×{height} pixels cannot be encoded: {e}"))
        })?;
    Ok(STANDARD.encode(out))
}

/// The half float nearest to `v` with 8 bits behind the leading one; values beyond the range at its
/// end.
fn rounded(v: f32) -> u16 {
    if v.is_nan() {
        return f16::NAN.to_bits();
    }
    let bits = f16::from_f32(v.clamp(-65504.0, 65504.0)).to_bits();
    let sum = (bits & 0x7fff) + 2;
    (bits & 0x8000) | (sum.min(0x7bff) & !3)
}

/// Linear colours: `width` × 2 `height` pixels.
///
/// # Errors
/// When the encoder fails.
pub(super) fn colors(pixels: &[Rgb], width: u32, height: u32) -> Result<String> {
    let bits: Vec<u16> = pixels.iter().flat_map(|c| c.to_array().map(rounded)).collect();
    let bytes: Vec<u8> =
        bits.iter().map(|b| (b >> 8) as u8).chain(bits.iter().map(|b| *b as u8)).collect();
    png(&bytes, width, 2 * height, ExtendedColorType::Rgb8)
}

/// Values from 0 to 1 in 8 bits: `width` × `height` pixels.
///
/// # Errors
/// When the encoder fails.
pub(super) fn map(values: &[f32], width: u32, height: u32) -> Result<String> {
    let bytes: Vec<u8> = values.iter().map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8).collect();
    png(&bytes, width, height, ExtendedColorType::L8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_keeps_a_quarter_of_a_percent() {
        for i in 0..4000 {
            let v = 1e-3 * 1.004f32.powi(i);
            let back = f16::from_bits(rounded(v)).to_f32();
            // Two roundings: to 11 bits, then to 9.
            assert!(
                v > 65000.0 || (back / v - 1.0).abs() <= 1.0 / 512.0 + 1.0 / 2048.0,
                "{v} {back}"
            );
        }
        assert_eq!(f16::from_bits(rounded(-0.75)).to_f32(), -0.75);
        assert_eq!(rounded(0.0), 0);
        assert!(f16::from_bits(rounded(f32::NAN)).is_nan());
        assert!(f16::from_bits(rounded(f32::INFINITY)).is_finite());
    }

    #[test]
    fn bytes_come_back() {
        let pixels = [Rgb::new(0.5, 1.0, 2.0), Rgb::new(0.0, 3.0, 100.0)];
        let png = STANDARD.decode(colors(&pixels, 2, 1).unwrap()).unwrap();
        let image = image::load_from_memory(&png).unwrap().to_rgb8();
        assert_eq!(image.dimensions(), (2, 2));
        for (x, pixel) in pixels.iter().enumerate() {
            for channel in 0..3 {
                let [high, low] =
                    [0, 1].map(|y| u16::from(image.get_pixel(x as u32, y).0[channel]));
                assert_eq!(f16::from_bits(high << 8 | low).to_f32(), pixel.to_array()[channel]);
            }
        }
    }
}
