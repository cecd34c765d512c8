//! Meshes as PLY files: positions, normals and texture coordinates in single precision, faces of
//! three indices.

use std::collections::HashMap;
use std::path::Path;

use glam::Vec3;

use crate::error::Result;
use crate::ply::{self, Columns};
use crate::scene::Mesh;

/// Writes those triangles of `mesh`, with their vertices only, and with its normals if `normals` is
/// set and it has some; a vertex without one gets that of each of its faces. Texture coordinates
/// have v downwards, as Mitsuba reads them from PLY.
///
/// # Errors
/// [`crate::error::Error::Write`] when the file cannot be written.
pub fn write(path: &Path, mesh: &Mesh, triangles: &[[u32; 3]], normals: bool) -> Result<()> {
    let normals = normals && !mesh.normals.is_empty();
    let uvs = !mesh.uvs.is_empty();
    let mut ids = HashMap::new();
    let mut order: Vec<(usize, Vec3)> = Vec::new();
    let faces: Vec<[u32; 3]> = triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| mesh.positions[v as usize].as_dvec3());
            let of_face = (b - a).cross(c - a).normalize_or_zero().as_vec3();
            t.map(|v| {
                let own = if normals { mesh.normals[v as usize] } else { Vec3::ONE };
                let normal = if own == Vec3::ZERO { of_face } else { own };
                *ids.entry((v, normal.to_array().map(f32::to_bits))).or_insert_with(|| {
                    order.push((v as usize, normal));
                    order.len() as u32 - 1
                })
            })
        })
        .collect();
    let row = |v: usize, normal: Vec3| {
        let mut row = mesh.positions[v].to_array().to_vec();
        if normals {
            row.extend(normal.to_array());
        }
        if uvs {
            row.extend([mesh.uvs[v].x, 1.0 - mesh.uvs[v].y]);
        }
        row
    };
    let mut properties = vec!["x", "y", "z"];
    properties.extend(normals.then_some(["nx", "ny", "nz"]).into_iter().flatten());
    properties.extend(uvs.then_some(["u", "v"]).into_iter().flatten());
    let rows: Vec<Vec<f32>> = order.iter().map(|&(v, normal)| row(v, normal)).collect();
    put(path, &properties, &rows, &faces)
}

/// Writes a parallelogram that faces along `edge1 × edge2`.
///
/// # Errors
/// [`crate::error::Error::Write`] when the file cannot be written.
pub fn write_quad(path: &Path, corner: Vec3, edge1: Vec3, edge2: Vec3) -> Result<()> {
    let corners = [corner, corner + edge1, corner + edge1 + edge2, corner + edge2]
        .map(|p| p.to_array().to_vec());
    put(path, &["x", "y", "z"], &corners, &[[0, 1, 2], [0, 2, 3]])
}

fn put(path: &Path, properties: &[&str], rows: &[Vec<f32>], faces: &[[u32; 3]]) -> Result<()> {
    let vertex = Columns::new("vertex").floats(properties.iter().copied());
    let elements = [(vertex, rows.len()), (Columns::triangles(), faces.len())];
    ply::write_for_others(path, &elements, |out| {
        rows.iter().try_for_each(|row| out.floats(row.iter().copied()))?;
        faces.iter().try_for_each(|&face| out.triangle(face))
    })
}
