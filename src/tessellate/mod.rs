//! `Scene` → [`Geometry`]: one list of world-space triangles, which rays, ground truth and
//! benchmarks see; and `Geometry` → [`Cells`]: pieces no larger than `near_cell` with radiosity per
//! side, for the near sum and the proxy only.
//!
//! Before that, at load: cages of subdivision surfaces and curves → meshes ([`subdivide`],
//! [`tessellate_curves`]).

mod catmull_clark;
mod cells;
mod curves;
mod geometry;
mod half_edges;
mod limit;
mod sphere;
mod topology;

pub use catmull_clark::{Levels, MAX_LEVELS, MAX_TRIANGLES, SubdivisionSettings, subdivide};
pub use cells::{CellId, Cells, Side};
pub use curves::{CurveSettings, CurveShape, tessellate_curves};
pub use geometry::{Geometry, Masks, SurfaceAttributes};
pub use topology::{Topology, analyze as analyze_topology};
