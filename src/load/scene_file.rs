//! The scene file: TOML keys, overrides, errors with lines. Data only; `assemble` makes a scene of
//! it.
//!
//! ```toml
//! name = "room"
//! search_paths = ["textures"]  # where textures are looked for that are not where MTL files say
//! [camera]                     # all optional; without eye and target the view frames the scene
//! eye = [0, 1.6, 4]
//! target = [0, 1.2, 0]
//! up = [0, 1, 0]
//! vfov_deg = 45                # vertical field of view
//! width = 640
//! height = 360
//! [[mesh]]
//! file = "room.obj"            # or builtin = "interior" with parameters = { … }; in names
//!                              # $VAR, ${VAR} and ${VAR:-default} stand for the environment's
//! scale = 1                    # number or [x, y, z]; then rotate_deg about x, y, z; translate
//! rotate_deg = [0, 90, 0]
//! translate = [0, 0, 0]        # or matrix = [[…], [3 rows of 4]] instead of the three
//! normals = "file"             # "face", "smooth" up to crease_deg (40)
//! sides = "auto"               # "one", "two"
//! materials = "file"           # "diffuse": those of the MTL are meant to be but diffuse
//! material = "paint"           # name of what no material of the file covers
//! subdivision = { levels = 3 } # the polygons are a Catmull–Clark cage: SubdivisionEntry
//! [[mesh]]
//! file = "fur.hair"            # or .curves, .txt
//! curves = { shape = "tube" }  # keys: CurvesEntry
//! [[light]]
//! type = "sky"                 # "environment", "quad", "sphere", "sun", "point", "spot"
//! radiance = [1, 1, 1]
//! [material.curtain]           # overrides a material by its name in the meshes
//! albedo = 0.5                 # a number or [r, g, b]; albedo_texture = "" removes a texture
//! drop = true                  # leaves its triangles out
//! [settings.decompose]         # handed on to the methods
//! alpha = 0.05
//! ```

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DVec3, Vec3};
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::{Error, Result};
use crate::scene::{Basis, Boundary, Sides, UvRule};
use crate::tessellate::CurveShape;

/// A whole scene file.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneFile {
    pub name: Option<String>,
    pub search_paths: Vec<String>,
    pub camera: Option<Spanned<CameraEntry>>,
    pub mesh: Vec<Spanned<MeshEntry>>,
    pub light: Vec<Spanned<LightEntry>>,
    pub material: BTreeMap<String, Spanned<MaterialEntry>>,
    pub settings: toml::Table,
    /// Line of each setting that the file itself gives, by dotted key.
    #[serde(skip)]
    pub setting_lines: BTreeMap<String, usize>,
}

/// `[camera]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CameraEntry {
    pub eye: Option<DVec3>,
    pub target: Option<DVec3>,
    pub up: Option<Vec3>,
    pub vfov_deg: Option<f32>,
    pub width: Option<u32>,
    pub height: Option<u32>,
}

/// What materials of an MTL file are rendered as: by all that is understood, or as Lambert of their
/// Kd, which is then not worth a warning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Shading {
    #[default]
    File,
    Diffuse,
}

/// How a mesh gets its normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Normals {
    #[default]
    File,
    Face,
    Smooth,
}

/// One number for all axes or channels, or one each.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged, expecting = "expected a number or an array of three numbers")]
pub enum Each<T> {
    One(T),
    Three([T; 3]),
}

/// Of a colour.
pub type Triple = Each<f32>;

impl<T: Copy> Each<T> {
    pub fn three(self) -> [T; 3] {
        match self {
            Self::One(x) => [x; 3],
            Self::Three(all) => all,
        }
    }
}

impl From<Triple> for Vec3 {
    fn from(t: Triple) -> Self {
        Self::from_array(t.three())
    }
}

/// `[[mesh]]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MeshEntry {
    pub file: Option<String>,
    pub builtin: Option<String>,
    pub parameters: toml::Table,
    pub scale: Option<Each<f64>>,
    pub rotate_deg: Option<DVec3>,
    pub translate: Option<DVec3>,
    pub matrix: Option<[[f64; 4]; 3]>,
    pub normals: Normals,
    pub crease_deg: Option<f32>,
    pub sides: Sides,
    pub materials: Shading,
    pub material: Option<String>,
    pub subdivision: Option<SubdivisionEntry>,
    pub curves: Option<CurvesEntry>,
}

/// A length in scene units, or a text like "0.5%": a share of the scene's diagonal.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged, expecting = "expected a length, or a share of the diagonal like \"0.5%\"")]
pub enum Length {
    Units(f32),
    Share(String),
}

/// `subdivision = { … }`: how a cage is tessellated. `levels` (3) or `edge`, the longest edge;
/// edges whose faces' normals differ by more than `crease_angle_deg` become creases of
/// `crease_sharpness` (10: always sharp); `boundary` is "edge-and-corner", "edge" or "none" and
/// overrides the file's; `uv` is "linear" or "smooth".
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SubdivisionEntry {
    pub levels: Option<u32>,
    pub edge: Option<Length>,
    pub crease_angle_deg: Option<f32>,
    pub crease_sharpness: Option<f32>,
    pub boundary: Option<Boundary>,
    pub uv: UvRule,
}

/// `curves = { … }`: how curves are read and tessellated. `shape` is "tube" of `sides` (5),
/// "ribbon" (along `normal`, where given) or "cross"; `segments` (4) a span; `basis` of a file is
/// "linear", "catmull-rom", "bspline" or "bezier"; `width` replaces the file's diameters,
/// `width_scale` multiplies them; `material` names the material (the file's stem).
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CurvesEntry {
    pub shape: CurveShape,
    pub sides: Option<u32>,
    pub segments: Option<u32>,
    pub normal: Option<Vec3>,
    pub basis: Option<Basis>,
    pub width: Option<f32>,
    pub width_scale: Option<f32>,
    pub material: Option<String>,
}

/// `[[light]]`; units as in [`crate::scene::Light`].
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
pub enum LightEntry {
    Quad {
        corner: DVec3,
        edge1: Vec3,
        edge2: Vec3,
        radiance: Triple,
    },
    Sphere {
        center: DVec3,
        radius: f32,
        radiance: Triple,
    },
    Sun {
        direction_to_sun: Vec3,
        irradiance: Triple,
        #[serde(default)]
        angular_radius_deg: f32,
    },
    Sky {
        radiance: Triple,
    },
    /// A latitude-longitude picture (`.hdr`, `.exr`), times `scale` (1), its top towards `up` ([0,
    /// 1, 0]), turned by `rotation_deg` about it.
    Environment {
        file: String,
        #[serde(default)]
        scale: Option<Triple>,
        #[serde(default)]
        rotation_deg: f32,
        #[serde(default)]
        up: Option<Vec3>,
    },
    Point {
        position: DVec3,
        intensity: Triple,
    },
    Spot {
        position: DVec3,
        direction: Vec3,
        intensity: Triple,
        inner_deg: f32,
        outer_deg: f32,
    },
}

/// `[material.NAME]`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MaterialEntry {
    pub albedo: Option<Triple>,
    pub albedo_texture: Option<String>,
    pub emission: Option<Triple>,
    pub opacity: Option<f32>,
    pub opacity_texture: Option<String>,
    pub drop: bool,
}

/// 1-based line of a byte offset.
pub fn line_at(text: &str, offset: usize) -> usize {
    1 + text.as_bytes()[..offset.min(text.len())].iter().filter(|&&b| b == b'\n').count()
}

/// Most parts of a key that is set: deeper, tables in tables would fill the stack.
const DEEPEST: usize = 16;

const SCENE_KEYS: [&str; 6] = ["name", "camera", "mesh", "light", "material", "settings"];

/// Reads a scene file's text and applies overrides, in order.
///
/// # Errors
/// [`Error::Input`] with the line for the file, [`Error::Setting`] with the key for an override.
pub fn parse(path: &Path, text: &str, overrides: &[(String, String)]) -> Result<SceneFile> {
    let wrong = |e: &toml::de::Error| {
        let message = e.message().trim_end_matches('\n').replace('\n', "; ");
        Error::input(path, e.span().map(|s| line_at(text, s.start)), message)
    };
    let mut table = DeTable::parse(text).map_err(|e| wrong(&e))?;
    let not_array = |key: String| format!("{key} is a table, not an array; write [{key}]");
    if let Some((key, span)) = array_for_table(table.get_ref()) {
        return Err(Error::input(path, line_at(text, span.start), not_array(key)));
    }
    let mut scene = read(&table).map_err(|e| wrong(&e))?;
    let mut lines = setting_lines(&table, text);
    for (key, value) in overrides {
        let bad = |message: String| Error::setting(key.clone(), message);
        apply(&mut table, key, value).map_err(bad)?;
        if let Some((name, _)) = array_for_table(table.get_ref()) {
            return Err(bad(not_array(name)));
        }
        scene = read(&table)
            .map_err(|e| bad(e.message().trim_end_matches('\n').replace('\n', "; ")))?;
        lines.remove(key.strip_prefix("settings.").unwrap_or(key));
    }
    scene.setting_lines = lines;
    Ok(scene)
}

/// Where the settings of a file stand.
fn setting_lines(table: &Spanned<DeTable<'_>>, text: &str) -> BTreeMap<String, usize> {
    fn walk(at: &Spanned<DeValue<'_>>, key: &str, text: &str, lines: &mut BTreeMap<String, usize>) {
        if let DeValue::Table(inner) = at.get_ref() {
            for (name, value) in inner {
                let dot = if key.is_empty() { "" } else { "." };
                let key = format!("{key}{dot}{}", name.get_ref());
                lines.insert(key.clone(), line_at(text, name.span().start));
                walk(value, &key, text, lines);
            }
        }
    }
    let mut lines = BTreeMap::new();
    if let Some(settings) = table.get_ref().get("settings") {
        walk(settings, "", text, &mut lines);
    }
    lines
}

fn read(table: &Spanned<DeTable<'_>>) -> std::result::Result<SceneFile, toml::de::Error> {
    SceneFile::deserialize(toml::de::Deserializer::from(table.clone()))
}

/// Where an array stands for a table: it would be read as the table's values in some order.
fn array_for_table(top: &DeTable<'_>) -> Option<(String, std::ops::Range<usize>)> {
    let wrong = |key: &str, value: &Spanned<DeValue<'_>>| {
        matches!(value.get_ref(), DeValue::Array(_)).then(|| (key.to_owned(), value.span()))
    };
    let below = |value: &Spanned<DeValue<'_>>, keys: &[&str]| match value.get_ref() {
        DeValue::Table(inner) => keys.iter().find_map(|key| wrong(key, inner.get(*key)?)),
        _ => None,
    };
    top.iter().find_map(|(name, value)| match (&**name.get_ref(), value.get_ref()) {
        ("camera", _) => wrong("camera", value),
        (key @ ("mesh" | "light"), DeValue::Array(list)) => list.iter().find_map(|entry| {
            wrong(key, entry).or_else(|| below(entry, &["subdivision", "curves", "parameters"]))
        }),
        ("material", DeValue::Table(all)) => {
            all.iter().find_map(|(name, entry)| wrong(name.get_ref(), entry))
        }
        _ => None,
    })
}

/// The value of an override: TOML where it parses as such, else a string.
fn value_of(text: &str) -> DeValue<'_> {
    DeValue::parse(text).map_or_else(|_| DeValue::String(text.into()), Spanned::into_inner)
}

fn apply<'a>(
    table: &mut Spanned<DeTable<'a>>,
    key: &str,
    value: &'a str,
) -> std::result::Result<(), String> {
    let mut parts: Vec<&str> = key.split('.').take(DEEPEST + 1).collect();
    if parts.len() > DEEPEST {
        return Err(format!("has more than {DEEPEST} parts; write section.key=value"));
    }
    if parts.iter().any(|p| p.is_empty()) {
        return Err("is no key; write section.key=value".into());
    }
    if !SCENE_KEYS.contains(&parts[0]) {
        parts.insert(0, "settings");
    }
    let span = table.span();
    let top = std::mem::take(table.get_mut());
    let mut root = Spanned::new(span, DeValue::Table(top));
    let done = set(&mut root, &parts, value_of(value));
    if let DeValue::Table(top) = root.into_inner() {
        *table.get_mut() = top;
    }
    done
}

fn set<'a>(
    at: &mut Spanned<DeValue<'a>>,
    parts: &[&str],
    value: DeValue<'a>,
) -> std::result::Result<(), String> {
    let Some((first, rest)) = parts.split_first() else {
        // The place keeps its span, so that later messages still point into the file.
        *at.get_mut() = value;
        return Ok(());
    };
    let span = at.span();
    match at.get_mut() {
        DeValue::Table(table) => {
            let key = Spanned::new(span.clone(), std::borrow::Cow::Owned((*first).to_owned()));
            let entry = table
                .entry(key)
                .or_insert_with(|| Spanned::new(span, DeValue::Table(DeTable::new())));
            set(entry, rest, value)
        }
        DeValue::Array(list) => {
            let count = list.len();
            let index = first.parse::<usize>().ok().filter(|&i| i < count);
            let index = index.ok_or_else(|| {
                format!("\"{first}\" is no index of an array of {count}; indices run from 0")
            })?;
            list.get_mut(index).map_or(Ok(()), |entry| set(entry, rest, value))
        }
        _ => Err(format!("\"{first}\" stands below a plain value; give the value itself")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(text: &str, overrides: &[(&str, &str)]) -> Result<SceneFile> {
        let list: Vec<_> =
            overrides.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        parse(Path::new("s.toml"), text, &list)
    }

    const TEXT: &str = "name = \"a\"\n[camera]\nwidth = 100\n[[light]]\ntype = \"sky\"\nradiance \
                        = 2\n[settings.decompose]\nalpha = 0.5\n";

    #[test]
    fn settings_know_their_lines() {
        let text = "[settings]\nseed = 1\n[settings.decompose]\nalpha = 0.5\nrays = 4\n";
        let overrides = [("decompose.rays".to_owned(), "8".to_owned())];
        let scene = parse(Path::new("a.toml"), text, &overrides).unwrap();
        let line = |key: &str| scene.setting_lines.get(key).copied();
        assert_eq!([line("seed"), line("decompose.alpha")], [Some(2), Some(4)]);
        assert_eq!(line("decompose.rays"), None);
    }

    #[test]
    fn overrides_reach_scene_and_settings() {
        let s = with(
            TEXT,
            &[
                ("camera.width", "320"),
                ("camera.eye", "[1, 2, 3]"),
                ("decompose.alpha", "0.1"),
                ("seed", "7"),
                ("name", "bare words"),
            ],
        )
        .unwrap();
        let camera = s.camera.unwrap().into_inner();
        assert_eq!((camera.width, camera.eye), (Some(320), Some(DVec3::new(1.0, 2.0, 3.0))));
        assert_eq!(s.settings["decompose"]["alpha"].as_float(), Some(0.1));
        assert_eq!(s.settings["seed"].as_integer(), Some(7));
        assert_eq!(s.name.as_deref(), Some("bare words"));
        let s = with(
            TEXT,
            &[
                ("light.0.radiance", "[3, 2, 1]"),
                ("material.wall.albedo", "0.3"),
                ("settings.path.spp", "4"),
            ],
        )
        .unwrap();
        assert!(matches!(
            s.light[0].get_ref(),
            LightEntry::Sky { radiance: Triple::Three([3.0, 2.0, 1.0]) }
        ));
        assert!(
            s.material.contains_key("wall") && s.settings["path"]["spp"].as_integer() == Some(4)
        );
    }

    #[test]
    fn bad_overrides_name_their_key() {
        let message = |o: &[(&str, &str)]| with(TEXT, o).unwrap_err().to_string();
        assert_eq!(
            message(&[("camera.width", "wide")]),
            "setting \"camera.width\": invalid type: string \"wide\", expected u32"
        );
        assert!(
            message(&[("camera.wdith", "3")])
                .starts_with("setting \"camera.wdith\": unknown field `wdith`")
        );
        assert_eq!(
            message(&[("light.1.radiance", "3")]),
            "setting \"light.1.radiance\": \"1\" is no index of an array of 1; indices run from 0"
        );
        assert!(message(&[("camera..width", "3")]).contains("is no key"));
        assert!(message(&[("camera.width.x", "3")]).contains("plain value"));
    }

    #[test]
    fn errors_have_lines() {
        let message = |t: &str| with(t, &[]).unwrap_err().to_string();
        assert!(
            message("name = \"a\"\n[camera]\nwdith = 3\n")
                .starts_with("s.toml:3: unknown field `wdith`, expected one of `eye`")
        );
        assert!(message("\n\nname = \n").starts_with("s.toml:3: "));
        assert!(message("[camera]\n\neye = [1, 2]\n").starts_with("s.toml:3: invalid length 2"));
        assert!(
            message("[[light]]\ntype = \"lamp\"\n").starts_with("s.toml:2: unknown variant `lamp`")
        );
    }
}
