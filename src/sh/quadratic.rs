//! Three bands as a quadratic polynomial of the direction, and its integrals over polygons as a dot
//! product with 14 moments.
//!
//! ```text
//! L(w) = c₀ + b·w + wᵀ M w            (M symmetric, trace carried by the l = 2 part and c₀)
//! ∫_P L(w) (N·w) dw = c₀ G + b·v/3 + M:Q/4 + (b·N) Ω/3 + (M N)·T/2
//! ```
//! Source: irradiance tensors `[Arvo95]`, worked out per polygon edge; the moments (G, v, Q, Ω, T)
//! do not depend on the radiance, so the moments of many polygons are summed first and the radiance
//! is applied once a point and channel.

use glam::Vec3;

use super::ShRgb;
use crate::radiometry::Rgb;

/// Moments of a polygon: G, v (3), Q (xx, yy, zz, xy, yz, xz), Ω, T (3).
pub const MOMENTS: usize = 14;

/// The first three bands of an SH field as c₀, b, M, for one normal.
#[derive(Clone, Copy, Debug)]
pub struct Quadratic {
    /// Factor of each moment, RGB.
    factor: [Rgb; MOMENTS],
}

impl Quadratic {
    /// From the first nine coefficients of `sh`, for integrals against the cosine to the unit
    /// normal `n`.
    pub fn new(sh: &ShRgb, n: Vec3) -> Self {
        let c = &sh.0;
        let c0 = c[0] * 0.282_094_79 - c[6] * 0.315_391_57;
        let b = [c[3], c[1], c[2]].map(|v| v * 0.488_602_51);
        let m_xx = c[8] * 0.546_274_2;
        let m_yy = -m_xx;
        let m_zz = c[6] * (3.0 * 0.315_391_57);
        let (m_xy, m_yz, m_xz) = (c[4] * 0.546_274_2, c[5] * 0.546_274_2, c[7] * 0.546_274_2);
        let m_n = [
            m_xx * n.x + m_xy * n.y + m_xz * n.z,
            m_xy * n.x + m_yy * n.y + m_yz * n.z,
            m_xz * n.x + m_yz * n.y + m_zz * n.z,
        ];
        let b_n = b[0] * n.x + b[1] * n.y + b[2] * n.z;
        Self {
            factor: [
                c0,
                b[0] / 3.0,
                b[1] / 3.0,
                b[2] / 3.0,
                m_xx / 4.0,
                m_yy / 4.0,
                m_zz / 4.0,
                m_xy / 2.0,
                m_yz / 2.0,
                m_xz / 2.0,
                b_n / 3.0,
                m_n[0] / 2.0,
                m_n[1] / 2.0,
                m_n[2] / 2.0,
            ],
        }
    }

    /// ∫ L(w) (N·w) dw over whatever the moments were summed over.
    pub fn integral(&self, moments: &[f32; MOMENTS]) -> Rgb {
        self.factor.iter().zip(moments).map(|(&f, &m)| f * m).sum()
    }
}
