//! Geometry without rendering knowledge: rays, boxes, frames, points in a tree. World space, scene
//! units, unit directions.

mod bounds;
mod frame;
mod kdtree;
mod ray;

pub use bounds::Aabb;
pub use frame::Frame;
pub use kdtree::KdTree;
pub use ray::{Hit, Ray, offset_origin};
