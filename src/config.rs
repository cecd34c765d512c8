//! All settings in one place: every room's settings struct under its key, with defaults, read from the scene file and `--set`.
//!
//! Keys are dotted: `decompose.alpha`, `photon.count`, `path.spp`. Unknown keys are errors that name the nearest known ones.
//! Precedence, later wins: defaults, scene file, `--set`, the option of its own (`--spp`, `--alpha`, `--seed`).

use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::error::{Error, Result};
use crate::method::path::PathSettings;
use crate::shading::DirectSettings;

/// What is computed at which quality.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RenderConfig {
    /// Seed of every random number.
    pub seed: u64,
    /// Direct light.
    pub direct: DirectSettings,
    /// Path tracing.
    pub path: PathSettings,
}

impl RenderConfig {
    /// From the `settings` table of a scene file (after `--set` was merged into it), every value checked.
    ///
    /// # Errors
    /// [`Error::Setting`] for unknown keys, wrong types and values out of range.
    pub fn from_table(table: Table) -> Result<Self> {
        check_keys(&table, &Self::default().to_table()?, "")?;
        for (key, value) in &table {
            // One section at a time, so that a wrong type is reported under its name.
            let alone: Table = [(key.clone(), value.clone())].into_iter().collect();
            alone.try_into::<Self>().map_err(|e| Error::setting(offender(key, value), one_line(e.message())))?;
        }
        let config: Self = table.try_into().map_err(|e: toml::de::Error| Error::setting("settings", one_line(e.message())))?;
        config.path.check()?;
        Ok(config)
    }

    /// All settings with their values.
    ///
    /// # Errors
    /// [`Error::Render`] when a setting cannot be written as TOML; cannot happen with the settings of this program.
    pub fn to_table(&self) -> Result<Table> {
        Table::try_from(self).map_err(|e| Error::Render(format!("settings: {e}")))
    }
}

fn one_line(message: &str) -> String {
    message.lines().collect::<Vec<_>>().join(" ")
}

/// The only key of a section, dotted, else the section.
fn offender(key: &str, value: &Value) -> String {
    match value {
        Value::Table(t) if t.len() == 1 => t.iter().next().map_or(key.to_owned(), |(k, v)| format!("{key}.{}", offender(k, v))),
        _ => key.to_owned(),
    }
}

fn check_keys(table: &Table, known: &Table, prefix: &str) -> Result<()> {
    for (key, value) in table {
        let dotted = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        match (known.get(key), value) {
            (None, _) => {
                let mut names: Vec<&String> = known.keys().collect();
                names.sort_by_key(|n| distance(n, key));
                let names: Vec<_> = names.into_iter().map(|n| format!("\"{n}\"")).collect();
                let place = if prefix.is_empty() { "known sections and keys".into() } else { format!("keys of \"{prefix}\"") };
                return Err(Error::setting(dotted, format!("unknown key; {place}: {}", names.join(", "))));
            }
            (Some(Value::Table(inner)), Value::Table(given)) => check_keys(given, inner, &dotted)?,
            (Some(Value::Table(_)), _) => return Err(Error::setting(&dotted, format!("is a section: set a key of it, such as \"{dotted}.…\""))),
            _ => {}
        }
    }
    Ok(())
}

/// Edit distance, to name the nearest key first.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &y) in b.iter().enumerate() {
            let next = (diagonal + usize::from(x != y)).min(row[j] + 1).min(row[j + 1] + 1);
            diagonal = std::mem::replace(&mut row[j + 1], next);
        }
    }
    row[b.len()]
}

/// `key=value` with the value read as TOML; what is no TOML value counts as text.
///
/// # Errors
/// [`Error::Usage`] without `=` or with an empty part of the key.
pub fn parse_assignment(text: &str) -> Result<(String, Value)> {
    let (key, value) = text.split_once('=').ok_or_else(|| Error::Usage(format!("--set {text}: write key=value, for example path.spp=64")))?;
    let key = key.trim();
    if key.is_empty() || key.split('.').any(|k| k.trim().is_empty()) {
        return Err(Error::Usage(format!("--set {text}: \"{key}\" is not a dotted key")));
    }
    Ok((key.to_owned(), parse_value(value.trim())))
}

/// A TOML value, else the text itself.
pub fn parse_value(text: &str) -> Value {
    format!("v = {text}").parse::<Table>().ok().filter(|t| t.len() == 1).and_then(|mut t| t.remove("v")).unwrap_or_else(|| Value::String(text.to_owned()))
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
        Some((section, rest)) => match table.entry(section).or_insert_with(|| Value::Table(Table::new())) {
            Value::Table(inner) => set(inner, rest, value),
            _ => Err(Error::setting(key, format!("\"{section}\" is a value, not a section"))),
        },
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
    }

    #[test]
    fn errors_name_the_key() {
        for (text, expected) in [
            ("[path]\nsppp = 3", "setting \"path.sppp\": unknown key; keys of \"path\": \"spp\""),
            ("[pth]\nspp = 3", "setting \"pth\": unknown key; known sections and keys: \"path\""),
            ("[path]\nspp = \"many\"", "setting \"path.spp\": invalid type"),
            ("[path]\nspp = 0", "setting \"path.spp\": must be at least 1"),
            ("path = 3", "setting \"path\": is a section"),
        ] {
            let error = config(text).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }

    #[test]
    fn assignments() {
        assert_eq!(parse_assignment("path.spp = 3").unwrap(), ("path.spp".into(), Value::Integer(3)));
        assert_eq!(parse_assignment("a.b=[1, 2.5]").unwrap().1.as_array().unwrap().len(), 2);
        assert_eq!(parse_assignment("decompose.near_hits=ignore").unwrap().1, Value::String("ignore".into()));
        assert!(parse_assignment("path.spp").is_err() && parse_assignment("path..spp=1").is_err());
        let mut t = Table::new();
        set(&mut t, "a.b.c", Value::Integer(1)).unwrap();
        assert_eq!(t.to_string().replace(' ', ""), "[a.b]\nc=1\n");
        assert!(set(&mut t, "a.b.c.d", Value::Integer(1)).is_err());
    }
}
