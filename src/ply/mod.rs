//! PLY files: the one reader and the one writer of everything that nearfar keeps as points.
//!
//! Only binary little-endian PLY is written and read; MeshLab, Blender and Mitsuba open it. A file
//! begins with a text header, which names the elements, how many rows each has and what numbers a
//! row holds; the rows of all elements follow, packed.
//!
//! | File | What it holds |
//! |---|---|
//! | `header` | the header as read: [`Header`], [`Element`], [`Property`], [`Kind`] |
//! | `columns` | what elements are written: [`Columns`], and their packed [`Rows`] |
//! | `write` | [`write()`] row by row, [`write_elements`] from memory; whole files or none |
//! | `read` | [`Reader`] for anyone's points, [`read_elements`] for nearfar's own files |
//! | `colour` | the 8-bit colour that a viewer shows for a value |
//!
//! Written files end with an element `checksum`: one row, the CRC-32 of all bytes before it. Files
//! that have it are held against it before their rows are read; those of other programs have none,
//! and those that say in a comment that nearfar wrote them must.
//!
//! What is written is read back bit for bit. Sizes that a header claims are held against the
//! file's before memory is taken. Lists are skipped when reading, and must come after the points.

mod colour;
mod columns;
mod header;
mod read;
mod write;

/// Element of the checksum.
const CHECKSUM: &str = "checksum";

pub use colour::{colour, colour_scale};
pub use columns::{Columns, Rows};
pub use header::{Element, Header, Kind, Property};
pub use read::{Reader, read_elements};
pub use write::{RowWriter, write, write_elements, write_for_others};
