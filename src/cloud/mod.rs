//! Point-based ambient occlusion and colour bleeding: surfaces become a cloud of discs, a hierarchy
//! of discs makes sums over them fast, and no ray is shot.
//!
//! The line is `Geometry` → [`dice`] → [`Cloud`] (light is baked on it; it can be a file) →
//! [`Hierarchy`] → [`Gather`] → [`Gathered`]. Baking may shoot rays for direct light. Gathering
//! cannot: nothing from the tree on knows of a ray query `[Bunnell05]` `[Christensen08]`.
//!
//! | File | What it holds |
//! |---|---|
//! | `dice` | [`dice`]: every triangle cut into pieces of equal area |
//! | `element` | [`Cloud`]: position, normal, area and channels of the discs |
//! | `cloud_file` | [`write_cloud`], [`read_cloud`]: clouds as PLY |
//! | `settings` | [`PointBasedSettings`] |
//! | `pack` | normals, colours and spherical harmonics in few bytes |
//! | `hierarchy` | [`Hierarchy`]: the discs in order and the nodes above them |
//! | `tree_build`, `group_sums` | how the tree is split, and what a group of discs sums up to |
//! | `groups` | [`Group`]: the tree level by level, for whoever looks at it |
//! | `raster` | the hemisphere of a receiver, filled from near to far; [`Gathered`] |
//! | `tree_walk` | [`Gather`]: the walk through the tree that fills the raster |
//! | `interpolate` | [`gather_some`]: gathers at few places of a picture, interpolated between |
//! | `plain_sum` | [`sum()`]: the sum without a raster, and Bunnell's correction of it |
//! | `radiosity` | [`bake`]: direct light and bounces on the elements; [`gather_all`] |
//!
//! # What it is good for
//! At the defaults occlusion is as good as that of about 20 rays a point (Sponza) to 50 (the
//! built-in interior), and rays of the same error are some 30 times faster: that it needs no ray is
//! its use, not that it is fast. Inside a closed box 0.2 % stays open, along its edges 1 %; where
//! mouldings are narrower than elements lie apart more does, and a bright sky leaks in. Bounces on
//! the elements lose about half a per cent more light than the proxy does, for a reason that is not
//! known. The measurements are in `docs/records/2026-11-point-based.md`.

mod cloud_file;
mod dice;
mod element;
mod group_sums;
mod groups;
mod hierarchy;
mod interpolate;
mod pack;
mod plain_sum;
mod radiosity;
mod raster;
mod settings;
mod tree_build;
mod tree_walk;

pub use cloud_file::{differing_scene, read_cloud, scene_comment, write_cloud};
pub use dice::{Density, Piece, dice};
pub use element::{Channel, Cloud};
pub use groups::Group;
pub use hierarchy::Hierarchy;
pub use interpolate::{Receivers, gather_some};
pub use plain_sum::{Accessibility, sum};
pub use radiosity::{accessibility, bake, bake_areas, element_irradiance, gather_all};
pub use raster::Gathered;
pub use settings::{FalloffMode, HitSides, Overlap, PointBasedSettings, RadiositySource};
pub use tree_walk::{Gather, Receiver};
