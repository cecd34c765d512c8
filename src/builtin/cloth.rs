//! Cloth with a thickness: two grids of points joined along their rim, one closed component.

use glam::Vec3;

use super::solid::Solids;

/// Adds cloth of `size` (columns, rows) cells; `point(i, k, side)` gives the point of column i and
/// row k on its side −1 or 1.
pub fn cloth(s: &mut Solids, size: [u32; 2], point: impl Fn(u32, u32, f32) -> Vec3, material: u32) {
    let [m, n] = size;
    let count = (m + 1) * (n + 1);
    let side = |side: f32| (0..=n).flat_map(move |k| (0..=m).map(move |i| (i, k, side)));
    let positions: Vec<Vec3> =
        side(-1.0).chain(side(1.0)).map(|(i, k, side)| point(i, k, side)).collect();
    let id = |i: u32, k: u32| k * (m + 1) + i;
    let mut triangles = Vec::new();
    for k in 0..n {
        for i in 0..m {
            let (a, b, c, d) = (id(i, k), id(i + 1, k), id(i + 1, k + 1), id(i, k + 1));
            triangles.extend([[a, b, c], [a, c, d]]);
            triangles.extend([[a, c, b], [a, d, c]].map(|t| t.map(|v| v + count)));
        }
    }
    let rim: Vec<u32> = (0..m)
        .map(|i| id(i, 0))
        .chain((0..n).map(|k| id(m, k)))
        .chain((0..m).map(|i| id(m - i, n)))
        .chain((0..n).map(|k| id(0, n - k)))
        .collect();
    for (i, &a) in rim.iter().enumerate() {
        let b = rim[(i + 1) % rim.len()];
        triangles.extend([[b, a, a + count], [b, a + count, b + count]]);
    }
    let faces = triangles.len();
    s.solid(&positions, triangles, &vec![material; faces]);
}
