//! Smooth normals up to a crease angle.
//!
//! The normal of a triangle's corner is the mean of the face normals around that position, weighted
//! by their angle there, over those faces that lie within the crease angle of the triangle itself.
//! Positions count as one where they are exactly equal, whatever their texture coordinates.
//! Vertices that end up with several normals are split. Cost: O(corners · faces around a position).

use std::collections::HashMap;

use glam::Vec3;

use crate::scene::Mesh;

fn key(v: Vec3) -> [u32; 3] {
    // Adding zero turns −0 into +0.
    (v + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// Replaces the mesh's normals by smoothed ones; `crease_deg` in \[0, 180\].
pub fn smooth(mesh: &mut Mesh, crease_deg: f32) {
    let limit = crease_deg.to_radians().cos() - 1e-6;
    let faces: Vec<Vec3> = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
            (b - a).cross(c - a).normalize_or_zero().as_vec3()
        })
        .collect();
    let mut ids: HashMap<[u32; 3], u32> = HashMap::new();
    let id_of: Vec<u32> = mesh
        .positions
        .iter()
        .map(|&p| {
            let next = ids.len() as u32;
            *ids.entry(key(p)).or_insert(next)
        })
        .collect();
    let mut around: Vec<Vec<(u32, f32)>> = vec![Vec::new(); ids.len()];
    for (face, t) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let [p, q, r] = [0, 1, 2].map(|j| mesh.positions[t[(k + j) % 3] as usize]);
            let angle = (q - p)
                .normalize_or_zero()
                .dot((r - p).normalize_or_zero())
                .clamp(-1.0, 1.0)
                .acos();
            around[id_of[t[k] as usize] as usize].push((face as u32, angle));
        }
    }
    let (old_positions, old_uvs) =
        (std::mem::take(&mut mesh.positions), std::mem::take(&mut mesh.uvs));
    mesh.normals.clear();
    let mut vertices: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
    for (t, &own) in mesh.triangles.iter_mut().zip(&faces) {
        for corner in t.iter_mut() {
            let old = *corner as usize;
            let sum: Vec3 = around[id_of[old] as usize]
                .iter()
                .map(|&(f, w)| (faces[f as usize], w))
                .filter(|(n, _)| n.dot(own) >= limit)
                .map(|(n, w)| n * w)
                .sum();
            let normal = sum.normalize_or(own);
            *corner = *vertices.entry((old as u32, key(normal))).or_insert_with(|| {
                mesh.positions.push(old_positions[old]);
                mesh.normals.push(normal);
                if !old_uvs.is_empty() {
                    mesh.uvs.push(old_uvs[old]);
                }
                mesh.positions.len() as u32 - 1
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of two quads with a fold of `fold_deg` along the y axis.
    fn folded(fold_deg: f32) -> Mesh {
        let (s, c) = fold_deg.to_radians().sin_cos();
        let positions = vec![
            Vec3::new(-1.0, 0.0, 0.0),
            Vec3::new(-1.0, 1.0, 0.0),
            Vec3::ZERO,
            Vec3::Y,
            Vec3::new(c, 0.0, -s),
            Vec3::new(c, 1.0, -s),
        ];
        let triangles = vec![[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]];
        Mesh { positions, triangles, materials: vec![0; 4], ..Mesh::default() }
    }

    #[test]
    fn smooths_below_the_crease_and_splits_above() {
        let mut soft = folded(30.0);
        smooth(&mut soft, 40.0);
        let (s, c) = 15f32.to_radians().sin_cos();
        for (p, n) in soft.positions.iter().zip(&soft.normals) {
            if p.x == 0.0 {
                assert!((*n - Vec3::new(s, 0.0, c)).length() < 1e-5, "{n}");
            }
        }
        assert_eq!(soft.positions.len(), 6);
        let mut hard = folded(50.0);
        smooth(&mut hard, 40.0);
        assert_eq!(hard.positions.len(), 8, "the two vertices of the fold are split");
        assert!(hard.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
        assert!((hard.normals[0] - Vec3::Z).length() < 1e-6);
    }

    #[test]
    fn an_octahedron_smooths_to_its_sphere() {
        let positions = vec![Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
        let mut triangles = Vec::new();
        for (i, x) in [0, 1].into_iter().enumerate() {
            for (j, y) in [2, 3].into_iter().enumerate() {
                for (k, z) in [4, 5].into_iter().enumerate() {
                    triangles.push(if (i + j + k) % 2 == 0 { [x, y, z] } else { [x, z, y] });
                }
            }
        }
        let mut mesh = Mesh { positions, materials: vec![0; 8], triangles, ..Mesh::default() };
        smooth(&mut mesh, 180.0);
        assert_eq!(mesh.positions.len(), 6);
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            assert!((*p - *n).length() < 1e-5);
        }
    }
}
