//! Polygons → triangles.
//!
//! A convex polygon becomes the fan around its first corner, any other is projected along its
//! Newell normal and cut by the crate `earcut`: weakly simple ones too, whose holes are joined to
//! the outer edge by bridges that are passed twice. Triangles are wound like the polygon. Not:
//! self-intersecting polygons, and those that are so far from flat that their projection is. Cost
//! O(n log n) as a rule, n the corners of one polygon, O(n²) at worst, which is why [`Cutter`] has
//! an end.

use earcut::Earcut;
use glam::{DVec2, DVec3};

/// What cutting the polygons of a file may cost, in corners squared: some seconds.
const MOST: f64 = 1e9;

/// Cuts polygons, as long as it does not take for ever.
#[derive(Debug)]
pub struct Cutter(f64);

impl Default for Cutter {
    fn default() -> Self {
        Self(MOST)
    }
}

impl Cutter {
    /// As [`triangulate`]; none when a polygon, or all together, have too many corners.
    pub fn cut(&mut self, corners: &[DVec3]) -> Option<Vec<[usize; 3]>> {
        if let Some(fan) = convex(corners) {
            return Some(fan);
        }
        self.0 -= (corners.len() as f64).powi(2);
        (self.0 >= 0.0).then(|| triangulate(corners))
    }
}

/// The fan of a polygon that is convex, or is no polygon.
fn convex(corners: &[DVec3]) -> Option<Vec<[usize; 3]>> {
    let n = corners.len();
    let normal = newell(corners);
    let turns = |i: usize| {
        let [a, b, c] = [corners[i], corners[(i + 1) % n], corners[(i + 2) % n]];
        (b - a).cross(c - b).dot(normal) >= 0.0
    };
    // Turns to one side all round can still be more than one round.
    let from_first = |i: usize| {
        let [a, b] = [corners[i] - corners[0], corners[i + 1] - corners[0]];
        a.cross(b).dot(normal) >= 0.0
    };
    let is_fan = n < 4 || normal == DVec3::ZERO || (0..n).all(turns) && (1..n - 1).all(from_first);
    is_fan.then(|| (2..n).map(|i| [0, i - 1, i]).collect())
}

fn newell(corners: &[DVec3]) -> DVec3 {
    let n = corners.len();
    (0..n).map(|i| (corners[i] - corners[0]).cross(corners[(i + 1) % n] - corners[0])).sum()
}

/// Cuts the polygon with these corners; triples of corner numbers.
fn triangulate(corners: &[DVec3]) -> Vec<[usize; 3]> {
    let normal = newell(corners);
    let (across, along) = normal.normalize().any_orthonormal_pair();
    let flat: Vec<[f64; 2]> = corners
        .iter()
        .map(|&p| DVec2::new((p - corners[0]).dot(across), (p - corners[0]).dot(along)).to_array())
        .collect();
    let mut cut: Vec<usize> = Vec::new();
    Earcut::new().earcut(flat.iter().copied(), &[], &mut cut);
    let wound = |t: [usize; 3]| {
        let [a, b, c] = t.map(|k| corners[k]);
        if (b - a).cross(c - a).dot(normal) < 0.0 { [t[0], t[2], t[1]] } else { t }
    };
    cut.chunks_exact(3).map(|t| wound([t[0], t[1], t[2]])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(corners: &[DVec3]) -> Vec<[usize; 3]> {
        Cutter::default().cut(corners).unwrap()
    }

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
        assert_eq!(cut(&square), [[0, 1, 2], [0, 2, 3]]);
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
            assert!((area(&corners, &cut(&corners)) - 1.0).abs() < 1e-12);
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
        let cut = cut(&comb);
        assert_eq!(cut.len(), 10);
        assert!((area(&comb, &cut) - 8.0).abs() < 1e-12);
    }

    /// A hundred thousand corners are a disc; the teeth of a saw are too many.
    #[test]
    fn many_corners_have_an_end() {
        let n = 100_000;
        let at = |i: usize, r: f64| {
            let angle = i as f64 * std::f64::consts::TAU / n as f64;
            DVec3::new(r * angle.cos(), r * angle.sin(), 0.0)
        };
        let disc: Vec<DVec3> = (0..n).map(|i| at(i, 1.0)).collect();
        assert!((area(&disc, &cut(&disc)) - std::f64::consts::PI).abs() < 1e-6);
        let saw: Vec<DVec3> = (0..n).map(|i| at(i, 1.0 + 0.1 * (i % 2) as f64)).collect();
        assert_eq!(Cutter::default().cut(&saw), None);
        let mut cutter = Cutter::default();
        assert!((0..2000).map_while(|_| cutter.cut(&saw[..1000])).count() < 1100);
    }

    /// Squares of side 4 with square holes of side 2 and 1, joined by bridges, in any plane: the
    /// area is the polygon's own, whatever corner is first.
    #[test]
    fn holes_with_bridges() {
        let flat = |points: &[[f64; 2]]| -> Vec<DVec3> {
            points.iter().map(|p| DVec3::new(p[0], p[1], 0.0)).collect()
        };
        let one = flat(&[
            [0., 0.],
            [4., 0.],
            [4., 4.],
            [0., 4.],
            [0., 0.],
            [1., 1.],
            [1., 3.],
            [3., 3.],
            [3., 1.],
            [1., 1.],
        ]);
        let two = flat(&[
            [0., 0.],
            [4., 0.],
            [4., 4.],
            [3., 3.],
            [3., 2.],
            [2., 2.],
            [2., 3.],
            [3., 3.],
            [4., 4.],
            [0., 4.],
            [0., 0.],
            [0.5, 0.5],
            [0.5, 1.5],
            [1.5, 1.5],
            [1.5, 0.5],
            [0.5, 0.5],
        ]);
        for (polygon, expected) in [(one, 12.0), (two, 14.0)] {
            for shift in 0..polygon.len() {
                let mut corners = polygon.clone();
                corners.rotate_left(shift);
                assert!((area(&corners, &cut(&corners)) - expected).abs() < 1e-9, "{shift}");
                let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 1.1, -2.0);
                let turned: Vec<DVec3> = corners.iter().map(|&p| turn * p).collect();
                let cut = cut(&turned);
                assert!((area(&corners, &cut) - expected).abs() < 1e-9, "{shift}, turned");
            }
        }
    }

    #[test]
    fn large_polygons_end() {
        let count = 20_000;
        let corner = |i: usize| {
            let angle = i as f64 / count as f64 * std::f64::consts::TAU;
            let radius = if i.is_multiple_of(2) { 1.0 } else { 0.9 };
            DVec3::new(angle.cos() * radius, angle.sin() * radius, 0.0)
        };
        let corners: Vec<DVec3> = (0..count).map(corner).collect();
        let expected = 0.5 * count as f64 * 0.9 * (std::f64::consts::TAU / count as f64).sin();
        assert!((area(&corners, &cut(&corners)) / expected - 1.0).abs() < 1e-9);
    }

    #[test]
    fn degenerate_polygons_end() {
        assert_eq!(cut(&[DVec3::ZERO; 5]).len(), 3);
        assert_eq!(cut(&[DVec3::X, DVec3::Y]).len(), 0);
        let line: Vec<DVec3> = (0..5).map(|i| DVec3::X * f64::from(i)).collect();
        assert_eq!(area(&line, &cut(&line)), 0.0);
    }
}
