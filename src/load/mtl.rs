//! MTL material libraries, parsed by `tobj` after a look at every line, because `tobj` gives no
//! line (and stops the program on a short colour).
//!
//! Read: `Kd`, `Ke`, `d` or `Tr`, `map_Kd`, `map_Ke`, `map_d`, textures with their options
//! ([`super::mtl_texture`]). `Kd` missing is white under a map, grey else. What makes a surface a
//! mirror, glass, metal, glossy or bumpy is told by [`MtlMaterial::more`]: surfaces are rendered as
//! diffuse. A library that is missing, or a material that it lacks, is no error: [`super::obj`]
//! warns by name and makes the surface grey.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::mtl_texture::{TextureStatement, parse};
use super::obj_text::decode;
use crate::error::{Error, Result};
use crate::input_file;
use crate::radiometry::Rgb;

/// A material as an MTL file describes it.
#[derive(Clone, Debug, Default)]
pub struct MtlMaterial {
    /// Name in the file.
    pub name: String,
    /// Diffuse reflectance.
    pub albedo: Rgb,
    /// Emitted radiance of the front.
    pub emission: Rgb,
    /// Opacity.
    pub opacity: f32,
    /// Texture of the reflectance.
    pub albedo_texture: Option<TextureStatement>,
    /// Texture of the emission.
    pub emission_texture: Option<TextureStatement>,
    /// Mask texture.
    pub opacity_texture: Option<TextureStatement>,
    /// Folder of the file: textures are looked for from there.
    pub folder: PathBuf,
    /// What it is beyond diffuse, if anything: "mirror", "glass", …
    pub more: Vec<&'static str>,
    /// Why it is but a grey: nobody defines it.
    pub undefined: Option<String>,
}

impl MtlMaterial {
    /// The grey that stands in for a material nobody defines.
    pub fn stand_in(name: &str, why: String) -> Self {
        Self {
            name: name.into(),
            albedo: Rgb::splat(0.5),
            opacity: 1.0,
            undefined: Some(why),
            ..Self::default()
        }
    }
}

/// Reads an MTL file.
///
/// # Errors
/// [`Error::Io`] when it cannot be read; [`Error::Input`] with the line of a malformed value.
pub fn read_mtl(path: &Path, warnings: &mut Vec<String>) -> Result<Vec<MtlMaterial>> {
    let bytes = input_file::read(path)?;
    let text = decode(bytes);
    let mut plain = String::with_capacity(text.len());
    for (index, line) in text.lines().enumerate() {
        match statement(line) {
            Statement::Fault(message) => return Err(Error::input(path, index + 1, message)),
            Statement::LeftOut(message) => {
                warnings.push(format!("{}:{}: {message}", path.display(), index + 1));
            }
            Statement::Whole => plain.push_str(line),
            Statement::Written(line) => plain.push_str(&line),
        }
        plain.push('\n');
    }
    let (found, _) = tobj::load_mtl_buf(&mut plain.as_bytes()).map_err(|e| {
        Error::input(path, None, format!("is no material library ({e}); export it again"))
    })?;
    let found = found.into_iter().filter(|m| !m.name.is_empty());
    let materials: Vec<MtlMaterial> = found.map(|m| convert(&m, path, warnings)).collect();
    Ok(materials)
}

fn convert(m: &tobj::Material, file: &Path, warnings: &mut Vec<String>) -> MtlMaterial {
    let unknown = |key: &str| {
        let mut keys: Vec<&String> =
            m.unknown_param.keys().filter(|k| k.eq_ignore_ascii_case(key)).collect();
        keys.sort();
        keys.first().map(|&k| m.unknown_param[k].clone())
    };
    let mut texture = |known: Option<&String>, key: &str| {
        let statement = parse(&known.cloned().or_else(|| unknown(key))?);
        if !statement.left_out.is_empty() {
            warnings.push(format!(
                "{}: options of {key} in \"{}\" are left out: {}",
                file.display(),
                m.name,
                statement.left_out.join(", ")
            ));
        }
        (!statement.file.is_empty()).then_some(statement)
    };
    let albedo_texture = texture(m.diffuse_texture.as_ref(), "map_Kd");
    let emission_texture = texture(None, "map_Ke");
    let opacity_texture = texture(m.dissolve_texture.as_ref(), "map_d");
    if albedo_texture.is_some() && m.diffuse == Some([0.0; 3]) {
        warnings.push(format!(
            "{}: material \"{}\" is black: its texture is multiplied by Kd 0 0 0; write Kd 1 1 1 \
             to see the texture",
            file.display(),
            m.name
        ));
    }
    let white = |mapped: bool, plain: Rgb| if mapped { Rgb::ONE } else { plain };
    let number = |key: &str| unknown(key).and_then(|t| t.trim().parse::<f64>().ok());
    let rgb = |c: [f64; 3]| DVec3::from_array(c).as_vec3();
    let opacity = m.dissolve.or(number("Tr").map(|t| 1.0 - t)).unwrap_or(1.0).clamp(0.0, 1.0);
    MtlMaterial {
        albedo: m.diffuse.map_or(white(albedo_texture.is_some(), Rgb::splat(0.5)), rgb),
        emission: m.emissive.map_or(white(emission_texture.is_some(), Rgb::ZERO), rgb),
        opacity: opacity as f32,
        albedo_texture,
        emission_texture,
        opacity_texture,
        folder: file.parent().unwrap_or(Path::new("")).into(),
        more: more(m, opacity, &unknown),
        name: m.name.clone(),
        undefined: None,
    }
}

/// What a material is beyond diffuse.
fn more(
    m: &tobj::Material,
    opacity: f64,
    unknown: &dyn Fn(&str) -> Option<String>,
) -> Vec<&'static str> {
    let number = |key: &str| unknown(key).and_then(|t| t.trim().parse::<f64>().ok());
    let tinted = unknown("Tf").is_some_and(|t| {
        let values: Vec<f32> = t.split_whitespace().filter_map(|w| w.parse().ok()).collect();
        values.iter().any(|&x| x != values[0])
            || values.first().is_some_and(|&x| 0.0 < x && x < 1.0)
    });
    let illum = m.illumination_model.unwrap_or(0);
    let shines = m.specular.is_some_and(|ks| ks.iter().any(|&x| x > 0.0)) && illum != 1;
    let glass = matches!(illum, 4 | 6 | 7 | 9) || opacity < 1.0 && (shines || tinted);
    let bumps = ["norm", "disp", "map_disp"].iter().any(|key| unknown(key).is_some());
    [
        (glass, "glass"),
        (!glass && matches!(illum, 3 | 5 | 8), "mirror"),
        (number("Pm").is_some_and(|x| x > 0.0) || unknown("map_Pm").is_some(), "metal"),
        (!glass && shines || m.specular_texture.is_some(), "gloss"),
        (bumps || m.normal_texture.is_some(), "bump map"),
    ]
    .into_iter()
    .filter_map(|(is, what)| is.then_some(what))
    .collect()
}

/// Materials with what they are beyond diffuse, in one line; none where all are diffuse.
pub fn taken_for_diffuse<'a>(materials: impl Iterator<Item = &'a MtlMaterial>) -> Option<String> {
    const NAMED: usize = 6;
    let mut by_kind: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for m in materials {
        m.more.iter().for_each(|kind| by_kind.entry(kind).or_default().push(&m.name));
    }
    let list = |names: &Vec<&str>| {
        let more = names.len().saturating_sub(NAMED);
        let named = names[..names.len() - more].join(", ");
        if more > 0 { format!("{named} and {more} more") } else { named }
    };
    let kinds: Vec<String> =
        by_kind.iter().map(|(kind, names)| format!("{kind}: {}", list(names))).collect();
    (!kinds.is_empty()).then(|| {
        format!(
            "rendered as diffuse by their Kd are {}; materials = \"diffuse\" in the [[mesh]] says \
             that this is meant",
            kinds.join("; ")
        )
    })
}

/// A line of an MTL file, as it is to be read.
#[derive(Debug, PartialEq)]
enum Statement {
    Whole,
    Written(String),
    LeftOut(String),
    Fault(String),
}

fn statement(line: &str) -> Statement {
    let mut words = line.split_whitespace();
    let Some(key) = words.next() else { return Statement::Whole };
    let fault = |message: String| Statement::Fault(message);
    match key {
        "Kd" | "Ke" | "Ka" | "Ks" => numbers(line, key, 3),
        "d" | "Tr" | "Ns" | "Ni" => numbers(line, key, 1),
        "illum" => match words.next().and_then(|w| w.parse::<u8>().ok()) {
            Some(_) => Statement::Whole,
            None => {
                fault(format!("illum needs a whole number from 0 to 10, found \"{}\"", line.trim()))
            }
        },
        "newmtl" if words.next().is_none() => {
            fault("newmtl needs a name; write newmtl NAME".into())
        }
        _ if (key.starts_with("map_") || key == "bump") && words.next().is_none() => {
            Statement::LeftOut(format!("{key} names no file and is left out"))
        }
        _ => Statement::Whole,
    }
}

/// A statement of finite numbers; one stands for three. Halos have a word before the opacity.
fn numbers(line: &str, key: &str, count: usize) -> Statement {
    let data = line.split('#').next().unwrap_or("");
    let mut given: Vec<&str> = data.split_whitespace().skip(1).collect();
    if key == "d" && given.first() == Some(&"-halo") {
        given.remove(0);
    }
    if matches!(given.first(), Some(&"spectral" | &"xyz")) {
        return Statement::LeftOut(format!(
            "{key} in spectra or CIE XYZ is left out; write three numbers, red, green and blue"
        ));
    }
    let found: Option<Vec<f32>> = given.iter().take(count).map(|w| w.parse().ok()).collect();
    let plural = if count == 1 { "" } else { "s" };
    match found {
        Some(v) if (v.len() == count || v.len() == 1) && v.iter().all(|x| x.is_finite()) => {
            if matches!(key, "Kd" | "Ke" | "d" | "Tr") && v.iter().any(|&x| x < 0.0) {
                return Statement::Fault(format!(
                    "{key} may not be negative, found \"{}\"; give {count} number{plural} from 0 \
                     on",
                    line.trim()
                ));
            }
            let all: Vec<String> = (0..count).map(|i| v[i.min(v.len() - 1)].to_string()).collect();
            Statement::Written(format!("{key} {}", all.join(" ")))
        }
        _ => Statement::Fault(format!(
            "{key} needs {count} finite number{plural}, found \"{}\"",
            line.trim()
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> (Vec<MtlMaterial>, Vec<String>) {
        static COUNT: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);
        let number = COUNT.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let name = format!("nearfar-{}-{number}.mtl", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, text).unwrap();
        let mut warnings = Vec::new();
        let found = read_mtl(&path, &mut warnings).unwrap();
        std::fs::remove_file(path).unwrap();
        (found, warnings)
    }

    #[test]
    fn colours_and_maps() {
        let (m, warnings) = read(
            "newmtl a\nmap_Kd t.png\nnewmtl b\nnewmtl c\nKd 0 0 0\nmap_Kd t.png\n\
             newmtl d\nKd 0.3 # dark\nmap_Ke t.png\nTr 0.25\nmap_Kd\n",
        );
        assert_eq!(m.iter().map(|m| m.albedo.x).collect::<Vec<_>>(), [1.0, 0.5, 0.0, 0.3]);
        assert_eq!((m[3].albedo, m[3].emission, m[3].opacity), (Rgb::splat(0.3), Rgb::ONE, 0.75));
        assert!(m[0].albedo_texture.is_some() && m[3].albedo_texture.is_none());
        assert_eq!(warnings.len(), 2);
        assert!(warnings[0].ends_with(":11: map_Kd names no file and is left out"));
        assert!(warnings[1].contains("material \"c\" is black"));
    }

    #[test]
    fn what_is_more_than_diffuse_is_told() {
        let (m, _) = read(
            "newmtl plain\nKd 1 1 1\nKs 0 0 0\nillum 2\nnewmtl chrome\nKs 1 1 1\nillum 3\n\
             newmtl pane\nd 0.1\nillum 4\nnewmtl lacquer\nKs 0.5 0.5 0.5\nillum 2\nbump b.png\n\
             newmtl gold\nPm 1\nnewmtl card\nmap_d m.png\n",
        );
        let more: Vec<_> = m.iter().map(|m| m.more.join(" ")).collect();
        assert_eq!(more, ["", "mirror gloss", "glass", "gloss bump map", "metal", ""]);
        let told = taken_for_diffuse(m.iter()).unwrap();
        assert!(told.contains("glass: pane; gloss: chrome, lacquer; metal: gold; mirror: chrome"));
        assert_eq!(taken_for_diffuse(m[..1].iter()), None);
    }

    #[test]
    fn statements() {
        let is_fault = |line: &str| matches!(statement(line), Statement::Fault(_));
        for line in ["Kd 0.1 0.2 0.3", "# Kd", "", "Pr x", "Kd 0.1", "d -halo 0.5", "map_Kd "] {
            assert!(!is_fault(line), "{line}");
        }
        for line in ["Kd 0.1 0.2", "Kd 1 2 x", "Ke nan 0 0", "Kd -1 0 0", "newmtl", "illum z", "d"]
        {
            assert!(is_fault(line), "{line}");
        }
        assert!(matches!(statement("Kd spectral a.rfl 1"), Statement::LeftOut(_)));
        assert_eq!(statement("Kd 0.5"), Statement::Written("Kd 0.5 0.5 0.5".into()));
    }
}
