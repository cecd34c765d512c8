//! Translational irradiance gradients after Ward and Heckbert (1992), from the borders between
//! strata.
//!
//! ```text
//! g = Σ_k { u_k 2π/N Σ_{j≥1} sin θ_j⁻ cos² θ_j⁻ (L_jk − L_{j−1,k}) / min(r_jk, r_{j−1,k})
//!         + v_k⁻ Σ_j (sin θ_j⁺ − sin θ_j⁻) (L_jk − L_{j,k−1}) / min(r_jk, r_{j,k−1}) }
//! ```
//! j rings from the pole, θ_j⁻ and θ_j⁺ the bounds of a ring; u_k the azimuth of a sector's middle,
//! v_k⁻ the azimuth of its first bound turned by 90°. The border between two strata moves with the
//! nearer of what they see. Input [`Hemisphere`]. Output  per channel, local, per unit length.
//! Exactly zero for constant radiance: nothing moves at the geometric horizon. Not seen: borders
//! between the strata at the zenith's own point, change at the horizon itself. Cost O(strata). The
//! radial sum starts at the border between the first two rings (an implementation in wide use
//! starts one ring too late).

use glam::Vec3;

use super::hemisphere::Hemisphere;

/// Per channel, local frame.
pub fn gradient_translation(hemisphere: &Hemisphere) -> [Vec3; 3] {
    let (rings, sectors) = (hemisphere.grid.rings, hemisphere.grid.sectors);
    let (l, inverse) = (&hemisphere.radiance, &hemisphere.inverse_distance);
    let mut g = [Vec3::ZERO; 3];
    for k in 0..sectors {
        let before = (k + sectors - 1) % sectors;
        let angle = |at: f32| std::f32::consts::TAU * at / sectors as f32;
        let (u, v) = (angle(k as f32 + 0.5), angle(k as f32));
        let (u, v) = (Vec3::new(u.cos(), u.sin(), 0.0), Vec3::new(-v.sin(), v.cos(), 0.0));
        for j in 0..rings {
            let here = j * sectors + k;
            let [sin_in, sin_out] = [j, j + 1].map(|j| hemisphere.grid.sin_border(j));
            let mut add = |other: usize, weight: f32, along: Vec3| {
                if !(hemisphere.above[here] && hemisphere.above[other]) {
                    return;
                }
                let change = (l[here] - l[other]) * (weight * inverse[here].max(inverse[other]));
                for (g, change) in g.iter_mut().zip(change.to_array()) {
                    *g += along * change;
                }
            };
            if j > 0 {
                add(
                    here - sectors,
                    std::f32::consts::TAU / sectors as f32 * sin_in * (1.0 - sin_in * sin_in),
                    u,
                );
            }
            add(j * sectors + before, sin_out - sin_in, v);
        }
    }
    g
}
