//! Clouds as files: binary little-endian PLY that MeshLab and Blender open, with the names of
//! RenderMan's point clouds.
//!
//! A file has one element `vertex` with `x y z nx ny nz _area`, the byte `_one_sided`, then three
//! floats `NAME_r NAME_g NAME_b` for every channel, then the bytes `red green blue`, which show the
//! first channel at a brightness fit for looking at. Any binary little-endian PLY whose first
//! element is `vertex` can be read, whatever the order of its properties. Positions and normals are
//! needed, and either `_area` or a `radius`; `_one_sided` is 0 where it is missing; triples
//! `NAME_r…` become channels; the rest is passed over.
//!
//! What is written is read back bit for bit. A file is written whole or not at all. Sizes are
//! checked before memory is taken. Positions or areas that are not finite, and areas that are not
//! positive, are errors that name the element. A file takes 28 bytes an element and 12 a channel,
//! and is streamed in both directions.

use std::path::Path;

use glam::Vec3;

use super::{Channel, Cloud};
use crate::error::Result;
use crate::ply::{self, Columns, Element, Property, Reader};
use crate::radiometry::Rgb;
use crate::scene::{Fingerprint, Scene};

/// Writes a cloud with header comments (one line each).
///
/// # Errors
/// [`crate::error::Error::Write`] when the system refuses.
pub fn write_cloud(path: &Path, cloud: &Cloud, comments: &[String]) -> Result<()> {
    let of_channel = |c: &Channel| ["r", "g", "b"].map(|suffix| format!("{}_{suffix}", c.name));
    let columns = Columns::new("vertex")
        .floats(["x", "y", "z", "nx", "ny", "nz", "_area"])
        .bytes(["_one_sided"])
        .floats(cloud.channels.iter().flat_map(of_channel))
        .bytes(["red", "green", "blue"]);
    let shown = cloud.channels.first().map(|c| c.values.as_slice());
    let scale = shown.map_or(1.0, |v| ply::colour_scale(v.iter().copied()));
    ply::write(path, comments, &[(columns, cloud.len())], |out| {
        for i in 0..cloud.len() {
            out.floats(cloud.p[i].to_array())?;
            out.floats(cloud.n[i].to_array())?;
            out.floats([cloud.area[i]])?;
            out.bytes(&[u8::from(cloud.one_sided[i])])?;
            for channel in &cloud.channels {
                out.floats(channel.values[i].to_array())?;
            }
            out.bytes(
                &shown.map_or(ply::colour(Rgb::splat(0.6), 1.0), |v| ply::colour(v[i], scale)),
            )?;
        }
        Ok(())
    })
}

/// Where the numbers of an element stand in a row.
struct Places<'a> {
    position: [&'a Property; 3],
    normal: [&'a Property; 3],
    /// Area, or the radius when that is what the file has.
    size: &'a Property,
    is_radius: bool,
    one_sided: Option<&'a Property>,
    channels: Vec<(&'a str, [&'a Property; 3])>,
}

impl<'a> Places<'a> {
    fn find(points: &'a Element) -> std::result::Result<Self, String> {
        let need = |name: &str| {
            let missing = || format!("has no property \"{name}\"; bake the cloud again");
            points.property(name).ok_or_else(missing)
        };
        let position = [need("x")?, need("y")?, need("z")?];
        let normal = [need("nx")?, need("ny")?, need("nz")?];
        let (size, is_radius) = match (points.property("_area"), points.property("radius")) {
            (Some(p), _) => (p, false),
            (None, Some(p)) => (p, true),
            _ => {
                let missing = "has no property \"_area\" (nor \"radius\"); bake the cloud again";
                return Err(missing.into());
            }
        };
        let channel = |p: &'a Property| {
            let name = p.name.strip_suffix("_r")?;
            let other = |suffix: &str| points.property(&format!("{name}_{suffix}"));
            Some((name, [p, other("g")?, other("b")?]))
        };
        Ok(Self {
            position,
            normal,
            size,
            is_radius,
            one_sided: points.property("_one_sided"),
            channels: points.properties.iter().filter_map(channel).collect(),
        })
    }

    /// Adds the element of a row, or says what is wrong with it.
    fn add(&self, row: &[u8], cloud: &mut Cloud) -> std::result::Result<(), String> {
        let triple = |of: &[&Property; 3]| Vec3::from_array(of.map(|p| p.read(row)));
        let (p, n, size) = (triple(&self.position), triple(&self.normal), self.size.read(row));
        let size = if self.is_radius { std::f32::consts::PI * size * size } else { size };
        if !(p.is_finite() && size.is_finite() && size > 0.0) {
            return Err(format!(
                " has position {p} and area {size}: both must be finite, and the area positive"
            ));
        }
        // A unit normal keeps its bits.
        let n = if (n.length_squared() - 1.0).abs() < 1e-4 { n } else { n.normalize_or_zero() };
        if n == Vec3::ZERO || !n.is_finite() {
            return Err(" has no normal".into());
        }
        cloud.p.push(p);
        cloud.n.push(n);
        cloud.area.push(size);
        cloud.one_sided.push(self.one_sided.is_some_and(|p| p.read(row) != 0.0));
        for ((name, of), channel) in self.channels.iter().zip(&mut cloud.channels) {
            let value = triple(of);
            if !value.is_finite() {
                return Err(format!(": \"{name}\" is not finite"));
            }
            channel.values.push(value);
        }
        Ok(())
    }
}

/// The header comment that names the scene of a cloud.
pub fn scene_comment(scene: &Scene) -> String {
    format!("scene {}", Fingerprint::new(scene))
}

/// The parts in which a scene differs from that of a cloud's file, in words; none when they are the
/// same or the file does not say.
///
/// # Errors
/// As [`read_cloud`], for the header.
pub fn differing_scene(path: &Path, scene: &Scene) -> Result<Option<String>> {
    let comments = Reader::open(path)?.header().comments.clone();
    let baked = comments.iter().find_map(|c| Fingerprint::parse(c.strip_prefix("scene ")?));
    Ok(baked.and_then(|baked| baked.differing(&Fingerprint::new(scene))))
}

/// Reads a cloud.
///
/// # Errors
/// [`crate::error::Error::Io`] when the file cannot be opened or read;
/// [`crate::error::Error::Input`] when it is no such file, cut short or holds impossible values.
pub fn read_cloud(path: &Path) -> Result<Cloud> {
    let mut reader = Reader::open(path)?;
    let points = reader.points()?;
    let places = Places::find(&points).map_err(|message| reader.fault(message))?;
    let count = points.count;
    let channel = |name: &str| Channel { name: name.into(), values: Vec::with_capacity(count) };
    let mut cloud = Cloud {
        p: Vec::with_capacity(count),
        n: Vec::with_capacity(count),
        area: Vec::with_capacity(count),
        one_sided: Vec::with_capacity(count),
        channels: places.channels.iter().map(|(name, _)| channel(name)).collect(),
    };
    let mut row = vec![0u8; points.row];
    for i in 0..count {
        reader.row(&mut row)?;
        places
            .add(&row, &mut cloud)
            .map_err(|m| reader.fault(format!("element {i} (counted from 0){m}")))?;
    }
    Ok(cloud)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(name: &str) -> std::path::PathBuf {
        std::env::temp_dir().join(format!("nearfar-cloud-{}-{name}.ply", std::process::id()))
    }

    fn cloud() -> Cloud {
        let mut cloud = Cloud {
            p: (0..100).map(|i| Vec3::new(i as f32, 0.1 * i as f32, -3.0)).collect(),
            n: (0..100).map(|i| Vec3::new(1.0, i as f32, 2.0).normalize()).collect(),
            area: (0..100).map(|i| 0.01 + i as f32).collect(),
            one_sided: (0..100).map(|i| i % 3 == 0).collect(),
            channels: Vec::new(),
        };
        cloud.set(Cloud::RADIOSITY, (0..100).map(|i| Rgb::new(i as f32, 0.5, 1e-7)).collect());
        cloud.set("albedo", vec![Rgb::splat(0.3); 100]);
        cloud
    }

    #[test]
    fn written_and_read_back() {
        let (path, cloud) = (path("round"), cloud());
        write_cloud(&path, &cloud, &["one\ntwo".into()]).unwrap();
        assert_eq!(read_cloud(&path).unwrap(), cloud);
        let text = std::fs::read(&path).unwrap();
        let header = String::from_utf8_lossy(&text[..600]).into_owned();
        for line in [
            "comment two\n",
            "property float _area\n",
            "property float _radiosity_g\n",
            "property uchar red\n",
        ] {
            assert!(header.contains(line), "{line} in {header}");
        }
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn another_scene_is_known() {
        let (path, scene) = (path("scene"), Scene::default());
        let mut other = scene.clone();
        other.lights.clear();
        other.materials.push(crate::scene::Material::default());
        write_cloud(&path, &cloud(), &[scene_comment(&scene)]).unwrap();
        assert_eq!(differing_scene(&path, &scene).unwrap(), None);
        assert_eq!(differing_scene(&path, &other).unwrap().as_deref(), Some("materials"));
        write_cloud(&path, &cloud(), &[]).unwrap();
        assert_eq!(differing_scene(&path, &other).unwrap(), None);
        std::fs::remove_file(&path).unwrap();
    }

    #[test]
    fn wrong_files_are_told_apart() {
        let (path, cloud) = (path("wrong"), cloud());
        let error = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            let text = read_cloud(&path).unwrap_err().to_string();
            text.rsplit("wrong.ply").next().unwrap().to_owned()
        };
        assert_eq!(error(b"hello\n"), ":1: is not a PLY file");
        assert_eq!(
            error(b"ply\nformat ascii 1.0\n"),
            ":2: format \"ascii\" cannot be read; convert it to binary_little_endian"
        );
        assert_eq!(
            error(b"ply\nelement vertex 3\nproperty float x\n"),
            ":4: the PLY header has no end: the file is cut short"
        );
        assert_eq!(
            error(b"ply\nelement vertex 1\nproperty uchar x\nend_header\n1"),
            ": has no property \"y\"; bake the cloud again"
        );
        write_cloud(&path, &cloud, &[]).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert!(error(&bytes[..bytes.len() / 2]).starts_with(": is cut short"));
        write_cloud(&path, &Cloud { area: vec![f32::NAN; 100], ..cloud }, &[]).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert!(error(&bytes).starts_with(": element 0 (counted from 0) has position"));
        std::fs::remove_file(&path).unwrap();
    }
}
