//! Irradiance caching.

pub mod edges;
pub mod hemisphere;
pub mod hessian;
pub mod measure;
pub mod ward;
