//! The finished picture denoised, by a library that is opened at run time.
//!
//! ```text
//! picture = emission + D(direct + indirect)              Parts::Together
//! picture = emission + D(direct) + D(indirect)  Parts::Apart; D guided by albedo, normal
//! ```
//! What the camera sees directly has no noise and stays sharp. A film without these layers is
//! denoised as a whole.
//!
//! Input   a film with `emission`, `direct`, `indirect`, `albedo`, `N`. Output  the same film with
//!         the beauty denoised; the beauty as it was in layer `noisy`, and what describes that one
//!         (`half0`, `half1`, `variance`) under `noisy` too. All other layers as they were.
//! Why     Path tracing at 16 samples a pixel, relMSE without the 0.1 % worst pixels, of Cornell
//!         box, Sponza by day, interior, veach_ajar: whole beauty 0.0011, 0.0070, 0.0185, 0.0117;
//!         with albedo and normals declared clean (sixteen samples and more make them so) 0.0009,
//!         0.0055, 0.0169, 0.0092; parts apart 0.0007, 0.0043, 0.0162, 0.0091: sun and lamps have
//!         other noise than bounces. Divided by albedo: never better, black where there is none.
//!         The decomposition has little noise in either part: together 0.00027, 0.0045, 0.0044,
//!         0.0039 after 0.00039, 0.0046, 0.0047, 0.0041, apart no better at twice the cost; and
//!         without `decompose.near_filter`, whose blotches look like light, 0.00028, 0.0044,
//!         0.0042, 0.0030, which is why it is off beside a denoiser.
//! Cost    see [`crate::ffi::oidn`]; two filters with parts apart. Phase `denoise`.

use crate::error::Result;
use crate::ffi::oidn::{Denoiser, Input};
use crate::film::{Film, Layer};
use crate::radiometry::Rgb;
use crate::run::Run;
use crate::settings::choices;

choices! {
    /// What removes noise from the finished picture.
    #[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
    pub enum Denoise default None {
        /// Open Image Denoise 2 where it is found, else nothing.
        Auto = "auto",
        /// Nothing.
        None = "none",
        /// Open Image Denoise 2, where the system or NEARFAR_OIDN has it.
        Oidn = "oidn",
    }
}

impl Denoise {
    /// Opens the library, if one is asked for or there; before the render, so that a missing one is
    /// told at once.
    ///
    /// # Errors
    /// As [`Denoiser::open`].
    pub fn open(self, run: &Run) -> Result<Option<Denoiser>> {
        match self {
            Self::None => Ok(None),
            Self::Auto => Denoiser::found(run.threads()),
            Self::Oidn => Denoiser::open(run.threads()).map(Some),
        }
    }
}

/// The beauty before it was denoised; layers that describe it stand under this name too.
pub const NOISY: Layer = Layer::rgb("noisy", "the picture before it was denoised, W/(sr m²)");

/// What goes through the denoiser at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parts {
    /// Direct and indirect light as one picture: where both have like noise.
    Together,
    /// Each by itself: where their noise differs.
    Apart,
}

/// Layers that describe the noisy beauty and no other.
const OF_THE_NOISY: [&str; 3] = ["half0", "half1", "variance"];

/// Denoises the beauty.
///
/// # Errors
/// As [`Denoiser::denoise`].
pub fn denoise(film: &mut Film, denoiser: &Denoiser, parts: Parts, run: &Run) -> Result<()> {
    let _phase = run.phase("denoise", 1);
    let Some(noisy) = film.rgb("") else { return Ok(()) };
    let (albedo, normal) = (film.rgb("albedo"), film.xyz("N"));
    let (width, height) = (film.width as usize, film.height as usize);
    let filter = |color: &[Rgb]| {
        denoiser.denoise(&Input {
            width,
            height,
            color,
            albedo: albedo.as_deref(),
            normal: normal.as_deref(),
            clean: true,
        })
    };
    let sum =
        |a: &[Rgb], b: &[Rgb]| -> Vec<Rgb> { a.iter().zip(b).map(|(&a, &b)| a + b).collect() };
    let beauty = match (film.rgb("emission"), film.rgb("direct"), film.rgb("indirect")) {
        (Some(emission), Some(direct), Some(indirect)) => match parts {
            Parts::Together => sum(&emission, &filter(&sum(&direct, &indirect))?),
            Parts::Apart => sum(&emission, &sum(&filter(&direct)?, &filter(&indirect)?)),
        },
        _ => filter(&noisy)?,
    };
    let of_the_noisy = |name: &str| {
        OF_THE_NOISY.iter().any(|l| name.strip_prefix(l).is_some_and(|rest| rest.starts_with('.')))
    };
    let moved: Vec<String> =
        film.channels.keys().filter(|name| of_the_noisy(name)).cloned().collect();
    for name in moved {
        if let Some(values) = film.channels.remove(&name) {
            film.set(&format!("noisy.{name}"), values);
        }
    }
    film.set_rgb(NOISY.name, &noisy);
    film.set_rgb("", &beauty);
    Ok(())
}
