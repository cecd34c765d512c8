//! Binary files with bytes changed, cut out, doubled and replaced by extreme numbers: every reader
//! reads them or says what is wrong, and takes no memory that the file cannot fill.

use std::path::Path;

use nearfar::error::Error;
use nearfar::film::{Film, Precision, read_exr, write_exr};
use nearfar::sampling::{Rng, Stream};
use nearfar::scene::Camera;
use nearfar::tessellate::Geometry;

use crate::support::Folder;

const CASES: u64 = 400;
const EXTREMES: [u32; 8] =
    [0, 1, u32::MAX, 1 << 31, 0x7fff_ffff, 1 << 30, 0x7f80_0000, 0xffc0_0000];

/// One to six changes, by the number of the case.
fn mutated(good: &[u8], case: u64) -> Vec<u8> {
    let mut bytes = good.to_vec();
    let mut rng = Rng::new(7, Stream::Test, case, 0);
    for _ in 0..=rng.below(6) {
        if bytes.len() < 8 {
            break;
        }
        let at = rng.below(bytes.len() - 4);
        let end = at + 1 + rng.below((bytes.len() - at).min(40));
        match rng.below(6) {
            0 => bytes[at] ^= 1 << rng.below(8),
            1 => bytes[at] = rng.next_u64() as u8,
            2 => bytes[at..at + 4].copy_from_slice(&EXTREMES[rng.below(8)].to_le_bytes()),
            3 => drop(bytes.drain(at..end.min(bytes.len()))),
            4 => {
                let again = bytes[at..end.min(bytes.len())].to_vec();
                drop(bytes.splice(at..at, again));
            }
            _ => bytes.truncate(at.max(bytes.len() / 2)),
        }
    }
    bytes
}

/// Lets `read` look at changed copies of `good` under `name`; returns how many were read.
fn survives(name: &str, good: &[u8], read: impl Fn(&Path) -> Result<(), Error>) -> usize {
    let folder = Folder::new(&format!("mutations-{name}"));
    let path = folder.0.join(name);
    std::fs::write(&path, good).unwrap();
    read(&path).unwrap();
    let mut accepted = 0;
    for case in 0..CASES {
        std::fs::write(&path, mutated(good, case)).unwrap();
        match read(&path) {
            Ok(()) => accepted += 1,
            Err(e) => assert!(e.exit_code() == 2 && !e.to_string().is_empty(), "{case}: {e}"),
        }
    }
    accepted
}

/// Loads `scene`, which stands beside the file, and makes triangles of it.
fn scene(scene: impl Into<String>) -> impl Fn(&Path) -> Result<(), Error> {
    let scene = scene.into();
    move |file| {
        let folder = file.parent().unwrap();
        std::fs::write(folder.join("s.toml"), &scene).unwrap();
        std::fs::write(folder.join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        nearfar::load::load(&folder.join("s.toml"), &[])
            .map(|loaded| drop(Geometry::new(&loaded.scene)))
    }
}

fn film() -> Film {
    let mut film = Film::new(24, 12);
    let ramp = |k: usize| (0..288).map(|i| (i * k % 17) as f32 * 0.1).collect();
    for (k, name) in ["R", "G", "B", "depth.Z"].into_iter().enumerate() {
        film.set(name, ramp(k + 1));
    }
    film.header.insert("nearfar.seed".into(), "1".into());
    film
}

fn exr() -> Vec<u8> {
    let folder = Folder::new("mutations-made");
    let path = folder.0.join("f.exr");
    write_exr(&film(), &path, Precision::Full).unwrap();
    std::fs::read(&path).unwrap()
}

#[test]
fn pictures_and_skies() {
    survives("f.exr", &exr(), |path| read_exr(path).map(drop));
    let sky = "[[mesh]]\nfile = \"a.obj\"\n[[light]]\ntype = \"environment\"\nfile = \"f.exr\"\n";
    survives("f.exr", &exr(), scene(sky));
    let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 6 +X 12\n".to_vec();
    hdr.extend((0..72u32).flat_map(|i| [i as u8 * 3, 90, 200, 128 + (i % 5) as u8]));
    let sky = "[[mesh]]\nfile = \"a.obj\"\n[[light]]\ntype = \"environment\"\nfile = \"f.hdr\"\n";
    survives("f.hdr", &hdr, scene(sky));
}

#[test]
fn textures() {
    let picture =
        image::RgbaImage::from_fn(9, 7, |x, y| image::Rgba([x as u8 * 20, 5, y as u8, 99]));
    for (name, format) in [
        ("f.png", image::ImageFormat::Png),
        ("f.tiff", image::ImageFormat::Tiff),
        ("f.tga", image::ImageFormat::Tga),
    ] {
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).unwrap();
        let textured = format!(
            "[[mesh]]\nfile = \"a.obj\"\nmaterial = \"m\"\n[material.m]\nalbedo_texture = \
             \"{name}\"\n[[light]]\ntype = \"sky\"\nradiance = 1\n"
        );
        survives(name, bytes.get_ref(), scene(textured));
    }
}

#[test]
fn hair_and_text_curves() {
    let mut hair = b"HAIR".to_vec();
    for word in [3u32, 9, 0b110, 2] {
        hair.extend(word.to_le_bytes());
    }
    for number in [0.01f32, 0.0, 0.5, 0.5, 0.5] {
        hair.extend(number.to_le_bytes());
    }
    hair.resize(128, 0);
    for i in 0..9 {
        let i = i as f32;
        [i, i * i, 1.0 / (1.0 + i)].iter().for_each(|x| hair.extend(x.to_le_bytes()));
    }
    (0..9).for_each(|i| hair.extend((0.01 * (1 + i) as f32).to_le_bytes()));
    let furry = "[[mesh]]\nfile = \"f.hair\"\n[[light]]\ntype = \"sky\"\nradiance = 1\n";
    survives("f.hair", &hair, scene(furry));
    let furry = "[[mesh]]\nfile = \"f.curves\"\n[[light]]\ntype = \"sky\"\nradiance = 1\n";
    survives("f.curves", b"0 0 0 .1\n1 0 0 .1\n\n0 0 1 .2 # c\n0 3 1 .2\n1 1 1 .1\n", scene(furry));
}

#[test]
fn clouds_cages_and_camera_paths() {
    let folder = Folder::new("mutations-cloud");
    let path = folder.0.join("c.ply");
    let cloud = nearfar::cloud::Cloud {
        p: (0..20).map(|i| glam::Vec3::splat(i as f32)).collect(),
        n: vec![glam::Vec3::Y; 20],
        area: vec![0.5; 20],
        one_sided: vec![false; 20],
        ..nearfar::cloud::Cloud::default()
    };
    nearfar::cloud::write_cloud(&path, &cloud, &["a comment".into()]).unwrap();
    let ply = std::fs::read(&path).unwrap();
    let read = survives("c.ply", &ply, |path| nearfar::cloud::read_cloud(path).map(drop));
    // What is changed in the rows is known by the checksum; the header has slack.
    assert!(read < CASES as usize / 4, "{read} of {CASES} changed clouds were read");
    let cage = "[[mesh]]\nfile = \"f.obj\"\nsubdivision = { levels = 1 }\n[[light]]\ntype = \
                \"sky\"\nradiance = 1\n";
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 1 2 3 4\nf 1 2 5\nt crease 2/1/0 0 1 \
               3\nt corner 1/1/0 2 1\nt interpolateboundary 1/0/0 1\n";
    survives("f.obj", obj.as_bytes(), scene(cage));
    let keys = "[[key]]\neye=[0,0,1]\ntarget=[0,0,0]\n[[key]]\neye=[1,0,1]\ntarget=[0,0,0]\n";
    survives("p.toml", keys.as_bytes(), |path| {
        nearfar::load::load_camera_path(path, &Camera::default(), glam::DVec3::ZERO).map(drop)
    });
}
