use super::*;
use crate::photon::{CellRadiosity, Proxy};
use crate::sampling::{Stream, sample_uniform_sphere};
use crate::scene::{Material, Mesh, Scene, Sides};
use crate::sh::{Quadratic, moments};
use crate::tessellate::{Cells, Geometry, Side};

fn cells_of(positions: Vec<Vec3>, sides: Sides, near_cell: f32) -> Cells {
    let n = positions.len() as u32 / 3;
    let mesh = Mesh {
        positions,
        triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        materials: vec![0; n as usize],
        sides,
        ..Mesh::default()
    };
    Cells::new(
        &Geometry::new(&Scene {
            meshes: vec![mesh],
            materials: vec![Material::default()],
            ..Scene::default()
        }),
        near_cell,
    )
    .unwrap()
}

fn random_radiosity(cells: &Cells, rng: &mut Rng) -> CellRadiosity {
    let mut side = || {
        (0..cells.len()).map(|_| Rgb::new(rng.next_f32(), rng.next_f32(), rng.next_f32())).collect()
    };
    CellRadiosity { front: side(), back: side(), ..CellRadiosity::default() }
}

/// The definition, cell by cell in double precision.
fn brute(
    proxy: Proxy<'_>,
    (x, n): (Vec3, Vec3),
    near_hits: NearHits,
    alpha: f32,
) -> (Rgb, [f64; MOMENTS], u32) {
    let Proxy { cells, radiosity } = proxy;
    let (mut sent, mut sum, mut count) = (Rgb::ZERO, [0.0; MOMENTS], 0);
    for (i, c) in cells.corners.iter().enumerate() {
        let mut v = c.map(|p| p - x);
        let normal = (v[1] - v[0]).cross(v[2] - v[0]).normalize();
        let m = near_hits.membership(cells.centroids[i].distance(x), alpha);
        let det = v[0].dot(normal);
        if m <= 0.0
            || det.abs() <= 1e-3 * cells.near_cell
            || v.iter().all(|p| p.dot(n) <= 1e-3 * cells.near_cell)
        {
            continue;
        }
        let side = if det > 0.0 { Side::Back } else { Side::Front };
        if side == Side::Back && cells.one_sided[i] {
            continue;
        }
        if side == Side::Front {
            v.swap(1, 2);
        }
        let found = moments(&v, n);
        count += 1;
        sent +=
            radiosity.get(i as u32, side) * (f64::from(m) * found[0] / std::f64::consts::PI) as f32;
        for (s, f) in sum.iter_mut().zip(found) {
            *s += f64::from(m) * f;
        }
    }
    (sent, sum, count)
}

#[test]
fn equals_the_definition_for_every_alpha_and_side_rule() {
    let mut rng = Rng::new(9, Stream::Test, 0, 0);
    let mut random = || Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
    let positions: Vec<Vec3> = (0..60)
        .flat_map(|_| {
            let c = random() * 2.0;
            [c, c + random() * 0.5, c + random() * 0.5]
        })
        .collect();
    for sides in [Sides::One, Sides::Two] {
        let cells = cells_of(positions.clone(), sides, 0.15);
        assert!(cells.len() > 300);
        let radiosity = random_radiosity(&cells, &mut rng);
        let proxy = Proxy { cells: &cells, radiosity: &radiosity };
        let tree = NearTree::new(proxy);
        for alpha in [0.3, 1.0, f32::INFINITY] {
            for i in 0..100 {
                let near_hits = [NearHits::Damp, NearHits::Ignore][i % 2];
                let x = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0;
                let n = sample_uniform_sphere(rng.next_2d());
                let query = NearQuery { near_hits, ..NearQuery::assumed(alpha) };
                let fast = tree.sum(x, n, &query, &mut rng);
                let (sent, sum, count) = brute(proxy, (x, n), near_hits, alpha);
                assert_eq!(fast.cells, count);
                assert!((fast.sent - sent).abs().max_element() < 1e-4, "{} {sent}", fast.sent);
                for (f, s) in fast.moments.iter().zip(sum) {
                    assert!((f64::from(*f) - s).abs() < 1e-3, "{f} {s}");
                }
            }
        }
    }
}

#[test]
fn alpha_zero_finds_nothing_and_no_cells_are_no_trouble() {
    let mut rng = Rng::new(9, Stream::Test, 1, 0);
    let cells = cells_of(vec![Vec3::ZERO, Vec3::X, Vec3::Y], Sides::Two, 0.1);
    let radiosity = random_radiosity(&cells, &mut rng);
    let tree = NearTree::new(Proxy { cells: &cells, radiosity: &radiosity });
    assert_eq!(tree.sum(Vec3::Z * 0.1, -Vec3::Z, &NearQuery::assumed(0.0), &mut rng).cells, 0);
    let none = Cells::default();
    let tree = NearTree::new(Proxy { cells: &none, radiosity: &CellRadiosity::default() });
    assert_eq!(tree.sum(Vec3::ZERO, Vec3::Z, &NearQuery::assumed(1.0), &mut rng).cells, 0);
}

/// Moving a point through the shell of one bright cell must not pop: no step may exceed what
/// the membership's slope allows.
#[test]
fn continuous_across_the_shell() {
    let mut rng = Rng::new(9, Stream::Test, 2, 0);
    let cells = cells_of(
        vec![Vec3::new(0.0, 0.0, 0.0), Vec3::new(0.3, 0.0, 0.0), Vec3::new(0.0, 0.3, 0.0)],
        Sides::Two,
        1.0,
    );
    let radiosity =
        CellRadiosity { front: vec![Rgb::ONE], back: vec![Rgb::ONE], ..CellRadiosity::default() };
    let tree = NearTree::new(Proxy { cells: &cells, radiosity: &radiosity });
    let at = |z: f32, rng: &mut Rng| {
        tree.sum(Vec3::new(0.1, 0.1, z), -Vec3::Z, &NearQuery::assumed(1.0), rng).sent.x
    };
    let (mut last, mut largest) = (at(0.5, &mut rng), 0.0f32);
    assert!(last > 0.01 && at(1.01, &mut rng) == 0.0);
    for step in 1..=600 {
        let now = at(0.5 + step as f32 * 1e-3, &mut rng);
        largest = largest.max((now - last).abs());
        last = now;
    }
    // Steepest: F(0.875) · |m'| = 0.045/(π 0.77) · 1.5 · 4 per unit length.
    assert!(largest < 2e-4, "{largest}");
}

#[test]
fn monte_carlo_agrees_with_the_closed_form() {
    let mut rng = Rng::new(9, Stream::Test, 3, 0);
    let cells = cells_of(
        vec![Vec3::new(-1.0, -1.0, 0.4), Vec3::new(1.0, -1.0, 0.6), Vec3::new(0.0, 1.0, 0.8)],
        Sides::Two,
        0.2,
    );
    let radiosity = random_radiosity(&cells, &mut rng);
    let tree = NearTree::new(Proxy { cells: &cells, radiosity: &radiosity });
    let mut field = ShRgb::default();
    for c in field.0.iter_mut().take(9) {
        *c = Rgb::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
    }
    let query = NearQuery { monte_carlo: Some((&field, 400)), ..NearQuery::assumed(1.2) };
    let sum = tree.sum(Vec3::ZERO, Vec3::Z, &query, &mut rng);
    let exact = Quadratic::new(&field, Vec3::Z).integral(&sum.moments);
    assert!(
        (sum.covered - exact).abs().max_element() < 2e-3 * exact.max_element(),
        "{} {exact}",
        sum.covered
    );
}
