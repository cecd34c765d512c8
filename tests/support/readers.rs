//! Every reader of the house behind one door: bytes in, and either a value or an error in words.
//!
//! ```text
//! bytes → the file of that name in a folder, beside what it needs → reader → picture of 4×3 pixels
//! ```
//! The fuzz targets in `fuzz/` and the tests that replay their seeds call [`Reader::look`], which
//! panics when an error is none of the user's. What is read is used, too: a scene is rendered, a
//! cloud is shown, kept work is gone on from. Checksums are set right first ([`mended`]): else a
//! changed file would be known by them, and what lies behind would never be tried.

use std::path::Path;
use std::sync::OnceLock;

use nearfar::accel::Backend;
use nearfar::error::Result;
use nearfar::film::{self, Film, Precision};
use nearfar::load::{load, load_camera_path};
use nearfar::method::Method;
use nearfar::render::{Flight, Kept, Renderer, Reuse, Shots};
use nearfar::scene::{Camera, Scene};
use nearfar::{RenderConfig, Run, cloud, compare, config, memory, page};

use super::folder::Folder;

/// A reader and the name of the file that it is given.
#[derive(Clone, Copy, Debug)]
pub struct Reader {
    /// Of the fuzz target and of its folder in `fuzz/seeds`.
    pub name: &'static str,
    /// Of the file, whose extension decides who reads it.
    pub file: &'static str,
    read: fn(&Folder, &Path) -> Result<()>,
}

const fn reader(
    name: &'static str,
    file: &'static str,
    read: fn(&Folder, &Path) -> Result<()>,
) -> Reader {
    Reader { name, file, read }
}

/// All of them.
pub const READERS: [Reader; 21] = [
    reader("scene", "scene.toml", |_, file| rendered(file, &[], Method::Direct)),
    reader("obj", "mesh.obj", |_, file| rendered(file, &[], Method::Direct)),
    reader("cage", "mesh.obj", |folder, _| {
        of_mesh(folder, "file = \"mesh.obj\"\nsubdivision = { levels = 1 }")
    }),
    reader("mtl", "a.mtl", |folder, _| of_mesh(folder, "file = \"a.obj\"")),
    reader("texture", "t.png", |folder, _| {
        let texture = "[material.m]\nalbedo_texture = \"t.png\"\nopacity_texture = \"t.png\"";
        of_mesh(folder, &format!("file = \"a.obj\"\n{texture}"))
    }),
    reader("tga", "t.tga", |folder, _| {
        of_mesh(folder, "file = \"a.obj\"\n[material.m]\nalbedo_texture = \"t.tga\"")
    }),
    reader("sky", "sky.hdr", |folder, _| of_sky(folder, "sky.hdr")),
    reader("sky_exr", "sky.exr", |folder, _| of_sky(folder, "sky.exr")),
    reader("hair", "fur.hair", |folder, _| of_mesh(folder, "file = \"fur.hair\"")),
    reader("curves", "fur.curves", |folder, _| {
        of_mesh(folder, "file = \"fur.curves\"\ncurves = { shape = \"ribbon\", width = 0.1 }")
    }),
    reader("camera_path", "path.toml", |_, file| {
        let path = load_camera_path(file, &Camera::default(), glam::DVec3::ONE)?;
        (0..5).for_each(|i| assert!(path.frame(i, 5).width > 0));
        Ok(())
    }),
    reader("settings", "settings.txt", settings),
    reader("film", "film.exr", film),
    reader("cloud", "cloud.ply", |_, file| cloud::read_cloud(file).map(drop)),
    reader("table", "table.ply", |_, file| {
        let table = page::viewer::Table::read(file)?;
        run().install(|| page::viewer::page(&table, "points")).map(drop)
    }),
    reader("kept", "kept.ply", |folder, file| kept(folder, file, Method::Decomposition)),
    reader("records", "records.ply", |folder, file| kept(folder, file, Method::IrradianceCache)),
    reader("film_state", "state.ply", film_state),
    reader("checkpoint", "partial.txt", |folder, file| {
        let film = film_of_text(&std::fs::read_to_string(file).unwrap_or_default());
        gone_on(folder, film)
    }),
    reader("report", "report.toml", |folder, _| page::report::page(folder, run()).map(drop)),
    reader("statistics", "a.json", |folder, _| page::report::page(folder, run()).map(drop)),
];

impl Reader {
    /// Gives the reader a file of these bytes; whether it was read. `folder` is that of
    /// [`Self::folder`].
    pub fn look(&self, folder: &Folder, bytes: &[u8]) -> bool {
        let file = folder.join(self.file);
        std::fs::write(&file, mended(bytes)).unwrap();
        match (self.read)(folder, &file) {
            Ok(()) => true,
            Err(error) => {
                let said = error.to_string();
                assert!(error.exit_code() == 2 && !said.is_empty(), "{}: {said}", self.name);
                false
            }
        }
    }

    /// What the readers need beside their file.
    pub fn folder(name: &str) -> Folder {
        memory::set_limit(2_000_000_000);
        let folder = Folder::new(name);
        folder.file(
            "a.obj",
            "mtllib a.mtl\nvt 0 0\nvt 1 0\nvt 0 1\nv 0 0 0\nv 1 0 0\nv 0 1 0\n\
                              usemtl m\nf 1/1 2/2 3/3\n",
        );
        folder.file("a.mtl", "newmtl m\nKd 0.5 0.5 0.5\n");
        let mut small = Film::new(4, 2);
        ["R", "G", "B"].iter().for_each(|name| small.set(name, vec![0.5; 8]));
        film::write_exr(&small, &folder.join("a.exr"), Precision::Full).unwrap();
        film::write_png(&small, &folder.join("t.png"), 0.0).unwrap();
        folder
    }
}

/// Bytes whose checksum is right, where they end in one as ours do.
pub fn mended(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let has_one = |b: &[u8]| b.windows(18).take(4096).any(|w| w == b"element checksum 1");
    if bytes.starts_with(b"ply") && has_one(&bytes) && bytes.len() > 4 {
        let end = bytes.len() - 4;
        let sum = crc32fast::hash(&bytes[..end]);
        bytes[end..].copy_from_slice(&sum.to_le_bytes());
    }
    bytes
}

fn run() -> &'static Run {
    static RUN: OnceLock<Run> = OnceLock::new();
    RUN.get_or_init(|| Run::new(1).unwrap())
}

/// Little of everything; the same in every build.
pub fn little() -> RenderConfig {
    let mut config = RenderConfig { backend: Backend::Bvh, ..RenderConfig::default() };
    (config.path.spp, config.record.spp, config.proxy.photons) = (2, 1, 200);
    (config.decompose.rays, config.cache.rays) = (16, 16);
    config.decompose.sh_bands = 2;
    config.decompose.near_rays = 4;
    config
}

const MOST_TRIANGLES: usize = 20_000;

/// Loads a scene and renders it in a few pixels.
fn rendered(file: &Path, overrides: &[(String, String)], method: Method) -> Result<()> {
    let loaded = load(file, overrides)?;
    let mut scene = loaded.scene;
    RenderConfig::from_table(loaded.settings)?;
    if scene.meshes.iter().map(|m| m.triangles.len()).sum::<usize>() > MOST_TRIANGLES {
        return Ok(());
    }
    (scene.camera.width, scene.camera.height) = (4, 3);
    let film = nearfar::render(&scene, &little(), method, run())?.film;
    let pixels = film.rgb("").unwrap_or_default();
    assert!(pixels.iter().all(|c| !c.is_nan() && c.min_element() >= 0.0), "{pixels:?}");
    Ok(())
}

/// A scene of one mesh under a sky, by the method that reads most of it.
fn of_mesh(folder: &Folder, mesh: &str) -> Result<()> {
    let text = format!("[[mesh]]\n{mesh}\n[[light]]\ntype = \"sky\"\nradiance = 1\n");
    rendered(Path::new(&folder.file("s.toml", text)), &[], Method::Decomposition)
}

fn of_sky(folder: &Folder, sky: &str) -> Result<()> {
    let light = format!("[[light]]\ntype = \"environment\"\nfile = \"{sky}\"\n");
    let text = format!("[[mesh]]\nfile = \"a.obj\"\n{light}");
    rendered(Path::new(&folder.file("s.toml", text)), &[], Method::Direct)
}

/// A line an assignment; then the settings are followed through every method.
fn settings(folder: &Folder, file: &Path) -> Result<()> {
    let text = std::fs::read(file).unwrap_or_default();
    let lines = String::from_utf8_lossy(&text).into_owned();
    let overrides = lines.lines().map(config::parse_assignment).collect::<Result<Vec<_>>>()?;
    let scene = room(folder);
    let settings = load(&scene, &overrides)?.settings;
    let found = RenderConfig::from_table(settings)?;
    let again = RenderConfig::from_table(found.to_table()?)?;
    for method in Method::ALL {
        let config = again.clone().for_method(method, 2.0)?;
        assert!(config.inputs(2.0).near_cell > 0.0);
    }
    Ok(())
}

fn film(folder: &Folder, file: &Path) -> Result<()> {
    drop(film::read_header(file));
    drop(film::read_whole_exr(file));
    let found = film::read_exr(file)?;
    let count = found.width as usize * found.height as usize;
    assert!(found.channels.values().all(|values| values.len() == count));
    if !(1..10_000).contains(&count) {
        return Ok(());
    }
    film::write_exr(&found, &folder.join("again.exr"), Precision::Full)?;
    compare::compare(&found, file, &compare::Truth::read(file)?).map(drop)
}

/// The scene file of a card under a sky.
fn room(folder: &Folder) -> std::path::PathBuf {
    folder.file("card.obj", "v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\n");
    let scene = "[camera]\neye = [0, 1, 2]\ntarget = [0, 0, 0]\nwidth = 4\nheight = 3\n[[mesh]]\n\
                 file = \"card.obj\"\nsides = \"two\"\n[[light]]\ntype = \"sky\"\nradiance = 1\n";
    folder.file("card.toml", scene).into()
}

/// The card, and how it is rendered where work is kept.
pub fn card(folder: &Folder) -> Scene {
    load(&room(folder), &[]).unwrap().scene
}

fn kept(folder: &Folder, file: &Path, method: Method) -> Result<()> {
    let (scene, config) = (card(folder), little());
    let kept = Kept { load: Some(file.into()), ..Kept::default() };
    Renderer::new(&scene, &config, run())?.render_keeping(method, &kept).map(drop)
}

/// The views of a film of two frames.
pub fn views(scene: &Scene) -> Vec<Camera> {
    let aside = Camera { eye: scene.camera.eye + glam::Vec3::X, ..scene.camera.clone() };
    vec![scene.camera.clone(), aside]
}

fn film_state(folder: &Folder, file: &Path) -> Result<()> {
    let (scene, config) = (card(folder), little());
    let shots = Shots::new(&scene, &config, views(&scene), Reuse::Extend, None)?;
    let kept = Kept { resume: Some(file.into()), ..Kept::default() };
    let mut flight = Flight::new(&scene, &config, shots, &kept, run())?;
    flight.frame(1).map(drop)
}

/// A film in words: its size in the first line, then `key = value` of the header and
/// `channel: number number …`, the last number for all that follow.
fn film_of_text(text: &str) -> Film {
    let mut lines = text.lines();
    let size: Vec<u32> = lines
        .next()
        .unwrap_or_default()
        .split_whitespace()
        .filter_map(|n| n.parse().ok().filter(|n| (1..64).contains(n)))
        .collect();
    let [width, height] = size[..] else { return Film::new(1, 1) };
    let mut film = Film::new(width, height);
    for line in lines {
        if let Some((name, numbers)) = line.split_once(": ") {
            let mut values: Vec<f32> =
                numbers.split_whitespace().filter_map(|n| n.parse().ok()).collect();
            let last = values.last().copied().unwrap_or_default();
            values.resize(width as usize * height as usize, last);
            film.set(name, values);
        } else if let Some((key, value)) = line.split_once(" = ") {
            film.header.insert(key.into(), value.into());
        }
    }
    film
}

/// What [`film_of_text`] reads.
pub fn text_of_film(film: &Film) -> String {
    let mut text = format!("{} {}\n", film.width, film.height);
    for (key, value) in film.header.iter().filter(|(_, value)| !value.contains('\n')) {
        text += &format!("{key} = {value}\n");
    }
    for (name, values) in &film.channels {
        let numbers: Vec<String> = values.iter().map(|v| format!("{v:e}")).collect();
        text += &format!("{name}: {}\n", numbers.join(" "));
    }
    text
}

/// Goes on from a film as from a partial picture, by itself and in a converging one.
fn gone_on(folder: &Folder, film: Film) -> Result<()> {
    let file = folder.join("partial.exr");
    film::write_exr(&film, &file, Precision::Full)?;
    let (scene, mut config) = (card(folder), little());
    let kept = Kept { resume: Some(file), ..Kept::default() };
    config.path.spp = 4;
    let traced = Renderer::new(&scene, &config, run())?.reference(&kept, true);
    if film.header.get(film::SUMS_OF).is_none_or(|of| of != "converge") {
        return traced.map(drop);
    }
    (config.converge.enabled, config.converge.spp) = (true, 4);
    Renderer::new(&scene, &config, run())?.render_keeping(Method::Direct, &kept).map(drop)
}
