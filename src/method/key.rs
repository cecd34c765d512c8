//! What a file of earlier work belongs to: kind and version, scene, and the settings that decided
//! its content. Kept as comments in its header.
//!
//! ```text
//! comment nearfar irradiance cache 3                     kind and version of the content
//! comment scene meshes=… materials=… textures=… lights=…  crate::scene::Fingerprint
//! comment settings {"cache.rays":512,…}                  the settings that matter, as JSON
//! comment surroundings 7.25 1.5 1 2                     extent and midst of what was seen
//! ```
//! Lengths follow the surroundings of the view; who starts from a file takes those of the file
//! ([`surroundings_of`]), so that what was kept fits another view too.
//!
//! A file with another key is refused, with what differs and how to mend it: the first setting by
//! name and both values, or the parts of the scene. Settings that are not left out by name count: a
//! new setting makes earlier files stale, never wrong.

use std::path::Path;

use glam::Vec3;
use serde::Serialize;
use serde_json::{Map, Value};

use crate::error::Result;
use crate::ply;
use crate::scene::Fingerprint;
use crate::shading::Surroundings;

/// Kind, version, scene and settings of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    kind: &'static str,
    version: u32,
    scene: Fingerprint,
    settings: Map<String, Value>,
    around: Surroundings,
}

/// Extent and midst of what was seen where a file was made; none where it does not say.
///
/// # Errors
/// When it is no file of points.
pub fn surroundings_of(file: &Path) -> Result<Option<Surroundings>> {
    let reader = ply::Reader::open(file)?;
    let comments = &reader.header().comments;
    let numbers = comments.iter().find_map(|c| c.strip_prefix("surroundings "));
    let numbers: Vec<f32> =
        numbers.unwrap_or_default().split(' ').filter_map(|n| n.parse().ok()).collect();
    Ok(match numbers[..] {
        [extent, x, y, z] if extent > 0.0 && numbers.iter().all(|n| n.is_finite()) => {
            Some(Surroundings { extent, midst: Vec3::new(x, y, z) })
        }
        _ => None,
    })
}

impl Key {
    /// A key without settings. `kind` is what the file is: "irradiance cache".
    pub fn new(kind: &'static str, version: u32, scene: Fingerprint, around: Surroundings) -> Self {
        Self { kind, version, scene, settings: Map::new(), around }
    }

    /// With every key of a settings section but those left out.
    pub fn with<T: Serialize>(mut self, section: &str, settings: &T, leave_out: &[&str]) -> Self {
        if let Ok(Value::Object(map)) = serde_json::to_value(settings) {
            let kept = map.into_iter().filter(|(key, _)| !leave_out.contains(&key.as_str()));
            self.settings.extend(kept.map(|(key, value)| (format!("{section}.{key}"), value)));
        }
        self
    }

    /// With one value more.
    pub fn with_value(mut self, key: &str, value: impl Into<Value>) -> Self {
        self.settings.insert(key.into(), value.into());
        self
    }

    /// Header comments.
    pub fn comments(&self) -> Vec<String> {
        let settings = Value::Object(self.settings.clone());
        let Surroundings { extent, midst } = self.around;
        vec![
            format!("nearfar {} {}", self.kind, self.version),
            format!("scene {}", self.scene),
            format!("settings {settings}"),
            format!("surroundings {extent} {} {} {}", midst.x, midst.y, midst.z),
        ]
    }

    /// Why a file with these comments does not belong here.
    pub fn difference(&self, comments: &[String]) -> Option<String> {
        let find = |name: &str| comments.iter().find_map(|c| c.strip_prefix(name)).map(str::trim);
        let Some(version) = find(&format!("nearfar {} ", self.kind)) else {
            let other = find("nearfar ")
                .map_or_else(String::new, |other| format!(", but says \"nearfar {other}\""));
            return Some(format!(
                "is no {}: it does not have the comment \"nearfar {} {}\"{other}",
                self.kind, self.kind, self.version
            ));
        };
        if version != self.version.to_string() {
            return Some(format!(
                "is of version {version}; this program reads \"nearfar {} {}\": save it again",
                self.kind, self.version
            ));
        }
        match find("scene ").and_then(Fingerprint::parse) {
            None => return Some("does not say what scene it belongs to: save it again".into()),
            Some(stored) => {
                if let Some(parts) = self.scene.differing(&stored) {
                    return Some(format!(
                        "was made for another scene: its {parts} differ from this one's; start \
                         without it and save it again"
                    ));
                }
            }
        }
        let stored: Map<String, Value> =
            find("settings ").and_then(|text| serde_json::from_str(text).ok()).unwrap_or_default();
        let keys = self.settings.keys().chain(stored.keys());
        keys.into_iter().find(|key| self.settings.get(*key) != stored.get(*key)).map(|key| {
            let say = |map: &Map<String, Value>| {
                map.get(key).map_or_else(|| "not there".into(), Value::to_string)
            };
            format!(
                "was made with other settings: {key} is {} there and {} here; set them alike, or \
                 save it again",
                say(&stored),
                say(&self.settings)
            )
        })
    }
}
