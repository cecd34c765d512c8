//! Broken inputs, each with its message: file, line where there is one, and what to do. Nothing
//! panics.

use std::path::Path;

use nearfar::load::{Loaded, load};

use crate::support::Folder;

/// A folder of scenes.
struct Scenes(Folder);

impl Scenes {
    fn new(name: &str) -> Self {
        Self(Folder::new(&format!("broken-{name}")))
    }
    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        self.0.file(name, content);
    }
    fn load(&self, name: &str) -> nearfar::error::Result<Loaded> {
        load(Path::new(&self.0.at(name)), &[])
    }
    /// What loading says, without the folder's name.
    fn message(&self, name: &str) -> String {
        let text = self
            .load(name)
            .map_or_else(|e| e.to_string(), |l| format!("loaded; {}", l.warnings.join("; ")));
        self.0.plain(&text)
    }
}

const GOOD_OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 \
                        1\nusemtl a\nf 1/1/1 2/2/1 3/3/1\n";
const GOOD_MTL: &str = "newmtl a\nKd 0.5 0.5 0.5\n";
const SKY: &str = "[[light]]\ntype = \"sky\"\nradiance = 1\n";
const MESH: &str = "[[mesh]]\nfile = \"a.obj\"\n";

#[test]
fn broken_objs() {
    let cases: &[(&str, &str)] = &[
        (
            "v 0 0\nf 1 1 1\n",
            "a.obj:1: \"v\" needs 3 numbers, found \"v 0 0\"; export the mesh again",
        ),
        (
            "v 0 0 0\nv 1 x 0\n",
            "a.obj:2: \"x\" is not a number in \"v 1 x 0\"; export the mesh again",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n",
            "a.obj:3: numbers must be finite, found \"v nan 1 0\"; correct or remove the vertex",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 inf 0\nf 1 2 3\n",
            "a.obj:3: numbers must be finite, found \"v 0 inf 0\"; correct or remove the vertex",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1e99 0\nf 1 2 3\n",
            "a.obj:3: numbers must be finite, found \"v 0 1e99 0\"; correct or remove the vertex",
        ),
        (
            "v 0 0 0 0\n",
            "a.obj:1: the fourth number of a vertex divides the others and may not be \"0\"; \
             remove it",
        ),
        (
            "v 0 0 0 1 1\n",
            "a.obj:1: a vertex has 3 numbers, 4 with a weight or 6 with a colour, found 5; export \
             the mesh again",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n",
            "a.obj:4: index 4 is out of range: the file has 3 vertices; correct the index or \
             export the mesh again",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n",
            "a.obj:4: index 0 in \"0\" is not allowed: OBJ files count from 1",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -4 -2 -1\n",
            "a.obj:4: index -4 is out of range: the file has 3 vertices; correct the index or \
             export the mesh again",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/2 3/1\n",
            "a.obj:5: index 2 is out of range: the file has 1 texture coordinates; correct the \
             index or export the mesh again",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//7\n",
            "a.obj:5: index 7 is out of range: the file has 1 normals; correct the index or \
             export the mesh again",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9223372036854775809\n",
            "a.obj:4: index 9223372036854775809 is out of range: the file has 3 vertices; correct \
             the index or export the mesh again",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/9223372036854775807 2/1 3/1\n",
            "a.obj:5: index 9223372036854775807 is out of range: the file has 1 texture \
             coordinates; correct the index or export the mesh again",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 two 3\n",
            "a.obj:4: \"two\" is not a face corner; write v, v/vt, v//vn or v/vt/vn",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1/1/1 2 3\n",
            "a.obj:4: \"1/1/1/1\" is not a face corner; write v, v/vt, v//vn or v/vt/vn",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 \\\n3\n",
            "loaded; a.obj: 1 triangles have no material and become grey; assign one with usemtl, \
             or name one by material in the [[mesh]]",
        ),
        ("vt 0\n", "a.obj:1: \"vt\" needs 2 numbers, found \"vt 0\"; export the mesh again"),
        ("vn 0 1\n", "a.obj:1: \"vn\" needs 3 numbers, found \"vn 0 1\"; export the mesh again"),
        ("usemtl\n", "a.obj: holds no faces; export it again, or take it out of the scene"),
        ("", "a.obj: holds no faces; export it again, or take it out of the scene"),
        (
            "v 0 0 0\nv 1 0 0\nl 1 2\n",
            "a.obj: holds no faces; export it again, or take it out of the scene",
        ),
        (
            "v 0 0 0\nv 1e20 0 0\nv 0 1e20 0\nf 1 2 3\n",
            "a.obj: coordinates are too large to trace; scale the scene down below 1e15 units",
        ),
        (
            "mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl gold\nf 1 2 3\n",
            "loaded; a.obj: material library \"none.mtl\" cannot be read; its materials become \
             grey; a.obj: material \"gold\" is not defined and becomes grey; define it in an MTL \
             file or as [material.gold]",
        ),
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "loaded; a.obj: 1 triangles have no material and become grey; assign one with usemtl, \
             or name one by material in the [[mesh]]",
        ),
    ];
    for (text, expected) in cases {
        let folder = Scenes::new("objs");
        folder.write("a.obj", text);
        assert_eq!(folder.message("a.obj"), *expected, "{text:?}");
    }
}

#[test]
fn broken_mtls() {
    let cases: &[(&str, &str)] = &[
        ("newmtl a\nKd 0.5\n", "loaded; "),
        ("newmtl a\nKd 0.5 x 0.5\n", "a.mtl:2: Kd needs 3 finite numbers, found \"Kd 0.5 x 0.5\""),
        (
            "newmtl a\nKd 0.5 nan 0.5\n",
            "a.mtl:2: Kd needs 3 finite numbers, found \"Kd 0.5 nan 0.5\"",
        ),
        (
            "newmtl a\n\nKe -1 0 0\n",
            "a.mtl:3: Ke may not be negative, found \"Ke -1 0 0\"; give 3 numbers from 0 on",
        ),
        ("newmtl a\nd half\n", "a.mtl:2: d needs 1 finite number, found \"d half\""),
        ("newmtl\n", "a.mtl:1: newmtl needs a name; write newmtl NAME"),
        ("newmtl a\nillum\n", "a.mtl:2: illum needs a whole number from 0 to 10, found \"illum\""),
        ("newmtl a\nmap_Kd\n", "loaded; a.mtl:2: map_Kd names no file and is left out"),
        (
            "newmtl a\nmap_Kd none.png\n",
            "loaded; none.png: texture of material \"a\" is missing; the plain colour is used; \
             name its folder in search_paths",
        ),
        (
            "newmtl a\nmap_Kd a.obj\n",
            "a.obj: is not a PNG, JPEG, BMP, TGA or TIFF image; convert it",
        ),
        ("newmtl a\nmap_d cut.png\n", "cut.png: is damaged and cannot be decoded; export it again"),
    ];
    for (text, expected) in cases {
        let folder = Scenes::new("mtls");
        folder.write("a.obj", GOOD_OBJ);
        folder.write("cut.png", [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', 0, 0, 0]);
        folder.write("a.mtl", text);
        assert_eq!(folder.message("a.obj"), *expected, "{text:?}");
    }
}

#[test]
fn broken_scene_files() {
    let lit = |text: &str| format!("{MESH}{SKY}{text}");
    let light = |text: &str| format!("{MESH}[[light]]\n{text}");
    let cases: Vec<(String, &str)> = vec![
        (
            lit("[camera]\neye = [0, 0, 5]\n"),
            "s.toml:6: a camera needs both eye and target, or neither for a framing view",
        ),
        (
            lit("[camera]\neye = [0, 0, 5]\ntarget = [0, 0, 5]\n"),
            "s.toml:6: camera eye and target are the same point; move one of them",
        ),
        (
            lit("[camera]\neye = [0, 5, 0]\ntarget = [0, 0, 0]\n"),
            "s.toml:6: camera up is zero or points along the view; choose another, e.g. [0, 1, 0] \
             or [0, 0, 1]",
        ),
        (
            lit("[camera]\nvfov_deg = 180\n"),
            "s.toml:6: camera vfov_deg is 180 but must lie between 0 and 180",
        ),
        (lit("[camera]\nwidth = 0\n"), "s.toml:6: camera width and height must be at least 1"),
        (
            lit("[camera]\nwidth = 100000\nheight = 100000\n"),
            "s.toml:6: an image of 100000x100000 pixels does not fit memory; at most 268435456 \
             pixels are allowed",
        ),
        (lit("[camera]\nwidth = -3\n"), "s.toml:7: invalid value: integer `-3`, expected u32"),
        (
            lit("[camera]\nwdith = 3\n"),
            "s.toml:7: unknown field `wdith`, expected one of `eye`, `target`, `up`, `vfov_deg`, \
             `width`, `height`",
        ),
        (
            lit("[camera]\neye = [nan, 0, 0]\ntarget = [0, 0, 0]\n"),
            "s.toml:6: camera eye, target and up must be finite numbers",
        ),
        ("light = 3\n".into(), "s.toml:1: invalid type: integer `3`, expected a sequence"),
        (
            MESH.into(),
            "s.toml: nothing emits light; add a [[light]] (e.g. type = \"sky\", radiance = [1, 1, \
             1]) or a material with emission",
        ),
        (SKY.into(), "s.toml: the scene is empty; add a [[mesh]] with triangles"),
        (
            light("type = \"sky\"\nradiance = -1\n"),
            "s.toml:3: radiance must be finite and not negative",
        ),
        (
            light("type = \"sphere\"\ncenter = [0, 0, 0]\nradius = 0\nradiance = 1\n"),
            "s.toml:3: a sphere light needs a finite center and a radius above 0",
        ),
        (
            light(
                "type = \"quad\"\ncorner = [0, 0, 0]\nedge1 = [1, 0, 0]\nedge2 = [2, 0, \
                 0]\nradiance = 1\n",
            ),
            "s.toml:3: the quad light has no area; edge1 and edge2 must be finite and span a \
             parallelogram",
        ),
        (
            light("type = \"sun\"\ndirection_to_sun = [0, 0, 0]\nirradiance = 1\n"),
            "s.toml:3: direction_to_sun may not be zero or infinite",
        ),
        (
            light(
                "type = \"sun\"\ndirection_to_sun = [0, 1, 0]\nirradiance = 1\nangular_radius_deg \
                 = 120\n",
            ),
            "s.toml:3: angular_radius_deg must lie from 0 to 90; the sun's is 0.27",
        ),
        (
            light(
                "type = \"spot\"\nposition = [0, 1, 0]\ndirection = [0, -1, 0]\nintensity = \
                 1\ninner_deg = 30\nouter_deg = 20\n",
            ),
            "s.toml:3: a spot needs 0 <= inner_deg <= outer_deg <= 180, and outer_deg above 0",
        ),
        (
            "[[mesh]]\nfile = \"none.obj\"\n".into(),
            "s.toml:1: mesh \"none.obj\" does not exist; correct the path",
        ),
        (
            "\n[[mesh]]\nscale = 2\n".into(),
            "s.toml:2: a mesh needs either file = \"….obj\" or builtin = \"…\"",
        ),
        (
            "[[mesh]]\nfile = \"s.toml\"\n".into(),
            "s.toml:1: mesh \"s.toml\" is no .obj, .hair, .curves or .txt file; convert it",
        ),
        (
            "[[mesh]]\nfile = \"$NEARFAR_NOT_SET/a.obj\"\n".into(),
            "s.toml:1: environment variable NEARFAR_NOT_SET in \"$NEARFAR_NOT_SET/a.obj\" is not \
             set; set it, or write ${NEARFAR_NOT_SET:-default}",
        ),
        (
            "[[mesh]]\nbuiltin = \"castle\"\n".into(),
            "s.toml:1: there is no builtin \"castle\"; there are: atrium, cathedral, corridor, \
             foliage, fur, garden-room, hairball, interior, lamp-hall, rotunda, slats, study, \
             subdivision",
        ),
        (
            "[[mesh]]\nbuiltin = \"interior\"\nparameters = { detial = 2 }\n".into(),
            "s.toml:1: parameters: unknown field `detial`, expected `detail`",
        ),
        (
            "[[mesh]]\nbuiltin = \"interior\"\nparameters = { detail = 1000 }\n".into(),
            "s.toml:1: detail is 1000 but must lie from 0.25 to 8",
        ),
        (
            "[[mesh]]\nfile = \"a.obj\"\nscale = 0\n".into(),
            "s.toml:1: the transform is not invertible; scale may not be 0 and all numbers must \
             be finite",
        ),
        (
            "[[mesh]]\nfile = \"a.obj\"\ntranslate = [1, 0, 0]\nmatrix = [[1, 0, 0, 0], [0, 1, 0, \
             0], [0, 0, 1, 0]]\n"
                .into(),
            "s.toml:1: matrix stands alone; remove it or scale, rotate_deg and translate",
        ),
        (
            "[[mesh]]\nfile = \"a.obj\"\nnormals = \"smooth\"\ncrease_deg = 200\n".into(),
            "s.toml:1: crease_deg is 200 but must lie from 0 to 180",
        ),
        (
            lit("[material.b]\nalbedo = 0.5\n"),
            "s.toml:6: no mesh has a material \"b\"; there are: a",
        ),
        (lit("[material.a]\nalbedo = 1.5\n"), "s.toml:6: albedo may not exceed 1"),
        (
            lit("[material.a]\nopacity_texture = \"none.png\"\n"),
            "s.toml:6: texture \"none.png\" does not exist; correct the path",
        ),
        (
            lit("[material.a]\ndrop = true\n"),
            "s.toml: the scene is empty; add a [[mesh]] with triangles",
        ),
    ];
    for (text, expected) in &cases {
        let folder = Scenes::new("files");
        folder.write("a.obj", GOOD_OBJ);
        folder.write("a.mtl", GOOD_MTL);
        folder.write("s.toml", text);
        assert_eq!(folder.message("s.toml"), *expected, "{text}");
    }
    let folder = Scenes::new("files");
    folder.write("s.toml", [0xff, 0xfe, b'a']);
    folder.write("s.blend", "");
    assert_eq!(folder.message("s.toml"), "s.toml: is not UTF-8 text; save it as UTF-8");
    assert_eq!(
        folder.message("s.blend"),
        "s.blend: is no scene; give a scene .toml or an .obj file"
    );
    assert!(
        folder.message("none.toml").starts_with("none.toml: No such file"),
        "{}",
        folder.message("none.toml")
    );
    assert!(
        folder.message("none.obj").starts_with("none.obj: No such file"),
        "{}",
        folder.message("none.obj")
    );
}

#[test]
fn bare_obj_gets_a_view_and_a_sky() {
    let folder = Scenes::new("sky");
    folder.write("a.obj", GOOD_OBJ);
    folder.write("a.mtl", GOOD_MTL);
    let loaded = folder.load("a.obj").unwrap();
    assert_eq!(loaded.scene.lights.len(), 2);
    assert_eq!((loaded.scene.camera.width, loaded.scene.camera.height), (640, 360));
    assert!(
        loaded.notes[0].starts_with("no camera given: a framing one was set, eye = [")
            && loaded.notes[1].starts_with("no light given")
    );
    let mesh = &loaded.scene.meshes[0];
    assert_eq!(
        (mesh.positions.len(), mesh.normals.len(), mesh.uvs.len(), mesh.triangles.len()),
        (3, 3, 3, 1)
    );
}

#[test]
fn transforms_and_overrides_reach_the_mesh() {
    let folder = Scenes::new("mesh");
    folder.write("a.obj", GOOD_OBJ);
    folder.write("a.mtl", GOOD_MTL);
    folder.write(
        "s.toml",
        format!(
            "[[mesh]]\nfile = \"a.obj\"\nscale = [-2, 1, 1]\nrotate_deg = [0, 0, 90]\ntranslate = \
             [0, 0, 3]\n{SKY}[material.a]\nemission = 2\n"
        ),
    );
    let scene = folder.load("s.toml").unwrap().scene;
    let mesh = &scene.meshes[0];
    // (1, 0, 0) → (−2, 0, 0) → (0, −2, 0) → (0, −2, 3).
    assert!(
        mesh.positions.iter().any(|p| (*p - glam::Vec3::new(0.0, -2.0, 3.0)).length() < 1e-5),
        "{:?}",
        mesh.positions
    );
    assert!((mesh.normals[0] - glam::Vec3::Z).length() < 1e-6);
    let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
    assert!((b - a).cross(c - a).z > 0.0, "a mirror keeps fronts");
    assert!(scene.materials[0].emits());
}
