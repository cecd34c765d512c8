//! What a proxy knows apart from the scene, as rows of numbers that a file can keep.
//!
//! A row is a cell with the light of its two sides, or a part of a place. Rows of cells stand in
//! the order that scene and piece size decide, so they say nothing of geometry:
//! [`super::Proxy::restore`] puts them back on the surfaces of the same scene.
//!
//! Guarantee  a row read back gives the same bits. Cost 53 B a cell, 69 B a part.

use glam::Vec3;

use super::cell_side::CellSide;
use super::places::{SavedPlaces, saved_bytes, saved_floats};
use super::radiosity::CellRadiosity;
use super::{Estimate, ProxySettings};
use crate::tessellate::Side;

/// Floats in a row of a cell.
const FLOATS: usize = 13;

/// The light of a proxy without its geometry.
#[derive(Clone, Debug, PartialEq)]
pub struct SavedProxy(pub(super) Saved);

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Saved {
    Cells(CellRadiosity),
    Places(SavedPlaces),
}

impl Default for SavedProxy {
    fn default() -> Self {
        Self(Saved::Places(SavedPlaces::default()))
    }
}

impl SavedProxy {
    /// What one row is called in a file.
    pub fn element(settings: &ProxySettings) -> &'static str {
        match settings.estimate() {
            Estimate::Places => "place_part",
            Estimate::Cells | Estimate::Gather | Estimate::Density => "cell",
        }
    }

    /// Names of the floats of a row. Of a cell: radiosity and indirect irradiance of front and
    /// back, W·m⁻², and the fraction that exists. Of a part: position and unit normal of one of
    /// its points, three lengths in scene units, direct and indirect irradiance, W·m⁻².
    pub fn floats(settings: &ProxySettings) -> Vec<String> {
        if settings.estimate() == Estimate::Places {
            return saved_floats();
        }
        let mut names = Vec::with_capacity(FLOATS);
        for quantity in ["radiosity", "indirect"] {
            for side in ["front", "back"] {
                names.extend(["r", "g", "b"].map(|c| format!("{quantity}_{side}_{c}")));
            }
        }
        names.push("coverage".into());
        names
    }

    /// Names of the bytes of a row. Of a cell: bit 0 says that the front was gathered, bit 1 the
    /// back. Of a part: the key of its place, and flags.
    pub fn bytes(settings: &ProxySettings) -> Vec<String> {
        match settings.estimate() {
            Estimate::Places => saved_bytes(),
            Estimate::Cells | Estimate::Gather | Estimate::Density => vec!["gathered".into()],
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        match &self.0 {
            Saved::Cells(known) => known.cells(),
            Saved::Places(known) => known.len(),
        }
    }
    /// True without rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All rows.
    pub fn rows(&self) -> Box<dyn Iterator<Item = (Vec<f32>, Vec<u8>)> + '_> {
        match &self.0 {
            Saved::Cells(known) => Box::new(rows_of_cells(known)),
            Saved::Places(known) => Box::new(known.rows()),
        }
    }

    /// From all rows of a proxy made with `settings`.
    ///
    /// # Errors
    /// The number of the first row whose numbers no proxy has.
    pub fn from_rows<'a>(
        rows: impl Iterator<Item = (Vec<f32>, &'a [u8])>,
        settings: &ProxySettings,
    ) -> std::result::Result<Self, usize> {
        Ok(Self(match settings.estimate() {
            Estimate::Places => Saved::Places(SavedPlaces::from_rows(rows)?),
            Estimate::Cells | Estimate::Gather | Estimate::Density => {
                Saved::Cells(cells_from_rows(rows, settings)?)
            }
        }))
    }
}

fn rows_of_cells(known: &CellRadiosity) -> impl Iterator<Item = (Vec<f32>, Vec<u8>)> + '_ {
    (0..known.cells() as u32).map(|cell| {
        let [front, back] = Side::BOTH.map(|side| CellSide::new(cell, side));
        let (b, e) = (&known.leaving, &known.indirect);
        let colours = [b[front.index()], b[back.index()], e[front.index()], e[back.index()]];
        let mut floats = vec![known.coverage(cell); FLOATS];
        for (to, colour) in floats.chunks_exact_mut(3).zip(colours) {
            to.copy_from_slice(&colour.to_array());
        }
        let bit = |side| u8::from(known.gathered(side));
        (floats, vec![bit(front) | bit(back) << 1])
    })
}

fn cells_from_rows<'a>(
    rows: impl Iterator<Item = (Vec<f32>, &'a [u8])>,
    settings: &ProxySettings,
) -> std::result::Result<CellRadiosity, usize> {
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
        if settings.estimate() == Estimate::Gather {
            known.gathered.extend([flags & 1 != 0, flags & 2 != 0]);
        }
    }
    if known.coverage.iter().all(|&c| c == 1.0) {
        known.coverage.clear();
    }
    Ok(known)
}
