//! Point-based ambient occlusion and colour bleeding: surfaces become discs, a hierarchy of discs makes their sum fast, no ray is shot.
//!
//! | File | Job |
//! |---|---|
//! | `dice` | [`dice`]: every triangle cut into pieces of equal area |
//! | `element` | [`Cloud`]: position, normal, area and channels of the discs |
//! | `cloud_file` | [`write_cloud`], [`read_cloud`]: binary PLY with the names of RenderMan's point clouds |

mod cloud_file;
mod dice;
mod element;

pub use cloud_file::{read_cloud, write_cloud};
pub use dice::{Density, Piece, dice};
pub use element::{Channel, Cloud};
