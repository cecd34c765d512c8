//! Knobs of the proxy.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// How indirect irradiance of a cell side comes from photons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Estimate {
    /// Photons counted per cell and side over the cell's exact area; cells with too few are merged
    /// with their neighbours.
    Cells,
    /// Cosine rays from every cell side that the picture can see to the others, solved as a linear
    /// system; the rest as `cells`.
    #[default]
    Gather,
    /// k nearest photons around the centroid over the area of surface that lies inside their
    /// sphere.
    Density,
}

/// Settings of photon tracing and of the radiosity made from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PhotonSettings {
    /// Paths emitted, 1 to 2³¹. Default 200 000: with `gather` they are a first guess; give `cells`
    /// and `density` 1 000 000. A path leaves about albedo/(1 − albedo) photons of 40 B.
    pub count: u32,
    /// Photons that an estimate should rest on, 2 to 10 000; relative noise about 1/√neighbours.
    /// Default 32.
    pub neighbours: u32,
    /// How photons become irradiance. Default `gather`.
    pub estimate: Estimate,
    /// Largest radius photons are sought in, as a fraction of the scene's diagonal, in (0, 1].
    /// Default 0.05. Where fewer photons lie within it the estimate is noisier, not darker.
    pub max_radius: f32,
    /// Cosine of the largest angle between normals that share photons, in \[0, 1). Default 0.7
    /// (45°).
    pub normal_agreement: f32,
    /// `density` only: divide by the surface area inside the sphere instead of by that of a disc.
    /// Default true.
    pub boundary_correction: bool,
    /// Shadow rays per cell side, 1 to 4096. Default 8. `gather` shoots one to sides that nothing
    /// reached.
    pub direct_samples: u32,
    /// `gather` only: rays per cell side, 1 to 4096, half as many for sides the picture sees only
    /// by way of others. Default 16.
    pub gather_rays: u32,
    /// `gather` only: rounds in which sides hit by the rays of others join in, 1 to 16. Default 3.
    pub gather_rounds: u32,
    /// `gather` only: most sweeps over the linear system, 1 to 1000; fewer are done when one
    /// changes less than 0.1 %. Default 16.
    pub gather_sweeps: u32,
}

impl Default for PhotonSettings {
    fn default() -> Self {
        Self {
            count: 200_000,
            neighbours: 32,
            estimate: Estimate::Gather,
            max_radius: 0.05,
            normal_agreement: 0.7,
            boundary_correction: true,
            direct_samples: 8,
            gather_rays: 16,
            gather_rounds: 3,
            gather_sweeps: 16,
        }
    }
}

impl PhotonSettings {
    /// # Errors
    /// [`Error::Setting`] for the first value out of its range.
    pub fn validate(&self) -> Result<()> {
        let ranges = [
            ("photon.count", f64::from(self.count), 1.0, 2_147_483_648.0),
            ("photon.neighbours", f64::from(self.neighbours), 2.0, 10_000.0),
            ("photon.max_radius", f64::from(self.max_radius), f64::from(f32::MIN_POSITIVE), 1.0),
            ("photon.normal_agreement", f64::from(self.normal_agreement), 0.0, 0.999),
            ("photon.direct_samples", f64::from(self.direct_samples), 1.0, 4096.0),
            ("photon.gather_rays", f64::from(self.gather_rays), 1.0, 4096.0),
            ("photon.gather_rounds", f64::from(self.gather_rounds), 1.0, 16.0),
            ("photon.gather_sweeps", f64::from(self.gather_sweeps), 1.0, 1000.0),
        ];
        match ranges.into_iter().find(|&(_, value, low, high)| !(low..=high).contains(&value)) {
            Some((key, value, low, high)) => {
                Err(Error::setting(key, format!("{value} is not between {low} and {high}")))
            }
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_and_unknown_keys() {
        assert!(PhotonSettings::default().validate().is_ok());
        for bad in [
            "count = 0",
            "neighbours = 1",
            "max_radius = nan",
            "max_radius = 0.0",
            "normal_agreement = 1.0",
            "direct_samples = 0",
        ] {
            assert!(toml::from_str::<PhotonSettings>(bad).unwrap().validate().is_err(), "{bad}");
        }
        assert!(toml::from_str::<PhotonSettings>("photons = 3").is_err());
        assert_eq!(
            toml::from_str::<PhotonSettings>("estimate = \"density\"").unwrap().estimate,
            Estimate::Density
        );
    }
}
