//! The sums that make a group of discs into one: areas, moments, spherical harmonics and bounds.
//!
//! A group's sums are those of its two parts ([`GroupSums::join`]); a single disc starts them
//! ([`GroupSums::of_element`]). With the clamped cosine's factors A_l `[RH01]` and the basis
//! functions y_i, a disc of area A, normal n and radiosities B, B' contributes
//!
//! ```text
//! area_sh_i  += A   A_l y_i(n) (1 + (−1)^l)         one-sided discs: without (−1)^l
//! power_sh_i += A   A_l y_i(n) (B + (−1)^l B')      for every colour
//! ```
//!
//! Input is a [`Disc`]; output are the [`Node`] that the traversal reads first and the
//! [`Appearance`] that it reads of groups that are used as one. The sphere and the slab of a
//! group's sums hold all discs below it. Joining is not associative in floating point: the tree's
//! shape, which depends on the cloud alone, fixes the order.

use glam::{DVec3, Vec3};

use super::hierarchy::{Appearance, Disc, Node};
use super::pack::{PackedRgb, PackedSh};
use crate::math::Aabb;
use crate::radiometry::Rgb;
use crate::sh::{basis, cosine_band};

/// Sums over the discs of a group.
#[derive(Clone, Copy)]
pub(super) struct GroupSums {
    area: f32,
    /// Area times position relative to the group's first element.
    moment: DVec3,
    origin: Vec3,
    normal: Vec3,
    front: Rgb,
    back: Rgb,
    area_sh: [f32; 9],
    power_sh: [f32; 27],
    bounds: Aabb,
    center: Vec3,
    radius: f32,
    thickness: f32,
    one_sided: bool,
}

impl GroupSums {
    pub fn of_element(disc: &Disc) -> Self {
        let (n, area, has_back) = (disc.n.get(), disc.area(), disc.has_back());
        let y = basis(n);
        let [front, back] = disc.radiosity.map(|c| c.get() * area);
        let (mut area_sh, mut power_sh) = ([0.0; 9], [0.0; 27]);
        for l in 0..3usize {
            for i in l * l..(l + 1) * (l + 1) {
                let lobe = cosine_band(l) * y[i];
                let turned = if !has_back {
                    0.0
                } else if l % 2 == 0 {
                    1.0
                } else {
                    -1.0
                };
                area_sh[i] = area * lobe * (1.0 + turned);
                let both = front + back * turned;
                for k in 0..3 {
                    power_sh[9 * k + i] = both[k] * lobe;
                }
            }
        }
        let radius = (area * std::f32::consts::FRAC_1_PI).sqrt();
        let extent = (Vec3::ONE - n * n).max(Vec3::ZERO).map(f32::sqrt) * radius;
        let bounds = Aabb { min: disc.p - extent, max: disc.p + extent };
        Self {
            area,
            moment: DVec3::ZERO,
            origin: disc.p,
            normal: n * area,
            front,
            back,
            area_sh,
            power_sh,
            bounds,
            center: disc.p,
            radius,
            thickness: 0.0,
            one_sided: !has_back,
        }
    }

    /// Both together; centre and radius of the sum.
    pub fn join(&self, other: &Self) -> Self {
        let mut sum = *self;
        sum.area += other.area;
        sum.one_sided &= other.one_sided;
        sum.moment +=
            other.moment + (other.origin - self.origin).as_dvec3() * f64::from(other.area);
        sum.normal += other.normal;
        sum.front += other.front;
        sum.back += other.back;
        sum.area_sh.iter_mut().zip(&other.area_sh).for_each(|(a, b)| *a += b);
        sum.power_sh.iter_mut().zip(&other.power_sh).for_each(|(a, b)| *a += b);
        sum.bounds = Aabb {
            min: self.bounds.min.min(other.bounds.min),
            max: self.bounds.max.max(other.bounds.max),
        };
        sum.center = self.origin + (sum.moment / f64::from(sum.area)).as_vec3();
        let by_parts = (sum.center.distance(self.center) + self.radius)
            .max(sum.center.distance(other.center) + other.radius);
        let corner = (sum.bounds.max - sum.center).max(sum.center - sum.bounds.min);
        sum.radius = by_parts.min(corner.length());
        // A part's discs lie in its own slab and its own sphere, both turned by the angle between
        // the normals.
        let axis = sum.normal.normalize_or(Vec3::Z);
        let reach = |part: &Self| {
            let normal = part.normal.normalize_or(Vec3::Z);
            let own = (part.thickness * normal.dot(axis).abs()
                + part.radius * normal.cross(axis).length())
            .min(part.radius);
            (part.center - sum.center).dot(axis).abs() + own
        };
        sum.thickness = reach(self).max(reach(other)).min(sum.radius);
        sum
    }

    pub fn node(&self, next: u32, count: u8) -> Node {
        let mean = (self.normal / self.area * 32767.0)
            .round()
            .clamp(Vec3::splat(-32767.0), Vec3::splat(32767.0));
        Node {
            center: self.center,
            radius: self.radius,
            thickness: self.thickness,
            next,
            mean_normal: mean.to_array().map(|v| v as i16),
            count,
            one_sided: self.one_sided,
        }
    }

    pub fn appearance(&self) -> Appearance {
        Appearance {
            total: self.area,
            area: PackedSh::new(&self.area_sh),
            power: PackedSh::new(&self.power_sh),
            radiosity: [
                PackedRgb::new(self.front / self.area, 1.0),
                PackedRgb::new(self.back / self.area, 1.0),
            ],
        }
    }
}
