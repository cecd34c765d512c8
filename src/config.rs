//! All settings in one place: every room's settings struct under its key, with defaults, read from the scene file and `--set`.
//!
//! Keys are dotted: `decompose.alpha`, `photon.count`, `path.spp`. Unknown keys are errors.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::shading::DirectSettings;

/// What is computed at which quality.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RenderConfig {
    /// Seed of every random number.
    pub seed: u64,
    /// Direct light.
    pub direct: DirectSettings,
}

impl RenderConfig {
    /// From the `settings` table of a scene file (after `--set` was merged into it), every value checked.
    ///
    /// # Errors
    /// [`Error::Setting`] for unknown keys, wrong types and values out of range.
    pub fn from_table(table: toml::Table) -> Result<Self> {
        table.try_into().map_err(|e: toml::de::Error| Error::setting("settings", e.message()))
    }
}
