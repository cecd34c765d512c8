//! Translational irradiance gradients after Ward and Heckbert (1992), from a polar grid.
//!
//! ```text
//! g = Σ_k { u_k 2π/N Σ_{j≥1} sin θ_j⁻ cos² θ_j⁻ (L_jk − L_{j−1,k}) / min(r_jk, r_{j−1,k})
//!         + v_k⁻ Σ_j (sin θ_j⁺ − sin θ_j⁻) (L_jk − L_{j,k−1}) / min(r_jk, r_{j,k−1}) }
//! ```
//! j rings from the pole, θ_j⁻ and θ_j⁺ the bounds of a ring; u_k the azimuth of a sector's middle, v_k⁻ the azimuth of its first bound
//! turned by 90°. The border between two strata moves with the nearer of what they see.
//! Input [`Hemisphere`] on [`Grid::Polar`]. Output  per channel, local, per unit length. Exactly zero for constant radiance.
//! The outermost rings' change at the horizon is not seen. Cost O(strata).

use glam::Vec3;

use super::hemisphere::{Grid, Hemisphere};

/// Per channel, local frame; zero for other grids.
pub fn gradient_translation(hemisphere: &Hemisphere) -> [Vec3; 3] {
    let Grid::Polar { rings, sectors } = hemisphere.grid else {
        return [Vec3::ZERO; 3];
    };
    let (l, inverse) = (&hemisphere.radiance, &hemisphere.inverse_distance);
    let mut g = [Vec3::ZERO; 3];
    for k in 0..sectors {
        let before = (k + sectors - 1) % sectors;
        let angle = |at: f32| std::f32::consts::TAU * at / sectors as f32;
        let (u, v) = (angle(k as f32 + 0.5), angle(k as f32));
        let (u, v) = (Vec3::new(u.cos(), u.sin(), 0.0), Vec3::new(-v.sin(), v.cos(), 0.0));
        for j in 0..rings {
            let here = j * sectors + k;
            let [sin_in, sin_out] = hemisphere.grid.sin_range(here);
            let mut add = |other: usize, weight: f32, along: Vec3| {
                let change = (l[here] - l[other]) * (weight * inverse[here].max(inverse[other]));
                for (g, change) in g.iter_mut().zip(change.to_array()) {
                    *g += along * change;
                }
            };
            if j > 0 {
                add(here - sectors, std::f32::consts::TAU / sectors as f32 * sin_in * (1.0 - sin_in * sin_in), u);
            }
            add(j * sectors + before, sin_out - sin_in, v);
        }
    }
    g
}
