//! The finished picture denoised, by a library that is opened at run time.
//!
//! Input   a film with the beauty and, where the method has them, `albedo` and `N`. Output  the same film: beauty denoised, the beauty as it was in layer
//!         `noisy`, and what belongs to it (`half0`, `half1`, `variance`) under `noisy` too.
//! Cost    see [`crate::ffi::oidn`]. Phase `denoise`.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::ffi::oidn::{Denoiser, Input};
use crate::film::Film;
use crate::radiometry::Rgb;
use crate::run::Run;

/// What removes noise from the finished picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Denoise {
    /// Nothing.
    #[default]
    None,
    /// Open Image Denoise 2, where the system or NEARFAR_OIDN has it.
    Oidn,
}

impl Denoise {
    /// Opens the library, if one is asked for; before the render, so that a missing one is told at once.
    ///
    /// # Errors
    /// As [`Denoiser::open`].
    pub fn open(self, run: &Run) -> Result<Option<Denoiser>> {
        match self {
            Self::None => Ok(None),
            Self::Oidn => Denoiser::open(run.threads()).map(Some),
        }
    }
}

/// Denoises the beauty.
///
/// # Errors
/// As [`Denoiser::denoise`].
pub fn denoise(film: &mut Film, denoiser: &Denoiser, run: &Run) -> Result<()> {
    let _phase = run.phase("denoise", 1);
    let vectors = |a: &str, b: &str, c: &str| -> Option<Vec<Rgb>> {
        let [x, y, z] = [a, b, c].map(|n| film.channels.get(n));
        Some(x?.iter().zip(y?).zip(z?).map(|((&x, &y), &z)| Rgb::new(x, y, z)).collect())
    };
    let Some(noisy) = film.rgb("") else { return Ok(()) };
    let (albedo, normal) = (film.rgb("albedo"), vectors("N.X", "N.Y", "N.Z"));
    let what = std::env::var("WHAT").unwrap_or_else(|_| "beauty".into());
    let clean = std::env::var("CLEAN").is_ok();
    let aux = std::env::var("NOAUX").is_err();
    let (width, height) = (film.width as usize, film.height as usize);
    let one = |color: &[Rgb], demodulated: bool| {
        let albedo = albedo.as_deref().filter(|_| aux);
        let white = vec![Rgb::ONE; color.len()];
        let albedo = if demodulated { Some(&white[..]) } else { albedo };
        denoiser.denoise(&Input { width, height, color, albedo, normal: normal.as_deref(), clean })
    };
    let layer = |n: &str| film.rgb(n).unwrap();
    let sum = |parts: [&[Rgb]; 3]| -> Vec<Rgb> { (0..noisy.len()).map(|i| parts.iter().map(|p| p[i]).sum()).collect() };
    let beauty = match what.as_str() {
        "beauty" => one(&noisy, false)?,
        "indirect" => sum([&layer("emission"), &layer("direct"), &one(&layer("indirect"), false)?]),
        "direct" => sum([&layer("emission"), &one(&layer("direct"), false)?, &layer("indirect")]),
        "both" => sum([&layer("emission"), &one(&layer("direct"), false)?, &one(&layer("indirect"), false)?]),
        "reflected" => {
            let r: Vec<Rgb> = layer("direct").iter().zip(&layer("indirect")).map(|(a, b)| *a + *b).collect();
            let r = one(&r, false)?;
            sum([&layer("emission"), &r, &vec![Rgb::ZERO; noisy.len()]])
        }
        "irradiance" | "dem-both" | "dem-reflected" => {
            let albedo = albedo.as_ref().unwrap();
            let dem = |l: &[Rgb]| -> Vec<Rgb> { l.iter().zip(albedo).map(|(&l, &a)| l / a.max(Rgb::splat(1e-3))).collect() };
            let rem = |n: &[Rgb], l: Vec<Rgb>| -> Vec<Rgb> {
                l.iter().zip(n).zip(albedo).map(|((&l, &n), &a)| if n == Rgb::ZERO { n } else { l * a.max(Rgb::splat(1e-3)) }).collect()
            };
            let (d, i) = (layer("direct"), layer("indirect"));
            match what.as_str() {
                "irradiance" => sum([&layer("emission"), &d, &rem(&i, one(&dem(&i), true)?)]),
                "dem-both" => sum([&layer("emission"), &rem(&d, one(&dem(&d), true)?), &rem(&i, one(&dem(&i), true)?)]),
                _ => {
                    let r: Vec<Rgb> = d.iter().zip(&i).map(|(a, b)| *a + *b).collect();
                    sum([&layer("emission"), &rem(&r, one(&dem(&r), true)?), &vec![Rgb::ZERO; noisy.len()]])
                }
            }
        }
        _ => panic!(),
    };
    film.set_rgb("", &beauty);
    film.set_rgb("noisy", &noisy);
    Ok(())
}
