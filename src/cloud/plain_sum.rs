//! The plain sum over the elements, and Bunnell's correction of it.
//!
//! ```text
//! occlusion = Σ_e a_e F_e        E = Σ_e a_e F_e B_e
//! ```
//!
//! F_e is the form factor from the receiver to element e, whatever lies between them. For `overlap
//! = "none"` all a_e are 1. For `"bunnell"` a_e is the mean over the element's sides of 1 −
//! occlusion there, by the sum with the a of the pass before (which are 1 at first). Every element
//! then counts by how much it is itself seen: what lies behind something is shadowed by it, so that
//! surfaces behind one another count about once `[Bunnell05]`. Corrected once, occlusion is too
//! weak, since an element that is half hidden from the sky may be in full view of the receiver, and
//! passes alternate around their limit: as in the source, the last two are averaged.
//!
//! Nearer than four radii a disc has the exact form factor of an octagon of its area (Lambert's
//! formula), so the sum is 1 inside closed surfaces. Where things overlap, the sum without
//! correction is no occlusion; with `clamp`, sums above 1 are cut, and their light with them. A sum
//! costs what a [`super::Gather`] does without its raster; `bunnell` costs a sum per small group of
//! elements, side and pass beforehand.

use glam::Vec3;

use super::hierarchy::{Disc, Hierarchy};
use super::raster::Gathered;
use super::settings::PointBasedSettings;
use super::tree_walk::{Seen, seen};
use super::{Cloud, Receiver};
use crate::math::Frame;
use crate::radiometry::Rgb;
use crate::sh::form_integral;

/// How much elements and groups count.
#[derive(Clone, Debug, Default)]
pub struct Accessibility {
    /// By place in the tree.
    pub(super) discs: Vec<f32>,
    pub(super) nodes: Vec<f32>,
}

impl Accessibility {
    /// From one value an element, in the order of the cloud; groups by area.
    pub fn new(tree: &Hierarchy, of_element: &[f32]) -> Self {
        let discs: Vec<f32> = tree.order.iter().map(|&i| of_element[i as usize]).collect();
        let mut sums = vec![0.0f32; tree.nodes.len()];
        for (i, node) in tree.nodes.iter().enumerate().rev() {
            sums[i] = if node.count > 0 {
                (node.next as usize..node.next as usize + usize::from(node.count))
                    .map(|e| tree.discs[e].area() * discs[e])
                    .sum()
            } else {
                sums[i + 1] + sums[node.next as usize]
            };
        }
        let nodes = sums.iter().zip(&tree.appearances).map(|(s, a)| s / a.total).collect();
        Self { discs, nodes }
    }
}

/// Elements nearer than this many radii are summed exactly.
const NEAR: f32 = 4.0;

/// π times the form factor of a disc.
fn disc_integral(disc: &Disc, d: Vec3, normal: Vec3) -> f32 {
    let (n, area) = (disc.n.get(), disc.area());
    let cos = -n.dot(d);
    if cos <= 0.0 && !disc.has_back() {
        return 0.0;
    }
    let radius2 = area * std::f32::consts::FRAC_1_PI;
    let d2 = d.length_squared();
    if d2 > NEAR * NEAR * radius2 {
        return (area * cos.abs() * d.dot(normal).max(0.0) / (d2 * (d2 + 0.75 * radius2))).max(0.0);
    }
    // A regular octagon of the same area.
    let frame = Frame::from_normal(if cos > 0.0 { n } else { -n });
    let r = (area / (2.0 * std::f32::consts::SQRT_2)).sqrt();
    let corners: [Vec3; 8] = std::array::from_fn(|i| {
        let (sin, cos) = (i as f32 * -std::f32::consts::FRAC_PI_4).sin_cos();
        d + (frame.s * cos + frame.t * sin) * r
    });
    form_integral(&corners, normal).abs() as f32
}

/// The plain sum at a receiver; `weights` from the passes of `bunnell`.
pub fn sum(
    tree: &Hierarchy,
    settings: &PointBasedSettings,
    weights: Option<&Accessibility>,
    r: &Receiver,
) -> Gathered {
    let limit = settings.maxsolidangle * std::f32::consts::FRAC_1_PI;
    let (mut occlusion, mut light, mut bent, mut blocked) = (0.0f32, Rgb::ZERO, Vec3::ZERO, 0.0f32);
    let cone = settings.coneangle.to_radians().cos();
    let mut stack = vec![0u32];
    while let Some(id) = stack.pop() {
        let node = &tree.nodes[id as usize];
        let d = node.center - r.p;
        let (d2, size) = (d.length_squared(), node.radius * node.radius);
        if d.dot(r.ng) + node.radius <= settings.bias
            || d.dot(r.ns) + node.radius <= 0.0
            || d2.sqrt() - node.radius > settings.maxdist
        {
            continue;
        }
        let mut add = |w: Vec3, integral: f32, distance: f32, radiance: Rgb, weight: f32| {
            if distance <= settings.maxdist && w.dot(r.ns) >= cone {
                let part = integral * weight;
                occlusion += part * settings.weight(distance);
                blocked += part;
                light += radiance * part;
                bent += w * part;
            }
        };
        if size < d2 && size < limit * d2 {
            let distance = d2.sqrt();
            let w = d / distance;
            let cos = w.dot(r.ns);
            if let (true, Some(Seen { area, radiance, .. })) =
                (cos > 0.0, seen(node, &tree.appearances[id as usize], w))
            {
                add(
                    w,
                    area * cos / d2,
                    distance,
                    radiance,
                    weights.map_or(1.0, |a| a.nodes[id as usize]),
                );
            }
        } else if node.count == 0 {
            stack.extend([id + 1, node.next]);
        } else {
            for e in node.next as usize..node.next as usize + usize::from(node.count) {
                let disc = &tree.discs[e];
                let d = disc.p - r.p;
                let radius = (disc.area() * std::f32::consts::FRAC_1_PI).sqrt();
                let lift = radius * (1.0 - disc.n.get().dot(r.ng).powi(2)).max(0.0).sqrt();
                if d.dot(r.ng) + lift <= settings.bias + 1e-3 * radius {
                    continue;
                }
                let side = usize::from(disc.n.get().dot(d) > 0.0);
                let w = d.normalize_or(r.ns);
                add(
                    w,
                    disc_integral(disc, d, r.ns),
                    d.length(),
                    disc.radiosity[side].get(),
                    weights.map_or(1.0, |a| a.discs[e]),
                );
            }
        }
    }
    let whole = std::f32::consts::PI * (1.0 - cone * cone);
    let cut = if settings.clamp && blocked > whole { whole / blocked } else { 1.0 };
    Gathered {
        from_map: Rgb::ZERO,
        occlusion: occlusion * cut / whole,
        open: (whole - blocked).max(0.0),
        bent_normal: r.ns * (std::f32::consts::FRAC_2_PI * whole) - bent * cut,
        irradiance: light * (cut * std::f32::consts::FRAC_1_PI / tree.scale),
        distance: f32::INFINITY,
    }
}

/// Cloud-ordered accessibility after one more pass: mean over the sides of 1 − occlusion.
pub(super) fn mean_open(cloud: &Cloud, occlusion: &[Vec<f32>; 2]) -> Vec<f32> {
    (0..cloud.len())
        .map(|i| {
            let open = |side: usize| (1.0 - occlusion[side][i]).max(0.0);
            if cloud.one_sided[i] { open(0) } else { 0.5 * (open(0) + open(1)) }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::{Density, HitSides, Overlap, dice};
    use crate::scene::{Material, Mesh, Scene, Sides};
    use crate::tessellate::Geometry;

    fn tree(quads: &[[Vec3; 4]], count: u64) -> Hierarchy {
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
        let g = Geometry::new(&Scene {
            meshes: vec![mesh],
            materials: vec![Material::default()],
            ..Scene::default()
        });
        let (cloud, _) = Cloud::from_pieces(&g, &dice(&g, Density::Elements(count)).unwrap());
        Hierarchy::new(&cloud, HitSides::Both).unwrap()
    }

    #[test]
    fn form_factors_of_a_closed_surface_sum_to_one() {
        let c = |i: usize| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32);
        let cube =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
                .map(|f| f.map(c));
        let tree = tree(&cube, 60_000);
        // The tolerance is that of groups, and of discs that stick out of the edges of the box or
        // leave its corners open.
        for (solid_angle, tolerance) in [(0.0, 0.004), (0.01, 0.012), (0.05, 0.025), (0.2, 0.06)] {
            let settings = PointBasedSettings {
                maxsolidangle: solid_angle,
                overlap: Overlap::None,
                clamp: false,
                ..PointBasedSettings::default()
            };
            for (p, n) in [
                (Vec3::new(0.5, 1e-4, 0.5), Vec3::Y),
                (Vec3::new(0.2, 0.3, 0.4), Vec3::new(0.5, 0.7, -0.2).normalize()),
                (Vec3::new(0.03, 0.5, 0.9), Vec3::X),
            ] {
                let g = sum(&tree, &settings, None, &Receiver { p, ng: n, ns: n });
                assert!(
                    (g.occlusion - 1.0).abs() < tolerance,
                    "{solid_angle} at {p}: {}",
                    g.occlusion
                );
            }
        }
    }

    #[test]
    fn near_discs_by_their_closed_form() {
        let disc = |n: Vec3| Disc {
            p: Vec3::ZERO,
            signed_area: 1.0,
            n: super::super::pack::PackedNormal::new(n),
            radiosity: Default::default(),
        };
        let r2 = std::f32::consts::FRAC_1_PI;
        for h in [0.0f32, 0.01, 0.3, 1.0, 2.0, 2.3, 4.0] {
            let exact = r2 / (r2 + h * h);
            let got =
                disc_integral(&disc(-Vec3::Z), Vec3::Z * h, Vec3::Z) * std::f32::consts::FRAC_1_PI;
            // An octagon for a disc, and its far form from 4 radii (2.26) on.
            assert!(
                got.is_finite() && (h == 0.0 || (got / exact - 1.0).abs() < 0.016),
                "{h}: {got} for {exact}"
            );
        }
    }
}
