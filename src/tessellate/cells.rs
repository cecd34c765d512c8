//! Cells (skeleton).

/// Index of a cell.
pub type CellId = u32;

/// Which side of a triangle, by winding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Side {
    /// The side the winding faces.
    Front = 0,
    /// The other.
    Back = 1,
}

/// Small pieces of triangles.
#[derive(Debug, Default)]
pub struct Cells {}
