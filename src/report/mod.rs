//! What is said about renders: distance from a reference, error budgets, benchmark tables. Computes
//! and formats; never prints.

pub mod backends;
pub mod budget;
pub mod chart;
mod compare;
pub mod curves;
pub mod export;
pub mod flicker;
mod flip;
pub mod info;
pub mod methods;
mod metrics;
#[cfg(feature = "embree")]
mod native_loop;
pub mod page;
pub mod streams;
pub mod viewer;

pub use compare::{
    Comparison, Reference, compare, compare_with_flip, difference, exposure_of, read_reference,
};
pub use flip::flip;
pub use metrics::{Errors, Halves, errors};
