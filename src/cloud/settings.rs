//! Knobs of the point-based method, by the names that RenderMan users know.

use super::Density;
use crate::error::{Error, Result};
use crate::settings::{choices, section};

choices! {
    /// What keeps surfaces behind one another from being counted twice.
    #[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
    pub enum Overlap default Raster {
        /// A raster of the hemisphere around every receiver, filled from near to far.
        Raster = "raster",
        /// The plain sum, in which every element counts by how much it is itself unoccluded;
        /// `accessibility_passes` passes.
        Bunnell = "bunnell",
        /// The plain sum.
        None = "none",
    }
}

choices! {
    /// How occlusion falls off with distance.
    #[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
    pub enum FalloffMode default Exponential {
        /// exp(−falloff · distance).
        Exponential = "exponential",
        /// (1 − distance / maxdist)^falloff; needs a finite `maxdist`.
        Polynomial = "polynomial",
    }
}

choices! {
    /// Which sides of elements are there.
    #[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
    pub enum HitSides default Both {
        /// Both.
        Both = "both",
        /// Those that normals face.
        Front = "front",
        /// The others.
        Back = "back",
    }
}

choices! {
    /// Where the light on the elements comes from.
    #[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
    pub enum RadiositySource default Bounces {
        /// Direct light and bounces gathered from the elements themselves.
        Bounces = "bounces",
        /// Direct light and the proxy's indirect light (photons and rays between cells): all
        /// bounces, by rays.
        Photon = "photon",
    }
}

section! {
    /// The point-based method: surface elements, baked and gathered.
    pub struct PointBasedSettings in "point_based", checked by together {
        /// Elements of the cloud.
        elements: u64 = 100_000, in from(1.0).to(400e6), unit "elements";
        /// Elements per unit of area; above zero it replaces `elements`.
        density: f64 = 0.0, unit "elements per scene unit²";
        /// Shadow rays per element and side when radiosity is baked.
        direct_samples: u32 = 8, in from(1.0).to(4096.0), unit "shadow rays";
        /// Where the light on the elements comes from.
        radiosity: RadiositySource = RadiositySource::Bounces;
        /// Bounces on the elements before the last one, at the receiver: 0 is direct light only.
        bounces: u32 = 4, in from(0.0).to(100.0), unit "bounces";
        /// Estimate the bounces after the last as a geometric series.
        tail: bool = true;
        /// Largest solid angle of a group of elements that is taken as one; 0 takes every element
        /// by itself.
        maxsolidangle: f32 = 0.05, in from(0.0).to(1.0), unit "steradians";
        /// Elements farther than this are not there.
        maxdist: f32 = f32::INFINITY, in above(0.0).or_inf(), unit "scene units";
        /// Strength of the fall-off of occlusion with distance; 0: none.
        falloff: f32 = 0.0, unit "1 / scene units, or a power";
        /// Its form.
        falloffmode: FalloffMode = FalloffMode::Exponential;
        /// Jitter of receivers in their plane.
        samplebase: f32 = 0.0, in from(0.0).to(1.0), unit "pixels";
        /// Largest error of occlusion that gathers at few places and interpolation between them may
        /// bring: places lie closer where occlusion bends more than this, light more than three
        /// times as much of itself, or surfaces are near. 0 gathers at every point; only with
        /// `overlap = "raster"`.
        maxvariation: f32 = 0.02, in from(0.0).to(1.0);
        /// Elements that rise less than this above the receiver's plane are not there.
        bias: f32 = 0.0, unit "scene units";
        /// Of the plain sums (`overlap` `none` and `bunnell`): occlusion above 1 is cut, and light
        /// with it.
        clamp: bool = true;
        /// Sides of elements that are there.
        hitsides: HitSides = HitSides::Both;
        /// Half angle of the cone that is looked into; 90 is the hemisphere.
        coneangle: f32 = 90.0, in from(0.001).to(90.0), unit "degrees";
        /// What is done about overlap.
        overlap: Overlap = Overlap::Raster;
        /// Cells along a side of the raster.
        microbufres: u32 = 16, in from(4.0).to(32.0), unit "cells";
        /// Passes of `overlap = "bunnell"`; 1 is halfway between the plain sum and the once
        /// corrected one.
        accessibility_passes: u32 = 1, in from(1.0).to(16.0), unit "passes";
    }
}

impl PointBasedSettings {
    fn together(&self) -> Result<()> {
        if self.falloffmode == FalloffMode::Polynomial
            && self.falloff > 0.0
            && self.maxdist.is_infinite()
        {
            return Err(Error::setting(
                "point_based.falloffmode",
                "\"polynomial\" needs a finite point_based.maxdist",
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
    fn polynomial_falloff() {
        let open = PointBasedSettings {
            falloff: 2.0,
            falloffmode: FalloffMode::Polynomial,
            ..PointBasedSettings::default()
        };
        assert!(open.validate().is_err());
        let closed = PointBasedSettings { maxdist: 4.0, ..open };
        assert!(closed.validate().is_ok() && (closed.weight(1.0) - 0.5625).abs() < 1e-6);
    }
}
