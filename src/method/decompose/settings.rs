//! Knobs of the decomposition: lengths follow alpha unless set.

use super::NearNoise;
use crate::error::{Error, Result};
use crate::length::Length;
use crate::proxy::{Estimate, ProxySettings};
use crate::settings::{choices, section};

choices! {
    /// What a far ray does at a hit that is near its origin.
    pub enum NearHits default Damp {
        /// Count it with its own radiance and a tenth of the weight: whatever the fit says there is
        /// subtracted again.
        Damp = "damp",
        /// Pass through everything closer than alpha (the course's plain form).
        Ignore = "ignore",
    }
}

choices! {
    /// How the SH is integrated over a near cell.
    pub enum NearIntegral default Exact {
        /// Closed form (up to 3 bands).
        Exact = "exact",
        /// A few random points per cell (the course's form; any number of bands).
        MonteCarlo = "monte-carlo",
    }
}

choices! {
    /// Whether a near cell is seen from the point.
    pub enum NearVisibility default Rays {
        /// Every near cell that faces the point is visible (the course).
        Assumed = "assumed",
        /// One ray to the cell's centroid.
        Traced = "traced",
        /// No sum over cells: `near_rays` cosine-distributed rays of length alpha find what is near
        /// and seen, as a difference against the SH.
        Rays = "rays",
        /// No near sum at all: the far field alone.
        Off = "off",
    }
}

choices! {
    /// One alpha for the picture, or one for each cluster.
    pub enum AlphaMode default Single {
        /// The same everywhere (the course).
        Single = "single",
        /// Twice to half as much, following the distance of what surrounds the cluster; cluster
        /// radius and reach follow.
        Adaptive = "adaptive",
    }
}

section! {
    /// Irradiance decomposition: passes 2 (clusters and their far field) and 3 (what is near).
    pub struct DecomposeSettings in "decompose", checked by together {
        /// Near/far distance; 0 makes everything far, inf everything near.
        alpha: Length = Length::Percent(2.0), in from(0.0).or_inf();
        /// One alpha, or one a cluster.
        alpha_mode: AlphaMode = AlphaMode::Single;
        /// With `alpha_mode = "adaptive"`: alpha over the harmonic mean distance of what a cluster
        /// sees.
        alpha_closeness: f32 = 0.25, in above(0.0);
        /// Longest edge of a cell.
        near_cell: Option<Length> = None, follows "0.7 decompose.alpha", in above(0.0);
        /// Largest distance of a member from its cluster's centre.
        cluster_radius: Option<Length> = None, follows "a quarter of decompose.alpha",
            in above(0.0);
        /// Reach of interpolation.
        blend_radius: Option<Length> = None, follows "2 decompose.cluster_radius", in above(0.0);
        /// Reach within which clusters share their far hits; 0: none.
        pool_radius: Option<Length> = None, follows "2 decompose.cluster_radius";
        /// Cosine of the largest angle between a member's normal and its cluster's.
        cluster_normal_cos: f32 = 0.7, in from(-1.0).to(1.0);
        /// Power of the cosine between normals in the interpolation weight.
        blend_normal_power: f32 = 4.0;
        /// Whether a cluster must be seen by the points it serves.
        sight: bool = true;
        /// Every how many pixels (in x and y) a pixel's points take part in clustering.
        record_stride: u32 = 2, in from(1.0).to(64.0), unit "pixels";
        /// Rays per cluster.
        rays: u32 = 384, in from(1.0).to(1_000_000.0), unit "rays";
        /// SH bands n (n² coefficients).
        sh_bands: u32 = 3, in from(1.0).to(5.0), unit "bands";
        /// Ridge of the fit (squared Laplacian).
        ridge: f64 = 1e-3;
        /// Rule for near hits of far rays.
        near_hits: NearHits = NearHits::Damp;
        /// Integral of the SH over near cells.
        near_integral: NearIntegral = NearIntegral::Exact;
        /// Points per near cell with `near_integral = "monte-carlo"`.
        near_samples: u32 = 4, in from(1.0).to(4096.0), unit "points";
        /// Visibility of near cells.
        near_visibility: NearVisibility = NearVisibility::Rays;
        /// Rays per shading point with `near_visibility = "rays"`.
        near_rays: u32 = 16, in from(1.0).to(65_536.0), unit "rays";
        /// What the noise of near rays sticks to when the camera moves.
        near_noise: Option<NearNoise> = None,
            follows "the command: world where nearfar fly shares work between frames, else point";
        /// Window radius of the filter over the noise of near rays; 0: off.
        near_filter: Option<u32> = None, follows "denoise: 4 without a denoiser, else 0",
            in from(0.0).to(64.0), unit "pixels";
        /// Reach of the filter as a fraction of the mean distance to what is near.
        near_filter_reach: f32 = 0.12, in above(0.0);
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
    fn together(&self) -> Result<()> {
        let exact = self.near_integral == NearIntegral::Exact && self.sums_cells();
        if exact && self.sh_bands > 3 {
            return Err(Error::setting(
                "decompose.near_integral",
                "\"exact\" integrates up to 3 bands; set decompose.sh_bands = 3 or \
                 decompose.near_integral = \"monte-carlo\"",
            ));
        }
        Ok(())
    }

    /// The window radius of the filter over near noise, pixels, where no denoiser follows.
    pub fn near_filter(&self) -> u32 {
        self.near_filter.unwrap_or(4)
    }

    /// What near noise sticks to in a picture by itself.
    pub fn near_noise(&self) -> NearNoise {
        self.near_noise.unwrap_or(NearNoise::Point)
    }

    /// Whether pass 3 sums over cells, and so needs the tree of them.
    pub fn sums_cells(&self) -> bool {
        matches!(self.near_visibility, NearVisibility::Assumed | NearVisibility::Traced)
    }

    /// Whether pass 3 finds in the proxy what it needs.
    ///
    /// # Errors
    /// [`Error::Setting`] where it sums over cells and the proxy has none.
    pub fn suits(&self, proxy: &ProxySettings) -> Result<()> {
        if self.sums_cells() && proxy.estimate() == Estimate::Places {
            return Err(Error::setting(
                "proxy.estimate",
                "\"places\" leaves no cells for decompose.near_visibility to sum over; set \
                 proxy.estimate = \"gather\", or decompose.near_visibility = \"rays\"",
            ));
        }
        Ok(())
    }

    /// The lengths in a world of the given extent. Where alpha is 0 or infinite the others fall
    /// back to multiples of 1/50 of the extent.
    pub fn lengths(&self, extent: f32) -> Lengths {
        let alpha = self.alpha.resolve(extent);
        let base = if alpha > 0.0 && alpha.is_finite() { alpha } else { extent / 50.0 };
        let or = |l: Option<Length>, default: f32| l.map_or(default, |l| l.resolve(extent));
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
    fn lengths_follow_alpha() {
        let l = DecomposeSettings {
            cluster_radius: Some(Length::Units(3.0)),
            ..DecomposeSettings::default()
        }
        .lengths(100.0);
        assert_eq!((l.alpha, l.near_cell, l.cluster_radius, l.blend_radius), (2.0, 1.4, 3.0, 6.0));
        let assumed = DecomposeSettings {
            near_visibility: NearVisibility::Assumed,
            ..DecomposeSettings::default()
        };
        assert!(DecomposeSettings { sh_bands: 4, ..assumed }.validate().is_err());
    }
}
