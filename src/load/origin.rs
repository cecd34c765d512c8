//! Where the zero of world space lies in the user's space.
//!
//! Coordinates of maps are millions of units from their zero, and single precision has 24 bits:
//! positions are read in double precision and become single only as differences to an origin in the
//! midst of the scene,
//!
//! ```text
//! origin = the componentwise median of the vertices, on a grid as coarse as they are spread
//! ```
//! which is where most of what there is to see is, however large the ground is on which it stands.
//! It is taken only where it gains more than [`GAIN`]: a scene that lies about its own zero, as
//! nearly all do, keeps it and every bit of its coordinates.
//!
//! The same rule gives every file an origin of its own (`obj`, `curve_file`), so that a transform
//! meets small numbers too; [`Pose`] joins both. Cost: one pass over at most [`SAMPLE`]
//! vertices.

use glam::{DAffine3, DVec3, Mat4};

/// Distance of the median from zero over the spread of the vertices from which on a scene is moved:
/// six of the 24 bits are lost there.
const GAIN: f64 = 64.0;
/// Vertices that are looked at.
const SAMPLE: usize = 1 << 16;
/// Fewest steps of double precision across a scene.
const STEPS: f64 = 4096.0;

/// The origin of `count` vertices, of which every so many are asked for their place.
///
/// # Errors
/// What is wrong where even double precision cannot tell the vertices apart.
pub fn origin_of<V>(
    count: usize,
    vertices: impl Iterator<Item = V>,
    place: impl Fn(V) -> DVec3,
) -> Result<DVec3, String> {
    let step = count.div_ceil(SAMPLE).max(1);
    let points: Vec<DVec3> = vertices.step_by(step).map(place).collect();
    if points.is_empty() {
        return Ok(DVec3::ZERO);
    }
    let quartile = |axis: usize, q: usize| {
        let mut along: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        let rank = (along.len() - 1) * q / 4;
        *along.select_nth_unstable_by(rank, f64::total_cmp).1
    };
    let of_axes = |q| DVec3::new(quartile(0, q), quartile(1, q), quartile(2, q));
    let (median, spread) = (of_axes(2), of_axes(3).distance(of_axes(1)));
    let away = median.abs().max_element();
    if !away.is_finite() || away <= GAIN * spread {
        return Ok(DVec3::ZERO);
    }
    if spread > 0.0 && away * f64::EPSILON * STEPS > spread {
        return Err(format!(
            "lies {away:.3e} units from the origin and is {spread:.3} units large: even double \
             precision cannot tell its corners apart there; move it to the origin in the program \
             that made it"
        ));
    }
    let grid = spread.max(away * f64::EPSILON).log2().ceil().exp2();
    Ok((median / grid).round() * grid)
}

/// How the points of a shape, which are relative to an origin of their own, come into the scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pose {
    /// The zero of the shape's coordinates, object space.
    pub object_origin: DVec3,
    /// From object space to the user's space; none: they are the same.
    pub user_from_object: Option<DAffine3>,
}

impl Pose {
    /// The place of a point of the shape, the user's space.
    pub fn user(&self, p: DVec3) -> DVec3 {
        let p = p + self.object_origin;
        self.user_from_object.map_or(p, |m| m.transform_point3(p))
    }

    /// From the shape's coordinates to those relative to `origin`; none: they are the same.
    pub fn world_from_shape(&self, origin: DVec3) -> Option<Mat4> {
        let translation = self.user(DVec3::ZERO) - origin;
        if self.user_from_object.is_none() && translation == DVec3::ZERO {
            return None;
        }
        let linear = self.user_from_object.map_or(glam::DMat3::IDENTITY, |m| m.matrix3);
        Some(Mat4::from_mat3_translation(linear.as_mat3(), translation.as_vec3()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(center: DVec3, size: f64) -> Vec<DVec3> {
        (0..64)
            .map(|i| {
                let at = [i & 3, i >> 2 & 3, i >> 4].map(|k| f64::from(k) / 3.0 - 0.5);
                center + DVec3::from_array(at) * size
            })
            .collect()
    }

    fn of(points: &[DVec3]) -> Result<DVec3, String> {
        origin_of(points.len(), points.iter(), |p| *p)
    }

    #[test]
    fn scenes_about_their_zero_stay_and_far_ones_are_moved() {
        for center in [DVec3::ZERO, DVec3::new(100.0, 0.0, -50.0)] {
            assert_eq!(of(&around(center, 4.0)), Ok(DVec3::ZERO));
        }
        let far = DVec3::new(448_262.25, 0.0, 5_411_932.75);
        let found = of(&around(far, 4.0)).unwrap();
        assert!(found.distance(far) < 8.0, "{found}");
        let doubled: Vec<DVec3> = around(far, 4.0).iter().map(|p| *p * 2.0).collect();
        assert_eq!(of(&doubled), Ok(found * 2.0));
        // A ground of kilometres, in whose corner a room stands.
        let mut points = around(DVec3::new(7e3, 0.0, 7e3), 4.0);
        points.extend(
            [-1e4, 1e4].iter().flat_map(|&x| [DVec3::new(x, 0.0, -1e4), DVec3::new(x, 0.0, 1e4)]),
        );
        assert!(of(&points).unwrap().distance(DVec3::new(7e3, 0.0, 7e3)) < 8.0);
        assert_eq!(of(&[]), Ok(DVec3::ZERO));
        assert!(of(&around(DVec3::splat(1e14), 4.0)).is_err());
    }

    #[test]
    fn what_is_far_in_object_and_user_space_is_near_in_the_world() {
        let far = DVec3::new(1e7, 2e7, 3e7);
        let back = DAffine3::from_scale_rotation_translation(
            DVec3::splat(0.001),
            glam::DQuat::from_rotation_y(0.5),
            DVec3::new(5e6, 0.0, 0.0),
        );
        let pose = Pose { object_origin: far, user_from_object: Some(back) };
        let origin = pose.user(DVec3::ZERO).round();
        let matrix = pose.world_from_shape(origin).unwrap();
        let p = glam::Vec3::new(250.0, -500.0, 125.0);
        let exact = back.transform_point3(far + p.as_dvec3()) - origin;
        assert!((matrix.transform_point3(p).as_dvec3() - exact).length() < 1e-6);
        assert!(Pose::default().world_from_shape(DVec3::ZERO).is_none());
    }
}
