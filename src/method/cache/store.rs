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
use serde::{Deserialize, Serialize};

use super::record::CacheRecord;
use super::settings::CacheSettings;
use crate::error::{Error, Result};
use crate::method::key::Key;
use crate::method::ply;
use crate::method::stage::Inputs;
use crate::radiometry::Rgb;
use crate::scene::Fingerprint;

const VERSION: u32 = 3;

/// One line of the file.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Row {
    x: f32,
    y: f32,
    z: f32,
    nx: f32,
    ny: f32,
    nz: f32,
    irradiance_r: f32,
    irradiance_g: f32,
    irradiance_b: f32,
    axis_x: f32,
    axis_y: f32,
    axis_z: f32,
    radius_along: f32,
    radius_across: f32,
    clearance: f32,
    least_radius: f32,
    standard_error: f32,
    rotation_r_x: f32,
    rotation_r_y: f32,
    rotation_r_z: f32,
    rotation_g_x: f32,
    rotation_g_y: f32,
    rotation_g_z: f32,
    rotation_b_x: f32,
    rotation_b_y: f32,
    rotation_b_z: f32,
    translation_r_x: f32,
    translation_r_y: f32,
    translation_r_z: f32,
    translation_g_x: f32,
    translation_g_y: f32,
    translation_g_z: f32,
    translation_b_x: f32,
    translation_b_y: f32,
    translation_b_z: f32,
    corral: u32,
    red: u8,
    green: u8,
    blue: u8,
}

impl Row {
    fn new(r: &CacheRecord, scale: f32) -> Self {
        let [red, green, blue] = ply::colour(r.irradiance, scale);
        Self {
            x: r.p.x,
            y: r.p.y,
            z: r.p.z,
            nx: r.n.x,
            ny: r.n.y,
            nz: r.n.z,
            irradiance_r: r.irradiance[0],
            irradiance_g: r.irradiance[1],
            irradiance_b: r.irradiance[2],
            axis_x: r.axis.x,
            axis_y: r.axis.y,
            axis_z: r.axis.z,
            radius_along: r.radius[0],
            radius_across: r.radius[1],
            clearance: r.clearance,
            least_radius: r.floor,
            standard_error: r.standard_error,
            rotation_r_x: r.gradient_rotation[0].x,
            rotation_r_y: r.gradient_rotation[0].y,
            rotation_r_z: r.gradient_rotation[0].z,
            rotation_g_x: r.gradient_rotation[1].x,
            rotation_g_y: r.gradient_rotation[1].y,
            rotation_g_z: r.gradient_rotation[1].z,
            rotation_b_x: r.gradient_rotation[2].x,
            rotation_b_y: r.gradient_rotation[2].y,
            rotation_b_z: r.gradient_rotation[2].z,
            translation_r_x: r.gradient_translation[0].x,
            translation_r_y: r.gradient_translation[0].y,
            translation_r_z: r.gradient_translation[0].z,
            translation_g_x: r.gradient_translation[1].x,
            translation_g_y: r.gradient_translation[1].y,
            translation_g_z: r.gradient_translation[1].z,
            translation_b_x: r.gradient_translation[2].x,
            translation_b_y: r.gradient_translation[2].y,
            translation_b_z: r.gradient_translation[2].z,
            corral: r.corral,
            red,
            green,
            blue,
        }
    }

    fn record(&self) -> Option<CacheRecord> {
        let row = self;
        let record = CacheRecord {
            p: Vec3::new(row.x, row.y, row.z),
            n: Vec3::new(row.nx, row.ny, row.nz),
            irradiance: Rgb::new(row.irradiance_r, row.irradiance_g, row.irradiance_b),
            gradient_rotation: [
                Vec3::new(row.rotation_r_x, row.rotation_r_y, row.rotation_r_z),
                Vec3::new(row.rotation_g_x, row.rotation_g_y, row.rotation_g_z),
                Vec3::new(row.rotation_b_x, row.rotation_b_y, row.rotation_b_z),
            ],
            gradient_translation: [
                Vec3::new(row.translation_r_x, row.translation_r_y, row.translation_r_z),
                Vec3::new(row.translation_g_x, row.translation_g_y, row.translation_g_z),
                Vec3::new(row.translation_b_x, row.translation_b_y, row.translation_b_z),
            ],
            axis: Vec3::new(row.axis_x, row.axis_y, row.axis_z),
            radius: [row.radius_along, row.radius_across],
            clearance: row.clearance,
            floor: row.least_radius,
            corral: row.corral,
            standard_error: row.standard_error,
        };
        let gradients = record
            .gradient_rotation
            .iter()
            .chain(&record.gradient_translation)
            .all(|g| g.is_finite());
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
}

/// What a file of records belongs to: a scene, its proxy and the cache's settings; those of the
/// final pass are left out.
pub fn key(scene: Fingerprint, inputs: &Inputs<'_>, settings: &CacheSettings) -> Key {
    Key::new("irradiance cache", VERSION, scene)
        .with("cache", settings, &["reach", "extrapolation"])
        .with("proxy", inputs.photon, &[])
        .with_value("decompose.near_cell", inputs.near_cell)
}

/// Writes records, in order.
///
/// # Errors
/// [`Error::Io`] when the system refuses.
pub fn save(path: &Path, key: &Key, records: &[CacheRecord]) -> Result<()> {
    let scale = ply::colour_scale(records.iter().map(|r| r.irradiance));
    let rows: Vec<Row> = records.iter().map(|r| Row::new(r, scale)).collect();
    ply::write(path, key.comments(), rows)
}

/// Reads records that belong to `key`.
///
/// # Errors
/// [`Error::Input`] for files of something else, cut short, or with numbers that are no record.
pub fn load(path: &Path, key: &Key) -> Result<Vec<CacheRecord>> {
    let rows: Vec<Row> = ply::read(path, |comments| key.difference(comments))?;
    let bad = |i: usize| {
        Error::input(
            path,
            None,
            format!(
                "record {i} is damaged: a number is not finite or out of range; render without \
                 --load-cache"
            ),
        )
    };
    rows.iter().enumerate().map(|(i, row)| row.record().ok_or_else(|| bad(i))).collect()
}
