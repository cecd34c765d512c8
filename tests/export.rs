//! `nearfar export`: the folder another renderer reads.

use std::path::Path;
use std::process::{Command, Output};

use roxmltree::Document;

use crate::support::Folder;

const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");

fn export(scene: &Path, folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_nearfar"))
        .arg("export")
        .arg(scene)
        .arg("-o")
        .arg(folder)
        .output()
        .unwrap()
}

/// Vertices and faces by the header, whose size must be that of the file.
fn counts(path: &Path) -> (usize, usize) {
    let bytes = std::fs::read(path).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    let count = |what: &str| {
        header
            .lines()
            .find_map(|l| l.strip_prefix(&format!("element {what} ")))
            .unwrap()
            .parse::<usize>()
            .unwrap()
    };
    let floats = header.matches("property float ").count();
    assert_eq!(
        bytes.len() - end,
        count("vertex") * floats * 4 + count("face") * 13,
        "{}",
        path.display()
    );
    (count("vertex"), count("face"))
}

/// Reads `folder/scene.xml`: `(types of what carries one, triangles of all meshes)`; every file
/// named is there, every material referred to described.
fn read(folder: &Path) -> (Vec<String>, usize) {
    let text = std::fs::read_to_string(folder.join("scene.xml")).unwrap();
    let document = Document::parse(&text).unwrap();
    let mut triangles = 0;
    for node in document.descendants().filter(|n| n.attribute("name") == Some("filename")) {
        let path = folder.join(node.attribute("value").unwrap());
        assert!(path.is_file(), "{}", path.display());
        if path.extension().unwrap() == "ply" {
            triangles += counts(&path).1;
        } else {
            image::open(&path).unwrap();
        }
    }
    for node in document.descendants().filter(|n| n.has_tag_name("ref")) {
        assert!(
            document
                .descendants()
                .any(|n| n.has_tag_name("bsdf") && n.attribute("id") == node.attribute("id"))
        );
    }
    let types =
        document.descendants().filter_map(|n| n.attribute("type")).map(str::to_owned).collect();
    (types, triangles)
}

fn has(types: &[String], word: &str) -> usize {
    types.iter().filter(|t| *t == word).count()
}

#[test]
fn the_cornell_box_is_complete() {
    let folder = Folder::new("export-cornell");
    let output = export(&Path::new(SCENES).join("cornell-box/cornell-box.toml"), &folder);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(
        String::from_utf8_lossy(&output.stdout).trim(),
        folder.join("scene.xml").display().to_string()
    );
    let (types, triangles) = read(&folder);
    let faces =
        std::fs::read_to_string(Path::new(SCENES).join("cornell-box/cornell-box.obj")).unwrap();
    // A face of n corners is n - 2 triangles.
    let expected: usize = faces
        .lines()
        .filter_map(|l| l.strip_prefix("f "))
        .map(|f| f.split_whitespace().count() - 2)
        .sum();
    assert_eq!(triangles, expected);
    assert!(has(&types, "area") > 0 && has(&types, "perspective") == 1);
}

#[test]
fn textures_masks_and_every_light_have_their_counterpart() {
    let folder = Folder::new("export-all");
    let at = |name: &str| folder.join(name);
    std::fs::write(
        at("card.obj"),
        "v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nvt 0 0\nvt 0 1\nvt 1 1\nvt 1 0\nusemtl card\nf \
         1/1 2/2 3/3 4/4\nusemtl glow\nf 1/1 2/2 3/3\n",
    )
    .unwrap();
    image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([60 * x as u8, 60 * y as u8, 128]))
        .save(at("paint.png"))
        .unwrap();
    image::GrayImage::from_fn(4, 4, |x, _| image::Luma([if x < 2 { 255 } else { 0 }]))
        .save(at("holes.png"))
        .unwrap();
    let lights = [
        "type = \"sun\"\ndirection_to_sun = [0, 1, 0]\nirradiance = [1, 1, 1]",
        "type = \"sun\"\ndirection_to_sun = [1, 1, 0]\nirradiance = [1, 1, 1]\nangular_radius_deg \
         = 0.3",
        "type = \"sky\"\nradiance = [1, 1, 1]",
        "type = \"point\"\nposition = [0, 1, 0]\nintensity = [1, 1, 1]",
        "type = \"spot\"\nposition = [0, 1, 0]\ndirection = [0, -1, 0]\nintensity = [1, 1, \
         1]\ninner_deg = 10\nouter_deg = 20",
        "type = \"quad\"\ncorner = [0, 2, 0]\nedge1 = [1, 0, 0]\nedge2 = [0, 0, 1]\nradiance = \
         [1, 1, 1]",
        "type = \"sphere\"\ncenter = [0, 3, 0]\nradius = 0.1\nradiance = [1, 1, 1]",
    ];
    let mut scene = String::from(
        "[camera]\neye = [0, 1, 2]\ntarget = [0, 0, 0]\n\n[[mesh]]\nfile = \"card.obj\"\n\n\
         [material.card]\nalbedo = [0.5, 0.5, 0.5]\nalbedo_texture = \"paint.png\"\n\
         opacity_texture = \"holes.png\"\n\n[material.glow]\nemission = [2, 2, 2]\n",
    );
    for light in lights {
        scene.push_str(&format!("\n[[light]]\n{light}\n"));
    }
    std::fs::write(at("all.toml"), scene).unwrap();
    let output = export(&at("all.toml"), &at("out"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (types, triangles) = read(&at("out"));
    assert_eq!(triangles, 3 + 2, "two of the card, one that glows, two of the quad light");
    let text = std::fs::read_to_string(at("out").join("scene.xml")).unwrap();
    assert!(text.contains(r#"name="integrator" value="volpath""#), "light passes masks");
    // The mask and the albedo; a disc for the wide sun; areas: glow, quad, sphere, disc.
    for (word, count) in [
        ("bitmap", 2),
        ("mask", 1),
        ("directional", 1),
        ("disk", 1),
        ("constant", 1),
        ("point", 1),
        ("spot", 1),
        ("sphere", 1),
        ("area", 4),
    ] {
        assert_eq!(has(&types, word), count, "{word}");
    }
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let folder = Folder::new("export-refused");
    let file = folder.join("taken");
    std::fs::write(&file, "").unwrap();
    let output =
        export(&Path::new(SCENES).join("masked-card/masked-card.toml"), &file.join("below"));
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("taken"));
    assert!(output.stdout.is_empty());
}
