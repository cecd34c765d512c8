//! Knobs of the irradiance cache.
//!
//! `error` is the one for quality. Its meaning belongs to the mode; 0.1 is a good picture in all of
//! them, and half of it about doubles the records (`hessian`) or quadruples them (the others):
//!
//! | Mode | Reach of a record |
//! |---|---|
//! | `hessian` | r⁴ = 4 ε A / (π abs λ), ε = (0.03 · error)², A of `allocation` |
//! | `production-2006` | 5 · error · smallest distance |
//! | `split-sphere` | 2 · error · harmonic mean distance (Ward's a = 2 · error) |

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// How the reach of a record is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// From the curvature of the irradiance, by the occlusion-aware Hessian.
    #[default]
    Hessian,
    /// From the smallest distance, clamped by neighbours: the standard of production about 2006.
    #[serde(rename = "production-2006")]
    Production2006,
    /// From the harmonic mean distance, without gradients: the first irradiance cache.
    SplitSphere,
}

/// What `hessian` keeps equal between records.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Allocation {
    /// The error summed over the pixels that a record covers.
    #[default]
    Pixel,
    /// The error summed over the surface that a record covers.
    Area,
}

/// Settings of the irradiance cache.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CacheSettings {
    /// How the reach of a record is found.
    pub mode: Mode,
    /// Quality: smaller is better and dearer.
    pub error: f32,
    /// Rays per record.
    pub rays: u32,
    /// What `hessian` keeps equal between records.
    pub allocation: Allocation,
    /// Least reach of a record, pixels.
    pub min_spacing: f32,
    /// Greatest reach of a record, pixels.
    pub max_spacing: f32,
    /// Greatest reach of a record, share of the scene's diagonal.
    pub max_radius: f32,
    /// Greatest reach of a record in smallest distances, neighbours clamping one another, at
    /// `error` 0.1 (`hessian`); infinite for no limit.
    pub clearance: f32,
    /// Largest ratio of the axes of a record's ellipse, at least 1.
    pub aspect: f32,
    /// Largest angle between the normals of a record and of a point, degrees; shrinks with `error`
    /// below 0.1.
    pub angle: f32,
    /// Largest distance of a point from the plane midway between its own and the record's, share of
    /// the shorter radius (`hessian`).
    pub plane: f32,
    /// Reach in the final pass, times that of the fill: at least 1, overlaps records.
    pub reach: f32,
    /// An extrapolated value lies between the record's value over this and times this; more than 1.
    pub extrapolation: f32,
    /// Test rays towards points behind low occluders (`hessian`).
    pub leak_guard: bool,
}

impl Default for CacheSettings {
    fn default() -> Self {
        Self {
            mode: Mode::default(),
            error: 0.1,
            rays: 512,
            allocation: Allocation::default(),
            min_spacing: 1.5,
            max_spacing: 60.0,
            max_radius: 0.1,
            clearance: 0.5,
            aspect: 2.0,
            angle: 20.0,
            plane: 0.25,
            reach: 1.7,
            extrapolation: 1.5,
            leak_guard: true,
        }
    }
}

impl CacheSettings {
    /// # Errors
    /// [`Error::Setting`] for values out of range.
    pub fn validate(&self) -> Result<()> {
        let range = |key: &str, ok: bool, allowed: &str| {
            if ok { Ok(()) } else { Err(Error::setting(format!("cache.{key}"), allowed)) }
        };
        let positive = |v: f32| v.is_finite() && v > 0.0;
        range("rays", (1..=1 << 20).contains(&self.rays), "must be in 1..=1048576")?;
        range(
            "error",
            positive(self.error) && (1e-6..=1e3).contains(&self.error),
            "must be in 1e-6..=1000",
        )?;
        range(
            "min_spacing",
            self.min_spacing.is_finite() && self.min_spacing >= 0.01,
            "must be finite and at least 0.01 pixels",
        )?;
        range(
            "max_spacing",
            self.max_spacing >= self.min_spacing,
            "must be at least cache.min_spacing; \"inf\" for no limit",
        )?;
        range(
            "max_radius",
            positive(self.max_radius) && self.max_radius <= 1.0,
            "must be above 0 and at most 1",
        )?;
        range("clearance", self.clearance > 0.0, "must be above 0; inf for no limit")?;
        range("aspect", (1.0..=100.0).contains(&self.aspect), "must be in 1..=100")?;
        range(
            "angle",
            positive(self.angle) && self.angle <= 60.0,
            "must be above 0 and at most 60 degrees",
        )?;
        range("plane", positive(self.plane) && self.plane <= 1.0, "must be above 0 and at most 1")?;
        range("reach", (1.0..=4.0).contains(&self.reach), "must be in 1..=4")?;
        range("extrapolation", self.extrapolation > 1.0, "must be above 1; \"inf\" for no limit")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_ranges() {
        let s: CacheSettings =
            toml::from_str("mode = \"production-2006\"\nallocation = \"area\"").unwrap();
        assert_eq!((s.mode, s.allocation, s.rays), (Mode::Production2006, Allocation::Area, 512));
        for bad in [
            "error = 0.0",
            "rays = 0",
            "reach = 0.5",
            "aspect = 0.9",
            "angle = 90.0",
            "extrapolation = 1.0",
            "max_spacing = 1.0",
        ] {
            let error =
                toml::from_str::<CacheSettings>(bad).unwrap().validate().unwrap_err().to_string();
            assert!(error.contains(bad.split(' ').next().unwrap()), "{error}");
        }
        assert!(CacheSettings::default().validate().is_ok());
    }
}
