//! Geometry without rendering knowledge: rays, boxes, frames. World space, scene units, unit
//! directions.

mod bounds;
mod frame;
mod ray;

pub use bounds::Aabb;
pub use frame::Frame;
pub use ray::{Hit, Ray, offset_origin};
