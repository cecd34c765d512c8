//! Sphere lights as triangles: an icosphere scaled so that its area, and with it its emitted power
//! and mean projected area, equals the sphere's.

use glam::Vec3;

/// Vertices and outward triangles of a sphere, `20 · 4^levels` faces, total area 4πr².
pub(super) fn icosphere(center: Vec3, radius: f32, levels: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let g = (1.0 + 5.0_f32.sqrt()) / 2.0;
    let mut v: Vec<Vec3> = Vec::new();
    for (a, b) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
        v.extend([Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)]);
    }
    for p in &mut v {
        *p = p.normalize();
    }
    // Faces of the icosahedron: triples of mutually nearest vertices.
    let near = |i: usize, j: usize, v: &[Vec3]| v[i].dot(v[j]) > 0.4;
    let mut faces = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j, &v) && near(j, k, &v) && near(i, k, &v) {
                    let outward = (v[j] - v[i]).cross(v[k] - v[i]).dot(v[i]) > 0.0;
                    faces.push(if outward {
                        [i as u32, j as u32, k as u32]
                    } else {
                        [i as u32, k as u32, j as u32]
                    });
                }
            }
        }
    }
    for _ in 0..levels {
        let mut middle = std::collections::BTreeMap::new();
        let mut next = Vec::with_capacity(faces.len() * 4);
        for [a, b, c] in faces {
            let mut mid = |i: u32, j: u32| {
                *middle.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    v.push((v[i as usize] + v[j as usize]).normalize());
                    v.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (mid(a, b), mid(b, c), mid(c, a));
            next.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = next;
    }
    let area: f32 = faces
        .iter()
        .map(|f| {
            (v[f[1] as usize] - v[f[0] as usize])
                .cross(v[f[2] as usize] - v[f[0] as usize])
                .length()
                * 0.5
        })
        .sum();
    let scale = radius * (4.0 * std::f32::consts::PI / area).sqrt();
    (v.into_iter().map(|p| center + p * scale).collect(), faces)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_and_count() {
        let (v, f) = icosphere(Vec3::ONE, 2.0, 3);
        assert_eq!((v.len(), f.len()), (642, 1280));
        let area: f32 = f
            .iter()
            .map(|t| {
                (v[t[1] as usize] - v[t[0] as usize])
                    .cross(v[t[2] as usize] - v[t[0] as usize])
                    .length()
                    * 0.5
            })
            .sum();
        assert!((area / (16.0 * std::f32::consts::PI) - 1.0).abs() < 1e-4);
    }
}
