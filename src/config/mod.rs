//! All settings in one place: every room's section under its name, read from the scene file and
//! from assignments (`path.spp=64`).
//!
//! The whole is a section of sections ([`crate::settings`]): keys, types, ranges and meanings stand
//! where the rooms declare them. Later wins: defaults, [`Quality`], the table. Unknown keys are
//! errors that name the key, what it is called now or what was probably meant, and what there is.

mod assignment;
mod quality;

use toml::{Table, Value};

use crate::accel::Backend;
use crate::cloud::PointBasedSettings;
use crate::denoise::Denoise;
use crate::error::{Error, Result};
use crate::method::cache::CacheSettings;
use crate::method::converge::ConvergeSettings;
use crate::method::decompose::DecomposeSettings;
use crate::method::final_gather::GatherSettings;
use crate::method::local_correction::LocalSettings;
use crate::method::path::PathSettings;
use crate::method::stage::Inputs;
use crate::method::{Method, course};
use crate::proxy::{Estimate, ProxySettings};
use crate::record::RecordSettings;
use crate::settings::{self, Group, Section, nearest, section};
use crate::shading::DirectSettings;

pub use assignment::{parse_assignment, parse_value, set};
pub use quality::Quality;

section! {
    /// What concerns every method.
    pub struct RenderConfig in "" {
        /// Seed of every random number.
        seed: u64 = 0;
        /// Who answers ray queries.
        backend: Backend = Backend::default();
        /// What removes noise from the finished picture; with it `decompose.near_filter` is 0
        /// unless set.
        denoise: Option<Denoise> = None, follows "the command: auto with nearfar render, else none";
    } sections {
        direct: DirectSettings;
        record: RecordSettings;
        proxy: ProxySettings;
        decompose: DecomposeSettings;
        cache: CacheSettings;
        gather: GatherSettings;
        point_based: PointBasedSettings;
        local: LocalSettings;
        path: PathSettings;
        converge: ConvergeSettings;
    }
}

/// Sections and keys by the names they had, and what to use now.
const RENAMED: [(&str, &str); 7] = [
    ("photon.count", "is called \"proxy.photons\" now"),
    ("points.pointbased", "is no setting any more: the method knows no rays"),
    ("decompose.near_tolerance", "is no setting any more: it belonged to \"triangles+rays\""),
    ("decompose.overlap", "is no setting any more"),
    ("proxy.boundary_correction", "is no setting any more: it is always on"),
    ("photon", "the section is called [proxy] now"),
    ("points", "the section is called [point_based] now"),
];

/// What became of a key or section of earlier versions.
pub fn renamed(key: &str) -> Option<&'static str> {
    RENAMED.iter().find(|(old, _)| *old == key).map(|(_, now)| *now)
}

impl RenderConfig {
    /// From the `settings` table of a scene file (after assignments were merged into it), every
    /// value checked.
    ///
    /// # Errors
    /// [`Error::Setting`] for unknown keys, wrong types and values out of range.
    pub fn from_table(table: Table) -> Result<Self> {
        Self::at_quality(table, Quality::Normal)
    }

    /// As [`RenderConfig::from_table`], where what the table leaves open is worth more or less
    /// time.
    ///
    /// # Errors
    /// As [`RenderConfig::from_table`].
    pub fn at_quality(mut table: Table, quality: Quality) -> Result<Self> {
        quality.fill(&mut table)?;
        check_keys(&table)?;
        let mut config = Self::default();
        table.iter().try_for_each(|(key, value)| config.set(key, value))?;
        config.validate()?;
        config.follow();
        Ok(config)
    }

    /// Gives what follows a setting of another section its value, where it is not set. Done by
    /// [`RenderConfig::from_table`]; once more is no harm.
    pub fn follow(&mut self) {
        if self.denoise == Some(Denoise::Oidn) {
            // A denoiser takes the noise of single rays better than what the filter makes of it,
            // and better than more rays in the same time.
            self.decompose.near_filter.get_or_insert(0);
            self.direct.light_samples.get_or_insert(2);
            self.gather.rays.get_or_insert(16);
        }
        if self.decompose.sums_cells() {
            self.proxy.estimate.get_or_insert(Estimate::Gather);
        }
        self.path.filter = self.record.pixel_filter();
    }

    /// The settings as `method` takes them in a world of the given extent: what follows others
    /// has its value, and the course decides some itself.
    ///
    /// # Errors
    /// [`Error::Setting`] for a value that contradicts the method.
    pub fn for_method(mut self, method: Method, extent: f32) -> Result<Self> {
        self.follow();
        if method == Method::Course {
            (self.decompose, self.proxy) =
                course::as_written(&self.decompose, &self.proxy, extent)?;
        }
        if method == Method::PhotonMap {
            self.proxy.estimate.get_or_insert(Estimate::Gather);
        }
        Ok(self)
    }

    /// What the methods start from, in a world of the given extent. All of them get the cells
    /// that the decomposition's alpha asks for.
    pub fn inputs(&self, extent: f32) -> Inputs<'_> {
        let near_cell = self.decompose.lengths(extent).near_cell;
        Inputs {
            near_cell,
            photon: &self.proxy,
            record: &self.record,
            direct: &self.direct,
            seed: self.seed,
        }
    }

    /// All settings with their values; those that follow others are left out until they are set.
    ///
    /// # Errors
    /// [`Error::Render`] when a setting cannot be written as TOML: a seed of 2⁶³ or more.
    pub fn to_table(&self) -> Result<Table> {
        Table::try_from(self).map_err(|e| Error::Render(format!("settings: {e}")))
    }

    /// The reference: every setting there is, section by section.
    pub fn reference() -> Vec<Group> {
        Self::groups()
    }
}

/// Refuses keys that there are none of.
fn check_keys(table: &Table) -> Result<()> {
    let groups = RenderConfig::groups();
    for (key, value) in table {
        match value {
            Value::Table(inner) if !inner.is_empty() => {
                inner.keys().try_for_each(|k| check_key(&groups, &settings::dotted(key, k)))?;
            }
            _ => check_key(&groups, key)?,
        }
    }
    Ok(())
}

fn check_key(groups: &[Group], key: &str) -> Result<()> {
    let (section, last) = key.split_once('.').unwrap_or(("", key));
    let own = groups.iter().find(|g| g.name == section);
    let keys = || groups.iter().flat_map(|g| &g.settings).map(|s| s.key.as_str());
    let sections = || groups.iter().map(|g| g.name).filter(|name| !name.is_empty());
    if keys().chain(sections()).any(|k| k == key) {
        return Ok(());
    }
    if let Some(now) = renamed(key).or_else(|| renamed(section)) {
        return Err(Error::setting(key, now));
    }
    let near = nearest(key, keys()).or_else(|| nearest(key, sections()));
    let elsewhere = || keys().find(|k| k.rsplit('.').next() == Some(last));
    let meant = near
        .or_else(elsewhere)
        .map_or_else(String::new, |meant| format!("; did you mean \"{meant}\"?"));
    let there = match own.filter(|_| !section.is_empty()) {
        Some(group) => {
            let bare = |s: &settings::Setting| s.key.rsplit('.').next().unwrap_or("").to_owned();
            let list: Vec<String> = group.settings.iter().map(bare).collect();
            format!("keys of [{section}]: {}", list.join(", "))
        }
        None => {
            let alone = keys().filter(|k| !k.contains('.')).collect::<Vec<_>>().join(", ");
            format!("sections: {}; keys alone: {alone}", sections().collect::<Vec<_>>().join(", "))
        }
    };
    Err(Error::setting(key, format!("unknown key{meant} ({there})")))
}

#[cfg(test)]
mod tests;
