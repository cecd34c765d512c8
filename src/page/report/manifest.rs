//! What a folder of renders says about itself: `report.toml`, every key optional.
//!
//! ```toml
//! title = "Two ways to light a room"
//! text = "Shown above the sections."
//! [[section]]
//! folder = "room"                          # below the report's folder, which is "."; may repeat
//! title = "The room"
//! text = "Shown under the title."
//! pictures = ["fast", "slow", "truth"]     # names without .exr, in order; default all
//! reference = "truth"
//! pair = ["fast", "truth"]                 # what the divider parts at first
//! exposure = 0.5                           # stops; default: log-average luminance at 0.18
//! layers = ["fast"]                        # pictures whose layers far and near are shown too
//! ratio = ["slow", "fast"]                 # the opponent and ours
//! [[section.toggle]]
//! label = "denoiser"
//! off = "noisy"
//! on = "fast"
//! [section.sweep]
//! label = "alpha"
//! values = [0, 0.1, 0.2]
//! pictures = ["alpha-0", "alpha-1", "alpha-2"]
//! ```

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::input_file;

/// The whole of `report.toml`.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Manifest {
    pub title: Option<String>,
    pub text: String,
    pub section: Vec<SectionPlan>,
}

/// One section as it is asked for.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct SectionPlan {
    pub folder: String,
    pub title: Option<String>,
    pub text: String,
    pub pictures: Vec<String>,
    pub reference: Option<String>,
    pub pair: Option<[String; 2]>,
    pub exposure: Option<f32>,
    pub layers: Vec<String>,
    pub ratio: Option<[String; 2]>,
    pub toggle: Vec<Toggle>,
    pub sweep: Option<Sweep>,
}

/// Two pictures that differ by one switch.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Toggle {
    pub label: String,
    pub off: String,
    pub on: String,
}

/// Pictures along one setting.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Sweep {
    pub label: String,
    pub values: Vec<f64>,
    pub pictures: Vec<String>,
}

impl SectionPlan {
    /// Every picture the plan names outside `pictures`, with the key that names it.
    pub(super) fn named(&self) -> Vec<(&'static str, &str)> {
        let mut names: Vec<(&'static str, &str)> =
            self.reference.iter().map(|n| ("reference", n.as_str())).collect();
        names.extend(self.pair.iter().flatten().map(|n| ("pair", n.as_str())));
        names.extend(self.ratio.iter().flatten().map(|n| ("ratio", n.as_str())));
        names.extend(self.layers.iter().map(|n| ("layers", n.as_str())));
        names.extend(
            self.toggle
                .iter()
                .flat_map(|t| [("toggle", t.off.as_str()), ("toggle", t.on.as_str())]),
        );
        names.extend(
            self.sweep.iter().flat_map(|s| s.pictures.iter().map(|n| ("sweep", n.as_str()))),
        );
        names
    }
}

/// Reads `report.toml` in `dir`; the empty manifest when there is none.
///
/// # Errors
/// [`Error::Input`] with the line of a malformed file or unknown key.
pub(super) fn read_manifest(dir: &Path) -> Result<Manifest> {
    let path = dir.join("report.toml");
    let text = match input_file::read_text(&path) {
        Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
            return Ok(Manifest::default());
        }
        text => text?,
    };
    let manifest: Manifest = toml::from_str(&text).map_err(|e| {
        let line =
            e.span().map_or(1, |s| 1 + text[..s.start.min(text.len())].matches('\n').count());
        Error::Usage(format!("{}:{line}: {}", path.display(), e.message().trim_end()))
    })?;
    for section in &manifest.section {
        if let Some(sweep) = section.sweep.as_ref().filter(|s| s.values.len() != s.pictures.len()) {
            return Err(Error::Usage(format!(
                "{}: section \"{}\": the sweep has {} values and {} pictures; give one value a \
                 picture",
                path.display(),
                section.folder,
                sweep.values.len(),
                sweep.pictures.len()
            )));
        }
    }
    Ok(manifest)
}
