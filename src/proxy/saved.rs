//! What a proxy knows apart from the scene, as rows of numbers that a file can keep.
//!
//! The rows stand in the order that scene and piece size decide, so they say nothing of geometry:
//! [`super::Proxy::restore`] puts them back on the surfaces of the same scene.
//!
//! Guarantee  a row read back gives the same bits. Cost 53 B a row.

use glam::Vec3;

use super::cell_side::CellSide;
use super::radiosity::CellRadiosity;
use super::{Estimate, ProxySettings};
use crate::tessellate::Side;

/// Floats in a row.
const FLOATS: usize = 13;

/// The light of a proxy without its geometry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SavedProxy(pub(super) CellRadiosity);

impl SavedProxy {
    /// What one row is called in a file.
    pub const ELEMENT: &'static str = "cell";
    /// Names of the bytes of a row: bit 0 says that the front was gathered, bit 1 the back.
    pub const BYTES: [&'static str; 1] = ["gathered"];

    /// Names of the floats of a row: radiosity and indirect irradiance of front and back, W·m⁻²,
    /// and the fraction that exists.
    pub fn floats() -> Vec<String> {
        let mut names = Vec::with_capacity(FLOATS);
        for quantity in ["radiosity", "indirect"] {
            for side in ["front", "back"] {
                names.extend(["r", "g", "b"].map(|c| format!("{quantity}_{side}_{c}")));
            }
        }
        names.push("coverage".into());
        names
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.0.cells()
    }
    /// True without rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All rows.
    pub fn rows(&self) -> impl Iterator<Item = ([f32; FLOATS], [u8; 1])> + '_ {
        (0..self.len() as u32).map(|cell| {
            let [front, back] = Side::BOTH.map(|side| CellSide::new(cell, side));
            let (b, e) = (&self.0.leaving, &self.0.indirect);
            let colours = [b[front.index()], b[back.index()], e[front.index()], e[back.index()]];
            let mut floats = [self.0.coverage(cell); FLOATS];
            for (to, colour) in floats.chunks_exact_mut(3).zip(colours) {
                to.copy_from_slice(&colour.to_array());
            }
            let bit = |side| u8::from(self.0.gathered(side));
            (floats, [bit(front) | bit(back) << 1])
        })
    }

    /// From all rows of a proxy made with `settings`.
    ///
    /// # Errors
    /// The number of the first row whose numbers no proxy has.
    pub fn from_rows<'a>(
        rows: impl Iterator<Item = (Vec<f32>, &'a [u8])>,
        settings: &ProxySettings,
    ) -> std::result::Result<Self, usize> {
        let mut known = CellRadiosity::default();
        for (i, (floats, bytes)) in rows.enumerate() {
            let [flags] = *bytes else { return Err(i) };
            let possible = |x: &f32| x.is_finite() && *x >= 0.0;
            if floats.len() != FLOATS || !floats.iter().all(possible) || flags > 3 {
                return Err(i);
            }
            let colour = |at: usize| Vec3::from_slice(&floats[at..]);
            known.leaving.extend([colour(0), colour(3)]);
            known.indirect.extend([colour(6), colour(9)]);
            known.coverage.push(floats[12]);
            if settings.estimate == Estimate::Gather {
                known.gathered.extend([flags & 1 != 0, flags & 2 != 0]);
            }
        }
        if known.coverage.iter().all(|&c| c == 1.0) {
            known.coverage.clear();
        }
        Ok(Self(known))
    }
}
