//! How much the light on things that stand still changes from frame to frame.
//!
//! ```text
//! temporal variance = mean over static points and channels of
//!                     (E' − E)² / (((E + E') / 2)² + 0.01 m²)        m: mean of E over the frame
//! ```
//! E is the indirect irradiance of a pixel, E' that of the same surface point in the next frame:
//! the pixel's position is projected there, and E' is interpolated among the four pixels around,
//! all of which must show the same surface (like normal, within a pixel's side of its plane).
//! Points that the next frame does not show, or shows at an edge, do not count.
//!
//! Not     zero for a perfect film: what shadows finer than a pixel lose by resampling is in it,
//!         the same for every method.

use glam::Vec3;

use crate::film::Film;
use crate::radiometry::Rgb;
use crate::scene::Camera;

/// What a frame shows.
#[derive(Clone, Debug)]
pub struct Frame {
    camera: Camera,
    irradiance: Vec<Rgb>,
    position: Vec<Vec3>,
    normal: Vec<Vec3>,
    depth: Vec<f32>,
}

/// Change between two frames, or over many.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Flicker {
    /// Mean relative squared change.
    pub temporal_variance: f64,
    /// The same of the one point in a thousand that changes most: pops.
    pub worst_thousandth: f64,
    /// Static points.
    pub points: usize,
}

impl Frame {
    /// From the layers `irradiance`, `P`, `N` and `depth`; none without them.
    pub fn new(film: &Film, camera: &Camera) -> Option<Self> {
        let xyz = |layer: &str| {
            let [x, y, z] = ["X", "Y", "Z"].map(|s| film.channels.get(&format!("{layer}.{s}")));
            Some(x?.iter().zip(y?).zip(z?).map(|((&x, &y), &z)| Vec3::new(x, y, z)).collect())
        };
        Some(Self {
            camera: camera.clone(),
            irradiance: film.rgb("irradiance")?,
            position: xyz("P")?,
            normal: xyz("N")?,
            depth: film.channels.get("depth.Z")?.clone(),
        })
    }

    /// Irradiance of the surface at `p` with normal `n`, if this frame shows it away from edges.
    fn at(&self, p: Vec3, n: Vec3) -> Option<Rgb> {
        let (pixel, depth) = self.camera.project(p)?;
        let corner = pixel - 0.5;
        let (x, y) = (corner.x.floor(), corner.y.floor());
        let (w, h) = (self.camera.width as usize, self.camera.height as usize);
        if x < 0.0 || y < 0.0 || x as usize + 1 >= w || y as usize + 1 >= h {
            return None;
        }
        let (fx, fy) = (corner.x - x, corner.y - y);
        let reach = depth * self.camera.pixel_angle();
        let mut sum = Rgb::ZERO;
        for (dx, dy, weight) in [
            (0, 0, (1.0 - fx) * (1.0 - fy)),
            (1, 0, fx * (1.0 - fy)),
            (0, 1, (1.0 - fx) * fy),
            (1, 1, fx * fy),
        ] {
            let j = (y as usize + dy) * w + x as usize + dx;
            if !self.depth[j].is_finite()
                || self.normal[j].dot(n) < 0.95
                || n.dot(self.position[j] - p).abs() > reach
            {
                return None;
            }
            sum += self.irradiance[j] * weight;
        }
        Some(sum)
    }

    /// Relative squared change of every static point to the `next` frame.
    pub fn changes(&self, next: &Self) -> Vec<f32> {
        let m = self.irradiance.iter().map(|e| e.element_sum() / 3.0).sum::<f32>()
            / self.irradiance.len().max(1) as f32;
        let change = |i: usize| {
            if !self.depth[i].is_finite() || self.normal[i].length_squared() < 0.9 {
                return None;
            }
            let (e, then) = (self.irradiance[i], next.at(self.position[i], self.normal[i])?);
            let (d, mean) = (then - e, (then + e) * 0.5);
            Some(
                (d * d / (mean * mean + 0.01 * m * m).max(Vec3::splat(f32::MIN_POSITIVE)))
                    .element_sum()
                    / 3.0,
            )
        };
        (0..self.irradiance.len()).filter_map(change).collect()
    }
}

impl Flicker {
    /// Of changes as [`Frame::changes`] returns them.
    pub fn new(mut changes: Vec<f32>) -> Self {
        if changes.is_empty() {
            return Self::default();
        }
        changes.sort_unstable_by(f32::total_cmp);
        let worst = changes[changes.len() - changes.len().div_ceil(1000)];
        let mean = changes.iter().map(|&c| f64::from(c)).sum::<f64>() / changes.len() as f64;
        Self { temporal_variance: mean, worst_thousandth: worst.into(), points: changes.len() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall at z = 0 seen by a camera that moves sideways: its light is a function of the place,
    /// and what a frame adds is the change.
    #[test]
    fn only_what_changes_on_the_surface_counts() {
        let frame = |eye: f32, more: f32| {
            let camera = Camera {
                eye: Vec3::new(eye, 0.0, 4.0),
                target: Vec3::new(eye, 0.0, 0.0),
                width: 40,
                height: 30,
                ..Camera::default()
            };
            let (mut film, mut p) = (Film::new(40, 30), Vec::new());
            for i in 0..1200 {
                let d =
                    camera.direction(glam::Vec2::new((i % 40) as f32 + 0.5, (i / 40) as f32 + 0.5));
                p.push(camera.eye + d * (4.0 / -d.z));
            }
            let light: Vec<Rgb> =
                p.iter().map(|p| Rgb::splat((6.0 + p.x + p.y) * (1.0 + more))).collect();
            film.set_rgb("irradiance", &light);
            film.set_xyz("P", &p);
            film.set_xyz("N", &[Vec3::Z; 1200]);
            film.set("depth.Z", vec![4.0; 1200]);
            Frame::new(&film, &camera).unwrap()
        };
        let still = Flicker::new(frame(0.0, 0.0).changes(&frame(0.13, 0.0)));
        assert!(still.points > 900 && still.temporal_variance < 1e-10, "{still:?}");
        let brighter = Flicker::new(frame(0.0, 0.0).changes(&frame(0.13, 0.1)));
        assert!(
            (brighter.temporal_variance - 0.0090).abs() < 1e-4
                && brighter.worst_thousandth < 0.00908,
            "{brighter:?}"
        );
        assert_eq!(Flicker::new(frame(0.0, 0.0).changes(&frame(99.0, 0.0))), Flicker::default());
    }
}
