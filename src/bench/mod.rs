//! What things cost: ray backends side by side, methods at equal error, and the parts of the
//! decomposition's error. Measures and formats; never prints.

pub mod backends;
pub mod budget;
#[cfg(feature = "cli")]
pub mod chart;
pub mod curves;
pub mod methods;
#[cfg(feature = "embree")]
mod native_loop;
pub mod streams;
