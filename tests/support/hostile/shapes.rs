//! Scenes that are well-formed and absurd: shapes without area, cameras that see nothing, lamps
//! where none can be, materials that are none, pictures of one row, cycles of files.

use super::{Case, LIBRARY, Right, SCENE, SQUARE, case};

/// Meshes.
const OBJ: [(&str, &str); 24] = [
    ("a point", "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n"),
    ("a line", "v -1 0 0\nv 0 0 0\nv 1 0 0\nf 1 2 3\n"),
    ("a needle", "v -1 0 0\nv 1 0 0\nv 0 1e-30 0\nf 1 2 3\n"),
    ("a speck", "v 0 0 0\nv 1e-30 0 0\nv 0 1e-30 0\nf 1 2 3\n"),
    (
        "a speck in a room",
        "v 0 0 0\nv 1e-30 0 0\nv 0 1e-30 0\nf 1 2 3\nv 9 0 0\nv 0 9 0\nf 1 4 5\n",
    ),
    ("one edge of an ulp", "v 1 1 1\nv 1.0000001 1 1\nv 1 2 1\nf 1 2 3\n"),
    ("one that is far", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1e12 0 0\nf 1 2 3\nf 1 2 4\n"),
    ("a face of one corner", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1\nf 1 2\nf 1 2 3\n"),
    ("a face twice", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 3\n"),
    ("a face and its back", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 1\n"),
    ("a corner twice", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 1 2 3 3\n"),
    ("a bow", "v -1 -1 0\nv 1 1 0\nv 1 -1 0\nv -1 1 0\nf 1 2 3 4\n"),
    ("a star", "v 0 1 0\nv .6 -.8 0\nv -1 .3 0\nv 1 .3 0\nv -.6 -.8 0\nf 1 2 3 4 5\n"),
    ("a polygon out of its plane", "v 0 0 0\nv 1 0 9\nv 1 1 -9\nv 0 1 9\nf 1 2 3 4\n"),
    ("a spiral in itself", "v 0 0 0\nv 3 0 0\nv 3 3 0\nv 0 3 0\nf 1 2 3 4 1 2 3 4\n"),
    ("index 0", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n"),
    ("an index beyond", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"),
    ("an index before", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n"),
    ("a normal beyond", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//2 3//9\n"),
    ("normals turned away", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 -1\nvn 1 0 0\nf 1//1 2//2 3//1\n"),
    ("no vertex", "f 1 2 3\n"),
    ("no face", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"),
    ("only points and lines", "v 0 0 0\nv 1 0 0\np 1\nl 1 2\n"),
    ("itself as its library", "mtllib a.obj\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n"),
];

/// Tables after those of the scene.
const TABLES: [(&str, &str); 25] = [
    (
        "a lamp of no area",
        "[[light]]\ntype = \"quad\"\ncorner = [0, 0, 1]\nedge1 = [1, 0, 0]\nedge2 \
                           = [2, 0, 0]\nradiance = 1",
    ),
    (
        "a lamp of next to no area",
        "[[light]]\ntype = \"quad\"\ncorner = [0, 0, 1]\nedge1 = [1e-20, \
                                   0, 0]\nedge2 = [0, 1e-20, 0]\nradiance = 1e30",
    ),
    (
        "a lamp of all area",
        "[[light]]\ntype = \"quad\"\ncorner = [-1e9, -1e9, 1]\nedge1 = [2e9, 0, \
                            0]\nedge2 = [0, 2e9, 0]\nradiance = 1",
    ),
    (
        "a lamp in the wall",
        "[[light]]\ntype = \"quad\"\ncorner = [-1, -1, 0]\nedge1 = [2, 0, 0]\nedge2 \
                            = [0, 2, 0]\nradiance = 1",
    ),
    (
        "a sphere of nothing",
        "[[light]]\ntype = \"sphere\"\ncenter = [0, 0, 1]\nradius = 1e-30\n\
                             radiance = 1e30",
    ),
    (
        "a sphere around all",
        "[[light]]\ntype = \"sphere\"\ncenter = [0, 0, 0]\nradius = 100\nradiance \
                             = 1",
    ),
    (
        "a sphere through the wall",
        "[[light]]\ntype = \"sphere\"\ncenter = [0, 0, 0]\nradius = 1\n\
                                   radiance = 1",
    ),
    ("a point in the wall", "[[light]]\ntype = \"point\"\nposition = [0, 0, 0]\nintensity = 1"),
    ("a point in the eye", "[[light]]\ntype = \"point\"\nposition = [0, 0, 3]\nintensity = 1"),
    (
        "a spot without a cone",
        "[[light]]\ntype = \"spot\"\nposition = [0, 0, 1]\ndirection = [0, 0, \
                               -1]\nintensity = 1\ninner_deg = 0\nouter_deg = 1e-20",
    ),
    (
        "a spot of all directions",
        "[[light]]\ntype = \"spot\"\nposition = [0, 0, 1]\ndirection = [0, \
                                  0, -1]\nintensity = 1\ninner_deg = 180\nouter_deg = 180",
    ),
    (
        "a sun from behind",
        "[[light]]\ntype = \"sun\"\ndirection_to_sun = [0, 0, -1]\nirradiance = 1",
    ),
    (
        "a sun of half the sky",
        "[[light]]\ntype = \"sun\"\ndirection_to_sun = [0, 0, 1]\nirradiance = \
                               1\nangular_radius_deg = 89.999",
    ),
    ("a black sky beside", "[[light]]\ntype = \"sky\"\nradiance = 0"),
    ("a sky of 1e38", "[[light]]\ntype = \"sky\"\nradiance = 1e38"),
    ("a white wall", "[material.m]\nalbedo = 1"),
    ("a wall beyond white", "[material.m]\nalbedo = 1.0001"),
    ("an opaque nothing", "[material.m]\nopacity = 0"),
    ("next to no opacity", "[material.m]\nopacity = 1e-30"),
    ("light of 1e38", "[material.m]\nemission = 1e38"),
    ("light of 1e-45", "[material.m]\nemission = 1e-45"),
    ("no triangles", "[material.m]\ndrop = true"),
    ("a texture that is the scene", "[material.m]\nalbedo_texture = \"s.toml\""),
    ("a texture that is a mesh", "[material.m]\nopacity_texture = \"a.obj\""),
    ("a sky that is the scene", "[[light]]\ntype = \"environment\"\nfile = \"s.toml\""),
];

const CAMERAS: [(&str, &str); 13] = [
    ("in the wall", "eye = [0, 0, 0]\ntarget = [1, 0, 0]"),
    ("in the wall, at it", "eye = [0, 0, 0]\ntarget = [0, 0, -1]"),
    ("a hair before it", "eye = [0, 0, 1e-7]\ntarget = [0, 0, 0]"),
    ("behind it", "eye = [0, 0, -3]\ntarget = [0, 0, 0]"),
    ("looking away", "eye = [0, 0, 3]\ntarget = [0, 0, 9]"),
    ("along it", "eye = [-3, 0, 0]\ntarget = [0, 0, 0]\nup = [0, 0, 1]"),
    ("far away", "eye = [0, 0, 1e9]\ntarget = [0, 0, 0]"),
    ("with its aim next to it", "eye = [0, 0, 3]\ntarget = [0, 0, 2.9999999999]"),
    ("with its aim at the horizon", "eye = [0, 0, 3]\ntarget = [0, 0, -1e30]"),
    ("upwards along", "eye = [0, 0, 3]\ntarget = [0, 0, 0]\nup = [0, 0, 1]"),
    ("all around", "eye = [0, 0, 3]\ntarget = [0, 0, 0]\nvfov_deg = 179.9999"),
    ("through a pinhole", "eye = [0, 0, 3]\ntarget = [0, 0, 0]\nvfov_deg = 1e-30"),
    ("with a long up", "eye = [0, 0, 3]\ntarget = [0, 0, 0]\nup = [0, 1e30, 0]"),
];

const SIZES: [(&str, Right); 8] = [
    ("1x1", Right::Picture),
    ("1x5000", Right::Picture),
    ("5000x1", Right::Picture),
    ("1x100000", Right::Picture),
    ("100000x1", Right::Picture),
    ("65536x65536", Right::Refused("65536")),
    ("4294967295x1", Right::Refused("4294967295")),
    ("4294967296x4294967296", Right::Refused("4294967296")),
];

const METHODS: [&str; 4] = ["decomposition", "path", "gather", "irradiance-cache"];

pub fn cases() -> Vec<Case> {
    let mut all = Vec::new();
    let methods = || METHODS.into_iter().cycle();
    for ((name, obj), method) in OBJ.into_iter().zip(methods()) {
        for (by, sides) in [(method, "auto"), ("photon-map", "two"), ("point-based", "one")] {
            let scene = SCENE.replace("\"a.obj\"", &format!("\"a.obj\"\nsides = \"{sides}\""));
            let entries = vec![("a.obj", obj.into()), ("s.toml", scene.into())];
            all.push(case(format!("{name} by {by}"), Right::Told, entries).by(by));
        }
        let scene = SCENE.replace("\"a.obj\"", "\"a.obj\"\nsubdivision = { levels = 2 }");
        let entries = vec![("a.obj", obj.into()), ("s.toml", scene.into())];
        all.push(case(format!("{name} as a cage"), Right::Told, entries).by(method));
        let scene = SCENE.replace("\"a.obj\"", "\"a.obj\"\nnormals = \"smooth\"");
        let entries = vec![("a.obj", obj.into()), ("s.toml", scene.into())];
        all.push(case(format!("{name}, smooth"), Right::Told, entries).by(method));
    }
    for ((name, table), method) in TABLES.into_iter().zip(methods()) {
        for by in [method, "direct", "point-based"] {
            let entries = vec![("s.toml", format!("{SCENE}{table}\n").into())];
            all.push(case(format!("{name} by {by}"), Right::Told, entries).by(by));
        }
    }
    for ((name, camera), method) in CAMERAS.into_iter().zip(methods()) {
        let rest = &SCENE[SCENE.find("[[mesh]]").unwrap()..];
        for by in [method, "decomposition"] {
            let scene = format!("[camera]\nwidth = 8\nheight = 6\n{camera}\n{rest}");
            let entries = vec![("s.toml", scene.into())];
            all.push(case(format!("a camera {name} by {by}"), Right::Told, entries).by(by));
        }
    }
    for (size, right) in SIZES {
        for by in ["direct", "decomposition"] {
            let case = case(format!("{size} pixels by {by}"), right, Vec::new());
            all.push(case.by(by).and(&["--size", size]));
        }
    }
    for line in [
        "Kd 2 2 2",
        "Kd 1e30 0 0",
        "Ke 1e38 1e38 1e38",
        "d 2",
        "d -1",
        "Tr 2",
        "Kd",
        "Kd 1 1 1 1",
        "Kd spectral file.rfl 1",
        "Kd xyz 1 1 1",
        "map_Kd a.mtl",
        "map_Kd a.obj",
        "map_Kd .",
        "map_Kd /",
        "map_Kd ..",
        "map_Kd -clamp",
        "map_Kd -s 1",
        "map_d -o a b c",
        "newmtl m",
        "illum -1",
        "illum 99999999999999999999",
        "Ns 1e308",
        "Tf 1 1",
        "map_Ke \"a b.png\"",
    ] {
        let library = format!("{LIBRARY}{line}\n");
        let name = format!("an MTL with {line:?}");
        all.push(case(name, Right::Told, vec![("a.mtl", library.into())]).by("decomposition"));
    }
    // A closed white room never loses its light.
    let room = "v -5 -5 -5\nv 5 -5 -5\nv 5 5 -5\nv -5 5 -5\nv -5 -5 5\nv 5 -5 5\nv 5 5 5\n\
                v -5 5 5\n\
                f 1 2 3 4\nf 8 7 6 5\nf 5 6 2 1\nf 6 7 3 2\nf 7 8 4 3\nf 8 5 1 4\n";
    let white = format!(
        "{SCENE}[[mesh]]\nfile = \"r.obj\"\nmaterial = \"w\"\n[material.w]\nalbedo = 1\n\
                         [material.m]\nalbedo = 1\nemission = 1\n"
    );
    for method in METHODS {
        let entries = vec![("r.obj", room.into()), ("s.toml", white.as_str().into())];
        all.push(case(format!("a white room by {method}"), Right::Picture, entries).by(method));
    }
    for (from, to) in
        [("out.exr", "s.toml"), ("out.exr", "a.obj"), ("out.exr", "."), ("out.exr", "")]
    {
        let case =
            case(format!("{to:?} as the output"), Right::Refused(""), vec![("x", SQUARE.into())]);
        let arguments = ["render", "s.toml", "-q", "--method", "direct", "-o", from]
            .map(|a| if a == from { to } else { a });
        all.push(case.arguments(&arguments));
    }
    all
}
