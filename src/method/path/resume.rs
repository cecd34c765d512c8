//! Running sums in a film, so that a reference can go on later, and the key that says of what it
//! is.

use std::fmt::Write;

use super::PathSettings;
use super::pixels::{Pixel, SUMS, split};
use crate::error::{Error, Result};
use crate::film::{Film, SUMS_OF};
use crate::sampling::{ENDLESS, PixelFilter, Words};
use crate::shading::World;

/// Header attribute that says of what a film's samples are.
pub const KEY: &str = "nearfar.path_key";
/// Version of the sums and of what the hash of the key runs over.
const VERSION: u32 = 2;

/// `VERSION-HASH-SEED`, where the hash is of everything else that decides the value of a sample:
/// scene, view, path length rules, ray backend; not how many samples are taken. Files that differ
/// by their seeds alone are independent samples of one picture.
pub(super) fn key(world: &World, settings: &PathSettings, seed: u64) -> String {
    let mut h = Words(0x6e65_6172_6661_7221);
    if settings.filter != PixelFilter::default() {
        let _ = write!(h, "{:?}", settings.filter);
    }
    let g = &world.geometry;
    let _ = write!(
        h,
        "{:?} {} {} {:?} {:?}",
        world.backend, settings.max_depth, settings.roulette_from, world.camera, g.materials
    );
    for v in g.positions.iter().chain(&g.normals) {
        h.floats(v.to_array());
    }
    g.uvs.iter().for_each(|v| h.add(u64::from(v.x.to_bits()) << 32 | u64::from(v.y.to_bits())));
    g.triangles.iter().flatten().chain(&g.material_of).for_each(|&i| h.add(u64::from(i)));
    for t in &g.textures {
        t.srgb.iter().for_each(|&[r, g, b]| h.add(u64::from(u32::from_le_bytes([r, g, b, 0]))));
        t.mask.iter().for_each(|&m| h.add(u64::from(m)));
        h.floats(t.placement.numbers());
    }
    world.lights.describe(&mut |text| {
        let _ = h.write_str(text);
    });
    format!("{VERSION}-{:016x}-{seed}", h.0)
}

/// In what two keys differ, in words.
pub(super) fn difference(there: &str, here: &str) -> &'static str {
    let parts = |key: &str| key.split('-').map(str::to_owned).collect::<Vec<String>>();
    let (there, here) = (parts(there), parts(here));
    if there.len() != here.len() || there[0] != here[0] {
        "the file was written by another version of this program"
    } else if there[1] == here[1] && there[2].contains('+') {
        "the file is merged of several seeds, and belongs to no single one"
    } else if there[1] == here[1] {
        "the file has another seed"
    } else {
        "the file shows another scene or camera, or has another ray backend or path settings"
    }
}

/// Adds every sum as two channels: `state.NAME.high`, `state.NAME.low`.
pub(super) fn add_state(film: &mut Film, pixels: &[Pixel]) {
    film.header.insert(SUMS_OF.into(), "path".into());
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
/// [`Error::Usage`] when the film is not of this scene, size, seed and backend, has no sums, or has
/// sums that no samples make.
pub(super) fn pixels_from(film: &Film, key: &str, width: u32, height: u32) -> Result<Vec<Pixel>> {
    let other = |what: &str| Error::Usage(format!("cannot resume: {what}; start a new file"));
    if (film.width, film.height) != (width, height) {
        return Err(other(&format!(
            "the file has {}×{} pixels, this render {width}×{height}",
            film.width, film.height
        )));
    }
    match film.header.get(KEY) {
        None => return Err(other("the file was not made by path tracing")),
        Some(there) if there != key => return Err(other(difference(there, key))),
        Some(_) => {}
    }
    let channel = |name: &str| {
        film.channels.get(name).ok_or_else(|| {
            other(&format!("the file has no layer {name}: it was written without its running sums"))
        })
    };
    let mut pixels = Vec::with_capacity(film.width as usize * film.height as usize);
    for &n in channel("samples")? {
        if !(0.0..=ENDLESS as f32).contains(&n) || n.fract() != 0.0 {
            return Err(other(&format!("the file is damaged: {n} samples in a pixel")));
        }
        pixels.push(Pixel { count: n as u32, ..Pixel::default() });
    }
    for (i, name) in SUMS.iter().enumerate() {
        let (high, low) =
            (channel(&format!("state.{name}.high"))?, channel(&format!("state.{name}.low"))?);
        for (pixel, (&h, &l)) in pixels.iter_mut().zip(high.iter().zip(low)) {
            pixel.sums[i] = f64::from(h) + f64::from(l);
        }
    }
    if pixels.iter().any(|p| !p.is_possible()) {
        return Err(other("the file is damaged: it has sums that no samples make"));
    }
    Ok(pixels)
}
