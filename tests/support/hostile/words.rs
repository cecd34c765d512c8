//! Texts that say the same in another spelling, and texts that say what cannot be: byte order
//! marks, line ends, names, duplicates, types, nesting.

use super::{Case, Entry, LIBRARY, Right, SCENE, SQUARE, case};

/// Names of files that people give.
const NAMES: [&str; 14] = [
    "two words.obj",
    "quote\"s.obj",
    "apo'strophe.obj",
    "new\nline.obj",
    "tab\tbed.obj",
    "-dash.obj",
    "per%cent.obj",
    "käse.obj",
    "漢字.obj",
    "🙂.obj",
    "a\u{301}.obj",
    "\u{202e}rtl.obj",
    "UPPER.OBJ",
    "semi;colon & $(x).obj",
];

/// Tables of the scene file that cannot be read, and what is said of them.
const BROKEN: [(&str, &str); 33] = [
    ("[camera]\n[camera]\n", "s.toml:"),
    ("name = 1\n", "s.toml:1"),
    ("name = \"a\"\nname = \"b\"\n", "s.toml:2"),
    ("search_paths = \"here\"\n", "s.toml:1"),
    ("search_paths = [\"$NEARFAR_NO_SUCH\"]\n", "s.toml"),
    ("camera = 3\n", "s.toml"),
    ("camera = []\n", "s.toml"),
    ("mesh = { file = \"a.obj\" }\n", "s.toml"),
    ("mesh = [1, 2]\n", "s.toml:1"),
    ("mesh = [[]]\n", "s.toml:1"),
    ("mesh = 1979-05-27\n", "s.toml:1"),
    ("light = \"sky\"\n", "s.toml:1"),
    ("light = [{}]\n", "s.toml"),
    ("light = [{ type = \"lamp\" }]\n", "lamp"),
    ("light = [{ type = \"sky\" }]\n", "radiance"),
    ("light = [{ type = \"sky\", radiance = [1, 2] }]\n", "s.toml"),
    ("light = [{ type = \"sky\", radiance = [1, 2, 3, 4] }]\n", "s.toml"),
    ("light = [{ type = \"sky\", radiance = \"white\" }]\n", "s.toml"),
    ("light = [{ type = \"sky\", radiance = true }]\n", "s.toml"),
    ("light = [{ type = \"sky\", radiance = 1, size = 2 }]\n", "size"),
    ("light = [{ type = 3 }]\n", "s.toml"),
    ("material = []\n", "s.toml"),
    ("material.m = 3\n", "s.toml"),
    ("material.m.albedo = \"red\"\n", "s.toml"),
    ("material.m.colour = 1\n", "colour"),
    ("material.none.albedo = 1\n", "none"),
    ("settings = 3\n", "s.toml:1"),
    ("settings.path = 3\n", "path"),
    ("settings.path.spp = \"many\"\n", "spp"),
    ("settings.path.spp = -1\n", "spp"),
    ("settings.\"a.b\".c = 1\n", "a.b"),
    ("settings.\"\" = 1\n", "s"),
    ("\0 = 1\n", "s.toml:1"),
];

/// Command lines that cannot be obeyed.
const ARGUMENTS: [&[&str]; 32] = [
    &["--size", "0x0"],
    &["--size", "x"],
    &["--size", "4"],
    &["--size", "4x"],
    &["--size", "-4x4"],
    &["--size", "4x4x4"],
    &["--size", "４x４"],
    &["--set", ""],
    &["--set", "="],
    &["--set", "a"],
    &["--set", ".=1"],
    &["--set", "a..b=1"],
    &["--set", "no.such=1"],
    &["--set", "camera=1"],
    &["--set", "mesh.9.file=a.obj"],
    &["--set", "mesh.0.file.x=1"],
    &["--set", "light.0=1"],
    &["--set", "settings=1"],
    &["--set", "path.spp.x=1"],
    &["--set", "seed=1.5"],
    &["--set", "seed=\"1\""],
    &["--set", "material.m.albedo=[1,2]"],
    &["--threads", "65536"],
    &["--threads", "-1"],
    &["--time-limit", "soon"],
    &["--time-limit", "1y"],
    &["--aov", "none,none,?"],
    &["--method", "magic"],
    &["--quality", ""],
    &["--backend", "gpu"],
    &["--exposure", "bright"],
    &["--load-cache", "a.obj"],
];

fn spellings() -> Vec<Case> {
    let mut all = Vec::new();
    let texts = [("a.obj", SQUARE), ("a.mtl", LIBRARY), ("s.toml", SCENE)];
    let spell = |name: &str, change: &dyn Fn(&str) -> Vec<u8>, files: &[&str]| -> Vec<Case> {
        let of = |(file, text): &(&'static str, &str)| {
            files.contains(file).then(|| {
                case(format!("{file} {name}"), Right::Plain, vec![(*file, change(text).into())])
            })
        };
        texts.iter().filter_map(of).collect()
    };
    let (both, three) = (["a.obj", "a.mtl"], ["a.obj", "a.mtl", "s.toml"]);
    let wide = |text: &str, order: fn(u16) -> [u8; 2]| -> Vec<u8> {
        format!("\u{feff}{text}").encode_utf16().flat_map(order).collect()
    };
    let replaced = |from: &'static str, to: &'static str| {
        move |text: &str| text.replace(from, to).into_bytes()
    };
    all.extend(spell("with a byte order mark", &|t| format!("\u{feff}{t}").into(), &three));
    all.extend(spell("in CRLF", &replaced("\n", "\r\n"), &three));
    all.extend(spell("in CR", &replaced("\n", "\r"), &both));
    all.extend(spell("with blank lines", &replaced("\n", "\n\n  \n"), &three));
    all.extend(spell("with trailing blanks", &replaced("\n", " \t \n"), &three));
    all.extend(spell("without a last line end", &|t| t.trim_end().into(), &three));
    all.extend(spell("in tabs", &replaced(" ", "\t"), &both));
    all.extend(spell("indented", &replaced("\n", "\n    "), &three));
    all.extend(spell("with form feeds", &|t| format!("{t}\x0c\n").into(), &both));
    all.extend(spell("with comments", &replaced("\n", "\n# a comment — ünicode\n"), &three));
    all.extend(spell("in UTF-16, low first", &|t| wide(t, u16::to_le_bytes), &both));
    all.extend(spell("in UTF-16, high first", &|t| wide(t, u16::to_be_bytes), &both));
    all.extend(spell("with a Latin-1 comment", &|t| [t.as_bytes(), b"# \xe4\n"].concat(), &both));
    all.extend(spell("with a null at its end", &|t| [t.as_bytes(), b"\n# \0\n"].concat(), &both));
    all
}

fn names() -> Vec<Case> {
    let long = format!("{}.obj", "n".repeat(251));
    let mut all = Vec::new();
    for name in NAMES.iter().copied().chain([long.as_str()]) {
        let scene =
            SCENE.replace("\"a.obj\"", &toml::Value::from(name.replace('$', "$$")).to_string());
        let entries = vec![("s.toml", scene.into()), (name, SQUARE.into())];
        all.push(case(format!("a mesh named {name:?}"), Right::Plain, entries));
        // A dash would be an option.
        if !name.starts_with('-') {
            let entries = vec![(name, SQUARE.into())];
            let bare =
                ["render", name, "-q", "--size", "4x4", "-o", "out.exr", "--method", "direct"];
            all.push(case(format!("a bare {name:?}"), Right::Picture, entries).arguments(&bare));
        }
        if !name.contains('\n') {
            let name = name.replace(".obj", ".mtl").replace(".OBJ", ".MTL");
            let obj = SQUARE.replace("a.mtl", &name);
            let entries = vec![("a.obj", obj.into()), (name.as_str(), LIBRARY.into())];
            all.push(case(format!("a library named {name:?}"), Right::Plain, entries));
        }
        let material = name.trim_end_matches(".obj");
        if !material.contains(['\n', '\t']) {
            let obj = SQUARE.replace("usemtl m", &format!("usemtl {material}"));
            let library = LIBRARY.replace("newmtl m", &format!("newmtl {material}"));
            let entries = vec![("a.obj", obj.into()), ("a.mtl", library.into())];
            all.push(case(format!("a material named {material:?}"), Right::Plain, entries));
        }
    }
    let far = "x".repeat(300);
    let scene = SCENE.replace("a.obj", &far);
    all.push(case("a name too long", Right::Refused("s.toml"), vec![("s.toml", scene.into())]));
    let scene = SCENE.replace("a.obj", "a\\u0000.obj");
    all.push(case("a null in a name", Right::Refused("s.toml"), vec![("s.toml", scene.into())]));
    all
}

pub fn cases() -> Vec<Case> {
    let mut all = [spellings(), names()].concat();
    for (text, word) in BROKEN {
        // What is said twice is said of the first; keys before tables.
        let scene = format!("{text}{SCENE}");
        let only =
            format!("{text}[[mesh]]\nfile = \"a.obj\"\n[[light]]\ntype = \"sky\"\nradiance = 1\n");
        let key = text.split([' ', '.']).next().unwrap_or_default();
        let alone = ["mesh", "light", "camera"].contains(&key);
        let scene = match key {
            "mesh" => format!("{text}[[light]]\ntype = \"sky\"\nradiance = 1\n"),
            "light" => format!("{text}[[mesh]]\nfile = \"a.obj\"\n"),
            _ if alone => only,
            _ => scene,
        };
        all.push(case(format!("{text:?}"), Right::Refused(word), vec![("s.toml", scene.into())]));
    }
    for arguments in ARGUMENTS {
        let case = case(format!("{arguments:?}"), Right::Refused(""), Vec::new());
        all.push(case.and(arguments));
    }
    // Some are no text at all.
    for bytes in [&b"\xff\xfe\xfd"[..], b"\x00\x00\x00", b"\x1f\x8b\x08\x00gz", b"PK\x03\x04"] {
        for (file, right) in
            [("s.toml", Right::Refused("s.toml")), ("a.obj", Right::Told), ("a.mtl", Right::Told)]
        {
            let entries = vec![(file, Entry::File(bytes.to_vec()))];
            all.push(case(format!("{file} of {bytes:?}"), right, entries));
        }
    }
    all
}
