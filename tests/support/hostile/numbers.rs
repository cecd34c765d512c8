//! Absurd numbers in every place that takes one: scene files, OBJ, MTL, curves, camera paths,
//! options.

use super::{Case, LIBRARY, Right, SCENE, SQUARE, case};

const NUMBERS: [&str; 12] = [
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e39",
    "1e-45",
    "-0.0",
    "-1",
    "0",
    "18446744073709551616",
    "1e20",
];

/// Where a number stands in the scene file, as `#`; the first line is its kind.
const PLACES: [(&str, &str); 43] = [
    ("eye", "[camera]\neye = [#, 0, 3]\ntarget = [0, 0, 0]"),
    ("target", "[camera]\neye = [0, 0, 3]\ntarget = [0, #, 0]"),
    ("up", "[camera]\nup = [0, #, 0]"),
    ("vfov", "[camera]\nvfov_deg = #"),
    ("width", "[camera]\nwidth = #"),
    ("height", "[camera]\nheight = #"),
    ("scale", "[[mesh]]\nfile = \"a.obj\"\nscale = #"),
    ("scales", "[[mesh]]\nfile = \"a.obj\"\nscale = [1, #, 1]"),
    ("rotate", "[[mesh]]\nfile = \"a.obj\"\nrotate_deg = [0, #, 0]"),
    ("translate", "[[mesh]]\nfile = \"a.obj\"\ntranslate = [#, 0, 0]"),
    ("matrix", "[[mesh]]\nfile = \"a.obj\"\nmatrix = [[#, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]"),
    ("moved", "[[mesh]]\nfile = \"a.obj\"\nmatrix = [[1, 0, 0, #], [0, 1, 0, 0], [0, 0, 1, 0]]"),
    ("crease", "[[mesh]]\nfile = \"a.obj\"\nnormals = \"smooth\"\ncrease_deg = #"),
    ("levels", "[[mesh]]\nfile = \"a.obj\"\nsubdivision = { levels = # }"),
    ("edge", "[[mesh]]\nfile = \"a.obj\"\nsubdivision = { edge = # }"),
    ("edges", "[[mesh]]\nfile = \"a.obj\"\nsubdivision = { edge = \"#%\" }"),
    ("sharpness", "[[mesh]]\nfile = \"a.obj\"\nsubdivision = { crease_sharpness = # }"),
    ("angle", "[[mesh]]\nfile = \"a.obj\"\nsubdivision = { crease_angle_deg = # }"),
    ("sides", "[[mesh]]\nfile = \"c.curves\"\ncurves = { sides = # }"),
    ("segments", "[[mesh]]\nfile = \"c.curves\"\ncurves = { segments = # }"),
    ("curve width", "[[mesh]]\nfile = \"c.curves\"\ncurves = { width = # }"),
    ("width scale", "[[mesh]]\nfile = \"c.curves\"\ncurves = { width_scale = # }"),
    (
        "normal",
        "[[mesh]]\nfile = \"c.curves\"\ncurves = { shape = \"ribbon\", normal = [0, #, 0] }",
    ),
    ("detail", "[[mesh]]\nbuiltin = \"interior\"\nparameters = { detail = # }"),
    (
        "corner",
        "[[light]]\ntype = \"quad\"\ncorner = [#, 0, 2]\nedge1 = [1, 0, 0]\nedge2 = [0, 1, \
                0]\nradiance = 1",
    ),
    (
        "edge1",
        "[[light]]\ntype = \"quad\"\ncorner = [0, 0, 2]\nedge1 = [#, 0, 0]\nedge2 = [0, 1, \
               0]\nradiance = 1",
    ),
    (
        "quad",
        "[[light]]\ntype = \"quad\"\ncorner = [0, 0, 2]\nedge1 = [1, 0, 0]\nedge2 = [0, 1, \
              0]\nradiance = #",
    ),
    ("center", "[[light]]\ntype = \"sphere\"\ncenter = [0, #, 2]\nradius = 0.1\nradiance = 1"),
    ("radius", "[[light]]\ntype = \"sphere\"\ncenter = [0, 0, 2]\nradius = #\nradiance = 1"),
    (
        "sphere",
        "[[light]]\ntype = \"sphere\"\ncenter = [0, 0, 2]\nradius = 0.1\nradiance = [#, 1, 1]",
    ),
    ("sun", "[[light]]\ntype = \"sun\"\ndirection_to_sun = [0, 0, #]\nirradiance = 1"),
    ("irradiance", "[[light]]\ntype = \"sun\"\ndirection_to_sun = [0, 0, 1]\nirradiance = #"),
    (
        "disc",
        "[[light]]\ntype = \"sun\"\ndirection_to_sun = [0, 0, 1]\nirradiance = \
              1\nangular_radius_deg = #",
    ),
    ("position", "[[light]]\ntype = \"point\"\nposition = [0, 0, #]\nintensity = 1"),
    ("intensity", "[[light]]\ntype = \"point\"\nposition = [0, 0, 1]\nintensity = #"),
    (
        "spot",
        "[[light]]\ntype = \"spot\"\nposition = [0, 0, 1]\ndirection = [0, 0, #]\nintensity = \
              1\ninner_deg = 20\nouter_deg = 30",
    ),
    (
        "inner",
        "[[light]]\ntype = \"spot\"\nposition = [0, 0, 1]\ndirection = [0, 0, -1]\nintensity = \
               1\ninner_deg = #\nouter_deg = 30",
    ),
    (
        "outer",
        "[[light]]\ntype = \"spot\"\nposition = [0, 0, 1]\ndirection = [0, 0, -1]\nintensity = \
               1\ninner_deg = 0\nouter_deg = #",
    ),
    ("sky", "[[light]]\ntype = \"sky\"\nradiance = #"),
    ("albedo", "[material.m]\nalbedo = #"),
    ("albedos", "[material.m]\nalbedo = [0.5, #, 0.5]"),
    ("emission", "[material.m]\nemission = #"),
    ("opacity", "[material.m]\nopacity = #"),
];

const OBJ: [(&str, &str, &str); 8] = [
    ("v", "v -1 -1 0", "v # -1 0"),
    ("all v", "-1 ", "# "),
    ("vt", "vt 1 0", "vt # 0"),
    ("vn", "vn 0 0 1", "vn 0 0 #"),
    ("f", "1/1/1", "#/1/1"),
    ("f vt", "1/1/1", "1/#/1"),
    ("f vn", "1/1/1", "1/1/#"),
    ("s", "usemtl m", "s #\nusemtl m"),
];

const MTL: [&str; 10] = [
    "Kd # 0.4 0.3",
    "Ke 0 # 0",
    "d #",
    "Tr #",
    "Ns #",
    "Ni #",
    "illum #",
    "Ks # 1 1",
    "map_Kd -s # 1 1 -o 1 # 0 t.png",
    "map_Kd -mm # 1 t.png",
];

const OPTIONS: [(&str, &str); 9] = [
    ("--size", "#x4"),
    ("--size", "4x#"),
    ("--threads", "#"),
    ("--seed", "#"),
    ("--spp", "#"),
    ("--exposure", "#"),
    ("--time-limit", "#"),
    ("--checkpoint", "#"),
    ("--memory-limit", "#"),
];

pub fn cases() -> Vec<Case> {
    let mut all = Vec::new();
    let curves = "0 0 0 .1\n0 1 0 .1\n1 1 0 .1\n";
    for number in NUMBERS {
        let put = |text: &str| text.replace('#', number);
        for (place, text) in PLACES {
            // A table that the scene has already gives way to the one that is tried.
            let has_camera = text.starts_with("[camera]");
            let rest = if has_camera { &SCENE[SCENE.find("[[mesh]]").unwrap()..] } else { SCENE };
            let scene = format!("{rest}{}\n", put(text));
            let entries = vec![("s.toml", scene.into()), ("c.curves", curves.into())];
            all.push(case(format!("{number} for {place}"), Right::Told, entries));
        }
        for (place, from, to) in OBJ {
            let obj = SQUARE.replacen(from, &put(to), if place == "all v" { 9 } else { 1 });
            let entries = vec![("a.obj", obj.into())];
            let name = format!("{number} for {place} of an OBJ");
            all.push(case(name, Right::Told, entries).by("decomposition"));
        }
        for line in MTL {
            let library = format!("{LIBRARY}{}\n", put(line));
            let name = format!("{number} in an MTL, {line}");
            all.push(case(name, Right::Told, vec![("a.mtl", library.into())]).by("decomposition"));
        }
        for (option, value) in OPTIONS {
            let given = format!("{option}={}", put(value));
            let case = case(format!("as option, {given}"), Right::Told, Vec::new());
            all.push(case.and(&[&given]));
        }
        let lines = put("0 0 0 .1\n# 1 0 .1\n1 1 0 #\n");
        let scene = SCENE.replace("a.obj", "c.curves");
        let entries = vec![("s.toml", scene.into()), ("c.curves", lines.into())];
        all.push(case(format!("{number} in curves"), Right::Told, entries).by("decomposition"));
        let path =
            put("[[key]]\neye=[0,0,3]\ntarget=[0,0,0]\n[[key]]\neye=[#,0,3]\ntarget=[0,0,#]\n");
        all.push(
            case(format!("{number} in a camera path"), Right::Told, vec![("p.toml", path.into())])
                .arguments(&["fly", "s.toml", "--path", "p.toml", "--frames", "2", "-o", "film"]),
        );
    }
    all
}
