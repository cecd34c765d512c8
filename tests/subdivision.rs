//! Catmull–Clark surfaces against closed forms: uniform B-splines on grids, the cube's limit,
//! creases as B-spline curves; and what must hold of every cage: closed stays closed, levels agree,
//! area and normals converge.

use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3};
use nearfar::scene::{Boundary, Cage, Mesh, Scene, UvRule};
use nearfar::tessellate::{Geometry, Levels, SubdivisionSettings, analyze_topology, subdivide};

use crate::support::grey;

fn cube() -> Cage {
    let mut cage = Cage {
        positions: (0..8)
            .map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32))
            .collect(),
        ..Cage::default()
    };
    for face in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    {
        cage.push_face(&face, 0);
    }
    cage
}

fn levels(n: u32) -> SubdivisionSettings {
    SubdivisionSettings { levels: Levels::Fixed(n), ..SubdivisionSettings::default() }
}

fn made(cage: &Cage, settings: &SubdivisionSettings) -> Mesh {
    subdivide(cage, settings).unwrap().0
}

fn geometry(mesh: Mesh) -> Geometry {
    Geometry::new(&Scene { meshes: vec![mesh], materials: vec![grey(0.5); 4], ..Scene::default() })
}

fn area(mesh: &Mesh) -> f64 {
    let at = |i: u32| mesh.positions[i as usize].as_dvec3();
    mesh.triangles
        .iter()
        .map(|t| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).length() * 0.5)
        .sum()
}

/// A height field over n × n points with spacing 1.
fn grid(n: usize, height: impl Fn(usize, usize) -> f32) -> Cage {
    let mut cage = Cage::default();
    for j in 0..n {
        for i in 0..n {
            cage.positions.push(Vec3::new(i as f32, j as f32, height(i, j)));
        }
    }
    for j in 0..n as u32 - 1 {
        for i in 0..n as u32 - 1 {
            let a = j * n as u32 + i;
            cage.push_face(&[a, a + 1, a + 1 + n as u32, a + n as u32], 0);
        }
    }
    cage
}

/// Weights of the uniform cubic B-spline and of its derivative.
fn bspline(t: f64) -> [[f64; 4]; 2] {
    let s = 1.0 - t;
    [
        [
            s * s * s / 6.0,
            (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
            (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
            t * t * t / 6.0,
        ],
        [-s * s / 2.0, (3.0 * t * t - 4.0 * t) / 2.0, (-3.0 * s * s + 4.0 * s) / 2.0, t * t / 2.0],
    ]
}

#[test]
fn a_regular_grid_is_its_bicubic_bspline() {
    let n = 8;
    let height = |i: usize, j: usize| ((i * 7 + j * 13 + i * i * j) % 5) as f32 * 0.3;
    let mesh = made(&grid(n, height), &levels(3));
    let mut seen = 0;
    for (p, normal) in mesh.positions.iter().zip(&mesh.normals) {
        // Parameters are positions here: the spline of an arithmetic progression is the identity.
        let (x, y) = (f64::from(p.x), f64::from(p.y));
        if !(1.0..=6.0).contains(&x) || !(1.0..=6.0).contains(&y) {
            continue;
        }
        seen += 1;
        let (i, j) = ((x.floor() as usize).min(5), (y.floor() as usize).min(5));
        let (u, v) = (bspline(x - i as f64), bspline(y - j as f64));
        let sum = |du: usize, dv: usize| -> f64 {
            (0..16)
                .map(|k| {
                    u[du][k % 4] * v[dv][k / 4] * f64::from(height(i + k % 4 - 1, j + k / 4 - 1))
                })
                .sum()
        };
        assert!((f64::from(p.z) - sum(0, 0)).abs() < 1e-6, "{p} {}", sum(0, 0));
        let exact = DVec3::new(-sum(1, 0), -sum(0, 1), 1.0).normalize();
        assert!((normal.as_dvec3() - exact).length() < 1e-5, "{p}: {normal} {exact}");
    }
    assert_eq!(seen, 41 * 41);
}

#[test]
fn open_edges_are_bspline_curves_and_lone_corners_stay() {
    let height = |i: usize, _: usize| [0.0, 1.0, -0.5, 2.0, 0.0, 0.7][i];
    let mesh = made(&grid(6, height), &levels(4));
    // Along y nothing changes, and the border row is a cubic B-spline whose ends are interpolated.
    let border: Vec<&Vec3> = mesh.positions.iter().filter(|p| p.y == 0.0).collect();
    assert_eq!(border.len(), 5 * 16 + 1);
    for p in border.iter().filter(|p| (1.0..=4.0).contains(&p.x)) {
        let x = f64::from(p.x);
        let i = (x.floor() as usize).min(3);
        let exact: f64 =
            (0..4).map(|k| bspline(x - i as f64)[0][k] * f64::from(height(i + k - 1, 0))).sum();
        assert!((f64::from(p.z) - exact).abs() < 1e-6, "{p} {exact}");
    }
    assert!(border.contains(&&Vec3::ZERO) && border.contains(&&Vec3::new(5.0, 0.0, height(5, 0))));
    let smooth =
        made(&grid(6, height), &SubdivisionSettings { boundary: Boundary::Edge, ..levels(4) });
    assert!(
        smooth.positions.iter().all(|p| p.x + p.y > 0.1),
        "without corners the sheet is rounded"
    );
    let cut =
        made(&grid(6, height), &SubdivisionSettings { boundary: Boundary::None, ..levels(2) });
    assert!(
        cut.positions.iter().all(|p| (1.0..=4.0).contains(&p.x) && (1.0..=4.0).contains(&p.y)),
        "border faces are left out"
    );
}

#[test]
fn the_cube_has_its_known_limit() {
    // From v/9·9 + 12 (e − v)…: k = 3 gives v∞ = (9 v + 4 Σe + Σf) / 24 on the first level's ring.
    for n in 1..=4 {
        let mesh = made(&cube(), &levels(n));
        let centred: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3() * 2.0 - 1.0).collect();
        let farthest = centred.iter().map(|p| p.length()).fold(0.0, f64::max);
        // Cube of half side 1: after one level v¹ = 5/9 (1,1,1), e¹ = (1,1,0) 3/4, f¹ = (1,0,0):
        // (9·5/9 + 4·2·3/4 + 1) / 24 = 1/2.
        assert!((farthest - 0.75f64.sqrt()).abs() < 1e-6, "corner at {farthest}");
        // Face centres: k = 4: v¹ = (0,0,1), e¹ = 4·(·,·,3/4), f¹ = 4·(·,·,5/9): (16 + 12 + 20/9) /
        // 36 is the limit.
        let nearest = centred.iter().map(|p| p.length()).fold(f64::MAX, f64::min);
        assert!(
            (nearest - (16.0 + 12.0 + 20.0 / 9.0) / 36.0).abs() < 1e-6,
            "face centre at {nearest}"
        );
        for (p, normal) in centred.iter().zip(&mesh.normals) {
            if (p.x.abs() - 0.5).abs() < 1e-6
                && (p.y.abs() - 0.5).abs() < 1e-6
                && (p.z.abs() - 0.5).abs() < 1e-6
            {
                assert!((normal.as_dvec3() - p.normalize()).length() < 1e-6);
            }
        }
    }
}

#[test]
fn levels_agree_where_they_meet() {
    // Every vertex of a coarse level is one of every finer level, with the same limit and normal,
    // whatever the creases.
    let mut cage = cube();
    cage.creases = vec![
        ([0, 1], 1.3),
        ([1, 3], 2.6),
        ([3, 2], 0.4),
        ([4, 5], 10.0),
        ([5, 7], 10.0),
        ([7, 6], 10.0),
        ([6, 4], 10.0),
        ([0, 4], 10.0),
    ];
    cage.sharp_vertices = vec![(2, 1.5), (3, 0.5)];
    let [coarse, fine] = [1, 4].map(|n| made(&cage, &levels(n)));
    for (p, n) in coarse.positions.iter().zip(&coarse.normals) {
        let near = fine.positions.iter().zip(&fine.normals).filter(|(q, _)| q.distance(*p) < 2e-6);
        let best = near.map(|(_, m)| m.distance(*n)).fold(f32::MAX, f32::min);
        // A dart's normal is that of a ring of finite size.
        assert!(best < 2e-3, "{p} {n}: {best}");
    }
}

#[test]
fn sharp_edges_meet_in_place_and_semi_sharp_ones_lie_between() {
    let ring = [[4u32, 5], [5, 7], [7, 6], [6, 4]];
    let sharpened =
        |s: f32| made(&Cage { creases: ring.map(|e| (e, s)).into(), ..cube() }, &levels(4));
    let areas = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0].map(|s| area(&sharpened(s)));
    assert!(areas.windows(2).all(|w| w[1] > w[0] + 1e-3), "{areas:?}");
    let top = sharpened(10.0).positions.iter().map(|p| p.z).fold(f32::MIN, f32::max);
    assert!((top - 1.0).abs() < 1e-6, "a planar sharp face stays in its plane");
    // The crease itself: a closed cubic B-spline of the square; a vertex goes to (1 + 4 + 1)/6
    // between its neighbours.
    let cage = Cage { creases: ring.map(|e| (e, 10.0)).into(), ..cube() };
    let mesh = made(&cage, &levels(3));
    let rim: Vec<Vec2> =
        mesh.positions.iter().filter(|p| p.z > 1.0 - 1e-6).map(|p| p.truncate()).collect();
    let corner = Vec2::splat((4.0 * 0.0 + 1.0) / 6.0);
    assert!(rim.iter().any(|p| p.distance(corner) < 1e-6));
    // Two normals along the crease, one upwards.
    let on_crease: Vec<Vec3> = mesh
        .positions
        .iter()
        .zip(&mesh.normals)
        .filter(|(p, _)| p.distance(corner.extend(1.0)) < 1e-6)
        .map(|(_, n)| *n)
        .collect();
    assert_eq!(on_crease.len(), 2);
    assert!(
        on_crease.iter().any(|n| n.distance(Vec3::Z) < 1e-6)
            && on_crease.iter().any(|n| n.z < 0.9 && n.x < 0.0),
        "{on_crease:?}"
    );
    // All edges sharp: the cube itself.
    let mut all = cube();
    all.creases = (0..8u32).flat_map(|a| [1, 2, 4].map(|bit| ([a, a ^ bit], 10.0))).collect();
    let mesh = made(&all, &levels(2));
    assert!((area(&mesh) - 6.0).abs() < 1e-5 && mesh.positions.len() == 6 * 25);
    let by_angle =
        made(&cube(), &SubdivisionSettings { crease_angle_deg: Some(60.0), ..levels(2) });
    assert_eq!((by_angle.positions, by_angle.normals), (mesh.positions, mesh.normals));
    assert!(
        area(&made(&cube(), &SubdivisionSettings { crease_angle_deg: Some(91.0), ..levels(2) }))
            < 4.0
    );
}

/// A torus cage of n × m vertices, radii 2 and 1.
fn torus(n: u32, m: u32) -> Cage {
    let mut cage = Cage::default();
    for i in 0..n {
        for j in 0..m {
            let (a, b) =
                (2.0 * PI * f64::from(i) / f64::from(n), 2.0 * PI * f64::from(j) / f64::from(m));
            let r = 2.0 + b.cos();
            cage.positions.push(DVec3::new(r * a.cos(), r * a.sin(), b.sin()).as_vec3());
        }
    }
    let at = |i: u32, j: u32| (i % n) * m + j % m;
    for i in 0..n {
        for j in 0..m {
            cage.push_face(&[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], 0);
        }
    }
    cage
}

#[test]
fn a_torus_converges() {
    // The limit of a finer cage nears the torus' area 8π²; at one cage, levels near the limit's
    // area by a factor of 4 each.
    let exact = 8.0 * PI * PI;
    let errors: Vec<f64> = [12, 24, 48]
        .map(|n| (area(&made(&torus(2 * n, n), &levels(2))) / exact - 1.0).abs())
        .into();
    assert!(
        errors[1] < errors[0] / 3.5 && errors[2] < errors[1] / 3.5 && errors[2] < 0.005,
        "{errors:?}"
    );
    let areas: Vec<f64> = (1..=6).map(|n| area(&made(&torus(12, 8), &levels(n)))).collect();
    for w in areas.windows(3).take(3) {
        let ratio = (w[1] - w[0]) / (w[2] - w[1]);
        assert!((3.8..4.2).contains(&ratio), "{areas:?}");
    }
    // Limit normals are those of the surface: the angle to the faces around falls with the level.
    let spread = |n: u32| {
        let g = geometry(made(&torus(12, 8), &levels(n)));
        g.triangles
            .iter()
            .zip(&g.face_normals)
            .flat_map(|(t, f)| t.map(|i| g.normals[i as usize].distance(*f)))
            .fold(0.0, f32::max)
    };
    let spreads = [2, 3, 4].map(spread);
    assert!(spreads[1] < 0.6 * spreads[0] && spreads[2] < 0.6 * spreads[1], "{spreads:?}");
}

#[test]
fn closed_cages_stay_closed_whatever_their_creases_and_polygons() {
    // A prism over a pentagon, with triangles, quads and pentagons, and creases of all kinds.
    let mut prism = Cage::default();
    for k in 0..10 {
        let (s, c) = (k as f32 % 5.0 * 1.2566371).sin_cos();
        prism.positions.push(Vec3::new(c, s, if k < 5 { 0.0 } else { 1.0 }));
    }
    prism.positions.push(Vec3::new(0.0, 0.0, 1.6));
    prism.push_face(&[4, 3, 2, 1, 0], 1);
    for k in 0..5 {
        prism.push_face(&[k, (k + 1) % 5, 5 + (k + 1) % 5, 5 + k], 0);
        prism.push_face(&[5 + k, 5 + (k + 1) % 5, 10], 2);
    }
    prism.creases = vec![
        ([0, 1], 10.0),
        ([1, 2], 10.0),
        ([5, 6], 1.7),
        ([6, 7], 2.5),
        ([7, 10], 10.0),
        ([8, 10], 0.3),
    ];
    prism.sharp_vertices = vec![(9, 10.0), (3, 1.2)];
    prism.uvs = vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    prism.uv_corners = (0..prism.face_count())
        .flat_map(|f| (0..prism.face(f).len() as u32).map(|k| k % 4))
        .collect();
    for (cage, closed) in [(prism, 1), (torus(12, 8), 1), (cube(), 1)] {
        for n in 1..=3 {
            let mesh = made(&cage, &levels(n));
            assert_eq!(mesh.triangles.len(), (2 * cage.corners.len()) << (2 * (n - 1)));
            assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
            assert_eq!(
                (mesh.uvs.is_empty(), mesh.materials.len()),
                (cage.uvs.is_empty(), mesh.triangles.len())
            );
            let g = geometry(mesh);
            let topology = analyze_topology(&g);
            assert_eq!(
                (topology.closed_components, topology.boundary_edges, g.dropped_degenerate),
                (closed, 0, 0)
            );
            assert!(topology.closed_of_triangle.iter().all(|c| *c));
        }
    }
}

#[test]
fn materials_holes_and_seams_are_kept() {
    let mut cage = cube();
    cage.materials = vec![0, 1, 2, 0, 1, 2];
    let mesh = made(&cage, &levels(2));
    for m in 0..3 {
        assert_eq!(mesh.materials.iter().filter(|x| **x == m).count(), 2 * 32);
    }
    cage.holes = vec![1, 5];
    let open = made(&cage, &levels(2));
    assert_eq!(open.triangles.len(), 4 * 32);
    assert!(
        open.positions.iter().all(|p| mesh.positions.contains(p)),
        "a hole shapes the surface all the same"
    );
    // One square of texture on each face of a flat sheet: linear keeps lines, smooth rounds the
    // island's border but keeps its corners.
    let mut sheet = grid(4, |_, _| 0.0);
    sheet.uvs = sheet.positions.iter().map(|p| p.truncate() / 3.0).collect();
    sheet.uv_corners.clone_from(&sheet.corners);
    let linear = made(&sheet, &levels(3));
    assert!(linear.uvs.contains(&Vec2::new(1.0 / 24.0, 0.0)) && linear.uvs.contains(&Vec2::ONE));
    let smooth = made(&sheet, &SubdivisionSettings { uv: UvRule::Smooth, ..levels(3) });
    for (p, uv) in smooth.positions.iter().zip(&smooth.uvs) {
        assert!((p.truncate() / 3.0).distance(*uv) < 1e-6, "texture and surface are refined alike");
    }
}

#[test]
fn the_edge_length_decides_the_level_and_too_much_is_refused() {
    let longest = |edge: f32| {
        let mesh = made(
            &cube(),
            &SubdivisionSettings { levels: Levels::Edge(edge), ..SubdivisionSettings::default() },
        );
        let at = |i: u32| mesh.positions[i as usize];
        (
            mesh.triangles.len(),
            mesh.triangles.iter().map(|t| at(t[0]).distance(at(t[1]))).fold(0.0, f32::max),
        )
    };
    assert_eq!(longest(10.0).0, 48);
    let (count, edge) = longest(0.06);
    // Diagonals are √2 longer than edges.
    assert!(count == 48 * 64 && edge < 0.06 * 1.5, "{count} {edge}");
    // Every part has a level of its own.
    let mut two = cube();
    two.positions.extend(cube().positions.iter().map(|p| *p * 0.25 + 5.0));
    for f in 0..6 {
        let corners: Vec<u32> = cube().corners[cube().face(f)].iter().map(|i| i + 8).collect();
        two.push_face(&corners, 1);
    }
    two.creases = vec![([8, 9], 10.0), ([0, 1], 10.0)];
    two.holes = vec![7];
    let mesh = made(
        &two,
        &SubdivisionSettings { levels: Levels::Edge(0.06), ..SubdivisionSettings::default() },
    );
    let count = |m: u32| mesh.materials.iter().filter(|x| **x == m).count();
    assert_eq!((count(0), count(1)), (48 * 64, 48 * 4 * 5 / 6));
    let refused = |levels: Levels| {
        subdivide(&cube(), &SubdivisionSettings { levels, ..SubdivisionSettings::default() })
            .unwrap_err()
    };
    assert_eq!(refused(Levels::Fixed(40)), "levels is 40 but may not exceed 10; give fewer");
    let big = subdivide(&torus(200, 200), &levels(9)).unwrap_err();
    assert!(
        big.starts_with("levels = 9 would make 20971520000 triangles, more than 33554432"),
        "{big}"
    );
    assert!(refused(Levels::Edge(1e-9)).contains("give a longer edge"));
    let mut broken = cube();
    broken.corners[3] = 99;
    assert_eq!(subdivide(&broken, &levels(1)).unwrap_err(), "an index of the cage is out of range");
}

#[test]
fn surfaces_that_touch_keep_their_edges() {
    // Three sheets at one edge, and two cubes at one vertex.
    let mut fan = Cage { positions: vec![Vec3::ZERO, Vec3::Z], ..Cage::default() };
    for k in 0..3u32 {
        let (s, c) = (k as f32 * 2.0944).sin_cos();
        fan.positions.extend([Vec3::new(c, s, 0.0), Vec3::new(c, s, 1.0)]);
        fan.push_face(&[0, 2 + 2 * k, 3 + 2 * k, 1], 0);
    }
    let (mesh, faulty) = subdivide(&fan, &levels(3)).unwrap();
    assert_eq!(faulty, 1);
    assert!((area(&mesh) - 3.0).abs() < 1e-5, "flat sheets stay what they are");
    let mut pair = cube();
    let shift: Vec<u32> = (0..8).map(|i| if i == 7 { 7 } else { 8 + i }).collect();
    pair.positions.extend(cube().positions.iter().map(|p| Vec3::splat(2.0) - *p));
    for f in 0..6 {
        let corners: Vec<u32> =
            cube().corners[cube().face(f)].iter().rev().map(|&i| shift[i as usize]).collect();
        pair.push_face(&corners, 0);
    }
    let mesh = made(&pair, &levels(2));
    assert!(mesh.positions.contains(&Vec3::ONE));
    let topology = analyze_topology(&geometry(mesh));
    assert_eq!((topology.boundary_edges, topology.nonmanifold_edges), (0, 0));
}
