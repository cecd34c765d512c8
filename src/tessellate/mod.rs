//! `Scene` → [`Geometry`]: one list of world-space triangles, which rays, ground truth and
//! benchmarks see.
//!
//! Before that, at load: cages of subdivision surfaces and curves → meshes ([`subdivide`],
//! [`tessellate_curves`]).

mod catmull_clark;
mod curves;
mod eyes;
mod geometry;
mod half_edges;
mod limit;
mod side;
mod sphere;
mod topology;

pub use catmull_clark::{Levels, MAX_LEVELS, MAX_TRIANGLES, SubdivisionSettings, subdivide};
pub use curves::{CurveSettings, CurveShape, tessellate_curves};
pub use eyes::Eyes;
pub use geometry::{Geometry, Masks, SurfaceAttributes};
pub use side::Side;
pub use topology::{Topology, analyze as analyze_topology};
