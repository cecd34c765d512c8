//! Latitude-longitude pictures of skies → [`Environment`]: Radiance `.hdr` and OpenEXR (first layer
//! with R, G, B).

use std::path::Path;

use glam::{Mat3, Vec3};

use crate::error::{Error, Result};
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
        return Err(fail(format!(
            "is {width} texels wide, at most {MAX_WIDTH} are read; scale it down"
        )));
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

fn read_hdr(path: &Path) -> std::result::Result<Pixels, String> {
    let wrong = |e: &dyn std::fmt::Display| format!("is no readable Radiance picture: {e}");
    let file = std::fs::File::open(path).map_err(|e| wrong(&e))?;
    let mut reader =
        image::ImageReader::with_format(std::io::BufReader::new(file), image::ImageFormat::Hdr);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(4 << 30);
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| wrong(&e))?.into_rgb32f();
    let (w, h) = picture.dimensions();
    Ok((w as usize, h as usize, picture.pixels().map(|p| Vec3::from_array(p.0)).collect()))
}

fn read_exr(path: &Path) -> std::result::Result<Pixels, String> {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.width(), size.height(), vec![Vec3::ZERO; size.width() * size.height()]),
            |pixels: &mut Pixels, at, (r, g, b): (f32, f32, f32)| {
                pixels.2[at.y() * pixels.0 + at.x()] = Vec3::new(r, g, b)
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .map_err(|e| format!("is no readable OpenEXR picture with R, G and B: {e}"))?;
    Ok(image.layer_data.channel_data.pixels)
}
