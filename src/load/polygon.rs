//! Polygons → triangles.
//!
//! Ears are cut from the second corner on, which makes a convex polygon the fan around its first
//! corner; an ear is a corner whose triangle is wound like the polygon (Newell normal) and holds no
//! other corner. A concave quad is thus cut along its inner diagonal. Not: self-intersecting or
//! badly non-planar polygons, whose rest becomes a fan. Cost O(n³) at worst, n the corners of one
//! polygon.

use glam::DVec3;

/// Cuts the polygon with these corners; triples of corner numbers, wound like the polygon.
pub fn triangulate(corners: &[DVec3]) -> Vec<[usize; 3]> {
    let n = corners.len();
    let normal: DVec3 =
        (0..n).map(|i| (corners[i] - corners[0]).cross(corners[(i + 1) % n] - corners[0])).sum();
    let turns = |a: usize, b: usize, c: usize| {
        (corners[b] - corners[a]).cross(corners[c] - corners[a]).dot(normal)
    };
    let mut left: Vec<usize> = (0..n).collect();
    let mut out = Vec::with_capacity(n.saturating_sub(2));
    while left.len() > 3 {
        let m = left.len();
        let ear = (1..=m).find(|&k| {
            let (a, b, c) = (left[k - 1], left[k % m], left[(k + 1) % m]);
            let holds = |p: usize| {
                p != a
                    && p != b
                    && p != c
                    && turns(a, b, p) >= 0.0
                    && turns(b, c, p) >= 0.0
                    && turns(c, a, p) >= 0.0
            };
            turns(a, b, c) > 0.0 && !left.iter().any(|&p| holds(p))
        });
        let k = ear.unwrap_or(1);
        out.push([left[k - 1], left[k % m], left[(k + 1) % m]]);
        left.remove(k % m);
    }
    if left.len() == 3 {
        out.push([left[0], left[1], left[2]]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        triangles
            .iter()
            .map(|t| (corners[t[1]] - corners[t[0]]).cross(corners[t[2]] - corners[t[0]]).z * 0.5)
            .inspect(|a| assert!(*a >= 0.0))
            .sum()
    }

    #[test]
    fn convex_is_a_fan() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        assert_eq!(triangulate(&square), [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn concave_stays_inside() {
        let arrow = [
            DVec3::ZERO,
            DVec3::new(2.0, 0.0, 0.0),
            DVec3::new(0.5, 0.5, 0.0),
            DVec3::new(0.0, 2.0, 0.0),
        ];
        for shift in 0..4 {
            let mut corners = arrow;
            corners.rotate_left(shift);
            assert!((area(&corners, &triangulate(&corners)) - 1.0).abs() < 1e-12);
        }
        let comb: Vec<DVec3> = [
            (0.0, 0.0),
            (5.0, 0.0),
            (5.0, 2.0),
            (4.0, 2.0),
            (4.0, 1.0),
            (3.0, 1.0),
            (3.0, 2.0),
            (2.0, 2.0),
            (2.0, 1.0),
            (1.0, 1.0),
            (1.0, 2.0),
            (0.0, 2.0),
        ]
        .map(|(x, y)| DVec3::new(x, y, 0.0))
        .into();
        let cut = triangulate(&comb);
        assert_eq!(cut.len(), 10);
        assert!((area(&comb, &cut) - 8.0).abs() < 1e-12);
    }

    #[test]
    fn degenerate_polygons_end() {
        assert_eq!(triangulate(&[DVec3::ZERO; 5]).len(), 3);
        assert_eq!(triangulate(&[DVec3::X, DVec3::Y]).len(), 0);
    }
}
