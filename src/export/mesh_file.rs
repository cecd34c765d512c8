//! Meshes as PLY files: positions, normals and texture coordinates in single precision, faces of
//! three indices.

use std::collections::HashMap;
use std::path::Path;

use glam::Vec3;

use crate::error::Result;
use crate::ply::{self, Columns};
use crate::scene::Mesh;

/// Writes those triangles of `mesh`, with their vertices only, and with its normals if `normals` is
/// set and it has some. Texture coordinates have v downwards, as Mitsuba reads them from PLY.
///
/// # Errors
/// [`crate::error::Error::Io`] when the file cannot be written.
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
    let rows: Vec<Vec<f32>> = order.iter().map(|&v| row(v)).collect();
    put(path, &properties, &rows, &faces)
}

/// Writes a parallelogram that faces along `edge1 × edge2`.
///
/// # Errors
/// [`crate::error::Error::Io`] when the file cannot be written.
pub fn write_quad(path: &Path, corner: Vec3, edge1: Vec3, edge2: Vec3) -> Result<()> {
    let corners = [corner, corner + edge1, corner + edge1 + edge2, corner + edge2]
        .map(|p| p.to_array().to_vec());
    put(path, &["x", "y", "z"], &corners, &[[0, 1, 2], [0, 2, 3]])
}

fn put(path: &Path, properties: &[&str], rows: &[Vec<f32>], faces: &[[u32; 3]]) -> Result<()> {
    let vertex = Columns::new("vertex").floats(properties.iter().copied());
    let elements = [(vertex, rows.len()), (Columns::triangles(), faces.len())];
    ply::write(path, &[], &elements, |out| {
        rows.iter().try_for_each(|row| out.floats(row.iter().copied()))?;
        faces.iter().try_for_each(|&face| out.triangle(face))
    })
}
