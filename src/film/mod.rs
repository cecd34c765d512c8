//! Layers of an image and the files they go to: EXR (all layers) and PNG (beauty).
//!
//! A [`Film`] is a set of named f32 channels. The beauty is `R G B`; a layer `direct` is `direct.R
//! direct.G direct.B`; scalars such as `depth.Z`, `cluster.id`, `samples` stand under their full
//! name. Rows run from the top.

mod checksum;
mod exr;
pub mod layer;
mod order;
mod png;

pub use exr::{Precision, read_exr, read_header, read_whole_exr, write_exr};
pub use layer::{Channels, Layer, layer_of};
pub(crate) use png::write_png_bytes;
pub use png::{srgb8, write_png, write_png_rgb};

use std::collections::BTreeMap;

use crate::radiometry::Rgb;

/// Header attribute that is "false" for pictures that were ended before their time.
pub const COMPLETE: &str = "nearfar.complete";

/// Header attribute of films with running sums (layers `state.*`), which a render can go on from:
/// what they are sums of.
pub const SUMS_OF: &str = "nearfar.sums_of";

/// Named channels of equal size and what the header says of them.
#[derive(Clone, Debug, Default)]
pub struct Film {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Zero of layer `P` in the user's space, in which files have it.
    pub origin: glam::DVec3,
    /// Full channel name → values, row by row from the top.
    pub channels: BTreeMap<String, Vec<f32>>,
    /// Text attributes of the header (settings, seed, version, time).
    pub header: BTreeMap<String, String>,
}

fn channel(layer: &str, suffix: &str) -> String {
    if layer.is_empty() { suffix.to_owned() } else { format!("{layer}.{suffix}") }
}

impl Film {
    /// An empty film.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, ..Self::default() }
    }
    /// Sets a colour layer; `""` is the beauty. `values` holds width · height pixels.
    pub fn set_rgb(&mut self, layer: &str, values: &[Rgb]) {
        for (i, suffix) in ["R", "G", "B"].into_iter().enumerate() {
            self.channels.insert(channel(layer, suffix), values.iter().map(|c| c[i]).collect());
        }
    }
    /// Sets a vector layer with channels X, Y, Z.
    pub fn set_xyz(&mut self, layer: &str, values: &[glam::Vec3]) {
        for (i, suffix) in ["X", "Y", "Z"].into_iter().enumerate() {
            self.channels.insert(channel(layer, suffix), values.iter().map(|c| c[i]).collect());
        }
    }
    /// Makes layer `P` relative to another origin, where there are hits.
    pub fn rebase(&mut self, origin: glam::DVec3) {
        let by = self.origin - origin;
        self.origin = origin;
        let depth = self.channels.get("depth.Z").cloned();
        let hit = |i: usize| depth.as_ref().and_then(|d| d.get(i)).is_none_or(|z| z.is_finite());
        for (axis, suffix) in ["X", "Y", "Z"].into_iter().enumerate() {
            let values = self.channels.get_mut(&channel("P", suffix));
            for (_, value) in values.into_iter().flatten().enumerate().filter(|(i, _)| hit(*i)) {
                *value = (f64::from(*value) + by[axis]) as f32;
            }
        }
    }
    /// Sets one channel by its full name.
    pub fn set(&mut self, name: &str, values: Vec<f32>) {
        self.channels.insert(name.to_owned(), values);
    }
    /// Removes the running sums.
    pub fn forget_sums(&mut self) {
        self.channels.retain(|name, _| layer_of(name) != "state");
        self.header.remove(SUMS_OF);
    }
    /// A colour layer; `""` is the beauty.
    pub fn rgb(&self, layer: &str) -> Option<Vec<Rgb>> {
        self.triples(layer, ["R", "G", "B"])
    }
    /// A vector layer with channels X, Y, Z.
    pub fn xyz(&self, layer: &str) -> Option<Vec<glam::Vec3>> {
        self.triples(layer, ["X", "Y", "Z"])
    }
    fn triples(&self, layer: &str, suffixes: [&str; 3]) -> Option<Vec<glam::Vec3>> {
        let [a, b, c] = suffixes.map(|s| self.channels.get(&channel(layer, s)));
        Some(a?.iter().zip(b?).zip(c?).map(|((&a, &b), &c)| glam::Vec3::new(a, b, c)).collect())
    }
}
