//! One side of one cell as a small key, which orders and indexes all arrays of the room.

use super::cells::CellId;
use crate::tessellate::Side;

/// A side of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct CellSide(u32);

impl CellSide {
    /// The side of a cell.
    pub fn new(cell: CellId, side: Side) -> Self {
        Self(2 * cell + side as u32)
    }
    /// All sides of the first `cells` cells, in order of their indices.
    pub fn all(cells: usize) -> impl Iterator<Item = Self> {
        (0..2 * cells as u32).map(Self)
    }
    /// Its cell.
    pub fn cell(self) -> CellId {
        self.0 / 2
    }
    /// Which of the cell's sides.
    pub fn side(self) -> Side {
        Side::BOTH[(self.0 & 1) as usize]
    }
    /// Place in arrays that hold the front and the back of every cell in turn.
    pub fn index(self) -> usize {
        self.0 as usize
    }
    /// Key of its random numbers.
    pub fn key(self) -> u64 {
        u64::from(self.0)
    }
}
