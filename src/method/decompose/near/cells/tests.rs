use super::*;
use crate::proxy::Proxy;
use crate::sampling::{Stream, sample_uniform_sphere};
use crate::scene::{Material, Mesh, Scene, Sides};
use crate::sh::{Quadratic, moments};
use crate::tessellate::{Geometry, Side};

fn proxy_of(
    positions: Vec<Vec3>,
    sides: Sides,
    near_cell: f32,
    glow: impl FnMut(Vec3, Vec3) -> Rgb,
) -> Proxy {
    let n = positions.len() as u32 / 3;
    let mesh = Mesh {
        positions,
        triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        materials: vec![0; n as usize],
        sides,
        ..Mesh::default()
    };
    Proxy::given(
        &Geometry::new(&Scene {
            meshes: vec![mesh],
            materials: vec![Material::default()],
            ..Scene::default()
        }),
        near_cell,
        glow,
    )
    .unwrap()
}

fn random_glow(rng: &mut Rng) -> impl FnMut(Vec3, Vec3) -> Rgb + '_ {
    |_, _| Rgb::new(rng.next_f32(), rng.next_f32(), rng.next_f32())
}

/// The definition, cell by cell in double precision.
fn brute(
    proxy: &Proxy,
    (x, n): (Vec3, Vec3),
    near_hits: NearHits,
    alpha: f32,
) -> (Rgb, [f64; MOMENTS], u32) {
    let tolerance = 1e-3 * proxy.piece_size();
    let (mut sent, mut sum, mut count) = (Rgb::ZERO, [0.0; MOMENTS], 0);
    for f in proxy.facets() {
        let mut v = f.corners.map(|p| p - x);
        let normal = (v[1] - v[0]).cross(v[2] - v[0]).normalize();
        let m = near_hits.membership(f.centroid.distance(x), alpha);
        let det = v[0].dot(normal);
        if m <= 0.0 || det.abs() <= tolerance || v.iter().all(|p| p.dot(n) <= tolerance) {
            continue;
        }
        let side = if det > 0.0 { Side::Back } else { Side::Front };
        if side == Side::Back && f.one_sided {
            continue;
        }
        if side == Side::Front {
            v.swap(1, 2);
        }
        let found = moments(&v, n);
        count += 1;
        sent += f.radiosity_of(side) * (f64::from(m) * found[0] / std::f64::consts::PI) as f32;
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
        let proxy = proxy_of(positions.clone(), sides, 0.15, random_glow(&mut rng));
        assert!(proxy.facet_count() > 300);
        let tree = NearTree::new(&proxy);
        for alpha in [0.3, 1.0, f32::INFINITY] {
            for i in 0..100 {
                let near_hits = [NearHits::Damp, NearHits::Ignore][i % 2];
                let x = Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0;
                let n = sample_uniform_sphere(rng.next_2d());
                let query = NearQuery { near_hits, ..NearQuery::assumed(alpha) };
                let fast = tree.sum(x, n, &query, &mut rng);
                let (sent, sum, count) = brute(&proxy, (x, n), near_hits, alpha);
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
    let triangle = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    let proxy = proxy_of(triangle, Sides::Two, 0.1, random_glow(&mut rng));
    let tree = NearTree::new(&proxy);
    assert_eq!(tree.sum(Vec3::Z * 0.1, -Vec3::Z, &NearQuery::assumed(0.0), &mut rng).cells, 0);
    let tree = NearTree::new(&Proxy::default());
    assert_eq!(tree.sum(Vec3::ZERO, Vec3::Z, &NearQuery::assumed(1.0), &mut rng).cells, 0);
}

/// Moving a point through the shell of one bright cell must not pop: no step may exceed what
/// the membership's slope allows.
#[test]
fn continuous_across_the_shell() {
    let mut rng = Rng::new(9, Stream::Test, 2, 0);
    let triangle = vec![Vec3::ZERO, Vec3::new(0.3, 0.0, 0.0), Vec3::new(0.0, 0.3, 0.0)];
    let tree = NearTree::new(&proxy_of(triangle, Sides::Two, 1.0, |_, _| Rgb::ONE));
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
    let triangle =
        vec![Vec3::new(-1.0, -1.0, 0.4), Vec3::new(1.0, -1.0, 0.6), Vec3::new(0.0, 1.0, 0.8)];
    let proxy = proxy_of(triangle, Sides::Two, 0.2, random_glow(&mut rng));
    let tree = NearTree::new(&proxy);
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
