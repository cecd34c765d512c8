//! What a receiver sees of the elements, without a ray: the walk through the tree from near to far.
//!
//! ```text
//! a group counts as one when   π r² < maxsolidangle · d²  and  d > r
//! solid angle of a group       Ω = a(−w) / d²
//! of an element                Ω = A |n·w| / (d² + ¾ r²)
//! ```
//!
//! A group that straddles the receiver's horizon must be four times smaller to count as one. The
//! solid angle of an element is exact on the axis of a disc to 1 % from two radii on; nearer than
//! nine radii an element is tested direction by direction, as a soft disc. Groups and elements wait
//! in buckets of distance, a quarter of an octave of d² each, so that what is nearer fills the
//! raster first and groups behind full directions are not opened. The receiver sees the side of an
//! element that faces it.
//!
//! Input is a [`Hierarchy`] with [`PointBasedSettings`], and per receiver a position and two
//! normals; output is [`Gathered`]. Results are finite at any distance, zero included, and the same
//! for any number of threads; elements in or below the receiver's plane do not count. Visibility is
//! not finer than the raster, and light and shade are not finer than the elements. A gather takes
//! about 20 ns for each group that is looked at, of which there are O(1 / maxsolidangle + log
//! elements).

use glam::Vec3;

use super::hierarchy::{Appearance, Disc, Hierarchy, Node};
use super::raster::{Face, Gathered, LargeDisc, Raster, Shape, Splat};
use super::settings::PointBasedSettings;
use crate::math::Frame;
use crate::radiometry::Rgb;

/// Where light is gathered.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// Position, world space.
    pub p: Vec3,
    /// Unit geometric normal.
    pub ng: Vec3,
    /// Unit shading normal: the hemisphere that is gathered.
    pub ns: Vec3,
}

const BUCKETS: usize = 256;
const NONE: u32 = u32::MAX;
/// Marks an element among the waiting.
const ELEMENT: u32 = 1 << 31;
/// Marks a group that is used as one.
const WHOLE: u32 = 1 << 30;
/// Mean normals longer than this are those of a plane.
pub(super) const PLANAR: f32 = 0.98;
/// Elements nearer than this many radii are tested direction by direction. Measured in a corner of
/// a box.
const NEAR: f32 = 9.0;
/// Elements that rise above the receiver's plane by less than this share of their radius do not
/// count.
const LEVEL: f32 = 1e-3;

/// Gathers; one for every thread.
#[derive(Clone, Debug)]
pub struct Gather<'a> {
    tree: &'a Hierarchy,
    settings: &'a PointBasedSettings,
    shape: Shape,
    raster: Raster,
    heads: Vec<u32>,
    waiting: Vec<(u32, u32)>,
    /// Key of the first bucket.
    first: u32,
    /// π r² / d² below which a group is one.
    limit: f32,
    /// Nothing covers beyond.
    reach: f32,
    /// Groups that rise less above the receiver's plane do not count.
    level: f32,
    /// Groups and elements looked at so far.
    pub visited: u64,
}

/// First nine basis functions.
pub(super) fn basis9(w: Vec3) -> [f32; 9] {
    let Vec3 { x, y, z } = w;
    [
        0.282_094_79,
        0.488_602_51 * y,
        0.488_602_51 * z,
        0.488_602_51 * x,
        1.092_548_4 * x * y,
        1.092_548_4 * y * z,
        0.315_391_57 * (3.0 * z * z - 1.0),
        1.092_548_4 * x * z,
        0.546_274_2 * (x * x - y * y),
    ]
}

/// What a receiver in direction −w of a group sees of it.
pub(super) struct Seen {
    /// Projected area.
    pub area: f32,
    /// Mean radiance times π times the tree's scale.
    pub radiance: Rgb,
    pub face: Face,
}

/// Nothing of groups that are turned away.
pub(super) fn seen(node: &Node, a: &Appearance, w: Vec3) -> Option<Seen> {
    let mean = node.mean_normal();
    let length = mean.length();
    if length > PLANAR {
        let cos = -mean.dot(w) / length;
        let back = cos < 0.0;
        return (!(back && node.one_sided)).then(|| Seen {
            area: a.total * cos.abs(),
            radiance: a.radiosity[usize::from(back)].get(),
            face: if back { Face::Back } else { Face::Front },
        });
    }
    let y = basis9(-w);
    let area = a.area.dot(0, &y);
    if area <= 0.0 {
        return None;
    }
    let power = Vec3::new(a.power.dot(0, &y), a.power.dot(9, &y), a.power.dot(18, &y));
    Some(Seen { area, radiance: (power / area).max(Vec3::ZERO), face: Face::Mixed })
}

impl<'a> Gather<'a> {
    /// For receivers of the tree.
    pub fn new(tree: &'a Hierarchy, settings: &'a PointBasedSettings) -> Self {
        let shape = Shape::new(
            settings.microbufres as usize,
            settings.coneangle.to_radians().cos().max(0.0),
        );
        let size = 4.0 * tree.nodes[0].radius;
        let first = ((size * size).max(f32::MIN_POSITIVE).to_bits() >> 21)
            .saturating_sub(BUCKETS as u32 - 1);
        Self {
            tree,
            settings,
            raster: Raster::new(&shape),
            shape,
            heads: vec![NONE; BUCKETS],
            waiting: Vec::new(),
            first,
            limit: settings.maxsolidangle * std::f32::consts::FRAC_1_PI,
            level: settings.bias
                + LEVEL
                    * (tree.appearances[0].total / (std::f32::consts::PI * tree.len() as f32))
                        .sqrt(),
            reach: f32::INFINITY,
            visited: 0,
        }
    }

    fn bucket(&self, d2: f32) -> usize {
        ((d2.to_bits() >> 21).saturating_sub(self.first) as usize).min(BUCKETS - 1)
    }

    fn wait(&mut self, id: u32, bucket: usize) {
        self.waiting.push((id, self.heads[bucket]));
        self.heads[bucket] = self.waiting.len() as u32 - 1;
    }

    /// Elements cover less the farther they are, from half of `reach` on, and nothing beyond it:
    /// nothing pops in.
    pub fn fading(self, reach: f32) -> Self {
        Self { reach, ..self }
    }

    fn fade(&self, distance: f32) -> f32 {
        if self.reach.is_infinite() {
            1.0
        } else {
            (2.0 - 2.0 * distance / self.reach).clamp(0.0, 1.0)
        }
    }

    /// Everything that the receiver sees.
    pub fn gather(&mut self, r: &Receiver) -> Gathered {
        self.under(r, None).0
    }

    /// The same, and the irradiance of the open directions: `sky` is the radiance of a world-space
    /// direction.
    pub fn gather_under(&mut self, r: &Receiver, sky: &dyn Fn(Vec3) -> Rgb) -> (Gathered, Rgb) {
        self.under(r, Some(sky))
    }

    fn under(&mut self, r: &Receiver, sky: Option<&dyn Fn(Vec3) -> Rgb>) -> (Gathered, Rgb) {
        let frame = Frame::from_normal(r.ns);
        self.raster.reset(&self.shape, frame.local_from_world(r.ng));
        self.heads.fill(NONE);
        self.waiting.clear();
        self.meet(0, r, 0);
        for bucket in 0..BUCKETS {
            if self.heads[bucket] == NONE {
                continue;
            }
            if self.raster.is_closed() {
                break;
            }
            while self.heads[bucket] != NONE {
                let (id, next) = self.waiting[self.heads[bucket] as usize];
                self.heads[bucket] = next;
                if id & ELEMENT != 0 {
                    self.element(&self.tree.discs[(id & !ELEMENT) as usize], r, &frame);
                } else if id & WHOLE != 0 {
                    self.whole(id & !WHOLE, r, &frame);
                } else {
                    self.open(id, r, &frame, bucket);
                }
            }
        }
        let from_local = |w: Vec3| sky.map_or(Rgb::ZERO, |sky| sky(frame.world_from_local(w)));
        let (mut result, from_sky) =
            self.raster.result(&self.shape, sky.is_some().then_some(&from_local));
        result.bent_normal = frame.world_from_local(result.bent_normal);
        result.irradiance *= std::f32::consts::FRAC_1_PI / self.tree.scale;
        (result, from_sky)
    }

    /// Squared distance of a group, and whether it is used as one; none when it does not count.
    fn judge(&self, node: &Node, r: &Receiver) -> Option<(f32, bool)> {
        let d = node.center - r.p;
        let d2 = d.length_squared();
        let height = d.dot(r.ng);
        let mut extent = node.radius;
        if height.abs() <= extent {
            let mean = node.mean_normal();
            let inverse = 1.0 / mean.length_squared().max(1e-12);
            let sin2 = mean.cross(r.ng).length_squared() * inverse;
            // Below what mean normals resolve, a plane is level.
            let sin = if sin2 < 4e-9 { 0.0 } else { sin2.min(1.0).sqrt() };
            extent = extent
                .min(node.thickness * mean.dot(r.ng).abs() * inverse.sqrt() + node.radius * sin);
        }
        let floor = self.level;
        if height + extent <= floor {
            return None;
        }
        let reach = self.settings.maxdist + node.radius;
        if d2 >= reach * reach {
            return None;
        }
        let size = node.radius * node.radius;
        let straddles = height - extent < floor;
        Some((d2, size < self.limit * d2 * if straddles { 0.25 } else { 1.0 } && size < d2))
    }

    /// Puts a group where its turn is.
    fn meet(&mut self, id: u32, r: &Receiver, now: usize) {
        self.visited += 1;
        let node = &self.tree.nodes[id as usize];
        let Some((d2, whole)) = self.judge(node, r) else { return };
        let from = if whole {
            d2
        } else {
            (d2 - 2.0 * d2.sqrt() * node.radius + node.radius * node.radius).max(0.0)
        };
        self.wait(
            if whole { id | WHOLE } else { id },
            self.bucket(if d2 > node.radius * node.radius { from } else { 0.0 }).max(now),
        );
    }

    /// A group as one.
    fn whole(&mut self, id: u32, r: &Receiver, frame: &Frame) {
        let node = &self.tree.nodes[id as usize];
        let d = node.center - r.p;
        let d2 = d.length_squared();
        let distance = d2.sqrt();
        let w = d / distance;
        let local = frame.local_from_world(w);
        if local.z <= 0.0 || distance > self.settings.maxdist {
            return;
        }
        if let Some(Seen { area, radiance, face }) =
            seen(node, &self.tree.appearances[id as usize], w)
        {
            let splat = Splat {
                w: local,
                solid_angle: area / d2 * self.fade(distance),
                radiance,
                occlusion: self.settings.weight(distance),
                distance,
                face,
            };
            self.raster.splat(&self.shape, &splat);
        }
    }

    /// The parts of a group, unless all that they could cover is full.
    fn open(&mut self, id: u32, r: &Receiver, frame: &Frame, now: usize) {
        let tree = self.tree;
        let node = &tree.nodes[id as usize];
        let d = node.center - r.p;
        let distance = d.length();
        if node.radius < 0.5 * distance
            && self.raster.is_full(
                &self.shape,
                frame.local_from_world(d / distance),
                1.05 * node.radius / distance,
            )
        {
            return;
        }
        if node.count == 0 {
            self.meet(id + 1, r, now);
            self.meet(node.next, r, now);
            return;
        }
        for e in node.next..node.next + u32::from(node.count) {
            self.visited += 1;
            let disc = &tree.discs[e as usize];
            let d = disc.p - r.p;
            let d2 = d.length_squared();
            if d2 > self.settings.maxdist * self.settings.maxdist {
                continue;
            }
            let cos = disc.n.get().dot(r.ng);
            let radius = (disc.area() * std::f32::consts::FRAC_1_PI).sqrt();
            if d.dot(r.ng) + radius * (1.0 - cos * cos).max(0.0).sqrt()
                <= self.settings.bias + LEVEL * radius
            {
                continue;
            }
            let bucket = self.bucket(d2);
            if bucket <= now {
                self.element(disc, r, frame);
            } else {
                self.wait(e | ELEMENT, bucket);
            }
        }
    }

    fn element(&mut self, disc: &Disc, r: &Receiver, frame: &Frame) {
        let d = disc.p - r.p;
        let d2 = d.length_squared();
        let n = disc.n.get();
        let radius2 = disc.area() * std::f32::consts::FRAC_1_PI;
        let there = [true, disc.has_back()];
        if d2 < NEAR * NEAR * radius2 {
            let radiance = [0, 1].map(|side| there[side].then(|| disc.radiosity[side].get()));
            let settings = self.settings;
            let (local_d, local_n) = (frame.local_from_world(d), frame.local_from_world(n));
            let large =
                LargeDisc { center: local_d, normal: local_n, radius: radius2.sqrt(), radiance };
            self.raster.disc(&self.shape, &large, settings.maxdist, |t| settings.weight(t));
            return;
        }
        let distance = d2.sqrt();
        let w = d / distance;
        let local = frame.local_from_world(w);
        let cos = -n.dot(w);
        let side = usize::from(cos < 0.0);
        if local.z <= 0.0 || !there[side] {
            return;
        }
        let solid_angle = disc.area() * cos.abs() / (d2 + 0.75 * radius2) * self.fade(distance);
        let splat = Splat {
            w: local,
            solid_angle,
            radiance: disc.radiosity[side].get(),
            occlusion: self.settings.weight(distance),
            distance,
            face: if side == 1 { Face::Back } else { Face::Front },
        };
        self.raster.splat(&self.shape, &splat);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::{Cloud, Density, HitSides, dice};
    use crate::scene::{Material, Mesh, Scene, Sides};
    use crate::tessellate::Geometry;

    fn geometry(quads: &[[Vec3; 4]]) -> Geometry {
        let positions: Vec<Vec3> = quads.iter().flatten().copied().collect();
        let triangles = (0..quads.len() as u32)
            .flat_map(|q| [[4 * q, 4 * q + 1, 4 * q + 2], [4 * q, 4 * q + 2, 4 * q + 3]])
            .collect();
        let mesh = Mesh {
            positions,
            triangles,
            materials: vec![0; 2 * quads.len()],
            sides: Sides::Two,
            ..Mesh::default()
        };
        Geometry::new(&Scene {
            meshes: vec![mesh],
            materials: vec![Material::default()],
            ..Scene::default()
        })
    }

    fn tree(quads: &[[Vec3; 4]], count: u64, radiosity: Rgb, sides: HitSides) -> Hierarchy {
        let g = geometry(quads);
        let (mut cloud, _) = Cloud::from_pieces(&g, &dice(&g, Density::Elements(count)).unwrap());
        let n = cloud.len();
        cloud.set(Cloud::RADIOSITY, vec![radiosity; n]);
        cloud.set(Cloud::RADIOSITY_BACK, vec![radiosity; n]);
        Hierarchy::new(&cloud, sides).unwrap()
    }

    fn cube() -> Vec<[Vec3; 4]> {
        let c = |i: usize| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32);
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
            .map(|f| f.map(c))
            .to_vec()
    }

    #[test]
    fn inside_a_closed_box_all_is_occluded_and_light_is_even() {
        let tree = tree(&cube(), 60_000, Rgb::new(3.0, 2.0, 1.0), HitSides::Both);
        let settings = PointBasedSettings::default();
        let mut gather = Gather::new(&tree, &settings);
        for (p, n) in [
            (Vec3::new(0.5, 0.0, 0.5), Vec3::Y),
            (Vec3::new(0.01, 0.0, 0.013), Vec3::Y),
            (Vec3::new(0.2, 0.3, 0.4), Vec3::new(0.5, 0.7, -0.2).normalize()),
            (Vec3::new(1.0, 0.3, 0.999), -Vec3::X),
        ] {
            let g = gather.gather(&Receiver { p: p + n * 1e-5, ng: n, ns: n });
            // Closer to an edge than an element is wide the last discs leave gaps.
            assert!(g.occlusion > 0.95 && g.occlusion <= 1.0, "{p}: {}", g.occlusion);
            assert!(
                (g.irradiance / Rgb::new(3.0, 2.0, 1.0) - g.occlusion).abs().max_element() < 0.01,
                "{p}: {}",
                g.irradiance
            );
        }
    }

    #[test]
    fn a_wall_covers_its_form_factor() {
        // Perpendicular to the receiver's plane, foot at distance 0.8, height 1.1, far to both
        // sides.
        let wall = [
            Vec3::new(0.8, 0.0, -300.0),
            Vec3::new(0.8, 0.0, 300.0),
            Vec3::new(0.8, 1.1, 300.0),
            Vec3::new(0.8, 1.1, -300.0),
        ];
        let expected = (1.0 - 0.8 / (0.8f32 * 0.8 + 1.1 * 1.1).sqrt()) / 2.0;
        let tree = tree(&[wall], 400_000, Rgb::ONE, HitSides::Both);
        for (solid_angle, tolerance) in [(0.1, 0.015), (0.05, 0.012), (0.01, 0.008)] {
            let settings =
                PointBasedSettings { maxsolidangle: solid_angle, ..PointBasedSettings::default() };
            let g = Gather::new(&tree, &settings).gather(&Receiver {
                p: Vec3::ZERO,
                ng: Vec3::Y,
                ns: Vec3::Y,
            });
            assert!(
                (g.occlusion - expected).abs() < tolerance,
                "{solid_angle}: {} for {expected}",
                g.occlusion
            );
            assert!(g.bent_normal.x < 0.0 && g.bent_normal.y > 0.0);
        }
    }

    #[test]
    fn distances_sides_and_bias() {
        let roof = [
            Vec3::new(-50.0, 1.0, -50.0),
            Vec3::new(50.0, 1.0, -50.0),
            Vec3::new(50.0, 1.0, 50.0),
            Vec3::new(-50.0, 1.0, 50.0),
        ];
        let roof = |sides| tree(&[roof], 1_000_000, Rgb::ONE, sides);
        let (tree, front, back) =
            (roof(HitSides::Both), roof(HitSides::Front), roof(HitSides::Back));
        let of = |tree: &Hierarchy, settings: PointBasedSettings, y: f32| {
            Gather::new(tree, &settings).gather(&Receiver {
                p: Vec3::new(0.1, y, 0.1),
                ng: Vec3::Y,
                ns: Vec3::Y,
            })
        };
        let at = |settings: PointBasedSettings, y: f32| of(&tree, settings, y);
        let default = PointBasedSettings::default();
        assert!(at(default.clone(), 0.0).occlusion > 0.98);
        // Within distance 2: the cone of 60 degrees, sin² = 3/4.
        assert!(
            (at(PointBasedSettings { maxdist: 2.0, ..default.clone() }, 0.0).occlusion - 0.75)
                .abs()
                < 0.01
        );
        // The winding of the roof faces down, towards the receiver.
        assert!(
            of(&front, default.clone(), 0.0).occlusion > 0.98
                && of(&back, default.clone(), 0.0).occlusion == 0.0
        );
        // In the plane, above it, and just below it.
        assert_eq!(at(default.clone(), 1.0).occlusion, 0.0);
        assert_eq!(at(default.clone(), 1.5).occlusion, 0.0);
        let touching = at(default.clone(), 0.9999).occlusion;
        assert!(touching > 0.95, "{touching}");
        assert_eq!(at(PointBasedSettings { bias: 0.01, ..default.clone() }, 0.995).occlusion, 0.0);
        // A narrow cone sees only the roof, and ∫ over it is π sin².
        let cone = at(PointBasedSettings { coneangle: 20.0, ..default }, 0.0);
        assert!(
            (cone.occlusion - 1.0).abs() < 1e-2
                && (cone.irradiance.x / 20f32.to_radians().sin().powi(2) - 1.0).abs() < 0.02,
            "{cone:?}"
        );
    }
}
