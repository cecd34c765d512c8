//! Mouldings along curves and wall panels around openings: tubes in a plane with depth.

use glam::{Vec2, Vec3};

use crate::builtin::solid::Solids;

/// A wall's plane: across, up, and out of the wall.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub origin: Vec3,
    pub across: Vec3,
    pub out: Vec3,
}

impl Plane {
    pub(super) fn at(&self, p: Vec2, depth: f32) -> Vec3 {
        self.origin + self.across * p.x + Vec3::Y * p.y + self.out * depth
    }
}

/// A moulding along a curve (point and normal): `profile` is a closed polygon of (along the normal,
/// depth). A closed curve does not repeat its first point; `material(k)` is that of piece k.
pub(super) fn moulding(
    s: &mut Solids,
    plane: &Plane,
    curve: &[(Vec2, Vec2)],
    profile: &[Vec2],
    closed: bool,
    material: impl Fn(usize) -> u32,
) {
    let ring =
        |&(p, n): &(Vec2, Vec2)| profile.iter().map(|q| plane.at(p + n * q.x, q.y)).collect();
    s.tube_by(&curve.iter().map(ring).collect::<Vec<_>>(), closed, material);
}

/// [`moulding`] along an open polyline: normals to the left of its direction, mitred.
pub(super) fn polyline(
    s: &mut Solids,
    plane: &Plane,
    points: &[Vec2],
    profile: &[Vec2],
    closed: bool,
    material: impl Fn(usize) -> u32,
) {
    let n = points.len();
    let normal = |i: usize| {
        let before = if i > 0 || closed {
            Some((points[i] - points[(i + n - 1) % n]).normalize())
        } else {
            None
        };
        let after = if i + 1 < n || closed {
            Some((points[(i + 1) % n] - points[i]).normalize())
        } else {
            None
        };
        let (a, b) = (
            before.or(after).unwrap_or(Vec2::X).perp(),
            after.or(before).unwrap_or(Vec2::X).perp(),
        );
        (a + b) / (1.0 + a.dot(b)).max(0.3)
    };
    let curve: Vec<(Vec2, Vec2)> = (0..n).map(|i| (points[i], normal(i))).collect();
    moulding(s, plane, &curve, profile, closed, material);
}

/// A rib in space: `profile` holds (along `across`, along the curve's normal `tangent × across`).
pub(super) fn rib(
    s: &mut Solids,
    points: &[Vec3],
    across: Vec3,
    profile: &[Vec2],
    material: impl Fn(usize) -> u32,
) {
    let last = points.len() - 1;
    let ring = |i: usize| {
        let tangent = (points[(i + 1).min(last)] - points[i.saturating_sub(1)]).normalize();
        let normal = across.cross(tangent);
        profile.iter().map(|q| points[i] + across * q.x + normal * q.y).collect()
    };
    s.tube_by(&(0..=last).map(ring).collect::<Vec<_>>(), false, material);
}

/// A wall panel between the corners of `rectangle` with one opening, from depth `front` to `back`.
/// `holes` are its outlines from front to back, (outline, depth), of equally many points, convex
/// and anticlockwise: several make a splay. The first and the last lie in the wall's faces.
pub(super) fn panel(
    s: &mut Solids,
    plane: &Plane,
    rectangle: [Vec2; 2],
    holes: &[(Vec<Vec2>, f32)],
    material: u32,
) {
    let [low, high] = rectangle;
    let front = &holes[0].0;
    let n = front.len();
    let center = front.iter().sum::<Vec2>() / n as f32;
    let edge = |direction: Vec2| {
        let reach = |d: f32, l: f32, h: f32| {
            if d > 0.0 {
                h / d
            } else if d < 0.0 {
                l / d
            } else {
                f32::INFINITY
            }
        };
        let t = reach(direction.x, low.x - center.x, high.x - center.x).min(reach(
            direction.y,
            low.y - center.y,
            high.y - center.y,
        ));
        (center + direction * t).clamp(low, high)
    };
    // (edge of the outline, how far along it, corner if any)
    let mut places: Vec<(usize, f32, Option<Vec2>)> = (0..n).map(|i| (i, 0.0, None)).collect();
    for corner in [low, Vec2::new(high.x, low.y), high, Vec2::new(low.x, high.y)] {
        let d = corner - center;
        for i in 0..n {
            let (a, b) = (front[i] - center, front[(i + 1) % n] - center);
            let (at_a, at_b) = (d.perp_dot(a), d.perp_dot(b));
            if at_a <= 0.0 && at_b > 0.0 && a.dot(d) > 0.0 {
                let t = at_a / (at_a - at_b);
                // A corner that a point looks at already takes that point.
                if t < 0.02 {
                    places.retain(|p| p.0 != i || p.2.is_some());
                }
                places.push((i, if t < 0.02 { 0.0 } else { t.min(0.98) }, Some(corner)));
            }
        }
    }
    places.sort_by(|a, b| (a.0, a.1).partial_cmp(&(b.0, b.1)).unwrap_or(std::cmp::Ordering::Equal));
    let rings: Vec<Vec<Vec3>> = places
        .iter()
        .map(|&(i, t, corner)| {
            let on = |outline: &[Vec2]| outline[i].lerp(outline[(i + 1) % n], t);
            let outer = corner.unwrap_or_else(|| edge((on(front) - center).normalize()));
            let (first, last) = (holes[0].1, holes[holes.len() - 1].1);
            let mut ring: Vec<Vec3> =
                holes.iter().map(|(outline, depth)| plane.at(on(outline), *depth)).collect();
            ring.extend([plane.at(outer, last), plane.at(outer, first)]);
            ring
        })
        .collect();
    s.tube(&rings, true, material);
}

/// A roll: a circle of `n` points, at least three.
pub(super) fn roll(center: Vec2, radius: f32, n: u32) -> Vec<Vec2> {
    super::arch::circle(center, radius, n.max(3))
}

/// A bevelled bar's section: half width, half depth, bevel.
pub(super) fn bevelled(half: Vec2, bevel: f32) -> Vec<Vec2> {
    let (w, h, b) = (half.x, half.y, bevel);
    [
        (w, b - h),
        (w, h - b),
        (w - b, h),
        (b - w, h),
        (-w, h - b),
        (-w, b - h),
        (b - w, -h),
        (w - b, -h),
    ]
    .map(Vec2::from)
    .into()
}

/// A box with all its edges bevelled: four levels of eight points.
pub(super) fn block(s: &mut Solids, min: Vec3, max: Vec3, bevel: f32, material: u32) {
    let (center, half) = (0.5 * (min + max), 0.5 * (max - min));
    let ring = |y: f32, inset: f32| -> Vec<Vec3> {
        bevelled(Vec2::new(half.x - inset, half.z - inset), bevel)
            .iter()
            .rev()
            .map(|p| center + Vec3::new(p.x, y, p.y))
            .collect()
    };
    // The ends' bevels keep their corners apart, so that eight points remain.
    let b = 0.5 * bevel;
    s.tube(
        &[ring(-half.y, b), ring(b - half.y, 0.0), ring(half.y - b, 0.0), ring(half.y, b)],
        false,
        material,
    );
}
