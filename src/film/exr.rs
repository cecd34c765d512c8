//! Films to and from OpenEXR: one part, dotted channel names, 32-bit float, ZIP, text attributes.
//!
//! Guarantees a file appears whole or not at all (written beside its place, then renamed); what is
//! written is read back equal, bit for bit, for finite values in 32 bits; equal films are equal
//! files.
//! Channel names are the film's, set by [`Film::set_rgb`], [`Film::set_xyz`] and [`Film::set`].
//! Of foreign files [`read_exr`] reads all flat parts, their largest level.
//! Not        deep data; channels of other sizes than their layer (chroma of half resolution).

use std::collections::{BTreeMap, HashMap};
use std::io::Write as _;
use std::ops::Range;
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, IntegerBounds, Layer,
    LayerAttributes, LineOrder, ReadChannels as _, ReadLayers as _, Text, WritableImage as _, f16,
};

use super::Film;
use super::checksum::{CHECKSUM, Checksum};
use super::order::sort_attributes;
use glam::DVec3;

use crate::atomic_file;
use crate::error::{Error, Result};
use crate::{input_file, memory};

/// Most pixels that are read: 2²⁸.
const MAX_PIXELS: u64 = 1 << 28;
/// Bytes of pixels that a byte of a file can stand for; deflate has 1032, wavelets on black more.
const MOST_PER_BYTE: u64 = 1 << 14;

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

/// Writes all channels and the header; positions in the user's space.
///
/// # Errors
/// [`Error::Image`] when a channel's length is not width · height or the film is empty;
/// [`Error::Write`] when the system refuses.
pub fn write_exr(film: &Film, path: &Path, precision: Precision) -> Result<()> {
    let fail = |message: String| Error::Image { path: path.into(), message };
    let count = film.width as usize * film.height as usize;
    if count == 0 || film.channels.is_empty() {
        return Err(fail("an image without pixels or channels cannot be written".into()));
    }
    if film.origin != DVec3::ZERO {
        let mut film = film.clone();
        film.rebase(DVec3::ZERO);
        return write_exr(&film, path, precision);
    }
    let plain = |text: &str| -> String {
        text.chars().map(|c| if c.is_ascii() { c } else { '?' }).collect()
    };
    let mut header: BTreeMap<String, String> =
        film.header.iter().map(|(key, value)| (plain(key), plain(value))).collect();
    let mut checksum = Checksum::new((film.width, film.height), &header);
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
        checksum.channel(name, samples.values_as_f32());
        let name = Text::new_or_none(name)
            .ok_or_else(|| fail(format!("channel name {name:?} is not Latin-1")))?;
        list.push(AnyChannel::new(name, samples));
    }
    let mut attributes = LayerAttributes::default();
    header.insert(CHECKSUM.into(), checksum.finish());
    for (key, value) in header {
        if let (Some(key), Some(value)) = (Text::new_or_none(key), Text::new_or_none(value)) {
            attributes.other.insert(key, AttributeValue::Text(value));
        }
    }
    let layer = Layer::new(
        (film.width as usize, film.height as usize),
        attributes,
        Encoding { line_order: LineOrder::Increasing, ..Encoding::SMALL_FAST_LOSSLESS },
        AnyChannels::sort(list.into()),
    );
    atomic_file::write(path, |out| {
        let written = exr::prelude::Image::from_layer(layer).write().to_buffered(&mut *out);
        written.map_err(|e| match e {
            exr::error::Error::Io(e) => e,
            e => std::io::Error::other(e.to_string()),
        })?;
        out.flush()?;
        sort_attributes(out.get_mut())
    })
}

/// Reads a file as it is meant to be shown: what lies in the data window goes to its place in the
/// display window, outside it there are zeros. Every channel as 32-bit float, every text attribute;
/// channels of parts after the first have the part's name before theirs. Where there is no R, G, B,
/// they are those of the first layer that has them, or all of them Y.
///
/// # Errors
/// [`Error::Input`] for a pipe; [`Error::Image`] when the file is missing, is no EXR, is damaged,
/// or claims to be larger than it can be.
pub fn read_exr(path: &Path) -> Result<Film> {
    let mut film = read(path)?;
    name_beauty(&mut film);
    Ok(film)
}

/// Reads a file that [`write_exr`] wrote, if it is as it was written.
///
/// # Errors
/// As [`read_exr`], and when the checksum is missing or that of another content.
pub fn read_whole_exr(path: &Path) -> Result<Film> {
    let fail = |message: &str| Err(Error::Image { path: path.into(), message: message.into() });
    let film = read(path)?;
    let mut checksum = Checksum::new((film.width, film.height), &film.header);
    film.channels.iter().for_each(|(name, values)| checksum.channel(name, values.iter().copied()));
    match film.header.get(CHECKSUM) {
        None => fail("has no checksum: it was not written by this program, or by an earlier one"),
        Some(there) if *there != checksum.finish() => {
            fail("is damaged: its content is not what its checksum says; remove it and start anew")
        }
        Some(_) => Ok(film),
    }
}

/// The text attributes of a file.
///
/// # Errors
/// [`Error::Input`] for a pipe; [`Error::Image`] when the file is missing or no EXR.
pub fn read_header(path: &Path) -> Result<BTreeMap<String, String>> {
    refuse_pipes(path)?;
    let meta = exr::meta::MetaData::read_from_file(path, false)
        .map_err(|e| Error::Image { path: path.into(), message: reason(e) })?;
    let attributes = meta
        .headers
        .iter()
        .flat_map(|h| texts(&h.shared_attributes.other).chain(texts(&h.own_attributes.other)));
    Ok(attributes.collect())
}

/// A file that is missing is told by who opens it.
fn refuse_pipes(path: &Path) -> Result<()> {
    match input_file::check(path) {
        Err(Error::Io { .. }) => Ok(()),
        other => other.map(drop),
    }
}

fn read(path: &Path) -> Result<Film> {
    let fail = |message: String| Error::Image { path: path.into(), message };
    refuse_pipes(path)?;
    check_size(path).map_err(fail)?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_file(path)
        .map_err(|e| fail(reason(e)))?;
    let window = image.attributes.display_window;
    let mut film = Film::new(window.size.0 as u32, window.size.1 as u32);
    for (number, layer) in image.layer_data.into_iter().enumerate() {
        let Place { columns, rows, skip } = place(&layer, window);
        let part = layer.attributes.layer_name.as_ref().map(Text::to_string);
        for channel in layer.channel_data.list {
            let name = channel.name.to_string();
            let name = match &part {
                Some(part) if number > 0 && !name.starts_with(&format!("{part}.")) => {
                    format!("{part}.{name}")
                }
                _ => name,
            };
            let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
            let whole = layer.size.0 * layer.size.1 == values.len();
            if !whole || film.channels.contains_key(&name) {
                continue;
            }
            let mut shown = vec![0.0; window.size.0 * window.size.1];
            for y in rows.clone() {
                let from = (y - rows.start + skip.1) * layer.size.0 + skip.0;
                let to = y * window.size.0 + columns.start;
                shown[to..to + columns.len()].copy_from_slice(&values[from..from + columns.len()]);
            }
            film.channels.insert(name, shown);
        }
        film.header.extend(texts(&layer.attributes.other));
    }
    film.header.extend(texts(&image.attributes.other));
    Ok(film)
}

fn texts(
    attributes: &HashMap<Text, AttributeValue>,
) -> impl Iterator<Item = (String, String)> + '_ {
    attributes.iter().filter_map(|(key, value)| match value {
        AttributeValue::Text(text) => Some((key.to_string(), text.to_string())),
        _ => None,
    })
}

/// Where a layer lies in a display window.
struct Place {
    /// Columns and rows of the window that it covers.
    columns: Range<usize>,
    rows: Range<usize>,
    /// Columns and rows of the layer that lie before the window; at most all.
    skip: (usize, usize),
}

fn place(layer: &Layer<AnyChannels<FlatSamples>>, window: IntegerBounds) -> Place {
    let along = |start: i32, size: usize, window_start: i32, window_size: usize| {
        let start = i64::from(start) - i64::from(window_start);
        let clip = |x: i64| x.clamp(0, window_size as i64) as usize;
        let range = clip(start)..clip(start + size as i64);
        (range, (-start).clamp(0, size as i64) as usize)
    };
    let at = layer.attributes.layer_position;
    let (columns, skip_x) = along(at.0, layer.size.0, window.position.0, window.size.0);
    let (rows, skip_y) = along(at.1, layer.size.1, window.position.1, window.size.1);
    Place { columns, rows, skip: (skip_x, skip_y) }
}

/// Refuses files that claim more pixels than fit memory or than their bytes can hold.
fn check_size(path: &Path) -> std::result::Result<(), String> {
    let meta = exr::meta::MetaData::read_from_file(path, false).map_err(reason)?;
    let bytes = std::fs::metadata(path).map_or(0, |m| m.len());
    let mut decoded = 0u64;
    let mut largest = 0u64;
    let mut held = 0.0;
    for header in &meta.headers {
        let pixels = |w: usize, h: usize| (w as u64).saturating_mul(h as u64);
        let window = header.shared_attributes.display_window.size;
        let shown = pixels(window.0, window.1);
        let stored = pixels(header.layer_size.0, header.layer_size.1);
        let channels = header.channels.list.len().max(1) as u64;
        largest = largest.max(shown).max(stored);
        decoded = decoded.saturating_add(stored.saturating_mul(2 * channels));
        held += (stored + shown) as f64 * 4.0 * channels as f64;
    }
    if largest > MAX_PIXELS {
        return Err(format!("claims {largest} pixels; at most {MAX_PIXELS} are read"));
    }
    if decoded > bytes.saturating_mul(MOST_PER_BYTE) {
        return Err("is damaged: it has too few bytes for the pixels it claims".into());
    }
    if !memory::fits(held) {
        return Err(format!("needs {}, more than memory holds", memory::size(held)));
    }
    Ok(())
}

/// Gives a film R, G and B if it has none.
fn name_beauty(film: &mut Film) {
    if film.channels.contains_key("R") {
        return;
    }
    let has = |layer: &str, suffix: &str| film.channels.contains_key(&format!("{layer}.{suffix}"));
    let names = film.channels.keys().filter_map(|name| name.strip_suffix(".R"));
    let layer = names.filter(|l| has(l, "G") && has(l, "B")).min_by_key(|l| l.len());
    let from = match layer {
        Some(layer) => ["R", "G", "B"].map(|suffix| format!("{layer}.{suffix}")),
        None if film.channels.contains_key("Y") => ["Y"; 3].map(String::from),
        None => return,
    };
    for (name, from) in ["R", "G", "B"].into_iter().zip(from) {
        let values = film.channels[&from].clone();
        film.channels.insert(name.into(), values);
    }
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

    /// Several tiles, compressed by several threads, and attributes in a map without an order.
    #[test]
    fn equal_films_are_equal_files() {
        let name = |i: i32| format!("nearfar-equal-{}-{i}.exr", std::process::id());
        let mut film = Film::new(600, 300);
        film.set("samples", (0..180_000).map(|i| (i % 977) as f32).collect());
        (0..20).for_each(|i| drop(film.header.insert(format!("key{i}"), i.to_string())));
        let [first, second] = [0, 1].map(|i| {
            let path = std::env::temp_dir().join(name(i));
            write_exr(&film, &path, Precision::Full).unwrap();
            let bytes = std::fs::read(&path).unwrap();
            assert_eq!(read_whole_exr(&path).unwrap().channels, film.channels);
            std::fs::remove_file(&path).unwrap();
            bytes
        });
        assert!(first == second);
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

    /// A part of 2×2 pixels in a window of 4×3, then one that sticks out of it.
    #[test]
    fn data_windows_and_foreign_names() {
        use exr::prelude::{Image, ImageAttributes, SpecificChannels, Vec2};
        let path = std::env::temp_dir().join(format!("nearfar-window-{}.exr", std::process::id()));
        let written = |at: Vec2<i32>| {
            let pixels = |p: Vec2<usize>| (1.0 + p.0 as f32 + 2.0 * p.1 as f32,);
            let channels = SpecificChannels::build().with_channel("Y").with_pixel_fn(pixels);
            let window = IntegerBounds::from_dimensions((4, 3));
            let attributes = LayerAttributes { layer_position: at, ..Default::default() };
            let layer = Layer::new((2, 2), attributes, Encoding::UNCOMPRESSED, channels);
            let image = Image::new(ImageAttributes::new(window), layer);
            image.write().to_file(&path).unwrap();
            let film = read_exr(&path).unwrap();
            assert_eq!((film.width, film.height), (4, 3));
            assert!(film.channels["R"] == film.channels["Y"]);
            film.channels["G"].clone()
        };
        assert_eq!(written(Vec2(1, 1)), [0., 0., 0., 0., 0., 1., 2., 0., 0., 3., 4., 0.]);
        assert_eq!(written(Vec2(-1, 2)), [0., 0., 0., 0., 0., 0., 0., 0., 2., 0., 0., 0.]);
        for aside in [Vec2(-900, 1), Vec2(1, -900), Vec2(900, 0), Vec2(0, 900), Vec2(-2, -2)] {
            assert_eq!(written(aside), [0.0; 12], "{aside:?}");
        }
        let mut film = Film::new(1, 1);
        film.set_rgb("ViewLayer.Combined", &[Rgb::new(1.0, 2.0, 3.0)]);
        write_exr(&film, &path, Precision::Full).unwrap();
        assert_eq!(read_exr(&path).unwrap().rgb("").unwrap(), [Rgb::new(1.0, 2.0, 3.0)]);
        std::fs::remove_file(&path).unwrap();
    }
}
