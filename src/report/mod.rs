//! How far an image is from a reference.

pub mod budget;
mod compare;
mod flip;
mod metrics;

pub use compare::{Comparison, Reference, compare, difference, exposure_of, read_reference};
pub use flip::flip;
pub use metrics::{Errors, Halves, errors};
//! What is said about renders: comparisons, benchmark tables. Computes and formats; never prints.

pub mod backends;
#[cfg(feature = "embree")]
mod native_loop;
pub mod streams;
