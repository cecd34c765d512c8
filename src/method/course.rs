//! `--method course`: irradiance decomposition as the course of 2007 writes it `[Course07]`.
//!
//! It is the default method's own code under other settings: [`as_written`] turns any settings into
//! the course's. So each difference below can be switched alone with `--method decomposition`, and
//! what is compared differs in nothing else. The slides, in their order:
//!
//! * **Near – far distinction.** All surfaces within alpha of the point are near. Code:
//!   [`NearHits::membership`], a step at alpha; triangles are near by their centre. The default
//!   fades membership out over the last quarter of alpha, for a step shows as an edge where a
//!   triangle becomes near.
//! * **Incident distant radiance, spherical harmonics.** Rays are shot from sparse places, the
//!   proxy (a photon map) is looked up where they hit, and the least-squares SH of what they find
//!   is kept. Code: [`sample`](fn@super::decompose::far::sample), [`crate::sh::Fit`].
//!   The photon map is a density estimate of the nearest photons, made once a triangle, at its
//!   centre, instead of again at every hit; the flux is divided by the area of surface it lies on,
//!   for a disc's area loses a seventh of the light of finely broken surfaces; direct light is
//!   added by shadow rays. The default lets the triangles that the picture sees gather from one
//!   another, for a density estimate blurs light over edges, and fits with a ridge and with the
//!   hits of neighbouring clusters, which takes noise away at the cost of no ray.
//! * **Interpolate these samples.** Code: [`FarField`](super::decompose::far::FarField), weights by
//!   distance and normal, as in irradiance caching. The default asks besides whether the point sees
//!   the cluster, for floors on both sides of a thin wall look alike.
//! * **The dot product.** The SH of the cosine after Ramamoorthi and Hanrahan. Code:
//!   [`ShRgb::irradiance`](crate::sh::ShRgb::irradiance); the default does the same.
//! * **Nearby geometry.** For each near triangle the energy of the SH that it covers is subtracted
//!   by Monte Carlo integration, and its own is added: radiosity from the proxy times the analytic
//!   form factor, all triangles assumed visible unless they face away. Code:
//!   [`CellSum`](super::decompose::near::cells::CellSum) with `near_integral = "monte-carlo"`. The
//!   default finds what is near by short rays, so that what hides what needs no assumption, and
//!   filters their noise.
//! * **Limitations.** Polygons only, a range search, one alpha, visibility assumed. The default
//!   has the first only where `near_visibility` sums over cells, and never the last.
//! * **Pass 1.** The visible surface places are saved, more coarsely than the picture. Code:
//!   [`crate::record`], `record_stride`; the default does the same.
//! * **Pass 2.** Hierarchical vector quantisation until no cluster is bigger than alpha: its radius
//!   is at most half of alpha. Random rays from random members; hits closer than alpha are ignored:
//!   rays begin there. Triangles are split until none is bigger than alpha. Code:
//!   [`cluster`](super::decompose::far::cluster), [`Bundle`](super::decompose::far::Bundle) with
//!   `near_hits = "ignore"`, [`crate::proxy`]. The default makes clusters of half that
//!   size and triangles of 0.7 alpha, and keeps near hits with a tenth of the weight: rays that
//!   pass through near walls find whatever lies behind them.
//! * **Pass 3.** SH are interpolated, near triangles located, the estimate updated. Code:
//!   [`pass3`](super::decompose::pass3); the default does the same.
//! * **Manually lit scene with local correction; simplify.** Methods of their own:
//!   [`super::local_correction`], and the hierarchy of discs.
//!
//! The failure case of the slides is darker than the truth where near surfaces hide one another;
//! `tests/course.rs` checks that it is so here, and that elsewhere the bias is small.

use super::decompose::{AlphaMode, DecomposeSettings, NearHits, NearIntegral, NearVisibility};
use crate::error::{Error, Result};
use crate::length::Length;
use crate::proxy::{Estimate, ProxySettings};

/// Sets a key to the course's value, `name` in words, if it had its default or that value.
fn fixed<T: PartialEq>(
    key: &str,
    given: &mut T,
    default: T,
    (course, name): (T, &str),
) -> Result<()> {
    if *given != default && *given != course {
        let allowed = format!("the method \"course\" has {name} here; leave it out");
        return Err(Error::setting(key, allowed));
    }
    *given = course;
    Ok(())
}

/// The given settings as the course has them, in a world of the given extent.
///
/// Keys that the course decides are set; where they had a value that is neither the default nor the
/// course's they are refused. Cells and clusters larger than the course allows are cut down to
/// alpha. All other keys (`alpha`, `rays`, `sh_bands`, `near_samples`, `proxy.photons`, …) stay
/// free.
///
/// # Errors
/// [`Error::Setting`] for keys that contradict the course.
pub fn as_written(
    decompose: &DecomposeSettings,
    photon: &ProxySettings,
    extent: f32,
) -> Result<(DecomposeSettings, ProxySettings)> {
    let (mut d, mut p) = (decompose.clone(), photon.clone());
    let default = DecomposeSettings::default();
    // The sum over cells, which is the course's, asks for this by itself.
    if p.estimate == Some(Estimate::Gather) {
        p.estimate = None;
    }
    let estimate = (Some(Estimate::Density), "\"density\"");
    fixed("proxy.estimate", &mut p.estimate, ProxySettings::default().estimate, estimate)?;
    let single = (AlphaMode::Single, "\"single\"");
    fixed("decompose.alpha_mode", &mut d.alpha_mode, default.alpha_mode, single)?;
    let ignore = (NearHits::Ignore, "\"ignore\"");
    fixed("decompose.near_hits", &mut d.near_hits, default.near_hits, ignore)?;
    let points = (NearIntegral::MonteCarlo, "\"monte-carlo\"");
    fixed("decompose.near_integral", &mut d.near_integral, default.near_integral, points)?;
    let assumed = (NearVisibility::Assumed, "\"assumed\"");
    fixed("decompose.near_visibility", &mut d.near_visibility, default.near_visibility, assumed)?;
    fixed("decompose.ridge", &mut d.ridge, default.ridge, (0.0, "0"))?;
    fixed("decompose.sight", &mut d.sight, default.sight, (false, "false"))?;
    fixed("decompose.near_filter", &mut d.near_filter, default.near_filter, (Some(0), "0"))?;
    let none = (Some(Length::Units(0.0)), "0");
    fixed("decompose.pool_radius", &mut d.pool_radius, default.pool_radius, none)?;

    let alpha = d.alpha.resolve(extent);
    let alpha = if alpha > 0.0 && alpha.is_finite() { alpha } else { extent / 50.0 };
    let at_most = |length: Option<Length>, most: f32| {
        Some(Length::Units(length.map_or(most, |l| l.resolve(extent).min(most))))
    };
    d.near_cell = at_most(d.near_cell, alpha);
    d.cluster_radius = at_most(d.cluster_radius, 0.5 * alpha);
    d.validate()?;
    Ok((d, p))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_step_is_the_courses_and_contradictions_are_named() {
        let (photon, extent) = (ProxySettings::default(), 50.0);
        let settings = DecomposeSettings {
            near_cell: Some(Length::Units(9.0)),
            cluster_radius: Some(Length::Units(0.1)),
            rays: 77,
            ..DecomposeSettings::default()
        };
        let (d, p) = as_written(&settings, &photon, extent).unwrap();
        let lengths = d.lengths(extent);
        assert_eq!((lengths.alpha, lengths.near_cell, lengths.pool_radius), (1.0, 1.0, 0.0));
        assert_eq!((lengths.cluster_radius, d.rays, d.ridge, d.sight), (0.1, 77, 0.0, false));
        assert_eq!((d.near_hits, d.near_filter), (NearHits::Ignore, Some(0)));
        assert_eq!(p.estimate(), Estimate::Density);
        assert_eq!(
            as_written(&d, &p, extent).unwrap().0.lengths(extent),
            lengths,
            "the course's settings are the course's"
        );
        let refused = |d: DecomposeSettings, p: ProxySettings| {
            as_written(&d, &p, extent).unwrap_err().to_string()
        };
        let cells = ProxySettings { estimate: Some(Estimate::Cells), ..photon.clone() };
        assert!(refused(settings.clone(), cells).contains("proxy.estimate"));
        for (key, d) in [
            ("ridge", DecomposeSettings { ridge: 0.5, ..settings.clone() }),
            (
                "near_visibility",
                DecomposeSettings { near_visibility: NearVisibility::Traced, ..settings.clone() },
            ),
            (
                "alpha_mode",
                DecomposeSettings { alpha_mode: AlphaMode::Adaptive, ..settings.clone() },
            ),
            (
                "pool_radius",
                DecomposeSettings { pool_radius: Some(Length::Units(1.0)), ..settings.clone() },
            ),
        ] {
            assert!(refused(d, photon.clone()).contains(&format!("decompose.{key}")), "{key}");
        }
    }
}
