//! How many rays, samples and cells a picture is worth, as settings under one name.
//!
//! A preset is where settings start from; whatever is set wins. It concerns the methods that look
//! up the proxy. Trimmed relMSE and CPU seconds at 640×360 on two threads against
//! `nearfar reference`:
//!
//! | | sponza_day | dining_room | interior | sponza_night |
//! |---|---|---|---|---|
//! | draft | 0.0058 · 4.1 | 0.0064 · 4.1 | 0.0083 · 4.8 | 0.0014 · 7.4 |
//! | normal | 0.0032 · 8.2 | 0.0031 · 8.2 | 0.0042 · 9.7 | 0.0006 · 14.9 |
//! | high | 0.0026 · 13 | 0.0026 · 15 | 0.0031 · 18 | 0.0006 · 20 |
//! | best (with 32 samples a pixel) | 0.0016 · 30 | 0.0013 · 37 | 0.0027 · 42 | 0.0003 · 44 |

use super::assignment::parse_value;
use crate::error::Result;
use crate::settings::choices;

choices! {
    /// A named set of settings.
    #[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
    pub enum Quality default Normal {
        /// Half the time of `normal`, twice its error.
        Draft = "draft",
        /// The defaults.
        Normal = "normal",
        /// Twice the time of `normal`.
        High = "high",
        /// Five times the time of `normal`, a third to half of its error.
        Best = "best",
    }
}

impl Quality {
    /// Dotted keys and their values, where they differ from the defaults.
    pub fn settings(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Draft => &[
                ("record.spp", "8"),
                ("gather.rays", "8"),
                ("direct.light_samples", "2"),
                ("proxy.photons", "100_000"),
                ("proxy.gather_rays", "6"),
                ("proxy.direct_samples", "4"),
                ("decompose.near_cell", "2.5%"),
                ("decompose.cluster_radius", "0.7%"),
                ("decompose.rays", "256"),
                ("decompose.near_rays", "8"),
            ],
            Self::Normal => &[],
            Self::High => &[
                ("proxy.gather_rays", "32"),
                ("gather.rays", "64"),
                ("direct.light_samples", "4"),
                ("decompose.rays", "1024"),
                ("decompose.near_rays", "32"),
            ],
            Self::Best => &[
                ("record.spp", "64"),
                ("gather.rays", "256"),
                ("direct.light_samples", "4"),
                ("proxy.gather_rays", "64"),
                ("decompose.near_cell", "1%"),
                ("decompose.cluster_radius", "0.4%"),
                ("decompose.rays", "2048"),
                ("decompose.near_rays", "96"),
            ],
        }
    }

    /// Fills in what `settings` leaves open.
    ///
    /// # Errors
    /// [`crate::error::Error::Setting`] where a section of `settings` is a value.
    pub fn fill(self, settings: &mut toml::Table) -> Result<()> {
        for (key, value) in self.settings() {
            let (section, last) = key.split_once('.').unwrap_or(("", key));
            let given = settings.get(section).and_then(|s| s.get(last)).is_some();
            if !given {
                super::set(settings, key, parse_value(value))?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::RenderConfig;

    #[test]
    fn presets_are_valid_and_give_way() {
        for (quality, near_rays) in
            [(Quality::Draft, 8), (Quality::Normal, 16), (Quality::High, 32), (Quality::Best, 96)]
        {
            let table = "[decompose]\nrays = 100".parse().unwrap();
            let config = RenderConfig::at_quality(table, quality).unwrap();
            assert_eq!((config.decompose.rays, config.decompose.near_rays), (100, near_rays));
        }
    }
}
