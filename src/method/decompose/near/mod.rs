//! The near half of pass 3: what close surfaces send to a point, less what the far field had
//! claimed for their directions.
//!
//! [`cells`] sums over all near cells in closed form, assumed visible or tested by a ray each (the
//! course's form). [`rays`], the default, estimates the same difference by short rays; [`noise`]
//! says what their noise sticks to, [`boxes`] keeps it there from frame to frame of a film, and
//! [`filter`](mod@filter) takes it away.

pub mod boxes;
pub mod cells;
pub mod filter;
pub mod noise;
pub mod rays;
