//! Curves as triangles: areas and splines in closed form, closedness, files; and cages and curves
//! by way of scene files.

use std::f64::consts::PI;
use std::path::Path;
use std::process::Command;

use glam::{DVec3, Vec3};
use nearfar::load::{Loaded, load};
use nearfar::scene::{Basis, Curves, Mesh, Scene};
use nearfar::tessellate::{
    CurveSettings, CurveShape, Geometry, MAX_TRIANGLES, analyze_topology, tessellate_curves,
};

use crate::support::{Folder, grey};

fn curves(basis: Basis, points: &[[f32; 4]]) -> Curves {
    let mut c = Curves { basis, ..Curves::default() };
    c.push_curve(points.iter().map(|p| (Vec3::new(p[0], p[1], p[2]), p[3])));
    c
}

fn made(c: &Curves, shape: CurveShape, sides: u32, segments: u32) -> Mesh {
    tessellate_curves(c, &CurveSettings { shape, sides, segments, normal: None }).unwrap()
}

fn area(mesh: &Mesh) -> f64 {
    let at = |i: u32| mesh.positions[i as usize].as_dvec3();
    mesh.triangles
        .iter()
        .map(|t| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).length() * 0.5)
        .sum()
}

fn geometry(mesh: Mesh) -> Geometry {
    Geometry::new(&Scene { meshes: vec![mesh], materials: vec![grey(0.5)], ..Scene::default() })
}

#[test]
fn a_straight_tube_has_the_area_of_the_round_one() {
    let (r, length) = (0.3, 5.0);
    for basis in [Basis::Linear, Basis::CatmullRom, Basis::Bezier] {
        let points: Vec<[f32; 4]> =
            (0..4).map(|i| [1.0, i as f32 / 3.0 * 5.0, -2.0, 0.6]).collect();
        let c = curves(basis, &points);
        for sides in [3, 5, 16] {
            let mesh = made(&c, CurveShape::Tube, sides, 4);
            let k = f64::from(sides);
            let caps = 2.0 * 0.5 * k * (r * PI / k / (PI / k).sin()).powi(2) * (2.0 * PI / k).sin();
            let exact = 2.0 * PI * r * length + caps;
            assert!(
                (area(&mesh) / exact - 1.0).abs() < 1e-5,
                "{basis:?} {sides}: {} {exact}",
                area(&mesh)
            );
        }
        assert!((area(&made(&c, CurveShape::Ribbon, 5, 4)) - 0.6 * length).abs() < 1e-5);
        assert!((area(&made(&c, CurveShape::Cross, 5, 4)) - 2.0 * 0.6 * length).abs() < 1e-5);
    }
}

#[test]
fn cones_and_arcs_converge() {
    // A cone: side area π r s, and normals that lean back by its slope.
    let cone = curves(Basis::Linear, &[[0.0, 0.0, 0.0, 2.0], [0.0, 0.0, 3.0, 0.0]]);
    let mesh = made(&cone, CurveShape::Tube, 64, 1);
    let exact = PI * 10f64.sqrt() + PI;
    assert!((area(&mesh) / exact - 1.0).abs() < 2e-3, "{} {exact}", area(&mesh));
    assert!(
        mesh.normals
            .iter()
            .filter(|n| **n != Vec3::ZERO)
            .all(|n| (n.z - 1.0 / 10f32.sqrt()).abs() < 1e-5)
    );
    // A circle of radius 1 by Catmull–Rom, closed on itself: a torus of area 4π² r.
    let n = 48;
    let ring: Vec<[f32; 4]> = (0..=n)
        .map(|i| 2.0 * PI * f64::from(i) / f64::from(n))
        .map(|a| [a.cos() as f32, a.sin() as f32, 0.0, 0.2])
        .collect();
    let errors: Vec<f64> = [1, 2, 4]
        .map(|s| {
            (area(&made(&curves(Basis::CatmullRom, &ring), CurveShape::Tube, 24, s))
                / (4.0 * PI * PI * 0.1 + 2.0 * PI * 0.01)
                - 1.0)
                .abs()
        })
        .into();
    assert!(errors[1] < errors[0] && errors[2] < 2e-3, "{errors:?}");
}

#[test]
fn splines_are_evaluated_exactly() {
    // The middle line of a ribbon, at every basis' own formula; all reproduce a straight line run
    // at constant speed and pass their known points.
    let p =
        [[0.0, 0.0, 0.0, 0.1], [1.0, 2.0, 0.0, 0.1], [3.0, 1.0, 1.0, 0.1], [4.0, 4.0, -1.0, 0.1]];
    let at = |i: usize| DVec3::new(f64::from(p[i][0]), f64::from(p[i][1]), f64::from(p[i][2]));
    let middle = |basis: Basis, segments: u32| -> Vec<DVec3> {
        made(&curves(basis, &p), CurveShape::Ribbon, 5, segments)
            .positions
            .chunks_exact(2)
            .map(|w| (w[0].as_dvec3() + w[1].as_dvec3()) * 0.5)
            .collect()
    };
    let near = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-6, "{a} {b}");
    let bezier = middle(Basis::Bezier, 2);
    near(bezier[1], (at(0) + at(1) * 3.0 + at(2) * 3.0 + at(3)) / 8.0);
    near(bezier[2], at(3));
    let bspline = middle(Basis::Bspline, 2);
    near(bspline[0], (at(0) + at(1) * 4.0 + at(2)) / 6.0);
    near(bspline[1], (at(0) + at(1) * 23.0 + at(2) * 23.0 + at(3)) / 48.0);
    let catmull_rom = middle(Basis::CatmullRom, 2);
    (0..4).for_each(|i| near(catmull_rom[2 * i], at(i)));
    near(catmull_rom[3], (at(1) * 9.0 + at(2) * 9.0 - at(0) - at(3)) / 16.0);
    let linear = middle(Basis::Linear, 7);
    assert_eq!(linear.len(), 4);
}

#[test]
fn tubes_are_closed_and_ribbons_two_sided() {
    let bent =
        [[0.0, 0.0, 0.0, 0.2], [0.1, 1.0, 0.0, 0.15], [0.9, 1.6, 0.3, 0.1], [1.5, 1.2, 1.0, 0.0]];
    for basis in [Basis::Linear, Basis::CatmullRom, Basis::Bspline, Basis::Bezier] {
        let g = geometry(made(&curves(basis, &bent), CurveShape::Tube, 6, 5));
        let t = analyze_topology(&g);
        assert_eq!(
            (t.components, t.closed_components, t.inside_out, g.dropped_degenerate),
            (1, 1, 0, 0),
            "{basis:?}"
        );
        assert!(t.closed_of_triangle.iter().all(|c| *c), "{basis:?}");
        for (tri, face) in g.triangles.iter().zip(&g.face_normals) {
            assert!(
                tri.iter().all(|&i| g.normals[i as usize] == Vec3::ZERO
                    || g.normals[i as usize].dot(*face) > 0.0)
            );
        }
        let ribbon = made(&curves(basis, &bent), CurveShape::Cross, 6, 5);
        for t in &ribbon.triangles {
            let [a, b, c] = t.map(|i| ribbon.positions[i as usize]);
            assert!((b - a).cross(c - a).dot(ribbon.normals[t[0] as usize]) > 0.0);
        }
    }
    let flat = CurveSettings {
        shape: CurveShape::Ribbon,
        normal: Some(Vec3::Y),
        ..CurveSettings::default()
    };
    let level = curves(
        Basis::CatmullRom,
        &[[0.0, 0.0, 0.0, 0.2], [1.0, 0.0, 0.5, 0.2], [2.0, 0.0, -0.5, 0.2]],
    );
    let mesh = tessellate_curves(&level, &flat).unwrap();
    assert!(
        mesh.normals.iter().all(|n| n.distance(Vec3::Y) < 1e-6)
            && mesh.positions.iter().all(|p| p.y.abs() < 1e-6)
    );
}

#[test]
fn too_many_triangles_are_refused() {
    let mut many = Curves::default();
    for i in 0..1000 {
        many.push_curve([(Vec3::X * i as f32, 0.1), (Vec3::Y, 0.1)]);
    }
    many.basis = Basis::CatmullRom;
    let fine = CurveSettings { sides: 64, segments: 64, ..CurveSettings::default() };
    assert!(
        tessellate_curves(&many, &fine).is_ok_and(|m| (m.triangles.len() as u64) < MAX_TRIANGLES)
    );
    let points: Vec<(Vec3, f32)> = (0..40_000).map(|i| (Vec3::X * i as f32, 0.1)).collect();
    many.push_curve(points);
    let message = tessellate_curves(&many, &fine).unwrap_err();
    assert!(
        message.starts_with("1001 curves would make 3359")
            && message.ends_with("use ribbons, fewer sides or fewer segments"),
        "{message}"
    );
    let short = Curves { basis: Basis::Bspline, ..curves(Basis::Linear, &[[0.0; 4], [1.0; 4]]) };
    let message = tessellate_curves(&short, &CurveSettings::default()).unwrap_err();
    assert_eq!(
        message,
        "curve 1 has 2 points, but a bspline curve needs at least 4 points; correct it or choose \
         another basis"
    );
}

/// A folder of scenes.
struct Scenes(Folder);

impl Scenes {
    fn new(name: &str) -> Self {
        Self(Folder::new(&format!("curves-{name}")))
    }
    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        self.0.file(name, content);
    }
    fn load(&self, mesh: &str) -> nearfar::error::Result<Loaded> {
        self.write(
            "s.toml",
            format!("[[mesh]]\n{mesh}\n[[light]]\ntype = \"sky\"\nradiance = 1\n"),
        );
        load(Path::new(&self.0.at("s.toml")), &[])
    }
    fn message(&self, mesh: &str) -> String {
        let text = self
            .load(mesh)
            .map_or_else(|e| e.to_string(), |l| format!("loaded; {}", l.warnings.join("; ")));
        self.0.plain(&text)
    }
}

/// A `.hair` file of two strands of 2 and 1 segments.
fn hair(arrays: u32, points: &[f32], more: &[u8]) -> Vec<u8> {
    let mut b = b"HAIR".to_vec();
    for word in [2u32, 5, arrays, 2] {
        b.extend(word.to_le_bytes());
    }
    for x in [0.25f32, 0.0, 0.8, 0.4, 0.2] {
        b.extend(x.to_le_bytes());
    }
    b.resize(128, 0);
    if arrays & 1 == 1 {
        b.extend([2, 0, 1, 0]);
    }
    points.iter().for_each(|x| b.extend(x.to_le_bytes()));
    b.extend(more);
    b
}

const POINTS: [f32; 15] =
    [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 1.0, 0.0, 0.0, 1.0, 3.0, 0.0];

#[test]
fn hair_files_are_read() {
    let folder = Scenes::new("hair");
    let ribbon = "file = \"a.hair\"\ncurves = { shape = \"ribbon\" }";
    folder.write("a.hair", hair(0b11, &POINTS, &[]));
    let loaded = folder.load(ribbon).unwrap();
    let mesh = &loaded.scene.meshes[0];
    assert_eq!((mesh.triangles.len(), loaded.scene.materials.len()), (6, 1));
    assert!((area(mesh) - 0.25 * 5.0).abs() < 1e-6);
    assert_eq!(
        (loaded.scene.materials[0].name.as_str(), loaded.scene.materials[0].albedo),
        ("a", Vec3::new(0.8, 0.4, 0.2))
    );
    assert!(
        loaded.notes[0].ends_with("a.hair: 2 curves made into 6 triangles"),
        "{:?}",
        loaded.notes
    );
    // Thickness and transparency a point.
    let each: Vec<u8> = [0.5f32; 5].iter().chain(&[0.3; 5]).flat_map(|x| x.to_le_bytes()).collect();
    folder.write("a.hair", hair(0b1111, &POINTS, &each));
    assert!((area(&folder.load(ribbon).unwrap().scene.meshes[0]) - 0.5 * 5.0).abs() < 1e-6);
    assert_eq!(folder.message(ribbon), "loaded; a.hair: transparency of hair is left out");
    let scaled = "file = \"a.hair\"\nscale = 2\ncurves = \
                  { shape = \"ribbon\", basis = \"catmull-rom\", width = 0.1, width_scale = 3, \
                  material = \"coat\" }";
    let loaded = folder.load(scaled).unwrap();
    assert!(
        (area(&loaded.scene.meshes[0]) - 2.0 * 0.3 * 10.0).abs() < 1e-5,
        "widths follow the scale"
    );
    assert_eq!(loaded.scene.materials[0].name, "coat");
    let cases: [(Vec<u8>, &str); 6] = [
        (
            b"HAI".to_vec(),
            "a.hair: is no HAIR file: its header is missing; give a .hair file, or rename a text \
             file to .curves",
        ),
        (
            hair(0b11, &POINTS[..9], &[]),
            "a.hair: is cut short: 2 strands of 5 points take 192 bytes, the file has 168; copy \
             it again",
        ),
        (hair(0b01, &[], &[]), "a.hair: has no points array; export it again"),
        (
            hair(0b10, &POINTS, &[]),
            "a.hair: its strands have 6 points together, its header says 5; export it again",
        ),
        (hair(0b11, &[f32::NAN; 15], &[]), "a.hair: point 0 is not finite; export it again"),
        (
            hair(0b111, &POINTS, &(-1f32).to_le_bytes().repeat(5)),
            "a.hair: the thickness of point 0 is -1; it must be finite and not negative",
        ),
    ];
    for (bytes, expected) in cases {
        folder.write("a.hair", bytes);
        assert_eq!(folder.message(ribbon), expected);
    }
    // Any cut and any single changed byte of the header is an error or a scene, never a panic.
    let good = hair(0b11, &POINTS, &[]);
    for n in 0..good.len() {
        folder.write("a.hair", &good[..n]);
        assert!(folder.load(ribbon).is_err());
    }
    for at in 0..48 {
        let mut bad = good.clone();
        bad[at] ^= 0xff;
        folder.write("a.hair", bad);
        let _ = folder.load(ribbon);
    }
}

#[test]
fn text_curves_are_read() {
    let folder = Scenes::new("text");
    folder.write(
        "a.curves",
        "# two curves\n0 0 0 0.1\n0 1 0 0.1\n# still the first\n0 2 0 0.1\n\n\n1 0 0 0.05\n1 4 0 \
         0.05 # tip\n",
    );
    let loaded = folder.load("file = \"a.curves\"\ncurves = { shape = \"ribbon\" }").unwrap();
    assert!((area(&loaded.scene.meshes[0]) - (0.2 * 2.0 + 0.1 * 4.0)).abs() < 1e-6);
    let cases = [
        ("0 0 0 1\n0 1 x 1\n", "a.curves:2: \"x\" is no finite number; a point is x y z radius"),
        (
            "0 0 0 1\n0 1 nan 1\n",
            "a.curves:2: \"nan\" is no finite number; a point is x y z radius",
        ),
        ("0 0 0 1\n0 1 0 -1\n", "a.curves:2: the radius -1 is negative; give a radius from 0 on"),
        (
            "0 0 0\n0 1 0\n",
            "a.curves:1: the point has no radius; write x y z radius, or give curves.width in the \
             scene",
        ),
        ("0 0\n", "a.curves:1: a point is x y z radius, found 2 numbers"),
        (
            "0 0 0 1\n0 1 0 1\n\n5 5 5 1\n\n4 4 4 1\n4 4 4 1\n",
            "loaded; a.curves: 2 curves are but a point and are left out",
        ),
        ("5 5 5 1\n", "a.curves: holds no curves; export it again"),
        ("# nothing\n", "a.curves: holds no curves; export it again"),
    ];
    for (text, expected) in cases {
        folder.write("a.curves", text);
        assert_eq!(folder.message("file = \"a.curves\""), expected);
    }
    folder.write("a.curves", "0 0 0\n0 1 0\n0 2 0\n");
    assert_eq!(folder.message("file = \"a.curves\"\ncurves = { width = 0.1 }"), "loaded; ");
    let scene_faults = [
        (
            "curves = { width = 0.1, basis = \"bezier\" }",
            "s.toml:1: curve 1 has 3 points, but a bezier curve needs 4, 7, 10, … points; correct \
             it or choose another basis",
        ),
        ("curves = { width = 0 }", "s.toml:1: curves.width must be finite and above 0"),
        (
            "curves = { width = 0.1, sides = 2 }",
            "s.toml:1: sides must lie from 3 to 64, segments from 1 to 64",
        ),
        (
            "curves = { width = 0.1, normal = [0, 0, 0] }",
            "s.toml:1: normal must be finite and not zero",
        ),
        ("subdivision = { levels = 2 }", "s.toml:1: subdivision belongs to .obj files; remove it"),
    ];
    for (table, expected) in scene_faults {
        assert_eq!(folder.message(&format!("file = \"a.curves\"\n{table}")), expected);
    }
}

const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\nvt 0 \
                    0\nvt 1 0\nvt 1 1\nvt 0 1\n\
    f 1/1 3/2 4/3 2/4\nf 5/1 6/2 8/3 7/4\nusemtl red\nf 1/1 2/2 6/3 5/4\nf 3/1 7/2 8/3 4/4\ng \
                    other\nf 1/1 5/2 7/3 3/4\nf 2/1 4/2 8/3 6/4\n";

#[test]
fn cages_are_read_with_their_tags() {
    let folder = Scenes::new("cage");
    let entry = "file = \"a.obj\"\nsubdivision = { levels = 3 }";
    let closed = |loaded: &Loaded| {
        let g = Geometry::new(&loaded.scene);
        analyze_topology(&g).closed_components == 1 && g.len() == 6 * 4 * 16 * 2
    };
    folder.write("a.obj", CUBE);
    let smooth = folder.load(entry).unwrap();
    assert!(closed(&smooth), "groups and materials do not part the surface");
    let mesh = &smooth.scene.meshes[0];
    assert!(
        !mesh.uvs.is_empty()
            && mesh.materials.iter().filter(|m| **m == mesh.materials[0]).count() == 2 * 4 * 16 * 2
    );
    assert!(
        smooth.notes[0].ends_with("a.obj: 6 faces subdivided into 768 triangles"),
        "{:?}",
        smooth.notes
    );
    let crest =
        |l: &Loaded| l.scene.meshes[0].positions.iter().map(|p| p.z).fold(f32::MIN, f32::max);
    assert!(crest(&smooth) < 0.95);
    // The rim as a chain, counted from 0.
    folder.write("a.obj", format!("{CUBE}t crease 5/1/0 4 5 7 6 4 10\n"));
    let rim = folder.load(entry).unwrap();
    assert!(closed(&rim) && crest(&rim) == 1.0);
    folder.write(
        "a.obj",
        format!(
            "{CUBE}t hole 1/0/0 1\nt corner 1/1/0 0 10\nt interpolateboundary 1/0/0 2\nt \
             creasemethod 0/0/1 chaikin\nt crease 2/1/0 0 7 3\n"
        ),
    );
    let holed = folder.load(entry).unwrap();
    assert_eq!(Geometry::new(&holed.scene).len(), 5 * 4 * 16 * 2);
    assert!(holed.scene.meshes[0].positions.contains(&Vec3::ZERO));
    let warned = folder.message(entry);
    assert!(
        warned.contains("1 creases run along no edge of the mesh")
            && warned.contains("left out: creasemethod"),
        "{warned}"
    );
    // Half the polygons are the cage as they are: tags do no harm without subdivision.
    assert_eq!(folder.load("file = \"a.obj\"").unwrap().scene.meshes[0].triangles.len(), 12);
    let mirrored = folder.load(&format!("{entry}\nscale = [-1, 1, 1]")).unwrap();
    let g = Geometry::new(&mirrored.scene);
    assert_eq!(analyze_topology(&g).inside_out, 0);
    let faults = [
        (
            "t crease 2/1/0 1 2\n",
            "a.obj:21: the tag announces 2 + 1 + 0 arguments and has 2; correct the counts",
        ),
        (
            "t crease 2/1 1 2 3\n",
            "a.obj:21: \"t crease 2/1 1 2 3\" is no tag; write t NAME ints/floats/strings and as \
             many arguments, e.g. t crease 2/1/0 4 7 2.5",
        ),
        (
            "t crease 2/1/0 1 99 3\n",
            "a.obj:21: vertex 99 is out of range: the file has 8, counted from 0 in tags",
        ),
        (
            "t crease 2/1/0 1 -1 3\n",
            "a.obj:21: \"-1\" is no index; vertices and faces count from 0 in tags",
        ),
        (
            "t crease 2/1/0 1 3 nan\n",
            "a.obj:21: \"nan\" is no sharpness; give a number from 0 on, 10 for always sharp",
        ),
        (
            "t crease 3/3/0 1 3 2 1 1 1\n",
            "a.obj:21: the tag has 3 values of sharpness for 2 edges; give one, or one each",
        ),
        (
            "t hole 1/0/0 6\n",
            "a.obj:21: face 6 is out of range: the file has 6, counted from 0 in tags",
        ),
        (
            "t interpolateboundary 1/0/0 7\n",
            "a.obj:21: interpolateboundary takes 0 (faces left out), 1 (creases with corners) or \
             2 (creases)",
        ),
        (
            "f 1 2 99\n",
            "a.obj:21: index 99 is out of range: the file has 8 vertices; correct the index or \
             export the mesh again",
        ),
    ];
    for (line, expected) in faults {
        folder.write("a.obj", format!("{CUBE}{line}"));
        assert_eq!(folder.message(entry), expected);
    }
    folder.write("a.obj", format!("{CUBE}f 1 1 2\n"));
    assert!(folder.message(entry).contains("1 faces have fewer than three distinct corners"));
    folder.write("a.obj", CUBE);
    let scene_faults = [
        (
            "{ levels = 0 }",
            "s.toml:1: levels is 0 but must be at least 1; remove subdivision for the polygons \
             themselves",
        ),
        ("{ levels = 11 }", "s.toml:1: levels is 11 but may not exceed 10; give fewer"),
        (
            "{ levels = 2, edge = 0.1 }",
            "s.toml:1: subdivision has levels and edge; remove one of them",
        ),
        (
            "{ edge = \"five\" }",
            "s.toml:1: subdivision.edge must be a length above 0, or a share of the diagonal like \
             \"0.5%\"",
        ),
        (
            "{ edge = -1 }",
            "s.toml:1: subdivision.edge must be a length above 0, or a share of the diagonal like \
             \"0.5%\"",
        ),
        ("{ crease_angle_deg = 200 }", "s.toml:1: crease_angle_deg must lie from 0 to 180"),
        (
            "{ crease_sharpness = 2 }",
            "s.toml:1: crease_sharpness belongs to crease_angle_deg; add it or remove \
             crease_sharpness",
        ),
        (
            "{ levls = 2 }",
            "s.toml:3: unknown field `levls`, expected one of `levels`, `edge`, \
             `crease_angle_deg`, `crease_sharpness`, `boundary`, `uv`",
        ),
    ];
    for (table, expected) in scene_faults {
        assert_eq!(folder.message(&format!("file = \"a.obj\"\nsubdivision = {table}")), expected);
    }
    let share = folder.load("file = \"a.obj\"\nsubdivision = { edge = \"5%\" }").unwrap();
    let absolute = folder.load("file = \"a.obj\"\nsubdivision = { edge = 0.0866 }").unwrap();
    assert_eq!(share.scene.meshes[0].positions, absolute.scene.meshes[0].positions, "5 % of √3");
    let sharp = folder
        .load("file = \"a.obj\"\nsubdivision = { levels = 2, crease_angle_deg = 30 }")
        .unwrap();
    assert!((area(&sharp.scene.meshes[0]) - 6.0).abs() < 1e-5);
}

#[test]
fn built_in_scenes_load_and_tell_what_they_are() {
    let path = |name: &str| {
        Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}/{name}.toml"))
    };
    let set = |key: &str, value: &str| vec![(key.to_owned(), value.to_owned())];
    let cages = load(&path("subdivision"), &set("mesh.0.subdivision.levels", "2")).unwrap();
    let g = Geometry::new(&cages.scene);
    let t = analyze_topology(&g);
    // Floor, five cubes, frame and vase are closed and face outwards; the sheet is open.
    assert_eq!(
        (
            t.components,
            t.closed_components,
            t.inside_out,
            t.inconsistent_edges,
            t.nonmanifold_edges
        ),
        (9, 8, 0, 0, 0)
    );
    let thin = load(&path("fur"), &set("mesh.0.parameters.detail", "0.05")).unwrap();
    assert_eq!(thin.scene.meshes.len(), 3);
    let round = load(
        &path("fur"),
        &[set("mesh.0.parameters.detail", "0.05"), set("mesh.0.curves.shape", "tube")].concat(),
    )
    .unwrap();
    let t = analyze_topology(&Geometry::new(&round.scene));
    assert_eq!((t.components, t.closed_components), (1500 + 300 + 2, 1500 + 300 + 2));
    let output = Command::new(env!("CARGO_BIN_EXE_nearfar"))
        .arg("info")
        .arg(path("subdivision"))
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        output.status.success()
            && text.contains("note: subdivision: ")
            && text.contains(" faces subdivided into "),
        "{text}"
    );
}
