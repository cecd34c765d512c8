//! Running sums in a film, so that a reference can go on later, and the key that says of what it
//! is.

use std::fmt::Write;

use super::PathSettings;
use super::pixels::{Pixel, SUMS, split};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::sampling::{PixelFilter, hash64};
use crate::shading::World;

/// Header attribute of the key.
pub(super) const KEY: &str = "nearfar.path_key";

/// A hash of everything that decides the value of a sample: scene, view, seed, path length rules.
/// Not how many samples are taken.
pub(super) fn fingerprint(world: &World, settings: &PathSettings, seed: u64) -> String {
    let mut h = Hasher(0x6e65_6172_6661_7221);
    if settings.filter != PixelFilter::default() {
        let _ = write!(h, "{:?}", settings.filter);
    }
    let g = &world.geometry;
    let _ = write!(
        h,
        "{seed} {} {} {:?} {:?}",
        settings.max_depth, settings.roulette_from, world.camera, g.materials
    );
    for v in g.positions.iter().chain(&g.normals) {
        v.to_array().into_iter().for_each(|x| h.word(u64::from(x.to_bits())));
    }
    g.uvs.iter().for_each(|v| h.word(u64::from(v.x.to_bits()) << 32 | u64::from(v.y.to_bits())));
    g.triangles.iter().flatten().chain(&g.material_of).for_each(|&i| h.word(u64::from(i)));
    for t in &g.textures {
        t.srgb.iter().for_each(|&[r, g, b]| h.word(u64::from(u32::from_le_bytes([r, g, b, 0]))));
        t.mask.iter().for_each(|&m| h.word(u64::from(m)));
        t.placement.numbers().iter().for_each(|x| h.word(u64::from(x.to_bits())));
    }
    world.lights.describe(&mut |text| {
        let _ = h.write_str(text);
    });
    format!("{:016x}", h.0)
}

struct Hasher(u64);

impl Hasher {
    fn word(&mut self, w: u64) {
        self.0 = hash64(self.0.rotate_left(5) ^ w).wrapping_add(0x9e37_79b9_7f4a_7c15);
    }
}

impl Write for Hasher {
    fn write_str(&mut self, s: &str) -> std::fmt::Result {
        s.bytes().for_each(|b| self.word(u64::from(b)));
        Ok(())
    }
}

/// Adds every sum as two channels: `state.NAME.high`, `state.NAME.low`.
pub(super) fn add_state(film: &mut Film, pixels: &[Pixel]) {
    for (i, name) in SUMS.iter().enumerate() {
        film.set(
            &format!("state.{name}.high"),
            pixels.iter().map(|p| split(p.sums[i]).0).collect(),
        );
        film.set(&format!("state.{name}.low"), pixels.iter().map(|p| split(p.sums[i]).1).collect());
    }
}

/// The sums that [`add_state`] wrote.
///
/// # Errors
/// [`Error::Usage`] when the film is not of this scene, size and seed, or has no sums.
pub(super) fn pixels_from(film: &Film, key: &str, width: u32, height: u32) -> Result<Vec<Pixel>> {
    let other = |what: &str| Error::Usage(format!("cannot resume: {what}; start a new file"));
    if (film.width, film.height) != (width, height) {
        return Err(other(&format!(
            "the file has {}×{} pixels, this render {width}×{height}",
            film.width, film.height
        )));
    }
    match film.header.get(KEY) {
        None => return Err(other("the file was not made by `nearfar reference`")),
        Some(k) if k != key => {
            return Err(other("the file shows another scene, camera, seed or path settings"));
        }
        Some(_) => {}
    }
    let channel = |name: &str| {
        film.channels.get(name).ok_or_else(|| {
            other(&format!("the file has no layer {name}: it was written without its running sums"))
        })
    };
    let mut pixels: Vec<Pixel> = channel("samples")?
        .iter()
        .map(|&n| Pixel { count: n as u32, ..Pixel::default() })
        .collect();
    for (i, name) in SUMS.iter().enumerate() {
        let (high, low) =
            (channel(&format!("state.{name}.high"))?, channel(&format!("state.{name}.low"))?);
        for (pixel, (&h, &l)) in pixels.iter_mut().zip(high.iter().zip(low)) {
            pixel.sums[i] = f64::from(h) + f64::from(l);
        }
    }
    Ok(pixels)
}
