//! Sizes that a file claims and does not have, and very many of something small: pixels, points,
//! strands, lines, names, corners, brackets.

use super::{Case, LIBRARY, Right, SCENE, SQUARE, case};

/// Counts that no small file can hold.
const COUNTS: [u64; 7] = [1 << 20, 1 << 30, u32::MAX as u64, 1 << 33, 1 << 53, 1 << 62, u64::MAX];

fn claims() -> Vec<Case> {
    let mut all = Vec::new();
    let columns = "property float x\nproperty float y\nproperty float z\nproperty float nx\n\
                   property float ny\nproperty float nz\nproperty float _area\n";
    for count in COUNTS {
        let head = "ply\nformat binary_little_endian 1.0\n";
        let ply = format!("{head}element vertex {count}\n{columns}end_header\n0123456789");
        let show = ["cloud", "show", "c.ply", "-o", "out.html"];
        let gather = ["cloud", "gather", "s.toml", "-q", "--cloud", "c.ply", "-o", "out.exr"];
        let load = ["render", "s.toml", "-q", "--load-cache", "c.ply", "-o", "out.exr"];
        for arguments in [&show[..], &gather[..], &load[..]] {
            let name = format!("{count} points in {}", arguments[..2].join(" "));
            let entries = vec![("c.ply", ply.clone().into())];
            all.push(case(name, Right::Refused("c.ply"), entries).arguments(arguments));
        }
        let wide = (0..2000).map(|i| format!("property double p{i}\n")).collect::<String>();
        let ply = format!("{head}element vertex {count}\n{columns}{wide}end_header\n");
        let entries = vec![("c.ply", ply.into())];
        let name = format!("{count} points of 2000 numbers");
        all.push(case(name, Right::Refused("c.ply"), entries).arguments(&show));
        let small = count as u32;
        for (strands, points, arrays) in
            [(small, 3, 2), (1, small, 2), (small, small, 31), (small, 3, 3)]
        {
            let mut hair = b"HAIR".to_vec();
            [strands, points, arrays, small].iter().for_each(|w| hair.extend(w.to_le_bytes()));
            hair.resize(200, 0);
            let scene = format!("{SCENE}[[mesh]]\nfile = \"f.hair\"\n");
            let entries = vec![("s.toml", scene.into()), ("f.hair", hair.into())];
            let name = format!("hair of {strands} strands, {points} points, arrays {arrays}");
            all.push(case(name, Right::Refused("f.hair"), entries));
        }
    }
    all
}

/// Pictures whose header says that they are of some size.
fn pictures() -> Vec<Case> {
    let mut all = Vec::new();
    let sides =
        [(0, 0), (0, 9), (1, 1 << 30), (60_000, 60_000), (u32::MAX, u32::MAX), (30_000, 30_000)];
    for (w, h) in sides {
        let big = |n: u32| n.to_be_bytes();
        let mut ihdr = [&b"IHDR"[..], &big(w), &big(h), &[8, 6, 0, 0, 0]].concat();
        let sum = crc32fast::hash(&ihdr);
        ihdr.extend(big(sum));
        let png = [b"\x89PNG\r\n\x1a\n\0\0\0\x0d", ihdr.as_slice(), &[0; 12]].concat();
        let (lw, lh) = (w.to_le_bytes(), h.to_le_bytes());
        let bmp =
            [&b"BM\x3a\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0"[..], &lw, &lh, b"\x01\0\x18\0", &[0; 28]]
                .concat();
        let tga = [&[0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0][..], &lw[..2], &lh[..2], &[32, 8, 1, 2]];
        let textures: [(&str, Vec<u8>); 3] = [("png", png), ("bmp", bmp), ("tga", tga.concat())];
        for (format, bytes) in textures {
            let scene = format!("{SCENE}[material.m]\nalbedo_texture = \"t.{format}\"\n");
            let file = format!("t.{format}");
            let entries = vec![("s.toml", scene.into()), (file.as_str(), bytes.into())];
            let name = format!("a {format} of {w}×{h}");
            all.push(case(name, Right::Refused("t."), entries));
        }
        let sky = format!("{SCENE}[[light]]\ntype = \"environment\"\nfile = \"sky.hdr\"\n");
        let hdr = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {h} +X {w}\n\x02\x02\0\0");
        let entries = vec![("s.toml", sky.into()), ("sky.hdr", hdr.into())];
        all.push(case(format!("an HDR of {w}×{h}"), Right::Refused("sky.hdr"), entries));
        let exr = exr_of(w, h);
        let sky = format!("{SCENE}[[light]]\ntype = \"environment\"\nfile = \"sky.exr\"\n");
        let entries = vec![("s.toml", sky.into()), ("sky.exr", exr.clone().into())];
        all.push(case(format!("an EXR sky of {w}×{h}"), Right::Refused("sky.exr"), entries));
        for arguments in [
            &["compare", "a.exr", "a.exr"][..],
            &["show", "a.exr", "-o", "out.png"],
            &["reference", "s.toml", "-q", "-o", "out.exr", "--resume", "a.exr"],
        ] {
            let name = format!("an EXR of {w}×{h} to {}", arguments[0]);
            let entries = vec![("a.exr", exr.clone().into())];
            all.push(case(name, Right::Refused("a.exr"), entries).arguments(arguments));
        }
    }
    all
}

/// An OpenEXR file of one channel that ends after its header.
fn exr_of(w: u32, h: u32) -> Vec<u8> {
    let mut out = b"\x76\x2f\x31\x01\x02\0\0\0".to_vec();
    let mut put = |name: &str, kind: &str, value: &[u8]| {
        out.extend([name.as_bytes(), b"\0", kind.as_bytes(), b"\0"].concat());
        out.extend((value.len() as u32).to_le_bytes());
        out.extend(value);
    };
    let channel = [&b"Y\0"[..], &2u32.to_le_bytes(), &[0; 4], &[1, 0, 0, 0, 1, 0, 0, 0], &[0]];
    let last = |n: u32| n.wrapping_sub(1).to_le_bytes();
    let window = [&[0; 8][..], &last(w), &last(h)].concat();
    put("channels", "chlist", &channel.concat());
    put("compression", "compression", &[3]);
    put("dataWindow", "box2i", &window);
    put("displayWindow", "box2i", &window);
    put("lineOrder", "lineOrder", &[0]);
    put("pixelAspectRatio", "float", &1f32.to_le_bytes());
    put("screenWindowCenter", "v2f", &[0; 8]);
    put("screenWindowWidth", "float", &1f32.to_le_bytes());
    out.push(0);
    out.resize(out.len() + 64, 0);
    out
}

/// A lot of something: read in time, or refused.
fn many() -> Vec<Case> {
    let lot = 200_000;
    let numbered = |line: &str, n: usize| -> String {
        (0..n).map(|i| line.replace('#', &i.to_string())).collect()
    };
    let scenes = [
        ("brackets", format!("x = {}{}\n", "[".repeat(lot), "]".repeat(lot))),
        ("braces", format!("x = {}1{}\n", "{a=".repeat(lot), "}".repeat(lot))),
        ("dots", format!("{} = 1\n", vec!["a"; lot].join("."))),
        ("dots of a table", format!("[{}]\n", vec!["a"; lot].join("."))),
        ("open brackets", format!("x = {}\n", "[".repeat(lot))),
        ("quotes", format!("x = {}\n", "\"".repeat(lot))),
        ("materials", numbered("[material.m#]\nalbedo = 1\n", lot)),
        ("search paths", format!("search_paths = [{}]\n{SCENE}", "\"a\",".repeat(20_000))),
        (
            "environments",
            format!("{SCENE}{}", "[[light]]\ntype = \"environment\"\nfile = \"e\"\n".repeat(2000)),
        ),
    ];
    let mut all: Vec<Case> = scenes
        .into_iter()
        .map(|(name, text)| {
            case(format!("many {name}"), Right::Told, vec![("s.toml", text.into())])
        })
        .collect();
    let lamps =
        "[[light]]\ntype = \"point\"\nposition = [0, 0, 2]\nintensity = 1e-4\n".repeat(5000);
    let entries = vec![("s.toml", format!("{SCENE}{lamps}").into())];
    all.push(case("many lamps", Right::Picture, entries));
    let meshes = "[[mesh]]\nfile = \"a.obj\"\n".repeat(2000);
    let entries = vec![("s.toml", format!("{SCENE}{meshes}").into())];
    all.push(case("one mesh many times", Right::Picture, entries));
    let corner = |i: usize| {
        let angle = i as f64 * std::f64::consts::TAU / lot as f64;
        format!("v {} {} 0\n", angle.cos(), angle.sin())
    };
    let corners: String = (0..lot).map(corner).collect();
    let around: String = (1..=lot).map(|i| format!(" {i}")).collect();
    let objs = [
        ("corners", format!("{corners}f{around}\n")),
        ("corners all alike", format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf{}\n", " 1".repeat(lot))),
        (
            "corners to and fro",
            format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3{}\n", " 1 2".repeat(lot / 2)),
        ),
        ("groups", format!("{SQUARE}{}", numbered("g g#\nf 1 2 3\n", lot))),
        ("objects", format!("{SQUARE}{}", numbered("o o#\n", lot))),
        ("materials in use", format!("{SQUARE}{}", numbered("usemtl u#\nf 1 2 3\n", lot))),
        ("libraries", format!("{SQUARE}{}", "mtllib a.mtl\n".repeat(lot))),
        ("libraries that are not there", format!("{SQUARE}{}", numbered("mtllib n#.mtl\n", 2000))),
        ("faces all alike", format!("{SQUARE}{}", "f 1 2 3\n".repeat(lot))),
        ("continuations", format!("{SQUARE}f 1 {}2 3\n", "\\\n".repeat(lot))),
        ("lines", format!("{SQUARE}{}", "l 1 2\n".repeat(lot))),
        ("blanks", format!("{SQUARE}f 1{}2 3\n", " ".repeat(5_000_000))),
        ("numbers in a vertex", format!("{SQUARE}v{}\n", " 1".repeat(lot))),
        ("digits", format!("{SQUARE}v {} 0 0\n", "1".repeat(lot))),
        ("digits of an index", format!("{SQUARE}f 1 2 {}\n", "1".repeat(lot))),
        ("slashes", format!("{SQUARE}f 1{} 2 3\n", "/".repeat(lot))),
        ("smoothing groups", format!("{SQUARE}{}", numbered("s #\nf 1 2 3\n", lot))),
        ("vertices of no face", format!("{SQUARE}{}", numbered("v # 0 0\n", lot))),
    ];
    for (name, obj) in objs {
        all.push(case(format!("many {name}"), Right::Told, vec![("a.obj", obj.into())]));
    }
    let mtls = [
        ("materials", numbered("newmtl m#\nKd 1 1 1\n", lot)),
        ("materials of a name", "newmtl m\nKd 1 1 1\n".repeat(lot)),
        ("textures that are not there", numbered("newmtl m#\nmap_Kd t#.png\n", 2000)),
        ("options", format!("newmtl m\nmap_Kd {}a.png\n", "-s 1 1 1 ".repeat(lot))),
        ("unknown keys", numbered("key# 1\n", lot)),
    ];
    for (name, mtl) in mtls {
        let mtl = format!("{LIBRARY}{mtl}");
        all.push(case(format!("many {name} in an MTL"), Right::Told, vec![("a.mtl", mtl.into())]));
    }
    let curves = [
        ("points", numbered("# 0 0 .1\n", 100_000)),
        ("curves of a point", "0 0 0 .1\n\n".repeat(lot)),
        ("points at a place", "0 0 0 .1\n".repeat(lot)),
        ("empty lines", format!("0 0 0 .1\n1 0 0 .1\n{}", "\n".repeat(lot))),
    ];
    for (name, text) in curves {
        let scene = SCENE.replace("a.obj", "c.curves");
        let entries = vec![("s.toml", scene.into()), ("c.curves", text.into())];
        all.push(case(format!("many {name}"), Right::Told, entries));
    }
    for (name, value) in [
        ("brackets", "[".repeat(20_000)),
        ("braces", "{a=".repeat(20_000)),
        ("closed brackets", format!("{}{}", "[".repeat(20_000), "]".repeat(20_000))),
    ] {
        let set = format!("seed={value}");
        let case = case(format!("an assignment of many {name}"), Right::Refused(""), Vec::new());
        all.push(case.and(&["--set", &set]));
    }
    let key = format!("{}=1", vec!["a"; 50_000].join("."));
    let case = case("an assignment of many dots", Right::Refused(""), Vec::new());
    all.push(case.and(&["--set", &key]));
    all
}

pub fn cases() -> Vec<Case> {
    [claims(), pictures(), many()].concat()
}
