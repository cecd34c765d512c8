//! A camera that moves: key views at times, joined smoothly.
//!
//! ```text
//! x(t) = cubic Hermite between neighbouring keys
//! tangent at an inner key: (x₊ − x₋) / (t₊ − t₋); at the ends that of the line to the neighbour
//! ```
//! for eye, target, up and field of view alike (Catmull–Rom with uneven times). Guarantees  keys
//! are met exactly, position and speed are continuous; two keys give a straight line at constant
//! speed. Not: a bound on how far the curve swings out between uneven keys.

use glam::Vec3;

use super::Camera;

/// Key views in the order of their times.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    keys: Vec<(f32, Camera)>,
}

impl CameraPath {
    /// From at least one key; times rise from key to key. None otherwise.
    pub fn new(keys: Vec<(f32, Camera)>) -> Option<Self> {
        let rising =
            keys.windows(2).all(|k| k[1].0 > k[0].0) && keys.iter().all(|k| k.0.is_finite());
        (!keys.is_empty() && rising).then_some(Self { keys })
    }

    /// The view of frame `frame` of `frames`; the first and the last are the first and the last
    /// key.
    pub fn frame(&self, frame: u32, frames: u32) -> Camera {
        let (first, last) = (self.keys[0].0, self.keys[self.keys.len() - 1].0);
        if frame + 1 == frames && frames > 1 {
            return self.keys[self.keys.len() - 1].1.clone();
        }
        self.at(first + (last - first) * frame as f32 / (frames.max(2) - 1) as f32)
    }

    fn at(&self, t: f32) -> Camera {
        let next = self.keys.partition_point(|k| k.0 <= t);
        if next == 0 || next == self.keys.len() {
            return self.keys[next.saturating_sub(1)].1.clone();
        }
        let (t0, t1) = (self.keys[next - 1].0, self.keys[next].0);
        let (u, width) = ((t - t0) / (t1 - t0), t1 - t0);
        let value = |of: &dyn Fn(&Camera) -> Vec3| {
            let x = |i: usize| of(&self.keys[i].1);
            let tangent = |i: usize| {
                let (a, b) = (i.saturating_sub(1), (i + 1).min(self.keys.len() - 1));
                (x(b) - x(a)) / (self.keys[b].0 - self.keys[a].0)
            };
            let (u2, u3) = (u * u, u * u * u);
            x(next - 1) * (2.0 * u3 - 3.0 * u2 + 1.0)
                + tangent(next - 1) * (width * (u3 - 2.0 * u2 + u))
                + x(next) * (3.0 * u2 - 2.0 * u3)
                + tangent(next) * (width * (u3 - u2))
        };
        Camera {
            eye: value(&|c| c.eye),
            target: value(&|c| c.target),
            up: value(&|c| c.up),
            vfov_deg: value(&|c| Vec3::splat(c.vfov_deg)).x,
            ..self.keys[0].1.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(t: f32, x: f32) -> (f32, Camera) {
        (t, Camera { eye: Vec3::new(x, 0.0, 5.0), ..Camera::default() })
    }

    #[test]
    fn keys_are_met_and_the_way_is_smooth() {
        let path = CameraPath::new(vec![key(0.0, 0.0), key(1.0, 1.0), key(3.0, 0.0)]).unwrap();
        assert_eq!((path.frame(0, 4).eye.x, path.frame(3, 4).eye.x), (0.0, 0.0));
        assert!((path.frame(1, 4).eye.x - 1.0).abs() < 1e-6);
        let x: Vec<f32> = (0..301).map(|i| path.frame(i, 301).eye.x).collect();
        let bend = x.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).fold(0.0, f32::max);
        // Acceleration is at most some 6 units per square unit of time: steps of 0.01.
        assert!(bend < 7e-4, "{bend}");
        let line = CameraPath::new(vec![key(0.0, 0.0), key(1.0, 2.0)]).unwrap();
        assert!((line.frame(1, 5).eye.x - 0.5).abs() < 1e-6);
        let still = CameraPath::new(vec![key(0.0, 3.0)]).unwrap();
        assert_eq!((still.frame(0, 1), still.frame(2, 5)), (key(0.0, 3.0).1, key(0.0, 3.0).1));
        assert!(
            CameraPath::new(vec![]).is_none()
                && CameraPath::new(vec![key(1.0, 0.0), key(1.0, 1.0)]).is_none()
        );
    }
}
