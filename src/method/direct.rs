//! `--method direct`: light that comes unscattered from sun, lamps and emitters; no sky, no
//! bounces.
//!
//! The same camera samples and shadow rays as the first pass of the decomposition; layers as there,
//! with zero irradiance.

use crate::error::Result;
use crate::method::locations::Locations;
use crate::method::{MethodStatistics, Rendered};
use crate::radiometry::Rgb;
use crate::record::{RecordSettings, camera_samples};
use crate::run::Run;
use crate::shading::{DirectSettings, World};

/// Renders direct light.
///
/// # Errors
/// For settings out of range, [`crate::error::Error::Interrupted`].
pub fn render(
    world: &World,
    record: &RecordSettings,
    direct: &DirectSettings,
    seed: u64,
    run: &Run,
) -> Result<Rendered> {
    record.validate()?;
    let samples = camera_samples(world, record, direct, seed, run)?;
    let none = vec![Rgb::ZERO; samples.points.len()];
    Ok(Rendered {
        film: samples.compose(&none),
        statistics: MethodStatistics::Direct {},
        locations: Locations::default(),
    })
}
