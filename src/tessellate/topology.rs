//! Connected parts, closedness, winding: what the edges say.
//!
//! Corners count as one where their positions are exactly equal, whatever their normals or texture
//! coordinates. A part is what hangs together by edges. It is closed and consistently wound when
//! every edge is run through equally often in both directions; its signed volume `V = Σ a · (b × c)
//! / 6` then tells whether fronts look outwards (V > 0).
//!
//! The backs of a closed part are never seen where it has no hole, none that a mask or an opacity
//! cuts either, and all eyes, that is the camera and the lamps, are on the side of its fronts:
//! outside of a body, inside of a room. What is inside has a solid angle of ±4π around it. A part
//! whose fronts look inwards and that has eyes outside is wound inside out.
//!
//! Input   [`Geometry`]. Output  [`Topology`].
//! Guarantees  the same for any thread count. Not  T-junctions: a part whose edges do not match
//!             vertex for vertex is open.
//! Cost    two sorts, of corners and of edges; about 100 B a triangle while it runs.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::Geometry;
use crate::math::Aabb;

/// What the edges say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Topology {
    /// Per triangle: the back is never seen, because the part is closed, consistently wound, and
    /// has all eyes on the side of its fronts.
    pub closed_of_triangle: Vec<bool>,
    /// Connected parts.
    pub components: usize,
    /// Parts closed and consistently wound.
    pub closed_components: usize,
    /// Closed parts whose fronts look inwards, with all eyes inside.
    pub rooms: usize,
    /// Closed parts whose fronts look inwards, with an eye outside: wound inside out.
    pub inside_out: usize,
    /// Edges of one triangle.
    pub boundary_edges: usize,
    /// Edges of more than two triangles.
    pub nonmanifold_edges: usize,
    /// Edges that two triangles run through in the same direction.
    pub inconsistent_edges: usize,
}

/// A directed edge of a triangle, sorted by its undirected key.
type HalfEdge = (u64, u32);

fn position_ids(positions: &[Vec3]) -> Vec<u32> {
    // Adding zero turns −0 into +0.
    let key = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut sorted: Vec<([u32; 3], u32)> =
        positions.par_iter().enumerate().map(|(i, &p)| (key(p), i as u32)).collect();
    sorted.par_sort_unstable();
    let mut ids = vec![0; positions.len()];
    let mut current = 0;
    for (rank, pair) in sorted.iter().enumerate() {
        if rank > 0 && pair.0 != sorted[rank - 1].0 {
            current += 1;
        }
        ids[pair.1 as usize] = current;
    }
    ids
}

fn find(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}

#[derive(Clone, Copy)]
struct Part {
    origin: DVec3,
    volume: f64,
    bounds: Aabb,
    closed: bool,
    /// A mask or an opacity cuts holes into it.
    cut: bool,
}

/// Analyses edges by exact position.
pub fn analyze(geometry: &Geometry) -> Topology {
    let ids = position_ids(&geometry.positions);
    let mut edges: Vec<HalfEdge> = geometry
        .triangles
        .par_iter()
        .enumerate()
        .flat_map_iter(|(t, triangle)| {
            let v = triangle.map(|i| ids[i as usize]);
            (0..3).map(move |k| {
                let (a, b) = (v[k], v[(k + 1) % 3]);
                (
                    u64::from(a.min(b)) << 32 | u64::from(a.max(b)),
                    (t as u32) << 1 | u32::from(a < b),
                )
            })
        })
        .collect();
    drop(ids);
    edges.par_sort_unstable();
    let mut out = Topology::default();
    let mut parent: Vec<u32> = (0..geometry.len() as u32).collect();
    let mut unbalanced = Vec::new();
    for edge in edges.chunk_by(|a, b| a.0 == b.0) {
        let forward = edge.iter().filter(|e| e.1 & 1 == 1).count();
        match edge.len() {
            1 => out.boundary_edges += 1,
            2 if forward != 1 => out.inconsistent_edges += 1,
            2 => {}
            _ => out.nonmanifold_edges += 1,
        }
        if 2 * forward != edge.len() {
            unbalanced.push(edge[0].1 >> 1);
        }
        for pair in edge.windows(2) {
            let (a, b) = (find(&mut parent, pair[0].1 >> 1), find(&mut parent, pair[1].1 >> 1));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    drop(edges);
    let mut part_of = vec![0_u32; geometry.len()];
    let mut parts: Vec<Part> = Vec::new();
    for t in 0..geometry.len() as u32 {
        let root = find(&mut parent, t);
        let corners = geometry.corners(t);
        if root == t {
            part_of[t as usize] = parts.len() as u32;
            parts.push(Part {
                origin: corners[0].as_dvec3(),
                volume: 0.0,
                bounds: Aabb::EMPTY,
                closed: true,
                cut: false,
            });
        } else {
            part_of[t as usize] = part_of[root as usize];
        }
        let material = geometry.material(t);
        let part = &mut parts[part_of[t as usize] as usize];
        part.cut |= material.opacity < 0.5 || material.opacity_texture.is_some();
        let [a, b, c] = corners.map(|p| p.as_dvec3() - part.origin);
        part.volume += a.dot(b.cross(c)) / 6.0;
        part.bounds = Aabb {
            min: corners.iter().fold(part.bounds.min, |m, p| m.min(*p)),
            max: corners.iter().fold(part.bounds.max, |m, p| m.max(*p)),
        };
    }
    for t in unbalanced {
        parts[part_of[t as usize] as usize].closed = false;
    }
    let closed: Vec<Option<Aabb>> = parts.iter().map(|p| p.closed.then_some(p.bounds)).collect();
    let eyes = geometry.eyes.sides(geometry, &part_of, &closed);
    let one_sided: Vec<bool> = parts
        .iter()
        .zip(&eyes)
        .map(|(p, &[any_inside, any_outside])| {
            out.closed_components += usize::from(p.closed);
            if !p.closed {
                return false;
            }
            if p.volume > 0.0 {
                return !p.cut && !any_inside;
            }
            *(if any_outside { &mut out.inside_out } else { &mut out.rooms }) += 1;
            !p.cut && !any_outside
        })
        .collect();
    out.components = parts.len();
    out.closed_of_triangle = part_of.iter().map(|&p| one_sided[p as usize]).collect();
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Material, Mesh, Scene};

    fn cube(center: Vec3, half: f32, inwards: bool) -> Vec<[Vec3; 3]> {
        let p = |i: u32| {
            center
                + half
                    * Vec3::new(
                        if i & 1 == 0 { -1.0 } else { 1.0 },
                        if i & 2 == 0 { -1.0 } else { 1.0 },
                        if i & 4 == 0 { -1.0 } else { 1.0 },
                    )
        };
        let quads =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        quads
            .iter()
            .flat_map(|q| [[p(q[0]), p(q[1]), p(q[2])], [p(q[0]), p(q[2]), p(q[3])]])
            .map(|[a, b, c]| if inwards { [a, c, b] } else { [a, b, c] })
            .collect()
    }

    /// Seen from far off.
    fn analyzed(soup: &[[Vec3; 3]]) -> Topology {
        seen_from(Vec3::splat(50.0), soup, Material::default())
    }

    fn seen_from(eye: Vec3, soup: &[[Vec3; 3]], material: Material) -> Topology {
        let positions: Vec<Vec3> = soup.iter().flatten().copied().collect();
        let n = soup.len() as u32;
        let mesh = Mesh {
            positions,
            triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            materials: vec![0; n as usize],
            ..Mesh::default()
        };
        analyze(&Geometry::new(&Scene {
            meshes: vec![mesh],
            materials: vec![material],
            camera: Camera { eye, ..Camera::default() },
            ..Scene::default()
        }))
    }

    #[test]
    fn closed_open_and_inside_out() {
        let t = analyzed(&cube(Vec3::ONE, 1.0, false));
        assert!(
            (t.components, t.closed_components, t.inside_out) == (1, 1, 0)
                && t.closed_of_triangle.iter().all(|c| *c)
        );
        let t = analyzed(&cube(Vec3::ONE, 1.0, false)[..11]);
        assert!(
            (t.boundary_edges, t.closed_components) == (3, 0)
                && !t.closed_of_triangle.iter().any(|c| *c)
        );
        let t = analyzed(&cube(Vec3::ONE, 1.0, true));
        assert!((t.inside_out, t.rooms) == (1, 0) && !t.closed_of_triangle[0]);
    }

    /// Where the eye is decides whether backs are seen: of a room, its block, a body around the
    /// eye, and of what a mask cuts.
    #[test]
    fn eyes_decide() {
        let mut soup = cube(Vec3::ZERO, 2.0, true);
        soup.extend(cube(Vec3::new(0.5, 0.0, 0.0), 0.5, false));
        let from = |x: f32| seen_from(Vec3::new(x, 0.1, 0.2), &soup, Material::default());
        let [in_room, in_block, outside] = [-1.0, 0.5, 5.0].map(from);
        assert_eq!((in_room.components, in_room.rooms, in_room.inside_out), (2, 1, 0));
        assert!(in_room.closed_of_triangle.iter().all(|c| *c));
        assert!(in_block.closed_of_triangle[0] && !in_block.closed_of_triangle[12]);
        assert_eq!((outside.rooms, outside.inside_out), (0, 1));
        assert!(!outside.closed_of_triangle[0] && outside.closed_of_triangle[12]);
        let outwards = cube(Vec3::ZERO, 2.0, false);
        let inside = seen_from(Vec3::new(0.3, 0.1, 0.2), &outwards, Material::default());
        assert!(!inside.closed_of_triangle.contains(&true));
        let glass = Material { opacity: 0.2, ..Material::default() };
        assert!(!seen_from(Vec3::splat(9.0), &outwards, glass).closed_of_triangle[0]);
    }

    #[test]
    fn flipped_and_shared_edges_are_counted() {
        let mut soup = cube(Vec3::ZERO, 1.0, false);
        soup[0].swap(1, 2);
        let t = analyzed(&soup);
        assert_eq!((t.inconsistent_edges, t.closed_components), (3, 0));
        // Two cubes that meet along one edge: four triangles there, but balanced.
        let mut soup = cube(Vec3::ZERO, 1.0, false);
        soup.extend(cube(Vec3::new(2.0, 2.0, 0.0), 1.0, false));
        let t = analyzed(&soup);
        assert_eq!((t.nonmanifold_edges, t.components, t.closed_components), (1, 1, 1));
    }
}
