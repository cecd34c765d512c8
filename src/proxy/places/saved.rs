//! What a file keeps of places: a row for each part, in their order.

use glam::Vec3;

use super::{Light, Part, Place, Places};
use crate::radiometry::Rgb;

/// Floats in a row.
const FLOATS: usize = 18;
/// The key of the place, flags, and the number of the need, low bytes first.
const BYTES: usize = 13;
/// The part is the first of its place.
const FIRST: u8 = 1;
/// The part holds what lies between its heights; without it, all of its place.
const SHARED: u8 = 2;
/// The place has one part, and nothing divides it.
const CLEAR: u8 = 4;
/// Landings on the part ask for direct light themselves.
const EDGE: u8 = 8;

/// Names of the floats of a row.
pub(in crate::proxy) fn floats() -> Vec<String> {
    let mut names: Vec<String> =
        ["x", "y", "z", "nx", "ny", "nz", "size", "low", "high"].map(String::from).into();
    for quantity in ["direct", "emitted", "indirect"] {
        names.extend(["r", "g", "b"].map(|c| format!("{quantity}_{c}")));
    }
    names
}

/// Names of the bytes of a row.
pub(in crate::proxy) fn bytes() -> Vec<String> {
    (0..8)
        .map(|i| format!("key_{i}"))
        .chain(["flags".to_owned()])
        .chain((0..4).map(|i| format!("need_{i}")))
        .collect()
}

/// Places without the scene that they belong to.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::proxy) struct SavedPlaces {
    rows: Vec<([f32; FLOATS], [u8; BYTES])>,
}

impl SavedPlaces {
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    pub fn rows(&self) -> impl Iterator<Item = (Vec<f32>, Vec<u8>)> + '_ {
        self.rows.iter().map(|(floats, bytes)| (floats.to_vec(), bytes.to_vec()))
    }

    /// # Errors
    /// The number of the first row that no part has.
    pub fn from_rows<'a>(
        rows: impl Iterator<Item = (Vec<f32>, &'a [u8])>,
    ) -> std::result::Result<Self, usize> {
        let mut out = Self::default();
        for (i, (floats, bytes)) in rows.enumerate() {
            let floats: [f32; FLOATS] = floats.try_into().map_err(|_| i)?;
            let bytes: [u8; BYTES] = bytes.try_into().map_err(|_| i)?;
            let lit = floats[9..].iter().all(|&x| x >= 0.0);
            let unit = (Vec3::from_slice(&floats[3..]).length() - 1.0).abs() < 1e-3;
            let flags = bytes[8];
            let begun = i > 0 || flags & FIRST != 0;
            if !floats.iter().all(|x| x.is_finite()) || !lit || !unit || !begun || flags > 15 {
                return Err(i);
            }
            out.rows.push((floats, bytes));
        }
        Ok(out)
    }
}

impl Places {
    pub fn saved(&self) -> SavedPlaces {
        let mut places: Vec<(u64, Place)> = self.index.iter().map(|(&k, &p)| (k, p)).collect();
        places.sort_unstable_by_key(|(_, place)| place.first);
        let row = |key: u64, place: &Place, i: u32| {
            let (part, light) = (&self.parts[i as usize], &self.lights[i as usize]);
            let shared = part.is_shared();
            let heights = if shared { part.heights } else { [0.0; 2] };
            let mut floats = [0.0; FLOATS];
            floats[..3].copy_from_slice(&part.p.to_array());
            floats[3..6].copy_from_slice(&part.ng.to_array());
            floats[6..9].copy_from_slice(&[part.size, heights[0], heights[1]]);
            floats[9..12].copy_from_slice(&light.direct.to_array());
            floats[12..15].copy_from_slice(&light.emitted.to_array());
            floats[15..].copy_from_slice(&light.indirect.to_array());
            let mut bytes = [0; BYTES];
            bytes[..8].copy_from_slice(&key.to_le_bytes());
            let first = if i == place.first { FIRST } else { 0 };
            let clear = if place.clear { CLEAR } else { 0 };
            let edge = if part.edge { EDGE } else { 0 };
            bytes[8] = first | clear | edge | if shared { SHARED } else { 0 };
            bytes[9..].copy_from_slice(&part.need.to_le_bytes());
            (floats, bytes)
        };
        let parts = |(key, place): &(u64, Place)| {
            let (key, place) = (*key, *place);
            let all = place.first..place.first + u32::from(place.parts);
            all.map(move |i| row(key, &place, i))
        };
        SavedPlaces { rows: places.iter().flat_map(parts).collect() }
    }

    /// Takes over what was saved, in place of all there is.
    pub fn restore(&mut self, saved: &SavedPlaces) {
        self.index.clear();
        self.parts.clear();
        self.lights.clear();
        let mut key = 0;
        for (f, bytes) in &saved.rows {
            let flags = bytes[8];
            let shared = flags & SHARED != 0;
            let first = self.parts.len() as u32;
            if flags & FIRST != 0 {
                key = u64::from_le_bytes(std::array::from_fn(|i| bytes[i]));
                let clear = flags & CLEAR != 0;
                self.index.insert(key, Place { first, parts: 1, clear, whole: clear && !shared });
            } else if let Some(place) = self.index.get_mut(&key) {
                place.parts += 1;
            }
            let heights = if shared { [f[7], f[8]] } else { [f32::NEG_INFINITY, f32::INFINITY] };
            let (p, ng) = (Vec3::from_slice(f), Vec3::from_slice(&f[3..]));
            let need = u32::from_le_bytes(std::array::from_fn(|i| bytes[9 + i]));
            self.needs = self.needs.max(need.saturating_add(1));
            let edge = flags & EDGE != 0;
            self.parts.push(Part { p, ng, size: f[6], heights, need, edge });
            let colour = |at: usize| Rgb::from_slice(&f[at..]);
            let [direct, emitted, indirect] = [9, 12, 15].map(colour);
            self.lights.push(Light { direct, emitted, indirect });
        }
    }
}
