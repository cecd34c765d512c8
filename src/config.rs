//! All settings in one place: every room's settings struct under its key, with defaults, read from
//! the scene file and `--set`.
//!
//! Keys are dotted: `decompose.alpha`, `photon.count`, `path.spp`. Unknown keys are errors that
//! name the known ones. Precedence, later wins: defaults, scene file, `--set`, the option of its
//! own (`--spp`, `--alpha`, `--seed`).

use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::cloud::PointsSettings;
use crate::denoise::Denoise;
use crate::error::{Error, Result};
use crate::method::cache::CacheSettings;
use crate::method::converge::ConvergeSettings;
use crate::method::decompose::DecomposeSettings;
use crate::method::gather::GatherSettings;
use crate::method::local_correction::LocalSettings;
use crate::method::path::PathSettings;
use crate::method::stage::Inputs;
use crate::photon::PhotonSettings;
use crate::record::RecordSettings;
use crate::shading::DirectSettings;

/// What is computed at which quality.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RenderConfig {
    /// Seed of every random number.
    pub seed: u64,
    /// What removes noise from the finished picture of `nearfar render`; with it
    /// `decompose.near_filter` is 0 unless set.
    pub denoise: Denoise,
    /// Direct light.
    pub direct: DirectSettings,
    /// Camera samples and shading points.
    pub record: RecordSettings,
    /// The proxy.
    pub photon: PhotonSettings,
    /// Passes 2 and 3 of the decomposition.
    pub decompose: DecomposeSettings,
    /// Irradiance caching.
    pub cache: CacheSettings,
    /// Final gathering.
    pub gather: GatherSettings,
    /// Surface elements.
    pub points: PointsSettings,
    /// Local correction of a flat ambient term.
    pub local: LocalSettings,
    /// Path tracing.
    pub path: PathSettings,
    /// The picture that converges.
    pub converge: ConvergeSettings,
}

impl RenderConfig {
    /// From the `settings` table of a scene file (after `--set` was merged into it), every value
    /// checked.
    ///
    /// # Errors
    /// [`Error::Setting`] for unknown keys, wrong types and values out of range.
    pub fn from_table(table: Table) -> Result<Self> {
        for (section, value) in &table {
            let Value::Table(keys) = value else {
                check_alone(section, section, value.clone())?;
                continue;
            };
            check_alone(section, section, Value::Table(Table::new()))?;
            for (key, value) in keys {
                check_alone(
                    &format!("{section}.{key}"),
                    section,
                    Value::Table([(key.clone(), value.clone())].into_iter().collect()),
                )?;
            }
        }
        let own_near_filter =
            table.get("decompose").is_some_and(|d| d.get("near_filter").is_some());
        let mut config: Self = table
            .try_into()
            .map_err(|e: toml::de::Error| Error::setting("settings", one_line(e.message())))?;
        config.path.check()?;
        config.converge.validate()?;
        config.decompose.validate()?;
        config.cache.validate()?;
        config.gather.validate()?;
        config.photon.validate()?;
        config.record.validate()?;
        if config.denoise != Denoise::None && !own_near_filter {
            // A denoiser takes the noise of single near rays better than what the filter makes of
            // it.
            config.decompose.near_filter = 0;
        }
        config.path.filter = config.record.pixel_filter();
        config.points.validate()?;
        config.local.validate()?;
        Ok(config)
    }

    /// What the methods start from, in a scene of the given diagonal. All of them get the cells
    /// that the decomposition's alpha asks for.
    pub fn inputs(&self, diagonal: f32) -> Inputs<'_> {
        let near_cell = self.decompose.lengths(diagonal).near_cell;
        Inputs {
            near_cell,
            photon: &self.photon,
            record: &self.record,
            direct: &self.direct,
            seed: self.seed,
        }
    }

    /// All settings with their values.
    ///
    /// # Errors
    /// [`Error::Render`] when a setting cannot be written as TOML; cannot happen with the settings
    /// of this program.
    pub fn to_table(&self) -> Result<Table> {
        Table::try_from(self).map_err(|e| Error::Render(format!("settings: {e}")))
    }
}

/// Reads one key alone, so that whatever is wrong with it is reported under its dotted name.
fn check_alone(dotted: &str, section: &str, value: Value) -> Result<()> {
    let alone: Table = [(section.to_owned(), value)].into_iter().collect();
    alone
        .try_into::<RenderConfig>()
        .map(|_| ())
        .map_err(|e| Error::setting(dotted, one_line(e.message()).replace("field", "key")))
}

fn one_line(message: &str) -> String {
    message.lines().collect::<Vec<_>>().join(" ")
}

/// A dotted key and the text of its value, from `key=value`.
///
/// # Errors
/// [`Error::Usage`] without `=` or with an empty part of the key.
pub fn parse_assignment(text: &str) -> Result<(String, String)> {
    let (key, value) = text.split_once('=').ok_or_else(|| {
        Error::Usage(format!("--set {text}: write key=value, for example path.spp=64"))
    })?;
    let key = key.trim();
    if key.is_empty() || key.split('.').any(|k| k.trim().is_empty()) {
        return Err(Error::Usage(format!("--set {text}: \"{key}\" is not a dotted key")));
    }
    Ok((key.to_owned(), value.trim().to_owned()))
}

/// A TOML value, else the text itself.
pub fn parse_value(text: &str) -> Value {
    format!("v = {text}")
        .parse::<Table>()
        .ok()
        .filter(|t| t.len() == 1)
        .and_then(|mut t| t.remove("v"))
        .unwrap_or_else(|| Value::String(text.to_owned()))
}

/// Puts a value at a dotted key, making sections on the way.
///
/// # Errors
/// [`Error::Setting`] when a part of the way is a value.
pub fn set(table: &mut Table, key: &str, value: Value) -> Result<()> {
    match key.split_once('.') {
        None => {
            table.insert(key.to_owned(), value);
            Ok(())
        }
        Some((section, rest)) => {
            match table.entry(section).or_insert_with(|| Value::Table(Table::new())) {
                Value::Table(inner) => set(inner, rest, value),
                _ => Err(Error::setting(key, format!("\"{section}\" is a value, not a section"))),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(text: &str) -> Result<RenderConfig> {
        RenderConfig::from_table(text.parse().unwrap())
    }

    #[test]
    fn values_and_defaults() {
        let c = config("seed = 4\n[path]\nspp = 3").unwrap();
        assert_eq!((c.seed, c.path.spp, c.path.max_depth), (4, 3, 0));
        assert!(RenderConfig::from_table(RenderConfig::default().to_table().unwrap()).is_ok());
        assert_eq!(config("denoise = \"oidn\"").unwrap().decompose.near_filter, 0);
        assert_eq!(
            config("denoise = \"oidn\"\n[decompose]\nnear_filter = 3")
                .unwrap()
                .decompose
                .near_filter,
            3
        );
    }

    #[test]
    fn errors_name_the_key() {
        for (text, expected) in [
            (
                "[path]\nsppp = 3",
                "setting \"path.sppp\": unknown key `sppp`, expected one of `spp`",
            ),
            ("[pth]\nspp = 3", "setting \"pth\": unknown key `pth`, expected one of `seed`"),
            (
                "[decompose]\nnear_cell = 0.1\nalpha = \"x\"",
                "setting \"decompose.alpha\": \"x\" is not a length",
            ),
            ("[path]\nspp = \"many\"", "setting \"path.spp\": invalid type"),
            ("[path]\nspp = 0", "setting \"path.spp\": must be at least 1"),
            ("path = 3", "setting \"path\": invalid type: integer `3`, expected struct"),
        ] {
            let error = config(text).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }

    #[test]
    fn assignments() {
        assert_eq!(parse_assignment("path.spp = 3").unwrap(), ("path.spp".into(), "3".into()));
        assert_eq!(parse_value("[1, 2.5]").as_array().unwrap().len(), 2);
        assert_eq!(parse_value("ignore"), Value::String("ignore".into()));
        assert!(parse_assignment("path.spp").is_err() && parse_assignment("path..spp=1").is_err());
        let mut t = Table::new();
        set(&mut t, "a.b.c", Value::Integer(1)).unwrap();
        assert_eq!(t.to_string().replace(' ', ""), "[a.b]\nc=1\n");
        assert!(set(&mut t, "a.b.c.d", Value::Integer(1)).is_err());
    }
}
