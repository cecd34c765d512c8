//! Point-based ambient occlusion and colour bleeding: surfaces become discs, a hierarchy of discs makes their sum fast, no ray is shot.
//!
//! | File | Job |
//! |---|---|
//! | `dice` | [`dice`]: every triangle cut into pieces of equal area |
//! | `element` | [`Cloud`]: position, normal, area and channels of the discs |
//! | `cloud_file` | [`write_cloud`], [`read_cloud`]: binary PLY with the names of RenderMan's point clouds |
//! | `settings` | [`PointsSettings`] |
//! | `pack` | compact normals, colours, spherical harmonics |
//! | `hierarchy` | [`Hierarchy`]: groups of discs, what they look like from afar |
//! | `raster` | the hemisphere of a receiver, filled from near to far |
//! | `gather` | [`Gather`]: the walk through the tree |
//! | `sum` | the plain sum, Bunnell's correction |
//! | `radiosity` | [`bake`]: direct light and bounces on the elements; [`gather_all`] |

mod cloud_file;
mod dice;
mod element;
mod gather;
mod hierarchy;
mod pack;
mod radiosity;
mod raster;
mod settings;
mod sum;

pub use cloud_file::{read_cloud, write_cloud};
pub use dice::{Density, Piece, dice};
pub use element::{Channel, Cloud};
pub use gather::{Gather, Receiver};
pub use hierarchy::Hierarchy;
pub use radiosity::{ProxyInputs, accessibility, bake, bake_areas, element_irradiance, gather_all};
pub use raster::Gathered;
pub use settings::{FalloffMode, HitSides, Overlap, PointsSettings, RadiositySource};
pub use sum::{Accessibility, sum};
