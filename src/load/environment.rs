//! Latitude-longitude pictures of skies → [`Environment`]: Radiance `.hdr` and OpenEXR (R, G, B, or
//! those of a layer, or Y, as [`crate::film::read_exr`] finds them).

use std::path::Path;

use glam::{Mat3, Vec3};

use crate::error::{Error, Result};
use crate::input_file;
use crate::radiometry::Rgb;
use crate::scene::Environment;

/// Longest row: 16 k by 8 k texels take 1.5 GiB as read.
const MAX_WIDTH: usize = 16_384;

/// Reads a map and multiplies it by `scale`.
///
/// # Errors
/// [`Error::Image`] for files that are missing, damaged, of another kind, not twice as wide as
/// high, too large, all black, or with texels that are negative or not finite.
pub fn read_environment(path: &Path, scale: Rgb, world_from_map: Mat3) -> Result<Environment> {
    let fail = |message: String| Error::Image { path: path.into(), message };
    if !path.is_file() {
        return Err(fail("does not exist; correct the path of the environment".into()));
    }
    let extension =
        path.extension().map(|x| x.to_string_lossy().to_lowercase()).unwrap_or_default();
    let (width, height, texels) = match extension.as_str() {
        "hdr" | "pic" => read_hdr(path).map_err(fail)?,
        "exr" => read_exr(path).map_err(fail)?,
        _ => {
            return Err(fail(
                "is no environment map; give a Radiance .hdr or an OpenEXR .exr file".into(),
            ));
        }
    };
    if width != 2 * height {
        return Err(fail(format!(
            "has {width} by {height} texels; a latitude-longitude map is twice as wide as high"
        )));
    }
    if width > MAX_WIDTH {
        return Err(fail(too_wide(&format!("{width} by {height}"))));
    }
    let texels: Vec<Rgb> = texels.into_iter().map(|c| c * scale).collect();
    if let Some(i) = texels.iter().position(|c| !c.is_finite() || c.min_element() < 0.0) {
        let c = texels[i];
        return Err(fail(format!(
            "texel ({}, {}) is [{}, {}, {}]; radiance must be finite and not negative: mend the \
             picture",
            i % width,
            i / width,
            c.x,
            c.y,
            c.z
        )));
    }
    if texels.iter().all(|c| c.max_element() <= 0.0) {
        return Err(fail(
            "is all black; give another picture, a larger scale, or remove the light".into(),
        ));
    }
    Ok(Environment {
        name: path.display().to_string(),
        width: width as u32,
        height: height as u32,
        texels,
        world_from_map,
    })
}

type Pixels = (usize, usize, Vec<Rgb>);

/// Radiance pictures: `#?RADIANCE` or `#?RGBE`, values divided by the product of their `EXPOSURE`
/// lines, which is what undoes it.
fn read_hdr(path: &Path) -> std::result::Result<Pixels, String> {
    let wrong = |e: &dyn std::fmt::Display| format!("is no readable Radiance picture: {e}");
    let bytes = input_file::read(path).map_err(|e| wrong(&e))?;
    let end =
        bytes.windows(2).position(|w| w == b"\n\n").ok_or_else(|| wrong(&"it has no header"))?;
    let header = String::from_utf8_lossy(&bytes[..end]);
    if !(header.starts_with("#?RADIANCE") || header.starts_with("#?RGBE")) {
        return Err(wrong(&"it does not begin with #?RADIANCE or #?RGBE"));
    }
    if header.lines().any(|line| line.trim() == "FORMAT=32-bit_rle_xyze") {
        return Err("is in CIE XYZ; convert it to RGB, such as by ra_xyze -r".into());
    }
    let exposures = header.lines().filter_map(|line| line.strip_prefix("EXPOSURE="));
    let exposure: f32 = exposures.filter_map(|x| x.trim().parse::<f32>().ok()).product();
    if !(exposure > 0.0 && exposure.is_finite()) {
        return Err(wrong(&"its EXPOSURE is not above 0"));
    }
    let rest = &bytes[end + 2..];
    let size = rest.split(|&b| b == b'\n').next().unwrap_or(&[]);
    let size = String::from_utf8_lossy(size);
    let sides = size.split_whitespace().filter_map(|word| word.parse::<usize>().ok());
    if sides.max().is_some_and(|side| side > MAX_WIDTH) {
        return Err(too_wide(&size));
    }
    let plain = [b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n", rest].concat();
    let mut reader =
        image::ImageReader::with_format(std::io::Cursor::new(plain), image::ImageFormat::Hdr);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(4 << 30);
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| wrong(&e))?.into_rgb32f();
    let (w, h) = picture.dimensions();
    let texel = |p: &image::Rgb<f32>| Vec3::from_array(p.0) / exposure;
    Ok((w as usize, h as usize, picture.pixels().map(texel).collect()))
}

fn too_wide(size: &str) -> String {
    format!("is of {size} texels, at most {MAX_WIDTH} a side are read; scale it down")
}

fn read_exr(path: &Path) -> std::result::Result<Pixels, String> {
    let film = crate::film::read_exr(path).map_err(|e| match e {
        Error::Image { message, .. } => format!("is no readable sky: {message}"),
        e => e.to_string(),
    })?;
    let texels = film.rgb("").ok_or("has neither R, G and B nor Y; export it with one of them")?;
    Ok((film.width as usize, film.height as usize, texels))
}
