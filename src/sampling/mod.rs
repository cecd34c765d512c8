//! Random numbers keyed by what they are for, never by thread; warps from the unit square to
//! directions and triangles; tables.
//!
//! A key is (seed, [`Stream`], element, sample). Two passes never share a stream, so adding samples
//! to one leaves the others' bits alone.

mod discrete;
mod grid;
mod pixel_filter;
mod ready;
mod rng;
mod sobol;
mod warp;
mod words;

/// Samples per pixel that no run reaches and that the sampler can still count: a limit on time or
/// error alone decides.
pub const ENDLESS: u32 = 1 << 30;

pub use discrete::Discrete;
pub use grid::Grid;
pub use pixel_filter::{FilterShape, PixelFilter};
pub use ready::{BuildReady, Ready};
pub use rng::{Rng, Stream, hash64, pixel_of_view, sub_seed};
pub use sobol::Sobol;
pub use warp::{
    pdf_cosine_hemisphere, pdf_uniform_cone, sample_cosine_hemisphere, sample_disc,
    sample_triangle, sample_uniform_cone, sample_uniform_hemisphere, sample_uniform_sphere,
};
pub use words::Words;
