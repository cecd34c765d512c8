//! The two sides of a triangle. Surfaces are two-sided: what lies on them is kept per side.

/// Which side of a triangle, by winding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Side {
    /// The side the winding faces.
    Front = 0,
    /// The other.
    Back = 1,
}

impl Side {
    /// Front, then back.
    pub const BOTH: [Self; 2] = [Self::Front, Self::Back];

    /// The side whose normal is `sign` times the triangle's: 1 in front, −1 at the back.
    pub fn sign(self) -> f32 {
        match self {
            Self::Front => 1.0,
            Self::Back => -1.0,
        }
    }

    /// The side that a ray of direction `dir` meets on a triangle of normal `normal`.
    pub fn met(normal: glam::Vec3, dir: glam::Vec3) -> Self {
        if normal.dot(dir) > 0.0 { Self::Back } else { Self::Front }
    }
}
