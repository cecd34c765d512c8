//! How far a picture is from a reference, and how far the frames of a film are from each other.
//!
//! A reference is read ([`read_reference`]), cleaned of its noise and thus made a [`Truth`]; all
//! figures of a picture are taken against that by [`errors`] and [`octaves`]. This is the only
//! place where the relMSE of a picture is computed: `nearfar compare`, `bench`, `report` and the
//! tests use it. The room computes and never prints.
//!
//! | File | What it holds |
//! |---|---|
//! | `reference` | reference images and their halves, from files |
//! | `truth` | [`Truth`]: a reference cleaned, its own noise |
//! | `cross_filter` | cleaning without a denoiser: two halves filter each other |
//! | `errors` | [`Errors`]: relMSE, bias, MSE, MAE with standard errors |
//! | `blocks` | means over pixels with standard errors over blocks |
//! | `octaves` | [`Octaves`]: the error by octave of size, and in plain regions |
//! | `flip` | LDR-FLIP per pixel |
//! | `comparison` | [`Comparison`]: all figures of a film, and what to doubt in them |
//! | `flicker` | change of light from frame to frame |

mod blocks;
mod comparison;
mod cross_filter;
mod errors;
pub mod flicker;
mod flip;
mod octaves;
mod reference;
mod truth;

pub use comparison::{Comparison, compare, compare_with_flip, difference, exposure_of, notes};
pub use errors::{Errors, Halves, errors, errors_at};
pub use flip::flip;
pub use octaves::{Octave, Octaves, octaves};
pub use reference::{Reference, read_reference};
pub use truth::{Cleaned, Truth};
