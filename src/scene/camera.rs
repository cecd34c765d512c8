//! Pinhole camera. Pixel (0, 0) is the upper left corner; x grows to the right, y downwards.

use glam::{Vec2, Vec3};

/// A pinhole camera with look-at and vertical field of view.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Eye position, world space.
    pub eye: Vec3,
    /// A point in the middle of the view.
    pub target: Vec3,
    /// Approximate upward direction.
    pub up: Vec3,
    /// Vertical field of view in degrees.
    pub vfov_deg: f32,
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            eye: Vec3::new(0.0, 0.0, 5.0),
            target: Vec3::ZERO,
            up: Vec3::Y,
            vfov_deg: 45.0,
            width: 640,
            height: 360,
        }
    }
}

impl Camera {
    /// World axes of the camera: right, up, forward; right-handed look-at (right = forward × up).
    pub fn axes(&self) -> (Vec3, Vec3, Vec3) {
        let forward = (self.target - self.eye).normalize();
        let right = forward.cross(self.up).normalize();
        (right, right.cross(forward), forward)
    }

    /// Unit direction through the image position `pixel` (continuous pixel coordinates; the centre
    /// of pixel (i, j) is (i + ½, j + ½)).
    pub fn direction(&self, pixel: Vec2) -> Vec3 {
        let (right, up, forward) = self.axes();
        let half_height = (self.vfov_deg.to_radians() * 0.5).tan();
        let scale = 2.0 * half_height / self.height as f32;
        let x = (pixel.x - self.width as f32 * 0.5) * scale;
        let y = (self.height as f32 * 0.5 - pixel.y) * scale;
        (forward + right * x + up * y).normalize()
    }

    /// Length of a pixel's side at unit distance along the view axis.
    pub fn pixel_angle(&self) -> f32 {
        2.0 * (self.vfov_deg.to_radians() * 0.5).tan() / self.height as f32
    }

    /// Image position of a world point and its depth along the view axis, if it lies in front.
    pub fn project(&self, p: Vec3) -> Option<(Vec2, f32)> {
        let (right, up, forward) = self.axes();
        let d = p - self.eye;
        let depth = d.dot(forward);
        if depth <= 0.0 {
            return None;
        }
        let scale = 1.0 / (self.pixel_angle() * depth);
        Some((
            Vec2::new(
                self.width as f32 * 0.5 + d.dot(right) * scale,
                self.height as f32 * 0.5 - d.dot(up) * scale,
            ),
            depth,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centre_corners_and_projection() {
        let c = Camera {
            eye: Vec3::ZERO,
            target: -Vec3::Z,
            up: Vec3::Y,
            vfov_deg: 90.0,
            width: 200,
            height: 100,
        };
        assert!((c.direction(Vec2::new(100.0, 50.0)) + Vec3::Z).length() < 1e-6);
        let top_left = c.direction(Vec2::ZERO);
        assert!((top_left - Vec3::new(-2.0, 1.0, -1.0).normalize()).length() < 1e-6);
        let (p, depth) = c.project(c.direction(Vec2::new(13.0, 77.0)) * 3.0).unwrap();
        assert!((p - Vec2::new(13.0, 77.0)).length() < 1e-3 && depth > 0.0);
        assert!(c.project(Vec3::Z).is_none());
    }
}
