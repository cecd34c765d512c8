//! Every reader is given the seeds of its fuzz target, and changed copies of them: it reads them or
//! says what is wrong.
//!
//! Seeds stand in `fuzz/seeds/READER`. Those called `good-…` are read; `cargo test --release
//! seeds_are_made_again -- --ignored` makes them again where a format has changed. Those called
//! `found-…` were found by fuzzing, and are never made again.

use std::path::{Path, PathBuf};

use nearfar::film::{self, Film, Precision};
use nearfar::method::Method;
use nearfar::render::{Checkpoint, Flight, Kept, Renderer, Reuse, Shots};
use nearfar::run::Run;
use nearfar::{RenderConfig, cloud};

use crate::support::Folder;
use crate::support::mutation::mutated;
use crate::support::readers::{READERS, Reader, card, little, text_of_film, views};

const SEEDS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/seeds");
const TARGETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/fuzz_targets");
/// Largest seed, bytes.
const LARGEST: usize = 8192;

fn sorted(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).collect();
    paths.sort();
    paths
}

/// The seeds of a reader: names and bytes.
fn seeds(reader: &str) -> Vec<(String, Vec<u8>)> {
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    let all = sorted(&Path::new(SEEDS).join(reader)).into_iter();
    all.map(|path| (name(&path), std::fs::read(&path).unwrap())).collect()
}

/// Good seeds are read, findings are told in words.
#[test]
fn seeds_are_read() {
    for reader in READERS {
        let folder = Reader::folder(&format!("seeds-{}", reader.name));
        let seeds = seeds(reader.name);
        assert!(seeds.iter().any(|(name, _)| name.starts_with("good-")), "{}", reader.name);
        for (name, bytes) in seeds {
            assert!(bytes.len() <= LARGEST, "{}/{name} has {} bytes", reader.name, bytes.len());
            let read = reader.look(&folder, &bytes);
            assert!(read || !name.starts_with("good-"), "{}/{name} is refused", reader.name);
        }
    }
}

/// A reader without a target, or a target of nothing, is noticed.
#[test]
fn every_reader_has_a_target() {
    let stems = |folder: &str| -> Vec<String> {
        let stem = |p: PathBuf| p.file_stem().unwrap().to_string_lossy().into_owned();
        sorted(Path::new(folder)).into_iter().map(stem).collect()
    };
    let mut names: Vec<&str> = READERS.iter().map(|reader| reader.name).collect();
    names.sort_unstable();
    assert_eq!(stems(TARGETS), names);
    assert_eq!(stems(SEEDS), names);
    for name in names {
        let target = std::fs::read_to_string(format!("{TARGETS}/{name}.rs")).unwrap();
        assert!(target.contains(&format!("nearfar_fuzz::target!(\"{name}\");")), "{name}");
    }
}

/// Gives every reader changed copies of its good seeds.
fn changed(cases: u64) {
    for reader in READERS {
        let folder = Reader::folder(&format!("changed-{}", reader.name));
        let good: Vec<_> =
            seeds(reader.name).into_iter().filter(|(name, _)| name.starts_with("good-")).collect();
        let count = good.len() as u64;
        for case in 0..cases {
            let (_, bytes) = &good[(case % count) as usize];
            reader.look(&folder, &mutated(bytes, case / count));
        }
    }
}

#[test]
fn changed_files_are_told() {
    changed(150);
}

#[test]
#[ignore = "slow: minutes"]
fn many_changed_files_are_told() {
    changed(20_000);
}

/// Whatever single byte of a cloud is another, its checksum tells.
#[test]
fn damage_is_noticed() {
    let folder = Folder::new("damage");
    let (_, good) = seeds("cloud").into_iter().find(|(name, _)| name == "good-cloud").unwrap();
    let end = good.windows(11).position(|w| w == b"end_header\n").unwrap();
    for at in end + 11..good.len() {
        let mut bytes = good.clone();
        bytes[at] ^= 1 << (at % 8);
        let path = folder.file("c.ply", &bytes);
        let said = cloud::read_cloud(Path::new(&path)).unwrap_err().to_string();
        assert!(said.contains("damaged"), "{at}: {said}");
    }
}

/// Takes in what is made.
struct Made(Vec<(&'static str, &'static str, Vec<u8>)>);

impl Made {
    fn put(&mut self, reader: &'static str, name: &'static str, bytes: impl Into<Vec<u8>>) {
        self.0.push((reader, name, bytes.into()));
    }
    fn texts(&mut self) {
        self.put("scene", "plain", PLAIN);
        self.put("scene", "every-key", EVERY_KEY);
        self.put("obj", "square", SQUARE);
        self.put("obj", "written", WRITTEN);
        self.put("cage", "tags", CAGE);
        self.put("mtl", "plain", "newmtl m\nKd 0.5 0.4 0.3\nKe 1 2 3\nd 0.5\nillum 2\n");
        self.put("mtl", "texture", MTL);
        self.put("curves", "two", "0 0 0 .1\n1 0 0 .1\n\n0 0 1 .2 # c\n0 3 1 .2\n1 1 1\n");
        self.put("camera_path", "two", PATH);
        self.put("settings", "lines", SETTINGS);
        self.put("report", "manifest", MANIFEST);
        self.put("statistics", "json", "{\"method\": \"path\", \"seconds\": 1.5, \"a\": [1]}\n");
    }
    fn pictures(&mut self) {
        let texel = |x: u32, y: u32| image::Rgba([x as u8 * 20, 5, y as u8, 99]);
        let picture = image::RgbaImage::from_fn(9, 7, texel);
        let opaque = image::DynamicImage::from(picture.clone()).into_rgb8();
        let mut put = |name, format| {
            let mut bytes = std::io::Cursor::new(Vec::new());
            match format {
                image::ImageFormat::Jpeg | image::ImageFormat::Bmp => {
                    opaque.write_to(&mut bytes, format).unwrap();
                }
                _ => picture.write_to(&mut bytes, format).unwrap(),
            }
            self.put("texture", name, bytes.into_inner());
        };
        put("png", image::ImageFormat::Png);
        put("jpeg", image::ImageFormat::Jpeg);
        put("bmp", image::ImageFormat::Bmp);
        put("tiff", image::ImageFormat::Tiff);
        let mut tga = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut tga, image::ImageFormat::Tga).unwrap();
        self.put("tga", "alpha", tga.into_inner());
        let mut flat = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 3 +X 6\n".to_vec();
        flat.extend((0..18u8).flat_map(|i| [i * 9, 90, 200, 128 + i % 5]));
        self.put("sky", "flat", flat);
        let mut rle = b"#?RGBE\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n".to_vec();
        let row = [2, 2, 0, 8, 136, 90, 8, 1, 2, 3, 4, 5, 6, 7, 8, 136, 7, 136, 129];
        (0..4).for_each(|_| rle.extend(row));
        self.put("sky", "rle", rle);
    }
    fn films(&mut self, folder: &Folder) {
        let mut film = Film::new(6, 3);
        let ramp = |k: usize| (0..18).map(|i| (i * k % 17) as f32 * 0.1).collect();
        for (k, name) in ["R", "G", "B", "half0.R", "depth.Z"].into_iter().enumerate() {
            film.set(name, ramp(k + 1));
        }
        film.header.insert("nearfar.seed".into(), "1".into());
        let path = folder.join("f.exr");
        for (name, precision) in [("full", Precision::Full), ("half", Precision::Half)] {
            film::write_exr(&film, &path, precision).unwrap();
            let bytes = std::fs::read(&path).unwrap();
            self.put("film", name, bytes.clone());
            self.put("sky_exr", name, bytes);
        }
        self.put("film", "rle-parts", foreign(folder));
    }
    fn points(&mut self, folder: &Folder) {
        let path = folder.join("c.ply");
        let cloud = cloud::Cloud {
            p: (0..12).map(|i| glam::Vec3::splat(i as f32)).collect(),
            n: vec![glam::Vec3::Y; 12],
            area: vec![0.5; 12],
            one_sided: vec![false; 12],
            channels: vec![cloud::Channel {
                name: "light".into(),
                values: vec![glam::Vec3::ONE; 12],
            }],
        };
        cloud::write_cloud(&path, &cloud, &["a comment".into()]).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        self.put("cloud", "cloud", bytes.clone());
        self.put("table", "cloud", bytes);
        let header = "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty double x\n\
                      property float y\nproperty short z\nproperty float nx\nproperty float ny\n\
                      property float nz\nproperty uchar radius\nend_header\n";
        let row = [&1f64.to_le_bytes()[..], &[0, 0, 128, 63, 3, 0, 0, 0, 128, 63], &[0; 8], &[7]];
        let foreign = [header.as_bytes(), &row.concat(), &row.concat()].concat();
        self.put("cloud", "foreign", foreign.clone());
        self.put("table", "foreign", foreign);
        let mut hair = b"HAIR".to_vec();
        [3u32, 9, 0b110, 2].iter().for_each(|w| hair.extend(w.to_le_bytes()));
        [0.01f32, 0.0, 0.5, 0.5, 0.5].iter().for_each(|w| hair.extend(w.to_le_bytes()));
        hair.resize(128, 0);
        for i in 0..9 {
            let i = i as f32;
            [i, i * i, 1.0 / (1.0 + i)].iter().for_each(|x| hair.extend(x.to_le_bytes()));
        }
        (0..9).for_each(|i| hair.extend((0.01 * (1 + i) as f32).to_le_bytes()));
        self.put("hair", "three", hair);
    }
    fn kept(&mut self) {
        let folder = Reader::folder("seeds-kept");
        let (scene, config, run) = (card(&folder), little(), Run::new(1).unwrap());
        let at = |name: &str| folder.join(name);
        let render = |method, kept: &Kept, config: &RenderConfig| {
            Renderer::new(&scene, config, &run).unwrap().render_keeping(method, kept).unwrap()
        };
        let methods = [("kept", Method::Decomposition), ("records", Method::IrradianceCache)];
        for (name, method) in methods {
            let kept = Kept { save: Some(at(name)), ..Kept::default() };
            render(method, &kept, &config);
            self.put(name, "card", std::fs::read(at(name)).unwrap());
        }
        let shots = Shots::new(&scene, &config, views(&scene), Reuse::Extend, None).unwrap();
        let every = std::time::Duration::ZERO;
        let checkpoint = Some(Checkpoint { file: at("state"), every });
        let kept = Kept { checkpoint, ..Kept::default() };
        let mut flight = Flight::new(&scene, &config, shots, &kept, &run).unwrap();
        flight.frame(0).unwrap();
        flight.keep(1).unwrap();
        self.put("film_state", "first", std::fs::read(at("state")).unwrap());
        let state = Renderer::new(&scene, &config, &run).unwrap();
        let film = state.reference(&Kept::default(), true).unwrap().film;
        self.put("checkpoint", "path", text_of_film(&film));
    }
}

/// A picture as others write it: two parts, run lengths, a data window of its own.
fn foreign(folder: &Folder) -> Vec<u8> {
    use exr::prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds,
        Layer, LayerAttributes, Layers, Text, WritableImage as _,
    };
    let part = |name: &str, at: (i32, i32)| {
        let channel = |c: &str| {
            AnyChannel::new(Text::new_or_none(c).unwrap(), FlatSamples::F32(vec![0.25; 12]))
        };
        let attributes = LayerAttributes {
            layer_position: at.into(),
            ..LayerAttributes::named(Text::new_or_none(name).unwrap())
        };
        let channels = AnyChannels::sort(["R", "G", "B"].map(channel).into_iter().collect());
        Layer::new((4, 3), attributes, Encoding::FAST_LOSSLESS, channels)
    };
    let window = IntegerBounds::new((0, 0), (8, 4));
    let parts = [part("near", (2, 1)), part("far", (-1, 0))];
    let image =
        Image::from_layers(ImageAttributes::new(window), parts.into_iter().collect::<Layers<_>>());
    let path = folder.join("parts.exr");
    image.write().to_file(&path).unwrap();
    std::fs::read(&path).unwrap()
}

#[test]
#[ignore = "writes fuzz/seeds"]
fn seeds_are_made_again() {
    let folder = Folder::new("seeds-made");
    let mut made = Made(Vec::new());
    made.texts();
    made.pictures();
    made.films(&folder);
    made.points(&folder);
    made.kept();
    for (reader, name, bytes) in made.0 {
        let at = Path::new(SEEDS).join(reader);
        std::fs::create_dir_all(&at).unwrap();
        std::fs::write(at.join(format!("good-{name}")), bytes).unwrap();
    }
}

const PLAIN: &str = "[[mesh]]\nfile = \"a.obj\"\n[[light]]\ntype = \"sky\"\nradiance = 1\n";
const EVERY_KEY: &str = "name = \"room\"\nsearch_paths = [\"textures\"]\n[camera]\neye = [0, 1.6, \
    4]\ntarget = [0, 1.2, 0]\nup = [0, 1, 0]\nvfov_deg = 45\nwidth = 64\nheight = 36\n[[mesh]]\n\
    file = \"a.obj\"\nscale = [1, 2, 1]\nrotate_deg = [0, 90, 0]\ntranslate = [0, 0, 0.5]\nnormals \
    = \"smooth\"\ncrease_deg = 30\nsides = \"two\"\nmaterials = \"diffuse\"\nmaterial = \"m\"\n\
    [[mesh]]\nfile = \"a.obj\"\nsubdivision = { levels = 2, crease_angle_deg = 30 }\n[[mesh]]\n\
    builtin = \"interior\"\nparameters = { detail = 0.25 }\nmatrix = [[1,0,0,0],[0,1,0,0],[0,0,1,\
    0]]\n[[light]]\ntype = \"quad\"\ncorner = [0, 2, 0]\nedge1 = [1, 0, 0]\nedge2 = [0, 0, 1]\n\
    radiance = [1, 2, 3]\n[[light]]\ntype = \"sphere\"\ncenter = [0, 3, 0]\nradius = 0.1\nradiance \
    = 1\n[[light]]\ntype = \"sun\"\ndirection_to_sun = [1, 1, 0]\nirradiance = 3\n\
    angular_radius_deg = 0.27\n[[light]]\ntype = \"environment\"\nfile = \"a.exr\"\nscale = 0.5\n\
    rotation_deg = 10\n[[light]]\ntype = \"point\"\nposition = [0, 1, 0]\nintensity = 1\n\
    [[light]]\ntype = \"spot\"\nposition = [0, 2, 0]\ndirection = [0, -1, 0]\nintensity = 1\n\
    inner_deg = 20\nouter_deg = 30\n[material.m]\nalbedo = [0.5, 0.4, 0.3]\nopacity = 0.5\n\
    emission = 0.1\n[settings]\nseed = 3\n[settings.decompose]\nalpha = \"2%\"\n";
const SQUARE: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvn \
    0 0 1\nusemtl m\nf 1/1/1 2/2/1 3/3/1 4/1/1\n";
const WRITTEN: &str = "# written\r\no box\r\ng a b\r\nv 0 0 0 1 0 0\r\nv 1 0 0\r\nv 1 \\\r\n1 0\r\n\
    s 1\r\nusemtl\tnone # grey\r\nf -3 -2 -1 # c\r\nl 1 2\r\np 1\r\nvn nan 0 0\r\nf 1//1 2//1 \
    3//1\r\n";
const CAGE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 1 2 3 4\nf 1 2 5\nt crease \
    2/1/0 0 1 3\nt corner 1/1/0 2 1\nt interpolateboundary 1/0/0 1\n";
const MTL: &str = "newmtl m\nKd 1 1 1\nmap_Kd -s 4 4 1 -o .5 0 0 -mm 0 1 -clamp on t.png\nmap_d \
    gone.png\nmap_Ke -bm 2 b.png\nKs 1 1 1\nNs 30\nTr 0.5\nPm 1\nnewmtl n\n";
const PATH: &str = "[[key]]\neye=[0,0,1]\ntarget=[0,0,0]\ntime=0\n[[key]]\neye=[1,0,1]\ntarget=[0,\
    0,0]\nup=[0,0,1]\nvfov_deg=60\ntime=2\n";
const SETTINGS: &str = "decompose.alpha=\"2%\"\nproxy.photons=1000\nseed=7\ncamera.width=32\n\
    light.0.radiance=[1, 2, 3]\npath.target_error=0.01\n";
const MANIFEST: &str = "title = \"Two\"\ntext = \"Above\"\n[[section]]\nfolder = \".\"\n\
    pictures = [\"a\", \"a\"]\nreference = \"a\"\npair = [\"a\", \"a\"]\nexposure = 0.5\n\
    ratio = [\"a\", \"a\"]\n[[section.toggle]]\nlabel = \"l\"\noff = \"a\"\non = \"a\"\n\
    [section.sweep]\nlabel = \"s\"\nvalues = [0]\npictures = [\"a\"]\n";
