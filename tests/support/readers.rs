//! Every reader of user files behind one kind of function: from the bytes of a file to `Ok`, or to
//! the error that a user would see.
//!
//! The stable tests replay the files of `fuzz/corpus` and changed copies of them through these
//! functions; the fuzz targets in `fuzz/` include this very file. A reader's corpus is the folder
//! of its name. What a function reads lies in a folder of the process and the thread, beside small
//! files that it needs.
//!
//! Caches are kept with a checksum and the key of their scene, which no change survives: their
//! function takes what follows the key, and writes key and checksum itself.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use nearfar::RenderConfig;
use nearfar::accel::Backend;
use nearfar::error::Result;
use nearfar::method::{cache, decompose, key::Key};
use nearfar::run::Run;
use nearfar::scene::{Camera, Fingerprint, Scene};
use nearfar::shading::World;
use nearfar::tessellate::Geometry;

/// From the bytes of a file to what a user would be told.
pub type Read = fn(&[u8]) -> Result<()>;

/// All readers by the name of their corpus.
pub const READERS: [(&str, Read); 15] = [
    ("scene", scene),
    ("obj", obj),
    ("cage", cage),
    ("mtl", mtl),
    ("texture", texture),
    ("texture_tga", texture_tga),
    ("sky_hdr", sky_hdr),
    ("sky_exr", sky_exr),
    ("film", film),
    ("cloud", cloud),
    ("cache_decomposition", cache_decomposition),
    ("cache_irradiance", cache_irradiance),
    ("camera_path", camera_path),
    ("hair", hair),
    ("curves", curves),
];

const TRIANGLE: &str =
    "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n";
const MESH: &str = "[[mesh]]\nfile = \"a.obj\"\n";
const SKY: &str = "[[light]]\ntype = \"sky\"\nradiance = 1\n";

/// The folder of this process and thread.
fn folder() -> PathBuf {
    let id = format!("{:?}", std::thread::current().id());
    let digits: String = id.chars().filter(char::is_ascii_digit).collect();
    let path =
        std::env::temp_dir().join(format!("nearfar-readers-{}-{digits}", std::process::id()));
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// Removes what the functions of this thread left.
pub fn clean() {
    let _ = std::fs::remove_dir_all(folder());
}

fn put(name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder().join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// Loads the scene `text` and makes triangles of it.
fn loaded(text: &str) -> Result<()> {
    triangles(&put("s.toml", text))
}

fn triangles(file: &Path) -> Result<()> {
    nearfar::load(file, &[]).map(|loaded| drop(Geometry::new(&loaded.scene)))
}

/// A scene file.
pub fn scene(bytes: &[u8]) -> Result<()> {
    put("a.obj", TRIANGLE);
    put("a.mtl", "newmtl a\nKd .5 .5 .5\n");
    triangles(&put("f.toml", bytes))
}

/// A mesh without a scene file.
pub fn obj(bytes: &[u8]) -> Result<()> {
    put("a.mtl", "newmtl a\nKd .5 .5 .5\n");
    triangles(&put("f.obj", bytes))
}

/// A mesh as the cage of a subdivision surface.
pub fn cage(bytes: &[u8]) -> Result<()> {
    put("c.obj", bytes);
    loaded(&format!("[[mesh]]\nfile = \"c.obj\"\nsubdivision = {{ levels = 1 }}\n{SKY}"))
}

/// A material library.
pub fn mtl(bytes: &[u8]) -> Result<()> {
    put("a.obj", TRIANGLE);
    put("a.mtl", bytes);
    loaded(&format!("{MESH}{SKY}"))
}

fn textured(name: &str, bytes: &[u8]) -> Result<()> {
    put("a.obj", TRIANGLE);
    put("a.mtl", "newmtl a\nKd .5 .5 .5\n");
    put(name, bytes);
    loaded(&format!("{MESH}{SKY}[material.a]\nalbedo_texture = \"{name}\"\n"))
}

/// A texture of any format that begins with its mark.
pub fn texture(bytes: &[u8]) -> Result<()> {
    textured("f.png", bytes)
}

/// A texture in TGA, which is known by its name alone.
pub fn texture_tga(bytes: &[u8]) -> Result<()> {
    textured("f.tga", bytes)
}

fn sky(name: &str, bytes: &[u8]) -> Result<()> {
    put("a.obj", TRIANGLE);
    put("a.mtl", "newmtl a\nKd .5 .5 .5\n");
    put(name, bytes);
    loaded(&format!("{MESH}[[light]]\ntype = \"environment\"\nfile = \"{name}\"\n"))
}

/// A sky in Radiance's format.
pub fn sky_hdr(bytes: &[u8]) -> Result<()> {
    sky("f.hdr", bytes)
}

/// A sky in OpenEXR.
pub fn sky_exr(bytes: &[u8]) -> Result<()> {
    sky("f.exr", bytes)
}

/// A picture: its header and its layers. Whether it may be gone on from, its checksum says, which
/// hardly any change survives: that it does not is no refusal.
pub fn film(bytes: &[u8]) -> Result<()> {
    let path = put("f.exr", bytes);
    nearfar::film::read_header(&path)?;
    nearfar::film::read_exr(&path)?;
    match nearfar::film::read_whole_exr(&path) {
        Err(e) if e.exit_code() != 2 => Err(e),
        _ => Ok(()),
    }
}

/// A cloud of discs.
pub fn cloud(bytes: &[u8]) -> Result<()> {
    nearfar::cloud::read_cloud(&put("f.ply", bytes)).map(drop)
}

/// The world that caches belong to.
fn world() -> &'static (Scene, World, RenderConfig) {
    static WORLD: OnceLock<(Scene, World, RenderConfig)> = OnceLock::new();
    WORLD.get_or_init(|| {
        put("a.obj", TRIANGLE);
        put("a.mtl", "newmtl a\nKd .5 .5 .5\n");
        let file = put("w.toml", format!("{MESH}{SKY}"));
        let scene = nearfar::load(&file, &[]).unwrap().scene;
        let world = World::new(&scene, Backend::Bvh, &Run::new(1).unwrap()).unwrap();
        (scene, world, RenderConfig::default())
    })
}

/// A whole cache file of what follows its key.
fn cache_file(key: &Key, bytes: &[u8]) -> PathBuf {
    let mut whole = b"ply\nformat binary_little_endian 1.0\n".to_vec();
    for comment in key.comments() {
        whole.extend(format!("comment {comment}\n").bytes());
    }
    whole.extend(bytes);
    whole.extend(crc32fast::hash(&whole).to_le_bytes());
    put("f.ply", whole)
}

/// Proxy and clusters of a decomposition, after the key and without the checksum.
pub fn cache_decomposition(bytes: &[u8]) -> Result<()> {
    let (scene, world, config) = world();
    let (inputs, settings) = (config.inputs(world.around.extent), &config.decompose);
    let key = decompose::store::key(Fingerprint::new(scene), &inputs, settings, world);
    let file = cache_file(&key, bytes);
    decompose::store::load(&file, &key, &inputs, settings).map(drop)
}

/// Records of the irradiance cache, after the key and without the checksum.
pub fn cache_irradiance(bytes: &[u8]) -> Result<()> {
    let (scene, world, config) = world();
    let inputs = config.inputs(world.around.extent);
    let key = cache::store::key(Fingerprint::new(scene), &inputs, &config.cache, world);
    cache::store::load(&cache_file(&key, bytes), &key).map(drop)
}

/// A camera path.
pub fn camera_path(bytes: &[u8]) -> Result<()> {
    let file = put("p.toml", bytes);
    let camera = Camera::default();
    nearfar::load::load_camera_path(&file, &camera, glam::DVec3::ZERO).map(|path| {
        path.frame(1, 3);
    })
}

/// Curves in the binary format.
pub fn hair(bytes: &[u8]) -> Result<()> {
    put("f.hair", bytes);
    loaded(&format!("[[mesh]]\nfile = \"f.hair\"\n{SKY}"))
}

/// Curves as text.
pub fn curves(bytes: &[u8]) -> Result<()> {
    put("f.curves", bytes);
    loaded(&format!("[[mesh]]\nfile = \"f.curves\"\n{SKY}"))
}
