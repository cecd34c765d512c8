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

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::Path;

use glam::Vec3;

use super::ply_header::{Property, header};
use super::{Channel, Cloud};
use crate::error::{Error, Result};
use crate::radiometry::Rgb;

/// Writes a cloud with header comments (one line each).
///
/// # Errors
/// [`Error::Io`] when the system refuses.
pub fn write_cloud(path: &Path, cloud: &Cloud, comments: &[String]) -> Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let part = path.with_file_name(name);
    write(&part, cloud, comments).and_then(|()| std::fs::rename(&part, path)).map_err(|source| {
        drop(std::fs::remove_file(&part));
        Error::Io { path: path.into(), source }
    })
}

fn write(path: &Path, cloud: &Cloud, comments: &[String]) -> std::io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    write!(out, "ply\nformat binary_little_endian 1.0\n")?;
    for line in comments.iter().flat_map(|c| c.lines()) {
        writeln!(out, "comment {line}")?;
    }
    writeln!(out, "element vertex {}", cloud.len())?;
    for name in ["x", "y", "z", "nx", "ny", "nz", "_area"] {
        writeln!(out, "property float {name}")?;
    }
    writeln!(out, "property uchar _one_sided")?;
    for channel in &cloud.channels {
        for suffix in ["r", "g", "b"] {
            writeln!(out, "property float {}_{suffix}", channel.name)?;
        }
    }
    for name in ["red", "green", "blue"] {
        writeln!(out, "property uchar {name}")?;
    }
    writeln!(out, "end_header")?;
    let shown = cloud.channels.first().map(|c| c.values.as_slice());
    let mean = shown.map_or(0.0, |v| {
        v.iter().map(|c| f64::from(c.element_sum() / 3.0)).sum::<f64>() / v.len().max(1) as f64
    });
    let scale = if mean > 0.0 { (0.2 / mean) as f32 } else { 1.0 };
    for i in 0..cloud.len() {
        for value in
            cloud.p[i].to_array().into_iter().chain(cloud.n[i].to_array()).chain([cloud.area[i]])
        {
            out.write_all(&value.to_le_bytes())?;
        }
        out.write_all(&[u8::from(cloud.one_sided[i])])?;
        for channel in &cloud.channels {
            for value in channel.values[i].to_array() {
                out.write_all(&value.to_le_bytes())?;
            }
        }
        let colour = shown.map_or(Rgb::splat(0.6), |v| v[i] * scale);
        out.write_all(
            &colour.to_array().map(|v| (v.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0 + 0.5) as u8),
        )?;
    }
    out.into_inner().map_err(std::io::IntoInnerError::into_error)?.sync_all()
}

/// Reads a cloud.
///
/// # Errors
/// [`Error::Io`] when the file cannot be opened or read, [`Error::Input`] when it is no such file,
/// cut short or holds impossible values.
pub fn read_cloud(path: &Path) -> Result<Cloud> {
    let io = |source| Error::Io { path: path.into(), source };
    let bad = |line: Option<usize>, message: String| Error::input(path, line, message);
    let file = File::open(path).map_err(io)?;
    let length = file.metadata().map_err(io)?.len();
    let mut input = BufReader::with_capacity(1 << 20, file);
    let header = header(&mut input).map_err(|(line, message)| bad(line, message))?;
    if header.row as u64 * header.count as u64 > length {
        return Err(bad(
            None,
            format!(
                "is cut short: {} elements of {} B do not fit {length} B",
                header.count, header.row
            ),
        ));
    }
    let find = |name: &str| header.properties.iter().find(|p| p.name == name);
    let need = |name: &str| {
        find(name)
            .ok_or_else(|| bad(None, format!("has no property \"{name}\"; bake the cloud again")))
    };
    let place = [need("x")?, need("y")?, need("z")?];
    let normal = [need("nx")?, need("ny")?, need("nz")?];
    let (area, is_radius) = match (find("_area"), find("radius")) {
        (Some(p), _) => (p, false),
        (None, Some(p)) => (p, true),
        _ => {
            return Err(bad(
                None,
                "has no property \"_area\" (nor \"radius\"); bake the cloud again".into(),
            ));
        }
    };
    let one_sided = find("_one_sided");
    let channels: Vec<(&str, [&Property; 3])> = header
        .properties
        .iter()
        .filter_map(|p| {
            let name = p.name.strip_suffix("_r")?;
            Some((name, [p, find(&format!("{name}_g"))?, find(&format!("{name}_b"))?]))
        })
        .collect();
    let mut cloud = Cloud {
        p: Vec::with_capacity(header.count),
        n: Vec::with_capacity(header.count),
        area: Vec::with_capacity(header.count),
        one_sided: Vec::with_capacity(header.count),
        channels: channels
            .iter()
            .map(|(name, _)| Channel {
                name: (*name).into(),
                values: Vec::with_capacity(header.count),
            })
            .collect(),
    };
    let mut row = vec![0u8; header.row];
    let triple = |row: &[u8], of: &[&Property; 3]| Vec3::from_array(of.map(|p| p.read(row)));
    for i in 0..header.count {
        input.read_exact(&mut row).map_err(|e| {
            if e.kind() == std::io::ErrorKind::UnexpectedEof {
                bad(None, "is cut short".into())
            } else {
                io(e)
            }
        })?;
        let (p, n, size) = (triple(&row, &place), triple(&row, &normal), area.read(&row));
        let size = if is_radius { std::f32::consts::PI * size * size } else { size };
        if !(p.is_finite() && size.is_finite() && size > 0.0) {
            return Err(bad(
                None,
                format!(
                    "element {i} (counted from 0) has position {p} and area {size}: \
                     both must be finite, and the area positive"
                ),
            ));
        }
        // A unit normal keeps its bits.
        let n = if (n.length_squared() - 1.0).abs() < 1e-4 { n } else { n.normalize_or_zero() };
        if n == Vec3::ZERO || !n.is_finite() {
            return Err(bad(None, format!("element {i} (counted from 0) has no normal")));
        }
        cloud.p.push(p);
        cloud.n.push(n);
        cloud.area.push(size);
        cloud.one_sided.push(one_sided.is_some_and(|p| p.read(&row) != 0.0));
        for ((name, of), channel) in channels.iter().zip(&mut cloud.channels) {
            let value = triple(&row, of);
            if !value.is_finite() {
                return Err(bad(
                    None,
                    format!("element {i} (counted from 0): \"{name}\" is not finite"),
                ));
            }
            channel.values.push(value);
        }
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
            ":4: the header has no end"
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
