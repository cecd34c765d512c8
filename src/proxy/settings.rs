//! Knobs of the proxy.

use crate::length::Length;
use crate::settings::{choices, section};

choices! {
    /// How indirect irradiance of a cell side comes from photons.
    #[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
    pub enum Estimate default Places {
        /// Photons counted per cell and side over the cell's exact area; cells with too few are
        /// merged with their neighbours.
        Cells = "cells",
        /// Cosine rays from every cell side that the picture can see to the others, solved as a
        /// linear system; the rest as `cells`.
        Gather = "gather",
        /// k nearest photons around the centroid over the area of surface that lies inside their
        /// sphere.
        Density = "density",
        /// No photons, no cells: places where rays land, with the light that their own rays find.
        Places = "places",
    }
}

section! {
    /// The proxy: photons are traced, and the radiosity of small pieces of surface is made of them.
    pub struct ProxySettings in "proxy" {
        /// Paths emitted. With `gather` they are a first guess; give `cells` and `density`
        /// 1 000 000. A path leaves about albedo/(1 − albedo) photons of 40 B.
        photons: u32 = 200_000, in from(1.0).to(2_147_483_648.0), unit "paths";
        /// Photons that an estimate should rest on; relative noise about 1/√neighbours.
        neighbours: u32 = 32, in from(2.0).to(10_000.0), unit "photons";
        /// How indirect irradiance is found.
        estimate: Option<Estimate> = None,
            follows "places; gather for the method photon-map and where \
            decompose.near_visibility sums over cells";
        /// Largest radius photons are sought in. Where fewer photons lie within it the estimate is
        /// noisier, not darker.
        max_radius: Length = Length::Percent(5.0), in above(0.0);
        /// Cosine of the largest angle between normals that share photons; 0.7 is 45°.
        normal_agreement: f32 = 0.7, in from(0.0).to(0.999);
        /// Shadow rays per cell side; `gather` shoots one to sides that nothing reached. For places
        /// the most.
        direct_samples: u32 = 8, in from(1.0).to(4096.0), unit "shadow rays";
        /// Rays per cell side with `gather`, half as many for sides the picture sees only by way of
        /// others. With `places`, an eighth of it to four times as many, by need and noise.
        gather_rays: u32 = 16, in from(1.0).to(4096.0), unit "rays";
        /// `gather` only: rounds in which sides hit by the rays of others join in.
        gather_rounds: u32 = 3, in from(1.0).to(16.0), unit "rounds";
        /// `places` only: smallest size of a place.
        place_size: Option<Length> = None, follows "0.4 decompose.near_cell", in above(0.0);
        /// `places` only: size of a place over the length of the ray that landed there, where that
        /// is more than `place_size`.
        place_reach: f32 = 0.05, in from(0.0).to(1.0);
        /// `gather` only: most sweeps over the linear system; fewer are done when one changes less
        /// than 0.1 %.
        gather_sweeps: u32 = 16, in from(1.0).to(1000.0), unit "sweeps";
    }
}

impl ProxySettings {
    /// The estimate, where nothing that it follows asks for another.
    pub fn estimate(&self) -> Estimate {
        self.estimate.unwrap_or_default()
    }
}
