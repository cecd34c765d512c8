//! Films to and from OpenEXR: one part, dotted channel names, 32-bit float, ZIP, text attributes.
//!
//! Guarantees a file appears whole or not at all (written beside its place, then renamed); what is
//! written is read back equal, bit for bit, for finite values in 32 bits.
//! Channel names are the film's, set by [`Film::set_rgb`], [`Film::set_xyz`] and [`Film::set`].
//! Not        deep data, several parts, mip levels: the first part's largest level is read.

use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Layer, LayerAttributes,
    ReadChannels as _, ReadLayers as _, Text, WritableImage as _, f16,
};

use super::Film;
use crate::atomic_file;
use crate::error::{Error, Result};

/// Bits of a stored channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// 32-bit float.
    #[default]
    Full,
    /// 16-bit float, for small committed files. Positions, depths, variances, counts and ids stay
    /// 32 bits.
    Half,
}

fn stays_full(name: &str) -> bool {
    let layer = name.split('.').next().unwrap_or(name);
    ["P", "depth", "variance", "samples", "cluster", "state"].contains(&layer)
}

/// Writes all channels and the header.
///
/// # Errors
/// [`Error::Image`] when a channel's length is not width · height or the film is empty;
/// [`Error::Io`] when the system refuses.
pub fn write_exr(film: &Film, path: &Path, precision: Precision) -> Result<()> {
    let fail = |message: String| Error::Image { path: path.into(), message };
    let count = film.width as usize * film.height as usize;
    if count == 0 || film.channels.is_empty() {
        return Err(fail("an image without pixels or channels cannot be written".into()));
    }
    let mut list = Vec::with_capacity(film.channels.len());
    for (name, values) in &film.channels {
        if values.len() != count {
            return Err(fail(format!(
                "channel {name} has {} values for {}×{} pixels",
                values.len(),
                film.width,
                film.height
            )));
        }
        let samples = if precision == Precision::Half && !stays_full(name) {
            FlatSamples::F16(values.iter().map(|&v| f16::from_f32(v)).collect())
        } else {
            FlatSamples::F32(values.clone())
        };
        let name = Text::new_or_none(name)
            .ok_or_else(|| fail(format!("channel name {name:?} is not Latin-1")))?;
        list.push(AnyChannel::new(name, samples));
    }
    let mut attributes = LayerAttributes::default();
    for (key, value) in &film.header {
        let plain: String = value.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect();
        if let (Some(key), Some(value)) = (Text::new_or_none(key), Text::new_or_none(plain)) {
            attributes.other.insert(key, AttributeValue::Text(value));
        }
    }
    let layer = Layer::new(
        (film.width as usize, film.height as usize),
        attributes,
        Encoding::SMALL_FAST_LOSSLESS,
        AnyChannels::sort(list.into()),
    );
    if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty() && !p.is_dir()) {
        return Err(fail(format!("folder {} does not exist: create it first", folder.display())));
    }
    atomic_file::write(path, |out| {
        exr::prelude::Image::from_layer(layer).write().to_buffered(out).map_err(|e| match e {
            exr::error::Error::Io(e) => e,
            e => std::io::Error::other(reason(e)),
        })
    })
}

/// Reads the first part of a file: every channel as 32-bit float, every text attribute.
///
/// # Errors
/// [`Error::Image`] when the file is missing, is no EXR, or is damaged.
pub fn read_exr(path: &Path) -> Result<Film> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .map_err(|e| Error::Image { path: path.into(), message: reason(e) })?;
    let layer = image.layer_data;
    let mut film = Film::new(layer.size.0 as u32, layer.size.1 as u32);
    for channel in layer.channel_data.list {
        film.channels
            .insert(channel.name.to_string(), channel.sample_data.values_as_f32().collect());
    }
    for (key, value) in image.attributes.other.iter().chain(&layer.attributes.other) {
        if let AttributeValue::Text(text) = value {
            film.header.insert(key.to_string(), text.to_string());
        }
    }
    Ok(film)
}

fn reason(error: exr::error::Error) -> String {
    match error {
        exr::error::Error::Io(e) if e.kind() == std::io::ErrorKind::NotFound => {
            "no such file".into()
        }
        e => format!("not a readable OpenEXR image: {e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radiometry::Rgb;

    fn film() -> Film {
        let mut film = Film::new(3, 2);
        let colors: Vec<Rgb> =
            (0..6).map(|i| Rgb::new(i as f32 / 3.0, 1e-30, 70_000.5 * i as f32)).collect();
        film.set_rgb("", &colors);
        film.set_rgb("direct", &colors);
        film.set_xyz("P", &colors);
        film.set("depth.Z", vec![1e9, 2.0, 3.0, f32::INFINITY, 5.0, -0.0]);
        film.header.insert("nearfar.settings".into(), "alpha = 0.1\nseed = 3".into());
        film
    }

    #[test]
    fn round_trip_is_exact() {
        let path = std::env::temp_dir().join(format!("nearfar-film-{}.exr", std::process::id()));
        let film = film();
        write_exr(&film, &path, Precision::Full).unwrap();
        let back = read_exr(&path).unwrap();
        let bits = |f: &Film| {
            f.channels
                .iter()
                .map(|(k, v)| (k.clone(), v.iter().map(|x| x.to_bits()).collect::<Vec<_>>()))
                .collect::<Vec<_>>()
        };
        assert_eq!((back.width, back.height), (3, 2));
        assert_eq!(bits(&back), bits(&film));
        assert_eq!(back.header.get("nearfar.settings"), film.header.get("nearfar.settings"));
        let names: Vec<_> = back.channels.keys().map(String::as_str).collect();
        assert_eq!(
            names,
            ["B", "G", "P.X", "P.Y", "P.Z", "R", "depth.Z", "direct.B", "direct.G", "direct.R"]
        );

        write_exr(&film, &path, Precision::Half).unwrap();
        let half = read_exr(&path).unwrap();
        assert_eq!(half.channels["P.X"], film.channels["P.X"]);
        assert!(
            (half.channels["R"][1] - 1.0 / 3.0).abs() < 2e-4 && half.channels["R"][1] != 1.0 / 3.0
        );
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn failures_leave_nothing_and_say_why() {
        let folder = std::env::temp_dir().join(format!("nearfar-none-{}", std::process::id()));
        let error =
            write_exr(&film(), &folder.join("a.exr"), Precision::Full).unwrap_err().to_string();
        assert!(error.contains("does not exist"), "{error}");
        assert!(read_exr(&folder.join("a.exr")).unwrap_err().to_string().contains("no such file"));
        let mut short = film();
        short.set("samples", vec![1.0]);
        std::fs::create_dir(&folder).unwrap();
        assert!(
            write_exr(&short, &folder.join("a.exr"), Precision::Full)
                .unwrap_err()
                .to_string()
                .contains("channel samples has 1 values for 3×2")
        );
        std::fs::write(folder.join("text.exr"), "hello").unwrap();
        assert!(
            read_exr(&folder.join("text.exr"))
                .unwrap_err()
                .to_string()
                .contains("not a readable OpenEXR")
        );
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
