//! Knobs of the point-based method, by the names that RenderMan users know.

use serde::{Deserialize, Serialize};

use super::Density;
use crate::error::{Error, Result};

/// What keeps surfaces behind one another from being counted twice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Overlap {
    /// A raster of the hemisphere around every receiver, filled from near to far.
    #[default]
    Raster,
    /// The plain sum, in which every element counts by how much it is itself unoccluded;
    /// `accessibility_passes` passes.
    Bunnell,
    /// The plain sum.
    None,
}

/// How occlusion falls off with distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum FalloffMode {
    /// exp(−falloff · distance).
    #[default]
    Exponential,
    /// (1 − distance / maxdist)^falloff; needs a finite `maxdist`.
    Polynomial,
}

/// Which sides of elements are there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum HitSides {
    /// Both.
    #[default]
    Both,
    /// Those that normals face.
    Front,
    /// The others.
    Back,
}

/// Where the light on the elements comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum RadiositySource {
    /// Direct light and bounces gathered from the elements themselves.
    #[default]
    Bounces,
    /// Direct light and the proxy's indirect light (photons and rays between cells): all bounces,
    /// by rays.
    Photon,
}

/// Settings of baking and gathering. Distances in scene units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PointsSettings {
    /// Elements of the cloud, 1 to 400 000 000. Default 100 000.
    pub elements: u64,
    /// Elements per unit of area; above zero it replaces `elements`. Default 0.
    pub density: f64,
    /// Shadow rays per element and side when radiosity is baked, 1 to 4096. Default 8.
    pub direct_samples: u32,
    /// Where the light on the elements comes from. Default `bounces`.
    pub radiosity: RadiositySource,
    /// Bounces on the elements before the last one, at the receiver: 0 is direct light only, up to
    /// 100. Default 4.
    pub bounces: u32,
    /// Estimate the bounces after the last as a geometric series. Default true.
    pub tail: bool,
    /// Only true: the gather knows no rays (`--method gather` does).
    pub pointbased: bool,
    /// Largest solid angle of a group of elements that is taken as one, steradians, 0 to 1; 0 takes
    /// every element by itself. Default 0.05.
    pub maxsolidangle: f32,
    /// Elements farther than this are not there. Default infinite.
    pub maxdist: f32,
    /// Strength of the fall-off of occlusion with distance, not negative. Default 0: none.
    pub falloff: f32,
    /// Its form. Default `exponential`.
    pub falloffmode: FalloffMode,
    /// Jitter of receivers in their plane, as a fraction of the pixel, 0 to 1. Default 0.
    pub samplebase: f32,
    /// Largest error of occlusion that gathers at few places and interpolation between them may
    /// bring, 0 to 1: places lie closer where occlusion bends more than this, light more than three
    /// times as much of itself, or surfaces are near. 0 gathers at every point; only with `overlap
    /// = "raster"`. Default 0.02.
    pub maxvariation: f32,
    /// Elements that rise less than this above the receiver's plane are not there. Default 0.
    pub bias: f32,
    /// Of the plain sums (`overlap` `none` and `bunnell`): occlusion above 1 is cut, and light with
    /// it. Default true.
    pub clamp: bool,
    /// Sides of elements that are there. Default `both`.
    pub hitsides: HitSides,
    /// Half angle of the cone that is looked into, degrees above 0 to 90. Default 90: the
    /// hemisphere.
    pub coneangle: f32,
    /// What is done about overlap. Default `raster`.
    pub overlap: Overlap,
    /// Cells along a side of the raster, 4 to 32. Default 16.
    pub microbufres: u32,
    /// Passes of `overlap = "bunnell"`, 1 to 16. Default 1: halfway between the plain sum and the
    /// once corrected one.
    pub accessibility_passes: u32,
}

impl Default for PointsSettings {
    fn default() -> Self {
        Self {
            elements: 100_000,
            density: 0.0,
            direct_samples: 8,
            radiosity: RadiositySource::Bounces,
            bounces: 4,
            tail: true,
            pointbased: true,
            maxsolidangle: 0.05,
            maxdist: f32::INFINITY,
            falloff: 0.0,
            falloffmode: FalloffMode::Exponential,
            samplebase: 0.0,
            maxvariation: 0.02,
            bias: 0.0,
            clamp: true,
            hitsides: HitSides::Both,
            coneangle: 90.0,
            overlap: Overlap::Raster,
            microbufres: 16,
            accessibility_passes: 1,
        }
    }
}

impl PointsSettings {
    /// # Errors
    /// [`Error::Setting`] for the first value out of its range.
    pub fn validate(&self) -> Result<()> {
        let big = f64::from(f32::MAX);
        let ranges = [
            ("elements", self.elements as f64, 1.0, 400e6),
            ("density", self.density, 0.0, 1e30),
            ("direct_samples", f64::from(self.direct_samples), 1.0, 4096.0),
            ("bounces", f64::from(self.bounces), 0.0, 100.0),
            ("maxsolidangle", f64::from(self.maxsolidangle), 0.0, 1.0),
            ("maxdist", f64::from(self.maxdist), f64::MIN_POSITIVE, f64::INFINITY),
            ("falloff", f64::from(self.falloff), 0.0, big),
            ("samplebase", f64::from(self.samplebase), 0.0, 1.0),
            ("maxvariation", f64::from(self.maxvariation), 0.0, 1.0),
            ("bias", f64::from(self.bias), 0.0, big),
            ("coneangle", f64::from(self.coneangle), 1e-3, 90.0),
            ("microbufres", f64::from(self.microbufres), 4.0, 32.0),
            ("accessibility_passes", f64::from(self.accessibility_passes), 1.0, 16.0),
        ];
        if let Some((key, value, low, high)) =
            ranges.into_iter().find(|&(_, value, low, high)| !(low..=high).contains(&value))
        {
            return Err(Error::setting(
                format!("points.{key}"),
                format!("{value} is not between {low} and {high}"),
            ));
        }
        if !self.pointbased {
            return Err(Error::setting(
                "points.pointbased",
                "this method knows no rays: use --method gather, or nearfar cloud gather --traced",
            ));
        }
        if self.falloffmode == FalloffMode::Polynomial
            && self.falloff > 0.0
            && self.maxdist.is_infinite()
        {
            return Err(Error::setting(
                "points.falloffmode",
                "\"polynomial\" needs a finite points.maxdist",
            ));
        }
        Ok(())
    }

    /// How fine to dice.
    pub fn dicing(&self) -> Density {
        if self.density > 0.0 {
            Density::PerArea(self.density)
        } else {
            Density::Elements(self.elements)
        }
    }

    /// Weight of occlusion at a distance.
    pub fn weight(&self, distance: f32) -> f32 {
        if self.falloff == 0.0 {
            return 1.0;
        }
        match self.falloffmode {
            FalloffMode::Exponential => (-self.falloff * distance).exp(),
            FalloffMode::Polynomial => (1.0 - distance / self.maxdist).max(0.0).powf(self.falloff),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_and_unknown_keys() {
        assert!(PointsSettings::default().validate().is_ok());
        for bad in [
            "elements = 0",
            "maxsolidangle = 2.0",
            "maxdist = 0.0",
            "falloff = nan",
            "coneangle = 91.0",
            "pointbased = false",
            "microbufres = 64",
            "falloff = 1.0\nfalloffmode = \"polynomial\"",
        ] {
            assert!(toml::from_str::<PointsSettings>(bad).unwrap().validate().is_err(), "{bad}");
        }
        assert!(toml::from_str::<PointsSettings>("max_solid_angle = 3").is_err());
        let s: PointsSettings = toml::from_str(
            "falloff = 2.0\nfalloffmode = \"polynomial\"\nmaxdist = 4.0\n\
                 hitsides = \"front\"\noverlap = \"bunnell\"",
        )
        .unwrap();
        assert!(
            s.validate().is_ok()
                && (s.weight(1.0) - 0.5625).abs() < 1e-6
                && s.hitsides == HitSides::Front
        );
    }
}
