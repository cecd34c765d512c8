//! Files → [`Scene`]: scene TOML (keys: [`scene_file`]), or a bare `.obj` that gets a framing view
//! and, unless it has emitters, a sky and a sun.
//!
//! Input   a path and `--set` overrides. Output  [`Loaded`].
//! Polygons of an OBJ become a mesh, or a cage that is subdivided at once; `.hair` and text curves
//! become tubes or ribbons (`shape`).
//! Guarantees  never panics on user data; every error names the file, the line where one is known,
//!             and the fix; what can be mended is mended and listed in `warnings` (missing material
//!             library, undefined material, missing texture of an MTL).
//! Not         materials beyond diffuse, emission and masks; `tobj` reads the OBJ, this room finds
//!             the lines of its errors.

mod assemble;
mod camera_path;
mod curve_file;
mod environment;
mod find;
mod image;
mod materials;
mod mtl;
mod mtl_texture;
mod normals;
mod obj;
mod obj_cage;
mod obj_fault;
mod obj_text;
mod origin;
mod path;
mod polygon;
#[expect(missing_docs, reason = "the fields are the keys that the page describes")]
pub mod scene_file;
mod shape;
mod validate;
mod view;

use std::path::Path;

use crate::error::{Error, Result};
use crate::input_file;
use crate::scene::Scene;

pub use camera_path::load_camera_path;
pub use validate::MAX_PIXELS;

/// A scene and what there is to say about its loading.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// The `[settings]` table with overrides merged in, unchecked.
    pub settings: toml::Table,
    /// Line in the scene file of each of them that comes from there, by dotted key.
    pub setting_lines: std::collections::BTreeMap<String, usize>,
    /// What was chosen for the user.
    pub notes: Vec<String>,
    /// What is wrong but was mended.
    pub warnings: Vec<String>,
}

/// Loads a scene file or a bare `.obj`. Overrides are (dotted key, value as TOML or a bare word);
/// keys that are none of the scene's go to the settings.
///
/// # Errors
/// [`Error::Io`], [`Error::Input`], [`Error::Image`] for files; [`Error::Setting`] for overrides.
pub fn load(path: &Path, overrides: &[(String, String)]) -> Result<Loaded> {
    let extension =
        path.extension().map(|x| x.to_string_lossy().to_lowercase()).unwrap_or_default();
    let bare = match extension.as_str() {
        "toml" => false,
        "obj" => true,
        _ => {
            return Err(Error::input(
                path,
                None,
                "is no scene; give a scene .toml or an .obj file",
            ));
        }
    };
    let (text, from) = if bare {
        let name =
            path.file_name().map(|n| n.to_string_lossy().replace('$', "$$")).unwrap_or_default();
        (format!("[[mesh]]\nfile = {}\n", toml::Value::String(name)), String::new())
    } else {
        let text = input_file::read_text(path)?;
        (text.clone(), text)
    };
    if bare {
        input_file::check(path)?;
    }
    let entry = scene_file::parse(path, &text, overrides)?;
    let mut loaded = assemble::Assembly::new(path, &from).scene(entry)?;
    if bare && !validate::emits(&loaded.scene) {
        loaded.scene.lights.extend(view::lights(loaded.scene.camera.up));
        loaded.notes.push("no light given: a sky of radiance 0.5 and a sun were set".into());
    }
    validate::check_scene(&loaded.scene, path)?;
    Ok(loaded)
}
