//! What is said about renders: comparisons, benchmark tables. Computes and formats; never prints.

pub mod backends;
#[cfg(feature = "embree")]
mod native_loop;
pub mod info;
pub mod streams;
