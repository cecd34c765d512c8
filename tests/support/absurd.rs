//! Hostile inputs by kind, made by rule: the same list on every machine.
//!
//! A case is a folder of files and what is done with them. What must come of it is one of two
//! things: the picture of the plain scene, where the case is but another way to write it, or either
//! a picture of finite light or a refusal that names one of its files.

/// What stands in a folder.
#[derive(Clone, Debug)]
pub enum Entry {
    /// A file.
    Bytes(Vec<u8>),
    /// A folder where a file is expected.
    Folder,
    /// A pipe without a writer.
    Pipe,
    /// A symbolic link to this name.
    Link(&'static str),
}

/// What must come of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Must {
    /// The picture of the plain scene.
    Plain,
    /// A picture of finite light, or a refusal.
    BeSaid,
    /// A refusal.
    BeRefused,
}

/// A hostile input.
#[derive(Clone, Debug)]
pub struct Case {
    /// Kind and member, for messages.
    pub name: String,
    /// What stands in the folder; `s.toml` (or what `scene` says) is rendered.
    pub files: Vec<(String, Entry)>,
    /// The file that is rendered.
    pub scene: String,
    /// More arguments; `@NAME` is a file of the folder.
    pub arguments: Vec<String>,
    /// What must come of it.
    pub must: Must,
}

pub const TOML: &str = "[camera]\neye = [0, 0, 3]\ntarget = [0, 0, 0]\n[[mesh]]\nfile = \
                        \"a.obj\"\n[[light]]\ntype = \"sky\"\nradiance = 1\n";
pub const OBJ: &str = "mtllib a.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 \
                       1\nvt 0 1\nvn 0 0 1\nusemtl a\nf 1/1/1 2/2/1 3/3/1 4/4/1\n";
pub const MTL: &str = "newmtl a\nKd 0.5 0.25 0.75\n";

const NUMBERS: [&str; 11] =
    ["1e308", "-1e308", "1e39", "1e19", "1e-30", "1e-45", "5e-324", "-0.0", "nan", "inf", "-inf"];

impl Case {
    fn new(kind: &str, member: impl std::fmt::Display, must: Must) -> Self {
        let mut case = Self {
            name: format!("{kind}: {member}"),
            files: Vec::new(),
            scene: "s.toml".into(),
            arguments: Vec::new(),
            must,
        };
        case.put("s.toml", TOML);
        case.put("a.obj", OBJ);
        case.put("a.mtl", MTL);
        case
    }
    fn put(&mut self, name: &str, bytes: impl Into<Vec<u8>>) -> &mut Self {
        self.entry(name, Entry::Bytes(bytes.into()))
    }
    fn entry(&mut self, name: &str, entry: Entry) -> &mut Self {
        self.files.retain(|(other, _)| other != name);
        self.files.push((name.into(), entry));
        self
    }
    fn with(mut self, name: &str, bytes: impl Into<Vec<u8>>) -> Self {
        self.put(name, bytes);
        self
    }
    fn told(mut self, arguments: &[&str]) -> Self {
        self.arguments = arguments.iter().map(|&a| a.to_owned()).collect();
        self
    }
}

/// The plain scene.
pub fn plain() -> Case {
    Case::new("plain", "", Must::Plain)
}

/// All cases.
pub fn cases() -> Vec<Case> {
    let kinds = [
        numbers_of_scenes,
        numbers_of_models,
        nesting,
        headers,
        writing,
        names,
        no_files,
        pictures,
        lamps_and_cameras,
        duplicates,
    ];
    kinds.into_iter().flat_map(|kind| kind()).collect()
}

/// Every key of a scene file that takes numbers, with `@` where one stands.
const KEYS: [&str; 38] = [
    "[camera]\neye = [0, @, 3]\ntarget = [0, 0, 0]\n",
    "[camera]\neye = [0, 0, 3]\ntarget = [@, 0, 0]\n",
    "[camera]\neye = [0, 0, 3]\ntarget = [0, 0, 0]\nup = [0, @, 0]\n",
    "[camera]\nvfov_deg = @\n",
    "[camera]\nwidth = @\n",
    "[[mesh]]\nfile = \"a.obj\"\nscale = @\n",
    "[[mesh]]\nfile = \"a.obj\"\nscale = [1, @, 1]\n",
    "[[mesh]]\nfile = \"a.obj\"\nrotate_deg = [0, @, 0]\n",
    "[[mesh]]\nfile = \"a.obj\"\ntranslate = [0, 0, @]\n",
    "[[mesh]]\nfile = \"a.obj\"\nmatrix = [[1, 0, 0, @], [0, 1, 0, 0], [0, 0, 1, 0]]\n",
    "[[mesh]]\nfile = \"a.obj\"\nmatrix = [[@, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]\n",
    "[[mesh]]\nfile = \"a.obj\"\nnormals = \"smooth\"\ncrease_deg = @\n",
    "[[mesh]]\nfile = \"a.obj\"\nsubdivision = { levels = @ }\n",
    "[[mesh]]\nfile = \"a.obj\"\nsubdivision = { edge = @ }\n",
    "[[mesh]]\nfile = \"a.obj\"\nsubdivision = { crease_angle_deg = @ }\n",
    "[[mesh]]\nfile = \"a.obj\"\nsubdivision = { crease_angle_deg = 30, crease_sharpness = @ }\n",
    "[[mesh]]\nfile = \"c.curves\"\ncurves = { width = @ }\n",
    "[[mesh]]\nfile = \"c.curves\"\ncurves = { width_scale = @ }\n",
    "[[mesh]]\nfile = \"c.curves\"\ncurves = { shape = \"ribbon\", normal = [0, 0, @] }\n",
    "[[light]]\ntype = \"quad\"\ncorner = [@, 2, 0]\nedge1 = [1, 0, 0]\nedge2 = [0, 0, \
     1]\nradiance = 1\n",
    "[[light]]\ntype = \"quad\"\ncorner = [0, 2, 0]\nedge1 = [@, 0, 0]\nedge2 = [0, 0, \
     1]\nradiance = 1\n",
    "[[light]]\ntype = \"quad\"\ncorner = [0, 2, 0]\nedge1 = [1, 0, 0]\nedge2 = [0, 0, \
     1]\nradiance = @\n",
    "[[light]]\ntype = \"sphere\"\ncenter = [0, @, 0]\nradius = 0.1\nradiance = 1\n",
    "[[light]]\ntype = \"sphere\"\ncenter = [0, 2, 0]\nradius = @\nradiance = 1\n",
    "[[light]]\ntype = \"sphere\"\ncenter = [0, 2, 0]\nradius = 0.1\nradiance = [1, @, 1]\n",
    "[[light]]\ntype = \"sun\"\ndirection_to_sun = [0, 1, @]\nirradiance = 1\n",
    "[[light]]\ntype = \"sun\"\ndirection_to_sun = [0, 1, 1]\nirradiance = @\n",
    "[[light]]\ntype = \"sun\"\ndirection_to_sun = [0, 1, 1]\nirradiance = 1\nangular_radius_deg \
     = @\n",
    "[[light]]\ntype = \"sky\"\nradiance = @\n",
    "[[light]]\ntype = \"point\"\nposition = [0, @, 1]\nintensity = 1\n",
    "[[light]]\ntype = \"point\"\nposition = [0, 0, 1]\nintensity = @\n",
    "[[light]]\ntype = \"spot\"\nposition = [0, 0, 2]\ndirection = [0, 0, @]\nintensity = \
     1\ninner_deg = 10\nouter_deg = 20\n",
    "[[light]]\ntype = \"spot\"\nposition = [0, 0, 2]\ndirection = [0, 0, -1]\nintensity = \
     1\ninner_deg = @\nouter_deg = 20\n",
    "[[light]]\ntype = \"spot\"\nposition = [0, 0, 2]\ndirection = [0, 0, -1]\nintensity = \
     1\ninner_deg = 10\nouter_deg = @\n",
    "[[light]]\ntype = \"environment\"\nfile = \"f.hdr\"\nscale = @\n",
    "[[light]]\ntype = \"environment\"\nfile = \"f.hdr\"\nrotation_deg = @\n",
    "[material.a]\nalbedo = @\n",
    "[material.a]\nemission = [1, 1, @]\n",
];

fn numbers_of_scenes() -> Vec<Case> {
    let mut all = Vec::new();
    for key in KEYS {
        for number in NUMBERS {
            let mut text = key.replace('@', number);
            if !key.contains("[[mesh]]") {
                text += "[[mesh]]\nfile = \"a.obj\"\n";
            }
            if !key.contains("[[light]]") {
                text += "[[light]]\ntype = \"sky\"\nradiance = 1\n";
            }
            let what = key.replace('\n', " ").replace('@', number);
            all.push(
                Case::new("number in a scene", what, Must::BeSaid)
                    .with("s.toml", text)
                    .with("c.curves", "0 0 0 .1\n1 0 0 .1\n1 1 0 .1\n")
                    .with("f.hdr", sky(12, 6)),
            );
        }
    }
    all
}

fn numbers_of_models() -> Vec<Case> {
    let mut all = Vec::new();
    for number in NUMBERS {
        let said = |what: String| Case::new("number in a model", what, Must::BeSaid);
        for (from, to) in [
            ("v 1 1 0", "v 1 @ 0"),
            ("v 1 1 0", "v 1 1 0 @"),
            ("vt 1 1", "vt 1 @"),
            ("vn 0 0 1", "vn 0 0 @"),
            ("4/4/1", "@/4/1"),
        ] {
            let to = to.replace('@', number);
            all.push(said(format!("OBJ {to}")).with("a.obj", OBJ.replacen(from, &to, 1)));
        }
        for line in [
            "Kd @ 0 0",
            "Ke 0 @ 0",
            "d @",
            "Tr @",
            "Ns @",
            "map_Kd -s @ 1 1 t.png",
            "map_Kd -o 0 @ 0 t.png",
            "map_Kd -mm 0 @ t.png",
        ] {
            let line = line.replace('@', number);
            let mtl = format!("{MTL}{line}\n");
            all.push(said(format!("MTL {line}")).with("a.mtl", mtl).with("t.png", png(2, 2)));
        }
        let curves = format!("0 0 0 .1\n1 {number} 0 .1\n1 1 0 {number}\n");
        let scene = TOML.replace("a.obj", "c.curves");
        all.push(said(format!("curves {number}")).with("c.curves", curves).with("s.toml", scene));
    }
    all
}

fn nesting() -> Vec<Case> {
    let mut all = Vec::new();
    for depth in [70, 1000, 100_000] {
        let refused = |what: &str| Case::new("nesting", format!("{what} {depth}"), Must::BeRefused);
        let (open, close) = ("[".repeat(depth), "]".repeat(depth));
        let scene = |text: String| format!("{TOML}{text}\n");
        all.push(refused("arrays").with("s.toml", scene(format!("name = {open}{close}"))));
        all.push(refused("unclosed").with("s.toml", scene(format!("x = {open}"))));
        let tables = format!("x = {}1{}", "{a=".repeat(depth), "}".repeat(depth));
        all.push(refused("tables").with("s.toml", scene(tables)));
        let dots = format!("x{} = 1", ".a".repeat(depth));
        all.push(refused("dotted keys").with("s.toml", scene(dots)));
        let header = format!("[x{}]\ny = 1", ".a".repeat(depth));
        all.push(refused("dotted tables").with("s.toml", scene(header)));
        let braces = format!("[[mesh]]\nfile = \"{}\"", "${A:-".repeat(depth));
        all.push(refused("variables").with("s.toml", scene(braces)));
    }
    let mut set = Case::new("nesting", "an override", Must::BeSaid);
    let value = format!("name={}{}", "[".repeat(2000), "]".repeat(2000));
    set.arguments = vec!["--set".into(), value];
    all.push(set);
    all
}

/// A sky of this size in Radiance's format, without run lengths.
fn sky(width: usize, height: usize) -> Vec<u8> {
    let head = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n");
    let mut bytes = head.into_bytes();
    (0..width * height).for_each(|i| bytes.extend([100, 90, (i % 200) as u8, 128]));
    bytes
}

/// A grey picture of this size.
fn png(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let picture = image::GrayImage::from_pixel(width, height, image::Luma([128]));
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// A PNG whose header says another size, with the check of the header made right.
fn lying_png(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = png(2, 2);
    bytes[16..20].copy_from_slice(&width.to_be_bytes());
    bytes[20..24].copy_from_slice(&height.to_be_bytes());
    let check = crc32fast::hash(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&check.to_be_bytes());
    bytes
}

fn textured(case: Case, name: &str, bytes: Vec<u8>) -> Case {
    let scene = format!("{TOML}[material.a]\nalbedo_texture = \"{name}\"\n");
    case.with("s.toml", scene).with(name, bytes)
}

fn under_sky(case: Case, bytes: Vec<u8>) -> Case {
    let scene = TOML.replace("\"sky\"\nradiance = 1", "\"environment\"\nfile = \"f.hdr\"");
    case.with("s.toml", scene).with("f.hdr", bytes)
}

fn headers() -> Vec<Case> {
    let mut all = Vec::new();
    let extremes = [0, 1, 1 << 16, 1 << 30, u32::MAX / 3, i32::MAX as u32, u32::MAX];
    for number in extremes {
        for word in 1..5 {
            let mut hair = b"HAIR".to_vec();
            for (i, value) in [2u32, 4, 0b10, 1].into_iter().enumerate() {
                hair.extend(if i + 1 == word { number } else { value }.to_le_bytes());
            }
            hair.resize(128, 0);
            hair[20..24].copy_from_slice(&0.1f32.to_le_bytes());
            (0..12).for_each(|i| hair.extend((i as f32).to_le_bytes()));
            all.push(
                Case::new("header", format!(".hair word {word} is {number}"), Must::BeSaid)
                    .with("s.toml", TOML.replace("a.obj", "h.hair"))
                    .with("h.hair", hair),
            );
        }
        for (width, height) in [(number, 2), (2, number), (number, number)] {
            let case = Case::new("header", format!("PNG {width}×{height}"), Must::BeSaid);
            all.push(textured(case, "t.png", lying_png(width, height)));
            let case = Case::new("header", format!("HDR {width}×{height}"), Must::BeRefused);
            let head = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n");
            all.push(under_sky(case, head.into_bytes()));
        }
        let ply = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {number}\nproperty float \
             x\nend_header\n"
        );
        all.push(
            Case::new("header", format!("PLY {number}"), Must::BeRefused)
                .with("c.ply", ply)
                .told(&["--method", "decomposition", "--load-cache", "@c.ply"]),
        );
    }
    all
}

fn writing() -> Vec<Case> {
    type Change = fn(&str) -> Vec<u8>;
    let ways: [(&str, Change); 7] = [
        ("a byte order mark", |t| format!("\u{feff}{t}").into_bytes()),
        ("carriage returns", |t| t.replace('\n', "\r\n").into_bytes()),
        ("spaces at the ends", |t| t.replace('\n', "  \t\n").into_bytes()),
        ("empty lines", |t| t.replace('\n', "\n\n\n").into_bytes()),
        ("no last newline", |t| t.trim_end().into()),
        ("comments of other scripts", |t| t.replace('\n', "\n# 注釈 ñ 🦀\n").into_bytes()),
        ("spaces before", |t| t.replace('\n', "\n\t ").into_bytes()),
    ];
    let mut all = Vec::new();
    for (name, text) in [("s.toml", TOML), ("a.obj", OBJ), ("a.mtl", MTL)] {
        for (way, change) in ways {
            let case = Case::new("writing", format!("{name} with {way}"), Must::Plain);
            all.push(case.with(name, change(text)));
        }
        let odd: [(&str, Vec<u8>); 5] = [
            ("zero bytes", text.replace(' ', "\0").into_bytes()),
            ("UTF-16", text.encode_utf16().flat_map(u16::to_le_bytes).collect()),
            ("unbreakable spaces", text.replace(' ', "\u{a0}").into_bytes()),
            ("lone returns", text.replace('\n', "\r").into_bytes()),
            ("half a character", [text.as_bytes(), b"# \xe6\xb3"].concat()),
        ];
        for (what, bytes) in odd {
            let case = Case::new("writing", format!("{name} with {what}"), Must::BeSaid);
            all.push(case.with(name, bytes));
        }
    }
    all
}

fn names() -> Vec<Case> {
    let odd = [
        "with space",
        "quote\"double",
        "quote'single",
        "new\nline",
        "tab\tname",
        "ünïcode 注",
        "$HOME",
        "${A}",
        "-dash",
        "percent%20",
        "semi;colon",
        "#hash",
        "back\\slash",
        "🦀",
    ];
    let mut all = Vec::new();
    for name in odd {
        let file = format!("{name}.obj");
        let quoted = toml::Value::String(file.replace('$', "$$")).to_string();
        let scene = TOML.replace("\"a.obj\"", &quoted);
        let must = if name.contains('\\') { Must::BeSaid } else { Must::Plain };
        all.push(
            Case::new("name", format!("mesh {name:?}"), must)
                .with("s.toml", scene)
                .with(&file, OBJ),
        );
        let mut case = Case::new("name", format!("scene {name:?}"), Must::Plain);
        case.scene = format!("{name}.toml");
        all.push(case.with(&format!("{name}.toml"), TOML));
    }
    all
}

/// What stands where a file of each role is expected.
fn no_files() -> Vec<Case> {
    let roles: [(&str, &str, &[&str]); 8] = [
        ("s.toml", "", &[]),
        ("a.obj", "", &[]),
        ("t.png", "[material.a]\nalbedo_texture = \"t.png\"\n", &[]),
        ("f.hdr", "[[light]]\ntype = \"environment\"\nfile = \"f.hdr\"\n", &[]),
        ("c.curves", "[[mesh]]\nfile = \"c.curves\"\n", &[]),
        ("h.hair", "[[mesh]]\nfile = \"h.hair\"\n", &[]),
        ("c.ply", "", &["--method", "decomposition", "--load-cache", "@c.ply"]),
        ("i.ply", "", &["--method", "irradiance-cache", "--load-cache", "@i.ply"]),
    ];
    let mut all = Vec::new();
    for (file, text, arguments) in roles {
        for (what, entry) in [
            ("empty", Entry::Bytes(Vec::new())),
            ("a space", Entry::Bytes(b" \n".to_vec())),
            ("zeros", Entry::Bytes(vec![0; 4096])),
            ("a folder", Entry::Folder),
            ("a pipe", Entry::Pipe),
            ("a loop", Entry::Link("l")),
            ("a dangling link", Entry::Link("nowhere")),
            ("a device", Entry::Link("/dev/zero")),
        ] {
            let mut case = Case::new("no file", format!("{file} is {what}"), Must::BeRefused);
            case = case.with("s.toml", format!("{TOML}{text}")).told(arguments);
            case.entry(file, entry).entry("l", Entry::Link("l"));
            all.push(case);
        }
    }
    all
}

fn pictures() -> Vec<Case> {
    let mut all = Vec::new();
    for (width, height) in [(1, 1), (1, 30_000), (30_000, 1), (3, 2)] {
        let case = Case::new("picture", format!("{width}×{height}"), Must::BeSaid);
        all.push(textured(case, "t.png", png(width, height)));
    }
    for (width, height) in [(1, 100_000), (100_000, 1), (0, 0), (0, 5)] {
        let case = Case::new("picture", format!("{width}×{height}"), Must::BeRefused);
        all.push(textured(case, "t.png", lying_png(width, height)));
    }
    for (width, height) in [(1, 1), (1, 1000), (20_000, 1), (2, 1), (4, 2)] {
        let case = Case::new("sky", format!("{width}×{height}"), Must::BeSaid);
        all.push(under_sky(case, sky(width, height)));
    }
    for size in ["0x0", "1x0", "1x1", "1x5000", "5000x1", "99999999x99999999", "axb"] {
        all.push(Case::new("size", size, Must::BeSaid).told(&["--size", size]));
    }
    all
}

fn lamps_and_cameras() -> Vec<Case> {
    let said = |what: &str, text: &str| {
        let scene = format!("{}{text}", TOML.split_once("[[mesh]]").unwrap().1);
        let own = text.contains("[camera]");
        let camera = if own { "" } else { "[camera]\neye = [0, 0, 3]\ntarget = [0, 0, 0]\n" };
        Case::new("lamp or camera", what, Must::BeSaid)
            .with("s.toml", format!("{camera}[[mesh]]{scene}"))
    };
    let quad = |a: &str, b: &str| {
        format!(
            "[[light]]\ntype = \"quad\"\ncorner = [0, 1, 0]\nedge1 = {a}\nedge2 = {b}\nradiance = \
             1\n"
        )
    };
    let camera = |eye: &str, target: &str, up: &str| {
        format!("[camera]\neye = {eye}\ntarget = {target}\nup = {up}\n")
    };
    let y = "[0, 1, 0]";
    vec![
        said("a quad without an edge", &quad("[0, 0, 0]", y)),
        said("a quad of one line", &quad(y, "[0, 2, 0]")),
        said("a tiny quad", &quad("[1e-20, 0, 0]", "[0, 0, 1e-20]")),
        said(
            "a sphere without a radius",
            "[[light]]\ntype = \"sphere\"\ncenter = [0, 1, 1]\nradius = 0\nradiance = 1\n",
        ),
        said(
            "a lamp at the eye",
            "[[light]]\ntype = \"point\"\nposition = [0, 0, 3]\nintensity = 1\n",
        ),
        said(
            "a lamp in the wall",
            "[[light]]\ntype = \"point\"\nposition = [0, 0, 0]\nintensity = 1\n",
        ),
        said(
            "a lamp that holds the eye",
            "[[light]]\ntype = \"sphere\"\ncenter = [0, 0, 3]\nradius = 1\nradiance = 1\n",
        ),
        said("an eye in the wall", &camera("[0, 0, 0]", "[1, 0, 0]", y)),
        said("an eye in a corner", &camera("[1, 1, 0]", "[0, 0, 0]", "[0, 0, 1]")),
        said("an eye on its target", &camera("[0, 0, 1]", "[0, 0, 1]", y)),
        said("an eye an ulp away", &camera("[0, 0, 1]", "[0, 0, 1.0000001]", y)),
        said("up along the view", &camera("[0, 0, 1]", "[0, 0, 0]", "[0, 0, 5]")),
        said("no up", &camera("[0, 0, 1]", "[0, 0, 0]", "[0, 0, 0]")),
    ]
}

fn duplicates() -> Vec<Case> {
    let refused = |what: &str, text: &str| {
        Case::new("duplicate", what, Must::BeRefused).with("s.toml", format!("{TOML}{text}"))
    };
    let said = |what: &str| Case::new("duplicate", what, Must::BeSaid);
    vec![
        refused("a table", "[camera]\nvfov_deg = 3\n"),
        refused("a key", "radiance = 2\n"),
        refused("a table and an array", "[light]\n"),
        refused("a material", "[material.a]\n[material.a]\n"),
        refused("a quoted key", "\"radiance\" = 1\n"),
        said("newmtl").with("a.mtl", format!("{MTL}{MTL}Kd 1 0 0\n")),
        said("mtllib").with("a.obj", OBJ.replace("a.mtl", "a.mtl a.mtl a.mtl")),
        said("faces").with("a.obj", format!("{OBJ}{}", "f 1 2 3 4\nf 4 3 2 1\n".repeat(50))),
        said("corners").with("a.obj", OBJ.replace("f ", "f 1/1/1 1/1/1 ")),
    ]
}
