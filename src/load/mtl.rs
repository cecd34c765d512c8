//! MTL material libraries, parsed by `tobj` after a look at every line, because `tobj` gives no
//! line (and stops the program on a short colour).
//!
//! Read: `Kd`, `Ke`, `d` or `Tr`, `map_Kd`, `map_d`. Everything else is left aside: surfaces are
//! diffuse. A library that is missing, or a material that it lacks, is no error: [`super::obj`]
//! warns by name and makes the surface grey.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::radiometry::Rgb;

/// A material as an MTL file describes it.
#[derive(Clone, Debug)]
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
    pub albedo_texture: Option<PathBuf>,
    /// Mask texture.
    pub opacity_texture: Option<PathBuf>,
}

impl MtlMaterial {
    /// The grey that stands in for a material nobody defines.
    pub fn stand_in(name: &str) -> Self {
        Self {
            name: name.into(),
            albedo: Rgb::splat(0.5),
            emission: Rgb::ZERO,
            opacity: 1.0,
            albedo_texture: None,
            opacity_texture: None,
        }
    }
}

/// Reads an MTL file.
///
/// # Errors
/// [`Error::Io`] when it cannot be read; [`Error::Input`] with the line of a malformed value.
pub fn read_mtl(path: &Path) -> Result<Vec<MtlMaterial>> {
    let bytes = std::fs::read(path).map_err(|source| Error::Io { path: path.into(), source })?;
    let text = String::from_utf8_lossy(&bytes);
    let text = text.trim_start_matches('\u{feff}');
    for (index, line) in text.lines().enumerate() {
        if let Some(message) = fault(line) {
            return Err(Error::input(path, index + 1, message));
        }
    }
    let (materials, _) = tobj::load_mtl_buf(&mut text.as_bytes()).map_err(|e| {
        Error::input(path, None, format!("is no material library ({e}); export it again"))
    })?;
    Ok(materials.into_iter().filter(|m| !m.name.is_empty()).map(|m| convert(m, path)).collect())
}

fn convert(m: tobj::Material, file: &Path) -> MtlMaterial {
    let unknown = |key: &str| {
        let mut keys: Vec<&String> =
            m.unknown_param.keys().filter(|k| k.eq_ignore_ascii_case(key)).collect();
        keys.sort();
        keys.first().map(|&k| m.unknown_param[k].clone())
    };
    let texture = |name: Option<String>| {
        name.map(|n| texture_path(&n, file)).filter(|p| p.file_name().is_some())
    };
    let transparency = unknown("Tr").and_then(|t| t.trim().parse::<f32>().ok());
    MtlMaterial {
        albedo: m.diffuse.map_or(Rgb::splat(0.5), Rgb::from),
        emission: m.emissive.map_or(Rgb::ZERO, Rgb::from),
        opacity: m.dissolve.or(transparency.map(|t| 1.0 - t)).unwrap_or(1.0).clamp(0.0, 1.0),
        albedo_texture: texture(m.diffuse_texture.clone().or_else(|| unknown("map_Kd"))),
        opacity_texture: texture(m.dissolve_texture.clone().or_else(|| unknown("map_d"))),
        name: m.name,
    }
}

/// The file of a texture statement: options (`-s 1 1 1`, `-clamp on`, …) stand before it;
/// backslashes are folders.
fn texture_path(statement: &str, file: &Path) -> PathBuf {
    let mut rest = statement.trim();
    while rest.starts_with('-') {
        let mut words = rest.split_whitespace();
        let option = words.next().unwrap_or("");
        let mut after = rest[option.len()..].trim_start();
        let at_most = match option {
            "-o" | "-s" | "-t" => 3,
            "-mm" => 2,
            _ => 1,
        };
        for i in 0..at_most {
            let word = after.split_whitespace().next().unwrap_or("");
            if i > 0 && word.parse::<f32>().is_err() {
                break;
            }
            after = after[word.len()..].trim_start();
        }
        rest = after;
    }
    file.parent().unwrap_or(Path::new("")).join(rest.replace('\\', "/"))
}

fn fault(line: &str) -> Option<String> {
    let mut words = line.split_whitespace();
    let key = words.next()?;
    let numbers = |count: usize| -> Option<String> {
        let given: Vec<&str> = line.split_whitespace().skip(1).collect();
        let parsed: Option<Vec<f32>> = given.iter().take(count).map(|w| w.parse().ok()).collect();
        match parsed {
            Some(v) if v.len() == count && v.iter().all(|x| x.is_finite()) => {
                let bounded = matches!(key, "Kd" | "Ke" | "d" | "Tr");
                let negative = v.iter().any(|&x| x < 0.0);
                (bounded && negative).then(|| {
                    format!(
                        "{key} may not be negative, found \"{}\"; give {count} number{} from 0 on",
                        line.trim(),
                        plural(count)
                    )
                })
            }
            _ => Some(format!(
                "{key} needs {count} finite number{}, found \"{}\"",
                plural(count),
                line.trim()
            )),
        }
    };
    match key {
        "Kd" | "Ke" | "Ka" | "Ks" => numbers(3),
        "d" | "Tr" | "Ns" | "Ni" => numbers(1),
        "illum" => {
            words.next().and_then(|w| w.parse::<u8>().ok()).is_none().then(|| {
                format!("illum needs a whole number from 0 to 10, found \"{}\"", line.trim())
            })
        }
        "newmtl" => words.next().is_none().then(|| "newmtl needs a name; write newmtl NAME".into()),
        "map_Ka" | "map_Kd" | "map_Ks" | "map_Bump" | "map_bump" | "map_Ns" | "map_ns"
        | "map_NS" | "bump" | "map_d" => words
            .next()
            .is_none()
            .then(|| format!("{key} names no file; write {key} FILE or remove the line")),
        _ => None,
    }
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_statements() {
        let file = Path::new("m/a.mtl");
        assert_eq!(texture_path("t.png", file), Path::new("m/t.png"));
        assert_eq!(
            texture_path("-s 2 2 1 -clamp on my wood.png", file),
            Path::new("m/my wood.png")
        );
        assert_eq!(texture_path("-bm 0.3 tex\\b.png", file), Path::new("m/tex/b.png"));
        assert_eq!(texture_path("-o 0.5 t.png", file), Path::new("m/t.png"));
    }

    #[test]
    fn faults() {
        assert!(
            fault("Kd 0.1 0.2 0.3").is_none()
                && fault("# Kd").is_none()
                && fault("").is_none()
                && fault("Pr x").is_none()
        );
        assert!(
            fault("Kd 0.1").is_some()
                && fault("Kd 1 2 x").is_some()
                && fault("Ke nan 0 0").is_some()
                && fault("Kd -1 0 0").is_some()
        );
        assert!(
            fault("newmtl").is_some()
                && fault("illum z").is_some()
                && fault("map_Kd ").is_some()
                && fault("d").is_some()
        );
    }
}
