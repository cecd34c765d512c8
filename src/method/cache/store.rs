//! Records in a file: one binary little-endian PLY, element `vertex`, every number under its name;
//! viewers show it as coloured points.
//!
//! ```text
//! comment nearfar irradiance cache 2          and the rest of a crate::method::key
//! ```
//! A file of another scene, of other settings or of another version is refused, with the first
//! difference named; so are files that are cut short or hold numbers that are no record. Floats are
//! stored as they are: what is loaded is bit for bit what was saved.

use std::path::Path;

use glam::Vec3;

use super::record::CacheRecord;
use super::settings::CacheSettings;
use crate::error::{Error, Result};
use crate::method::key::Key;
use crate::method::stage::Inputs;
use crate::ply::{self, Columns};
use crate::scene::Fingerprint;
use crate::shading::World;

const VERSION: u32 = 3;

/// The numbers of a record: floats, then `corral` and the colour that viewers show.
fn columns() -> Columns {
    let triple = |name: &str, parts: [&str; 3]| parts.map(|part| format!("{name}_{part}"));
    let gradients = ["rotation", "translation"]
        .into_iter()
        .flat_map(|of| ["r", "g", "b"].map(|c| format!("{of}_{c}")))
        .flat_map(|name| triple(&name, ["x", "y", "z"]));
    Columns::new("vertex")
        .floats(["x", "y", "z", "nx", "ny", "nz"])
        .floats(triple("irradiance", ["r", "g", "b"]))
        .floats(triple("axis", ["x", "y", "z"]))
        .floats(["radius_along", "radius_across", "clearance", "least_radius", "standard_error"])
        .floats(gradients)
        .integers(["corral"])
        .bytes(["red", "green", "blue"])
}

/// The floats of a record, in the order of [`columns`].
fn floats(r: &CacheRecord) -> impl Iterator<Item = f32> {
    let numbers = [r.radius[0], r.radius[1], r.clearance, r.floor, r.standard_error];
    let gradients = r.gradient_rotation.iter().chain(&r.gradient_translation);
    [r.p, r.n, r.irradiance, r.axis]
        .into_iter()
        .flat_map(|v| v.to_array())
        .chain(numbers)
        .chain(gradients.flat_map(|g| g.to_array()).collect::<Vec<_>>())
}

/// The record of a row; none when a number is not finite or out of range.
fn record(v: &[f32], corral: u32) -> Option<CacheRecord> {
    let triple = |at: usize| Vec3::from_slice(&v[at..]);
    let record = CacheRecord {
        p: triple(0),
        n: triple(3),
        irradiance: triple(6),
        axis: triple(9),
        radius: [v[12], v[13]],
        clearance: v[14],
        floor: v[15],
        standard_error: v[16],
        gradient_rotation: [triple(17), triple(20), triple(23)],
        gradient_translation: [triple(26), triple(29), triple(32)],
        corral,
    };
    let gradients =
        record.gradient_rotation.iter().chain(&record.gradient_translation).all(|g| g.is_finite());
    let unit = |v: Vec3| (v.length() - 1.0).abs() < 1e-3;
    let positive = |v: f32| v.is_finite() && v > 0.0;
    let ok = record.p.is_finite()
        && gradients
        && unit(record.n)
        && unit(record.axis)
        && record.irradiance.is_finite()
        && record.irradiance.min_element() >= 0.0
        && positive(record.radius[0])
        && positive(record.radius[1])
        && positive(record.floor)
        && record.clearance.is_finite()
        && record.clearance >= 0.0;
    ok.then_some(record)
}

/// What a file of records belongs to: a scene, its proxy and the cache's settings; those of the
/// final pass are left out.
pub fn key(
    scene: Fingerprint,
    inputs: &Inputs<'_>,
    settings: &CacheSettings,
    world: &World,
) -> Key {
    Key::new("irradiance cache", VERSION, scene, world.around)
        .with("cache", settings, &["reach", "extrapolation"])
        .with("proxy", inputs.photon, &[])
        .with_value("decompose.near_cell", inputs.near_cell)
}

/// Writes records, in order.
///
/// # Errors
/// [`Error::Write`] when the system refuses.
pub fn save(path: &Path, key: &Key, records: &[CacheRecord]) -> Result<()> {
    let scale = ply::colour_scale(records.iter().map(|r| r.irradiance));
    ply::write(path, &key.comments(), &[(columns(), records.len())], |out| {
        for r in records {
            out.floats(floats(r))?;
            out.integer(r.corral)?;
            out.bytes(&ply::colour(r.irradiance, scale))?;
        }
        Ok(())
    })
}

/// Reads records that belong to `key`.
///
/// # Errors
/// [`Error::Input`] for files of something else, cut short, or with numbers that are no record.
pub fn load(path: &Path, key: &Key) -> Result<Vec<CacheRecord>> {
    let columns = columns();
    let read = ply::read_elements(path, |c| key.difference(c), std::slice::from_ref(&columns))?;
    let bad = |i: usize| {
        Error::input(
            path,
            None,
            format!(
                "record {i} is damaged: a number is not finite or out of range; \
                 render without the file and save it again"
            ),
        )
    };
    let rows = read.iter().flat_map(|rows| rows.iter(&columns)).enumerate();
    rows.map(|(i, (values, rest))| {
        let corral = u32::from_le_bytes([rest[0], rest[1], rest[2], rest[3]]);
        record(&values, corral).ok_or_else(|| bad(i))
    })
    .collect()
}
