//! How far a picture is from a reference, and how far the frames of a film are from each other.
//! Computes; never prints.

pub mod flicker;
mod flip;
mod metrics;
mod reference;

pub use flip::flip;
pub use metrics::{Errors, Halves, errors};
pub use reference::{
    Comparison, Reference, compare, compare_with_flip, difference, exposure_of, read_reference,
};
