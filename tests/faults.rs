//! Files and scenes that exporters and people really write, with the right value: a closed form, or
//! the same scene written plainly.

use std::path::Path;

use glam::Vec2;
use nearfar::accel::Backend;
use nearfar::film::{Film, Precision, read_exr, write_exr};
use nearfar::load::{Loaded, load};
use nearfar::radiometry::Rgb;
use nearfar::run::Run;
use nearfar::scene::Light;
use nearfar::shading::World;
use nearfar::tessellate::Geometry;

use crate::support::{Folder, program};

const SQUARE: &str =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n";
const LIBRARY: &str = "newmtl m\nKd 0.7 0.2 0.1\nnewmtl n\nKd 0.1 0.2 0.7\n";
const RED: Rgb = Rgb::new(0.7, 0.2, 0.1);

/// A folder of files.
struct Files(Folder);

impl Files {
    fn new(name: &str, files: &[(&str, &[u8])]) -> Self {
        let out = Self(Folder::new(name));
        files.iter().for_each(|(name, bytes)| out.write(name, bytes));
        out
    }
    fn write(&self, name: &str, bytes: &[u8]) {
        self.0.file(name, bytes);
    }
    /// A picture of 8 by 8 texels, the left half black, the right half white.
    fn halves(&self, name: &str) {
        let texel = |x: u32, _: u32| image::Luma([if x < 4 { 0u8 } else { 255 }]);
        image::GrayImage::from_fn(8, 8, texel).save(self.0.join(name)).unwrap();
    }
    fn load(&self, mesh: &str) -> nearfar::error::Result<Loaded> {
        let text = format!("{mesh}\n[[light]]\ntype = \"sky\"\nradiance = 1\n");
        self.write("s.toml", text.as_bytes());
        load(&self.0.join("s.toml"), &[])
    }
}

const MESH: &str = "[[mesh]]\nfile = \"a.obj\"";

/// Albedo of a triangle at the barycentrics (u, v).
fn albedo(loaded: &Loaded, triangle: u32, u: f32, v: f32) -> Rgb {
    Geometry::new(&loaded.scene).albedo(triangle, u, v)
}

/// The square, and what is written of it in one way or another: its material is found.
#[test]
fn squares_as_exporters_write_them() {
    let wide: Vec<u8> = format!("\u{feff}{SQUARE}mtllib a.mtl\nusemtl m\nf 1 2 3 4\n")
        .encode_utf16()
        .flat_map(u16::to_le_bytes)
        .collect();
    let text = |rest: &str| format!("mtllib a.mtl\n{SQUARE}{rest}").into_bytes();
    let cases = [
        ("comment", text("usemtl m\nf 1 2 3 4 # quad\n")),
        ("continuation", text("usemtl m\nf 1 2 \\\n3 4\n")),
        ("tab", text("usemtl\tm\nf\t1\t2\t3\t4\n")),
        ("tail", text("usemtl m # red\nf 1 2 3 4\n")),
        (
            "CR",
            text("usemtl m\nf 1 2 3 4\n")
                .iter()
                .map(|&b| if b == b'\n' { b'\r' } else { b })
                .collect(),
        ),
        ("UTF-16", wide),
        ("two", [b"mtllib b.mtl a.mtl\n", SQUARE.as_bytes(), b"usemtl m\nf 1 2 3 4\n"].concat()),
        ("case", [b"mtllib A.MTL\n", SQUARE.as_bytes(), b"usemtl m\nf 1 2 3 4\n"].concat()),
        ("nan", text("vn nan nan nan\nusemtl m\nf 1//1 2//1 3//1 4//2\n")),
        ("colours", text("v 5 5 5 1 0 0\nusemtl m\nf 1 2 3 4\n")),
        ("mixed corners", text("usemtl m\nf 1/1 2 3/3 4/4/1\n")),
    ];
    for (name, bytes) in cases {
        let files =
            Files::new("faults-square", &[("a.mtl", LIBRARY.as_bytes()), ("a.obj", &bytes)]);
        files.write("b.mtl", b"newmtl x\nKd 0 1 0\n");
        let loaded = files.load(MESH).unwrap_or_else(|e| panic!("{name}: {e}"));
        let g = Geometry::new(&loaded.scene);
        assert!(g.len() == 2 && albedo(&loaded, 0, 0.3, 0.3) == RED, "{name}");
        let told = loaded.warnings.join("\n");
        assert_eq!(told.is_empty(), !matches!(name, "nan" | "colours"), "{name}: {told}");
    }
}

#[test]
fn materials_nobody_defines() {
    let files = Files::new("faults-undefined", &[("a.mtl", LIBRARY.as_bytes())]);
    for (use_statement, told) in
        [("usemtl\n", "usemtl without a name"), ("", "2 triangles have no material")]
    {
        files
            .write("a.obj", format!("mtllib a.mtl\n{SQUARE}{use_statement}f 1 2 3 4\n").as_bytes());
        let loaded = files.load(MESH).unwrap();
        assert_eq!(albedo(&loaded, 0, 0.3, 0.3), Rgb::splat(0.5));
        assert!(loaded.warnings[0].contains(told), "{:?}", loaded.warnings);
        let named = format!("{MESH}\nmaterial = \"paint\"\n[material.paint]\nalbedo = 0.25");
        let loaded = files.load(&named).unwrap();
        assert_eq!(albedo(&loaded, 0, 0.3, 0.3), Rgb::splat(0.25));
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    }
    // Many of them end soon, and are not told one by one.
    let many: String = (0..20_000).map(|i| format!("usemtl x{i}\nf 1 2 3\n")).collect();
    files.write("a.obj", format!("{SQUARE}{many}").as_bytes());
    let loaded = files.load(MESH).unwrap();
    assert!(loaded.warnings.len() < 12 && loaded.warnings.join(" ").contains("further materials"));
}

/// Faces keep their texture coordinates and normals, whatever the others of their group have.
#[test]
fn faces_keep_what_they_have() {
    let more =
        "v 3 0 0\nv 4 0 0\nv 3 1 0\nvn 0 1 1\nusemtl m\nf 1/1 2/2 3/3\nf 5 6 7\nf 5//2 6//2 7//2\n";
    let text = format!("mtllib a.mtl\n{SQUARE}{more}");
    let files = Files::new("faults-mixed", &[("a.obj", text.as_bytes())]);
    files.write("a.mtl", b"newmtl m\nmap_Kd t.png\n");
    files.halves("t.png");
    let loaded = files.load(MESH).unwrap();
    let g = Geometry::new(&Default::default());
    assert!(g.is_empty() && loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let mesh = &loaded.scene.meshes[0];
    assert_eq!(mesh.triangles.len(), 3);
    let uv = |t: usize, k: usize| mesh.uvs[mesh.triangles[t][k] as usize];
    assert_eq!([uv(0, 1), uv(0, 2), uv(1, 1)], [Vec2::X, Vec2::ONE, Vec2::ZERO]);
    let normal = |t: usize| mesh.normals[mesh.triangles[t][0] as usize];
    assert!(normal(0) == glam::Vec3::ZERO && normal(2).y > 0.7);
}

/// Textures with options, under `Kd` that is missing, white or black, and where they are not said
/// to be.
#[test]
fn textures() {
    let obj = format!("mtllib a.mtl\n{SQUARE}usemtl m\nf 1/1 2/2 3/3\n");
    let files = Files::new("faults-textures", &[("a.obj", obj.as_bytes())]);
    files.halves("t.png");
    let look = |mtl: &str, at: f32| {
        files.write("a.mtl", format!("newmtl m\n{mtl}\n").as_bytes());
        let loaded = files.load(MESH).unwrap();
        // Barycentrics of (at, y) in the triangle (0, 0), (1, 0), (1, 1).
        let y = 0.01;
        (albedo(&loaded, 0, at - y, y).x, loaded)
    };
    let value = |mtl: &str, at: f32| look(mtl, at).0;
    assert!(value("map_Kd t.png", 0.2) < 0.01 && value("map_Kd t.png", 0.8) > 0.9);
    assert!(value("Kd 1 1 1\nmap_Kd -s 4 4 1 t.png", 0.19) > 0.9);
    assert!(value("Kd 1 1 1\nmap_Kd -s 4 4 1 t.png", 0.31) < 0.01);
    assert!(value("Kd 1 1 1\nmap_Kd -o 0.5 0 0 -clamp on t.png", 0.2) > 0.9);
    assert!(value("Kd 1 1 1\nmap_Kd -o 0.5 0 0 -clamp on t.png", 0.9) > 0.9);
    assert!((value("Kd 1 1 1\nmap_Kd -mm 0.25 0.5 t.png", 0.2) - 0.25).abs() < 1e-3);
    let (black, loaded) = look("Kd 0 0 0\nmap_Kd t.png", 0.8);
    assert!(black == 0.0 && loaded.warnings[0].contains("material \"m\" is black"));
    let (_, loaded) = look("map_Kd -bm 0.3 t.png", 0.8);
    assert!(loaded.warnings[0].contains("options of map_Kd in \"m\" are left out: -bm 0.3"));
    let (found, loaded) = look("map_Kd D:\\art\\T.PNG", 0.8);
    assert!(found > 0.9 && loaded.notes.join(" ").contains("is taken from"), "{:?}", loaded.notes);
    let (plain, loaded) = look("Kd 0.3 0.3 0.3\nmap_Kd gone.png", 0.8);
    assert!(plain == 0.3 && loaded.warnings[0].contains("name its folder in search_paths"));
    files.write("a.mtl", b"newmtl m\nmap_Kd /gone/u.png\n");
    std::fs::create_dir_all(files.0.join("maps")).unwrap();
    files.halves("maps/u.png");
    let searched = files.load(&format!("search_paths = [\"maps\"]\n{MESH}")).unwrap();
    assert!(albedo(&searched, 0, 0.79, 0.01).x > 0.9);
}

#[test]
fn mirrors_and_glass_are_told() {
    let obj = format!("mtllib a.mtl\n{SQUARE}usemtl m\nf 1 2 3 4\n");
    let files = Files::new("faults-mirror", &[("a.obj", obj.as_bytes())]);
    files.write("a.mtl", b"newmtl m\nKd 0 0 0\nKs 1 1 1\nillum 3\n");
    let told = files.load(MESH).unwrap().warnings;
    assert!(told.len() == 1 && told[0].contains("mirror: m"), "{told:?}");
    let meant = files.load(&format!("{MESH}\nmaterials = \"diffuse\"")).unwrap().warnings;
    assert!(meant.is_empty(), "{meant:?}");
}

/// A lamp whose face is there twice, back to back, lights both ways alike.
#[test]
fn doubled_lamps_light_both_ways() {
    let square = |z: f32, half: f32, material: &str, turned: bool| {
        let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
        let lines: String = corners.iter().map(|[x, y]| format!("v {x} {y} {z}\n")).collect();
        let order = if turned { "-1 -2 -3 -4" } else { "-4 -3 -2 -1" };
        format!("{lines}usemtl {material}\nf {order}\n")
    };
    let lamp = square(0.0, 0.5, "lamp", false) + "f -1 -2 -3 -4\n";
    let walls = square(-1.0, 1.0, "m", false) + &square(1.0, 1.0, "m", true);
    let files = Files::new("faults-doubled", &[]);
    files.write("a.mtl", b"newmtl m\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\n");
    files.write("a.obj", format!("mtllib a.mtl\n{lamp}{walls}").as_bytes());
    let mean = |target: f32| {
        let scene = format!(
            "[camera]\neye = [0.9, 0, {}]\ntarget = [0, 0, {target}]\n{MESH}\n",
            0.4 * target
        );
        files.write("s.toml", scene.as_bytes());
        let at = |name: &str| files.0.at(name);
        let (scene, out) = (at("s.toml"), at("o.exr"));
        let done = program(&[
            "render", &scene, "-o", &out, "-q", "--size", "32x32", "--method", "direct", "--spp",
            "16",
        ]);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let all = read_exr(Path::new(&out)).unwrap().rgb("").unwrap();
        all.iter().map(|c| c.x).sum::<f32>() / all.len() as f32
    };
    let (floor, ceiling) = (mean(-1.0), mean(1.0));
    assert!(floor > 0.05 && (floor / ceiling - 1.0).abs() < 0.02, "{floor} {ceiling}");
}

/// Skies of luminance alone and under either magic word are the plain sky; what is outside of a
/// data window is black.
#[test]
fn foreign_skies() {
    let obj = format!("{SQUARE}f 1 2 3 4\n");
    let files = Files::new("faults-skies", &[("a.obj", obj.as_bytes())]);
    let sky = |file: &str| {
        let text = format!("{MESH}\n[[light]]\ntype = \"environment\"\nfile = \"{file}\"\n");
        files.write("e.toml", text.as_bytes());
        let loaded = load(&files.0.join("e.toml"), &[]).unwrap();
        let maps = loaded.scene.lights.iter().find_map(|light| match light {
            Light::Environment { map } => Some(map.texels.clone()),
            _ => None,
        });
        maps.unwrap()
    };
    let mut film = Film::new(8, 4);
    film.set("Y", (0..32).map(|i| i as f32).collect());
    write_exr(&film, &files.0.join("y.exr"), Precision::Full).unwrap();
    assert!(sky("y.exr").iter().enumerate().all(|(i, c)| *c == Rgb::splat(i as f32)));
    // Flat texels (128, 64, 32) · 2^(129 − 136): 1, 0.5, 0.25.
    let texels = [128u8, 64, 32, 129].repeat(32);
    for (head, expected) in [
        ("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n", 1.0),
        ("#?RGBE\nFORMAT=32-bit_rle_rgbe\n", 1.0),
        ("#?RADIANCE\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=4\n", 0.125),
    ] {
        files.write("m.hdr", &[format!("{head}\n-Y 4 +X 8\n").as_bytes(), &texels].concat());
        let found = sky("m.hdr")[5];
        assert!((found / (Rgb::new(1.0, 0.5, 0.25) * expected) - 1.0).abs().max_element() < 0.01);
    }
    files.write("wide.hdr", b"#?RADIANCE\n\n-Y 13000 +X 26000\n");
    files.write(
        "e.toml",
        format!("{MESH}\n[[light]]\ntype = \"environment\"\nfile = \"wide.hdr\"\n").as_bytes(),
    );
    let refused = load(&files.0.join("e.toml"), &[]).unwrap_err().to_string();
    assert!(refused.contains("at most 16384 a side are read"), "{refused}");
}

/// The backs of a body around the camera and its lamp are there for the methods that ask.
#[test]
fn rooms_wound_outwards_have_insides() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
                f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    let files = Files::new("faults-room", &[("a.obj", text.as_bytes())]);
    let loaded = files
        .load(&format!(
            "[camera]\neye = [0.5, 0.5, 0.9]\ntarget = [0.5, 0.5, 0]\nup = [0, 1, 0]\n{MESH}\n\
             [[light]]\ntype = \"point\"\nposition = [0.5, 0.5, 0.5]\nintensity = 1\n"
        ))
        .unwrap();
    let world = World::new(&loaded.scene, Backend::Bvh, &Run::new(1).unwrap()).unwrap();
    assert!(!nearfar::render::camera_inside_wall(&world));
    let topology = nearfar::tessellate::analyze_topology(&world.geometry);
    assert!(topology.closed_components == 1 && !topology.closed_of_triangle.contains(&true));
}

/// A room with a lamp, its coordinates moved by `shift` and multiplied by `times`; the scene file
/// brings them to where `at` is.
fn room(shift: [f64; 3], times: f64, at: [f64; 3], transform: &str) -> (String, String) {
    let corners =
        "0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1 .3 0 .3 .6 0 .3 .6 .4 .3 .3 .4 .3";
    let numbers: Vec<f64> = corners.split(' ').map(|n| n.parse().unwrap()).collect();
    let mut obj = String::new();
    for p in numbers.chunks(3) {
        let p: Vec<String> = (0..3).map(|k| format!("{:.6}", p[k] * times + shift[k])).collect();
        obj += &format!("v {}\n", p.join(" "));
    }
    obj += "f 1 4 3 2\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nf 9 10 11 12\n";
    let point = |p: [f64; 3]| format!("{:?}", [p[0] + at[0], p[1] + at[1], p[2] + at[2]]);
    let scene = format!(
        "[camera]\neye = {}\ntarget = {}\nwidth = 32\nheight = 24\n{MESH}\n{transform}\n\
         [[light]]\ntype = \"quad\"\ncorner = {}\nedge1 = [0.4, 0, 0]\nedge2 = [0, 0, 0.4]\n\
         radiance = 10\n",
        point([0.5, 0.6, 2.0]),
        point([0.5, 0.5, 0.0]),
        point([0.3, 0.99, 0.3])
    );
    (obj, scene)
}

/// Coordinates of maps, far transforms and millimetres give the picture of the plain scene, and
/// positions are told in the user's space.
#[test]
fn far_scenes_are_the_plain_one() {
    let files = Files::new("faults-far-room", &[]);
    let picture = |(obj, scene): (String, String), method: &str| {
        files.write("a.obj", obj.as_bytes());
        files.write("s.toml", scene.as_bytes());
        let at = |name: &str| files.0.at(name);
        let (scene, out) = (at("s.toml"), at("o.exr"));
        let done =
            program(&["render", &scene, "-o", &out, "-q", "--method", method, "--spp", "16"]);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        read_exr(Path::new(&out)).unwrap()
    };
    let mean = |film: &Film| {
        let all = film.rgb("").unwrap();
        all.iter().map(|c| f64::from(c.element_sum())).sum::<f64>() / all.len() as f64
    };
    let zero = [0.0; 3];
    let utm = [448_262.25, 312.5, 5_411_932.75];
    let far = [3e9, 0.0, -1e9];
    for method in ["path", "decomposition"] {
        let plain = picture(room(zero, 1.0, zero, ""), method);
        assert!(mean(&plain) > 0.05);
        let by = |p: [f64; 3]| format!("translate = {p:?}");
        for (case, at) in [
            (room(utm, 1.0, utm, ""), utm),
            (room(zero, 1.0, utm, &by(utm)), utm),
            (room(utm, 1.0, zero, &by(utm.map(|x| -x))), zero),
            (room(utm.map(|x| x * 1e3), 1e3, utm, "scale = 0.001"), utm),
            (room(far, 1.0, far, ""), far),
        ] {
            let text = case.1.clone();
            let moved = picture(case, method);
            let ratio = mean(&moved) / mean(&plain);
            // Places follow a grid through zero: elsewhere it cuts the room differently, and other
            // rays are shot.
            let bound = if method == "path" { 1e-3 } else { 1e-2 };
            assert!((ratio - 1.0).abs() < bound, "{method} {ratio} {text}");
            let (p, q) = (plain.xyz("P").unwrap(), moved.xyz("P").unwrap());
            let hit = p.iter().position(|p| p.length() > 0.1).unwrap();
            let error = (q[hit].as_dvec3() - p[hit].as_dvec3() - glam::DVec3::from_array(at)).abs();
            let largest = at.iter().fold(1.0f64, |m, x| m.max(x.abs()));
            assert!(error.max_element() < largest * 1e-7 + 1e-3, "{error}");
        }
    }
}

/// What even double precision cannot hold is refused, and so is what is but a point.
#[test]
fn far_and_flat_scenes_are_refused() {
    let files = Files::new("faults-far", &[("a.obj", format!("{SQUARE}f 1 2 3 4\n").as_bytes())]);
    let moved = |by: &str| files.load(&format!("{MESH}\ntranslate = [{by}, 0, 0]"));
    for by in ["1000", "5e5", "1e9"] {
        let loaded = moved(by).unwrap();
        let around = Geometry::new(&loaded.scene).bounds;
        assert!((around.diagonal() - 2.0f32.sqrt()).abs() < 1e-6);
        let corner = around.min.as_dvec3() + loaded.scene.origin;
        assert!((corner.x - by.parse::<f64>().unwrap()).abs() < 1e-6, "{corner}");
    }
    let refused = moved("1e14").unwrap_err().to_string();
    assert!(refused.contains("double precision"), "{refused}");
    files.write("a.obj", b"v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n");
    let refused = files.load(MESH).unwrap_err().to_string();
    assert!(refused.contains("a.obj is but a point"), "{refused}");
}

/// Vertices without a normal are exported with those of their faces.
#[test]
fn exported_normals_are_unit() {
    let obj = format!("{SQUARE}vn 0 0 0\nf 1//2 2//1 3//1 4//1\nf 1 3 4\n");
    let files = Files::new("faults-export", &[("a.obj", obj.as_bytes())]);
    let loaded = files.load(MESH).unwrap();
    let written = nearfar::export::export(&loaded.scene, &files.0.join("mi")).unwrap();
    let mesh = written.iter().find(|p| p.extension().is_some_and(|x| x == "ply")).unwrap();
    let bytes = std::fs::read(mesh).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let columns = header.matches("property float").count();
    let count = header.split("element vertex ").nth(1).unwrap().lines().next().unwrap();
    let rows = bytes[end..].chunks_exact(4 * columns).take(count.parse().unwrap());
    for row in rows {
        let number = |i: usize| f32::from_le_bytes(row[4 * i..4 * i + 4].try_into().unwrap());
        assert!((glam::Vec3::new(number(3), number(4), number(5)).length() - 1.0).abs() < 1e-5);
    }
}
