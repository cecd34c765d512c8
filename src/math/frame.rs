//! Orthonormal frames around a normal `[Duff17]`.

use glam::Vec3;

/// Right-handed orthonormal frame; `n` is local +z.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// First tangent.
    pub s: Vec3,
    /// Second tangent.
    pub t: Vec3,
    /// Normal.
    pub n: Vec3,
}

impl Frame {
    /// A frame around the unit vector `n`; continuous except across z = 0.
    pub fn from_normal(n: Vec3) -> Self {
        let sign = 1.0_f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }
    /// Local coordinates to world.
    pub fn world_from_local(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
    /// World coordinates to local.
    pub fn local_from_world(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn orthonormal_right_handed(x in -1.0f32..1.0, y in -1.0f32..1.0, z in -1.0f32..1.0) {
            let v = Vec3::new(x, y, z);
            prop_assume!(v.length() > 1e-3);
            let f = Frame::from_normal(v.normalize());
            let dots = [f.s.dot(f.t), f.s.dot(f.n), f.t.dot(f.n)];
            prop_assert!(dots.iter().all(|d| d.abs() < 1e-5), "{dots:?}");
            prop_assert!((f.s.cross(f.t) - f.n).length() < 1e-5);
            let w = Vec3::new(0.3, -0.7, 0.2);
            prop_assert!((f.local_from_world(f.world_from_local(w)) - w).length() < 1e-5);
        }
    }
}
