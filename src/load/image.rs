//! Image files → [`Texture`]: PNG, JPEG, BMP, TGA, TIFF, 8 bits a channel.
//!
//! Colour is kept sRGB-encoded; the mask is the alpha channel where the image has one, else its red
//! channel, not decoded. Size limits: 32 768 pixels a side, 2 GiB decoded; larger images are
//! refused before they are allocated.

use std::path::Path;

use image::{ImageReader, Limits};

use crate::error::{Error, Result};
use crate::input_file;
use crate::scene::Texture;

const MAX_SIDE: u32 = 32_768;
const MAX_BYTES: u64 = 2 << 30;

/// Reads a texture.
///
/// # Errors
/// [`Error::Io`] when the file cannot be read, [`Error::Image`] when it is no image or too large.
pub fn read_texture(path: &Path) -> Result<Texture> {
    let io = |source| Error::Io { path: path.into(), source };
    input_file::check(path)?;
    let mut reader = ImageReader::open(path).map_err(io)?.with_guessed_format().map_err(io)?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    let image =
        reader.decode().map_err(|e| Error::Image { path: path.into(), message: explain(&e) })?;
    let has_alpha = image.color().has_alpha();
    let rgba = image.into_rgba8();
    let (width, height) = rgba.dimensions();
    let mut texture =
        Texture { name: path.display().to_string(), width, height, ..Texture::default() };
    texture.srgb = rgba.pixels().map(|p| [p[0], p[1], p[2]]).collect();
    texture.mask = rgba.pixels().map(|p| if has_alpha { p[3] } else { p[0] }).collect();
    Ok(texture)
}

fn explain(error: &image::ImageError) -> String {
    match error {
        image::ImageError::Unsupported(_) => {
            "is not a PNG, JPEG, BMP, TGA or TIFF image; convert it".into()
        }
        image::ImageError::Limits(_) => {
            format!("is too large; textures may have at most {MAX_SIDE} pixels a side")
        }
        _ => "is damaged and cannot be decoded; export it again".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(name: &str, image: &image::DynamicImage) -> std::path::PathBuf {
        let path = std::env::temp_dir().join(format!("nearfar-{}-{name}", std::process::id()));
        image.save(&path).unwrap();
        path
    }

    #[test]
    fn alpha_becomes_the_mask_and_else_red() {
        let rgba = image::RgbaImage::from_raw(2, 1, vec![10, 20, 30, 0, 40, 50, 60, 255]).unwrap();
        let path = written("alpha.png", &rgba.into());
        let t = read_texture(&path).unwrap();
        assert_eq!(
            (t.width, t.height, t.srgb, t.mask),
            (2, 1, vec![[10, 20, 30], [40, 50, 60]], vec![0, 255])
        );
        std::fs::remove_file(path).unwrap();
        let rgb = image::RgbImage::from_raw(1, 2, vec![10, 20, 30, 40, 50, 60]).unwrap();
        let path = written("red.png", &rgb.into());
        let t = read_texture(&path).unwrap();
        assert_eq!((t.height, t.srgb[1], t.mask), (2, [40, 50, 60], vec![10, 40]));
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn refuses_what_is_no_image() {
        let path = std::env::temp_dir().join(format!("nearfar-{}-text.png", std::process::id()));
        std::fs::write(&path, "not a picture").unwrap();
        assert!(matches!(read_texture(&path), Err(Error::Image { .. })));
        std::fs::remove_file(&path).unwrap();
        assert!(matches!(read_texture(&path), Err(Error::Io { .. })));
    }
}
