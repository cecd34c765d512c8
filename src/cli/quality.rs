//! `--quality`: how many rays, samples and cells a picture is worth, as settings under one name.
//!
//! A preset fills in settings that neither the scene file nor `--set` gives. It concerns the
//! methods that look up the proxy. Trimmed relMSE and CPU seconds at 640×360 on two threads against
//! `nearfar reference`:
//!
//! | | sponza_day | dining_room | interior | sponza_night |
//! |---|---|---|---|---|
//! | draft | 0.0058 · 4.1 | 0.0064 · 4.1 | 0.0083 · 4.8 | 0.0014 · 7.4 |
//! | normal | 0.0032 · 8.2 | 0.0031 · 8.2 | 0.0042 · 9.7 | 0.0006 · 14.9 |
//! | high | 0.0026 · 13 | 0.0026 · 15 | 0.0031 · 18 | 0.0006 · 20 |
//! | best (with 32 samples a pixel) | 0.0016 · 30 | 0.0013 · 37 | 0.0027 · 42 | 0.0003 · 44 |

use toml::{Table, Value};

use crate::config;
use crate::error::Result;

/// A named set of settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Quality {
    /// Half the time of `normal`, twice its error.
    Draft,
    /// The defaults.
    #[default]
    Normal,
    /// Twice the time of `normal`.
    High,
    /// Five times the time of `normal`, a third to half of its error.
    Best,
}

impl Quality {
    fn settings(self) -> Vec<(&'static str, Value)> {
        let int = |v: i64| Value::Integer(v);
        let length = |v: &str| Value::String(v.to_owned());
        match self {
            Self::Draft => vec![
                ("record.spp", int(8)),
                ("photon.count", int(100_000)),
                ("photon.gather_rays", int(6)),
                ("photon.direct_samples", int(4)),
                ("decompose.near_cell", length("2.5%")),
                ("decompose.cluster_radius", length("0.7%")),
                ("decompose.rays", int(256)),
                ("decompose.near_rays", int(8)),
            ],
            Self::Normal => Vec::new(),
            Self::High => vec![
                ("photon.gather_rays", int(32)),
                ("decompose.rays", int(1024)),
                ("decompose.near_rays", int(32)),
            ],
            Self::Best => vec![
                ("record.spp", int(64)),
                ("photon.gather_rays", int(64)),
                ("decompose.near_cell", length("1%")),
                ("decompose.cluster_radius", length("0.4%")),
                ("decompose.rays", int(2048)),
                ("decompose.near_rays", int(96)),
            ],
        }
    }

    /// Fills in what `settings` leaves open.
    ///
    /// # Errors
    /// A section of `settings` that is no section.
    pub(super) fn fill(self, settings: &mut Table) -> Result<()> {
        for (key, value) in self.settings() {
            let given = key
                .split('.')
                .try_fold(Value::Table(settings.clone()), |at, part| at.get(part).cloned());
            if given.is_none() {
                config::set(settings, key, value)?;
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
        for quality in [Quality::Draft, Quality::Normal, Quality::High, Quality::Best] {
            let mut settings: Table = "[decompose]\nrays = 100".parse().unwrap();
            quality.fill(&mut settings).unwrap();
            let config = RenderConfig::from_table(settings).unwrap();
            assert_eq!(config.decompose.rays, 100);
            assert_eq!(
                config.decompose.near_rays,
                match quality {
                    Quality::Draft => 8,
                    Quality::Normal => 16,
                    Quality::High => 32,
                    Quality::Best => 96,
                }
            );
        }
    }
}
