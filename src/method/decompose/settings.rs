//! Knobs of the decomposition: lengths follow alpha unless set.

use serde::{Deserialize, Serialize};

use super::NearNoise;
use crate::error::{Error, Result};
use crate::sh::MAX_BANDS;

/// A length: a number in scene units (`0.5`, `inf`), or a text in percent of the scene's diagonal
/// (`"2%"`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// Scene units.
    Units(f32),
    /// Percent of the scene's diagonal.
    PercentOfDiagonal(f32),
}

impl Length {
    /// In scene units.
    pub fn resolve(self, diagonal: f32) -> f32 {
        match self {
            Self::Units(v) => v,
            Self::PercentOfDiagonal(p) => p * 0.01 * diagonal,
        }
    }
}

impl std::str::FromStr for Length {
    type Err = String;
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let fail = || {
            format!(
                "\"{text}\" is not a length; write a number in scene units (0.5), \"inf\", or percent of the diagonal (\"2%\")"
            )
        };
        let (digits, percent) =
            text.trim().strip_suffix('%').map_or((text.trim(), false), |d| (d.trim(), true));
        let v: f32 = digits.parse().map_err(|_| fail())?;
        if v.is_nan() || v < 0.0 || (percent && v.is_infinite()) {
            return Err(fail());
        }
        Ok(if percent { Self::PercentOfDiagonal(v) } else { Self::Units(v) })
    }
}

impl Serialize for Length {
    fn serialize<S: serde::Serializer>(&self, s: S) -> std::result::Result<S::Ok, S::Error> {
        match self {
            Self::Units(v) => s.serialize_f32(*v),
            Self::PercentOfDiagonal(p) => s.serialize_str(&format!("{p}%")),
        }
    }
}

impl<'de> Deserialize<'de> for Length {
    fn deserialize<D: serde::Deserializer<'de>>(d: D) -> std::result::Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Raw {
            Number(f64),
            Text(String),
        }
        match Raw::deserialize(d)? {
            Raw::Number(v) => v.to_string().parse(),
            Raw::Text(t) => t.parse(),
        }
        .map_err(serde::de::Error::custom)
    }
}

/// What a far ray does at a hit that is near its origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NearHits {
    /// Count it with its own radiance and a tenth of the weight: whatever the fit says there is
    /// subtracted again.
    #[default]
    Damp,
    /// Pass through everything closer than alpha (the course's plain form).
    Ignore,
}

/// How the SH is integrated over a near cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NearIntegral {
    /// Closed form (up to 3 bands).
    #[default]
    Exact,
    /// A few random points per cell (the course's form; any number of bands).
    MonteCarlo,
}

/// Whether a near cell is seen from the point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NearVisibility {
    /// Every near cell that faces the point is visible (the course).
    Assumed,
    /// One ray to the cell's centroid.
    Traced,
    /// No sum over cells: `near_rays` cosine-distributed rays of length alpha find what is near and
    /// seen, as a difference against the SH.
    #[default]
    Rays,
    /// No near sum at all: the far field alone.
    Off,
}

/// One alpha for the picture, or one for each cluster.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AlphaMode {
    /// The same everywhere (the course).
    #[default]
    Single,
    /// Twice to half as much, following the distance of what surrounds the cluster; cluster radius
    /// and reach follow.
    Adaptive,
}

/// Settings of passes 2 and 3.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DecomposeSettings {
    /// Near/far distance.
    pub alpha: Length,
    /// One alpha, or one a cluster.
    pub alpha_mode: AlphaMode,
    /// With `alpha_mode = "adaptive"`: alpha over the harmonic mean distance of what a cluster
    /// sees.
    pub alpha_closeness: f32,
    /// Longest edge of a cell; default 0.7 alpha.
    pub near_cell: Option<Length>,
    /// Largest distance of a member from its cluster's centre; default a quarter of alpha.
    pub cluster_radius: Option<Length>,
    /// Reach of interpolation; default 2 cluster radii.
    pub blend_radius: Option<Length>,
    /// Reach within which clusters share their far hits; default 2 cluster radii, 0: none.
    pub pool_radius: Option<Length>,
    /// Cosine of the largest angle between a member's normal and its cluster's.
    pub cluster_normal_cos: f32,
    /// Power of the cosine between normals in the interpolation weight.
    pub blend_normal_power: f32,
    /// Whether a cluster must be seen by the points it serves.
    pub sight: bool,
    /// Every how many pixels (in x and y) a pixel's points take part in clustering.
    pub record_stride: u32,
    /// Rays per cluster.
    pub rays: u32,
    /// SH bands n (n² coefficients), 1..=5.
    pub sh_bands: u32,
    /// Ridge of the fit (squared Laplacian).
    pub ridge: f64,
    /// Rule for near hits of far rays.
    pub near_hits: NearHits,
    /// Integral of the SH over near cells.
    pub near_integral: NearIntegral,
    /// Points per near cell with `near_integral = "monte-carlo"`.
    pub near_samples: u32,
    /// Visibility of near cells.
    pub near_visibility: NearVisibility,
    /// Rays per shading point with `near_visibility = "rays"`.
    pub near_rays: u32,
    /// What their noise sticks to when the camera moves. `nearfar fly` takes `world` unless told
    /// otherwise.
    pub near_noise: NearNoise,
    /// Window radius of the filter over their noise, pixels; 0: off.
    pub near_filter: u32,
    /// Reach of the filter as a fraction of the mean distance to what is near.
    pub near_filter_reach: f32,
}

impl Default for DecomposeSettings {
    fn default() -> Self {
        Self {
            alpha: Length::PercentOfDiagonal(2.0),
            alpha_mode: AlphaMode::default(),
            alpha_closeness: 0.25,
            near_cell: None,
            cluster_radius: None,
            blend_radius: None,
            pool_radius: None,
            cluster_normal_cos: 0.7,
            blend_normal_power: 4.0,
            sight: true,
            record_stride: 2,
            rays: 384,
            sh_bands: 3,
            ridge: 1e-3,
            near_hits: NearHits::default(),
            near_integral: NearIntegral::default(),
            near_samples: 4,
            near_visibility: NearVisibility::default(),
            near_rays: 16,
            near_noise: NearNoise::default(),
            near_filter: 4,
            near_filter_reach: 0.12,
        }
    }
}

/// The lengths of one scene, scene units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lengths {
    /// Near/far distance; 0 and infinity are allowed.
    pub alpha: f32,
    /// Longest edge of a cell.
    pub near_cell: f32,
    /// Largest distance of a member from its cluster's centre.
    pub cluster_radius: f32,
    /// Reach of interpolation.
    pub blend_radius: f32,
    /// Reach of shared far hits.
    pub pool_radius: f32,
}

impl DecomposeSettings {
    /// # Errors
    /// [`Error::Setting`] for values out of range.
    pub fn validate(&self) -> Result<()> {
        let range = |key: &str, ok: bool, allowed: &str| {
            if ok { Ok(()) } else { Err(Error::setting(format!("decompose.{key}"), allowed)) }
        };
        range("sh_bands", (1..=MAX_BANDS as u32).contains(&self.sh_bands), "must be in 1..=5")?;
        range("rays", (1..=1_000_000).contains(&self.rays), "must be in 1..=1000000")?;
        range("record_stride", (1..=64).contains(&self.record_stride), "must be in 1..=64")?;
        range(
            "ridge",
            self.ridge.is_finite() && self.ridge >= 0.0,
            "must be finite and not negative",
        )?;
        range("near_samples", (1..=4096).contains(&self.near_samples), "must be in 1..=4096")?;
        range("near_filter", self.near_filter <= 64, "must be in 0..=64")?;
        range(
            "near_filter_reach",
            self.near_filter_reach > 0.0 && self.near_filter_reach.is_finite(),
            "must be positive",
        )?;
        range(
            "alpha_closeness",
            self.alpha_closeness > 0.0 && self.alpha_closeness.is_finite(),
            "must be positive",
        )?;
        range("near_rays", (1..=65_536).contains(&self.near_rays), "must be in 1..=65536")?;
        range(
            "cluster_normal_cos",
            (-1.0..=1.0).contains(&self.cluster_normal_cos),
            "must be in -1..=1",
        )?;
        range("blend_normal_power", self.blend_normal_power >= 0.0, "must not be negative")?;
        let exact = self.near_integral == NearIntegral::Exact && self.sums_cells();
        range(
            "near_integral",
            !exact || self.sh_bands <= 3,
            "\"exact\" integrates up to 3 bands; set decompose.sh_bands = 3 or decompose.near_integral = \"monte-carlo\"",
        )?;
        for (key, length) in [
            ("near_cell", self.near_cell),
            ("cluster_radius", self.cluster_radius),
            ("blend_radius", self.blend_radius),
        ] {
            let positive =
                length.is_none_or(|l| l.resolve(1.0) > 0.0 && l.resolve(1.0).is_finite());
            range(key, positive, "must be a positive, finite length")?;
        }
        Ok(())
    }

    /// Whether pass 3 sums over cells, and so needs the tree of them.
    pub fn sums_cells(&self) -> bool {
        matches!(self.near_visibility, NearVisibility::Assumed | NearVisibility::Traced)
    }

    /// The lengths in a scene of the given diagonal. Where alpha is 0 or infinite the others fall
    /// back to multiples of 1/50 of the diagonal.
    pub fn lengths(&self, diagonal: f32) -> Lengths {
        let alpha = self.alpha.resolve(diagonal);
        let base = if alpha > 0.0 && alpha.is_finite() { alpha } else { diagonal / 50.0 };
        let or = |l: Option<Length>, default: f32| l.map_or(default, |l| l.resolve(diagonal));
        let cluster_radius = or(self.cluster_radius, 0.25 * base);
        Lengths {
            alpha,
            near_cell: or(self.near_cell, 0.7 * base),
            cluster_radius,
            blend_radius: or(self.blend_radius, 2.0 * cluster_radius),
            pool_radius: or(self.pool_radius, 2.0 * cluster_radius),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_read_and_follow_alpha() {
        assert_eq!("2%".parse(), Ok(Length::PercentOfDiagonal(2.0)));
        assert_eq!("inf".parse(), Ok(Length::Units(f32::INFINITY)));
        for bad in ["", "-1", "nan", "x%", "inf%"] {
            assert!(bad.parse::<Length>().is_err(), "{bad}");
        }
        let l = DecomposeSettings {
            cluster_radius: Some(Length::Units(3.0)),
            ..DecomposeSettings::default()
        }
        .lengths(100.0);
        assert_eq!((l.alpha, l.near_cell, l.cluster_radius, l.blend_radius), (2.0, 1.4, 3.0, 6.0));
        let settings: DecomposeSettings =
            toml::from_str("alpha = \"4%\"\nnear_cell = 0.25").unwrap();
        assert_eq!(settings.near_cell, Some(Length::Units(0.25)));
        assert!(toml::from_str::<DecomposeSettings>("alfa = 1").is_err());
        let assumed = DecomposeSettings {
            near_visibility: NearVisibility::Assumed,
            ..DecomposeSettings::default()
        };
        assert!(DecomposeSettings { sh_bands: 4, ..assumed }.validate().is_err());
    }
}
