//! Binary little-endian PLY: positions, normals and texture coordinates in single precision, faces
//! of three indices.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use glam::Vec3;

use crate::error::{Error, Result};
use crate::scene::Mesh;

/// Writes those triangles of `mesh`, with their vertices only, and with its normals if `normals` is
/// set and it has some. Texture coordinates have v downwards, as Mitsuba reads them from PLY.
///
/// # Errors
/// [`Error::Io`] when the file cannot be written.
pub fn write(path: &Path, mesh: &Mesh, triangles: &[[u32; 3]], normals: bool) -> Result<()> {
    let mut ids = HashMap::new();
    let mut order = Vec::new();
    let faces: Vec<[u32; 3]> = triangles
        .iter()
        .map(|t| {
            t.map(|v| {
                *ids.entry(v).or_insert_with(|| {
                    order.push(v as usize);
                    order.len() as u32 - 1
                })
            })
        })
        .collect();
    let normals = normals && !mesh.normals.is_empty();
    let uvs = !mesh.uvs.is_empty();
    let row = |v: usize| {
        let mut row = mesh.positions[v].to_array().to_vec();
        if normals {
            row.extend(mesh.normals[v].to_array());
        }
        if uvs {
            row.extend([mesh.uvs[v].x, 1.0 - mesh.uvs[v].y]);
        }
        row
    };
    let mut properties = vec!["x", "y", "z"];
    properties.extend(normals.then_some(["nx", "ny", "nz"]).into_iter().flatten());
    properties.extend(uvs.then_some(["u", "v"]).into_iter().flatten());
    put(path, &properties, order.len(), order.iter().map(|&v| row(v)), &faces)
        .map_err(|source| Error::Io { path: path.into(), source })
}

/// Writes a parallelogram that faces along `edge1 × edge2`.
///
/// # Errors
/// [`Error::Io`] when the file cannot be written.
pub fn write_quad(path: &Path, corner: Vec3, edge1: Vec3, edge2: Vec3) -> Result<()> {
    let corners = [corner, corner + edge1, corner + edge1 + edge2, corner + edge2]
        .map(|p| p.to_array().to_vec());
    put(path, &["x", "y", "z"], 4, corners.into_iter(), &[[0, 1, 2], [0, 2, 3]])
        .map_err(|source| Error::Io { path: path.into(), source })
}

fn put(
    path: &Path,
    properties: &[&str],
    count: usize,
    rows: impl Iterator<Item = Vec<f32>>,
    faces: &[[u32; 3]],
) -> std::io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {count}")?;
    for p in properties {
        writeln!(out, "property float {p}")?;
    }
    writeln!(
        out,
        "element face {}\nproperty list uchar int vertex_indices\nend_header",
        faces.len()
    )?;
    for row in rows {
        for value in row {
            out.write_all(&value.to_le_bytes())?;
        }
    }
    for face in faces {
        out.write_all(&[3])?;
        for i in face {
            out.write_all(&i.to_le_bytes())?;
        }
    }
    out.flush()
}
