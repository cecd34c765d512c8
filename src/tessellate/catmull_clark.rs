//! Catmull–Clark subdivision surfaces: [`Cage`] → [`Mesh`] on the limit surface.
//!
//! The cage is refined N times (rules: `half_edges`), every vertex is moved to its limit and gets
//! the limit's normal (`limit`), and every quad is cut along its shorter diagonal. So the vertices
//! lie exactly on the smooth surface, whatever N; what N decides is how well the triangles between
//! them follow it: the distance falls by 4 a level.
//!
//! Input   a [`Cage`] in world space. Output  a [`Mesh`]; vertices split where normals (creases) or
//!         texture coordinates (seams) differ.
//! Source  `[CC78]` Catmull, Clark; `[DKT98]` DeRose, Kass, Truong (creases); `[HKD93]` Halstead,
//!         Kass, DeRose (limits).
//! Guarantees  one limit position a vertex, so that a closed cage gives a closed mesh, bit for bit;
//!             the same for any thread count; a mesh of more than [`MAX_TRIANGLES`] is refused
//!             before it is allocated. Not  adaptive within one connected part; hierarchical edits.
//! Cost    2 · 4^(N−1) triangles a corner of the cage; about 250 B a triangle while it runs.
//! Knobs   [`Levels`] (3); [`SubdivisionSettings::boundary`] (edge-and-corner);
//!         [`SubdivisionSettings::uv`] (linear); creases by angle (off).

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::half_edges::{HalfEdges, NONE};
use super::limit::Ring;
use crate::scene::{Boundary, Cage, INFINITE_SHARPNESS, Mesh, UvRule};

/// Most triangles of one subdivided or curve mesh; about 8 GiB while it is made.
pub const MAX_TRIANGLES: u64 = 1 << 25;

/// Most levels: one cage face becomes a quarter of a million quads.
pub const MAX_LEVELS: u32 = 10;

/// How fine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Levels {
    /// This number, from 1 on.
    Fixed(u32),
    /// For every part of the cage that shares no vertex with others the least for which no edge of
    /// the refined cage is longer than this, scene units.
    Edge(f32),
}

/// How a cage is tessellated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubdivisionSettings {
    /// How fine.
    pub levels: Levels,
    /// Open edges, where the cage does not say.
    pub boundary: Boundary,
    /// Texture coordinates.
    pub uv: UvRule,
    /// Edges whose faces' normals differ by more than this many degrees are creases of
    /// `crease_sharpness`.
    pub crease_angle_deg: Option<f32>,
    /// Sharpness of such edges, levels.
    pub crease_sharpness: f32,
}

impl Default for SubdivisionSettings {
    fn default() -> Self {
        Self {
            levels: Levels::Fixed(3),
            boundary: Boundary::default(),
            uv: UvRule::default(),
            crease_angle_deg: None,
            crease_sharpness: INFINITE_SHARPNESS,
        }
    }
}

/// The triangles of a cage's limit surface, and how many of its edges are shared by more than two
/// faces or by two wound against each other (they became creases).
///
/// # Errors
/// A message when the cage's indices are wrong or the mesh would not fit.
pub fn subdivide(cage: &Cage, settings: &SubdivisionSettings) -> Result<(Mesh, usize), String> {
    let (mut out, faulty) = if matches!(settings.levels, Levels::Edge(_)) && cage.face_count() > 1 {
        HalfEdges::check(cage)?;
        let mut whole = Mesh::default();
        let mut faulty = 0;
        for part in cage.parts() {
            let (mesh, count) = subdivide_part(&part, settings)?;
            faulty += count;
            append(&mut whole, mesh);
            if whole.triangles.len() as u64 > MAX_TRIANGLES {
                return Err(format!(
                    "the parts together would make more than {MAX_TRIANGLES} triangles; give a \
                     longer edge"
                ));
            }
        }
        (whole, faulty)
    } else {
        subdivide_part(cage, settings)?
    };
    out.name.clone_from(&cage.name);
    out.sides = cage.sides;
    Ok((out, faulty))
}

fn append(whole: &mut Mesh, part: Mesh) {
    let base = whole.positions.len() as u32;
    whole.triangles.extend(part.triangles.iter().map(|t| t.map(|i| i + base)));
    whole.materials.extend(part.materials);
    whole.positions.extend(part.positions);
    whole.normals.extend(part.normals);
    whole.uvs.extend(part.uvs);
}

fn subdivide_part(cage: &Cage, settings: &SubdivisionSettings) -> Result<(Mesh, usize), String> {
    let boundary = cage.boundary.unwrap_or(settings.boundary);
    let mut mesh = HalfEdges::new(cage, boundary)?;
    if let Some(angle) = settings.crease_angle_deg {
        crease_by_angle(&mut mesh, angle, settings.crease_sharpness);
    }
    let mut uv_mesh = (settings.uv == UvRule::Smooth && !cage.uv_corners.is_empty())
        .then(|| uv_cage(cage))
        .transpose()?;
    let mut level = 0;
    loop {
        let done = match settings.levels {
            Levels::Fixed(n) => level >= n.max(1),
            Levels::Edge(length) => level >= 1 && mesh.longest_edge() <= f64::from(length),
        };
        if done {
            break;
        }
        let left = match settings.levels {
            Levels::Fixed(n) => n.max(1) - level,
            Levels::Edge(_) => 1,
        };
        check_size(&mesh, level, left, settings.levels)?;
        mesh = mesh.refine();
        uv_mesh = uv_mesh.map(|m| m.refine());
        level += 1;
    }
    if let Some(uv) = uv_mesh {
        let (offsets, list) = uv.corners_of_vertices();
        let mut corner_uvs = vec![Vec2::ZERO; uv.vertex.len()];
        for v in 0..uv.positions.len() {
            let own = &list[offsets[v] as usize..offsets[v + 1] as usize];
            if let Some(&first) = own.first() {
                let limit = limit_of(&uv, first).0.as_vec3().truncate();
                own.iter().for_each(|&c| corner_uvs[c as usize] = limit);
            }
        }
        mesh.uvs = corner_uvs;
    }
    Ok((emit(&mesh), mesh.faulty_edges))
}

fn check_size(mesh: &HalfEdges, level: u32, left: u32, levels: Levels) -> Result<(), String> {
    let triangles = (2 * mesh.next_faces() as u64)
        .saturating_mul(1u64.checked_shl(2 * (left - 1)).unwrap_or(u64::MAX));
    if triangles <= MAX_TRIANGLES && level + left <= MAX_LEVELS {
        return Ok(());
    }
    Err(match levels {
        Levels::Fixed(n) if n > MAX_LEVELS => {
            format!("levels is {n} but may not exceed {MAX_LEVELS}; give fewer")
        }
        Levels::Fixed(n) => format!(
            "levels = {n} would make {triangles} triangles, more than {MAX_TRIANGLES}; give fewer \
             levels"
        ),
        Levels::Edge(length) => {
            format!(
                "edges of {length} would need more than {level} levels and {MAX_TRIANGLES} \
                 triangles or {MAX_LEVELS} levels; give a longer edge"
            )
        }
    })
}

/// The texture plane as a cage of its own: seams are its open edges.
fn uv_cage(cage: &Cage) -> Result<HalfEdges, String> {
    let flat = Cage {
        positions: cage.uvs.iter().map(|uv| uv.extend(0.0)).collect(),
        faces: cage.faces.clone(),
        corners: cage.uv_corners.clone(),
        materials: cage.materials.clone(),
        ..Cage::default()
    };
    HalfEdges::new(&flat, Boundary::EdgeAndCorner)
}

/// Sharpens edges between faces whose (Newell) normals differ by more than an angle.
fn crease_by_angle(mesh: &mut HalfEdges, angle_deg: f32, sharpness: f32) {
    let limit = f64::from(angle_deg).to_radians().cos() - 1e-9;
    let normal = |mesh: &HalfEdges, c: u32| {
        let origin = mesh.positions[mesh.vertex[c as usize] as usize];
        let at = |c: u32| mesh.positions[mesh.vertex[c as usize] as usize] - origin;
        let mut sum = DVec3::ZERO;
        let mut k = mesh.next(c);
        while k != c {
            sum += at(k).cross(at(mesh.next(k)));
            k = mesh.next(k);
        }
        sum.normalize_or_zero()
    };
    for c in 0..mesh.twin.len() as u32 {
        let t = mesh.twin[c as usize];
        if t != NONE && c < t && normal(mesh, c).dot(normal(mesh, t)) < limit {
            let e = mesh.edge[c as usize] as usize;
            mesh.edge_sharpness[e] = mesh.edge_sharpness[e].max(sharpness);
        }
    }
}

/// Limit of the start vertex of a corner, with the normals of the fan's corners.
fn limit_of(mesh: &HalfEdges, corner: u32) -> (DVec3, Vec<(u32, DVec3)>) {
    let (fan, closed) = mesh.fan(corner);
    let (position, normals) = Ring::new(mesh, &fan, closed).limit();
    (position, fan.into_iter().zip(normals).collect())
}

/// New vertices of a block of old ones, in order.
#[derive(Default)]
struct Block {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    /// Corner and its vertex in this block.
    corners: Vec<(u32, u32)>,
}

const BLOCK: usize = 1 << 14;

fn emit(mesh: &HalfEdges) -> Mesh {
    let (offsets, list) = mesh.corners_of_vertices();
    let of_vertex = |v: usize| &list[offsets[v] as usize..offsets[v + 1] as usize];
    let kept = |c: u32| mesh.materials[c as usize / 4] != NONE;
    let vertices = mesh.positions.len();
    let blocks: Vec<Block> = (0..vertices.div_ceil(BLOCK))
        .into_par_iter()
        .map(|b| {
            let mut block = Block::default();
            let mut made: Vec<([u32; 5], u32)> = Vec::new();
            for v in b * BLOCK..(b * BLOCK + BLOCK).min(vertices) {
                let own = of_vertex(v);
                let Some(&first) = own.first() else { continue };
                let (position, mut normals) = limit_of(mesh, first);
                // Other surfaces that touch here share the position and have normals of their own.
                for &c in own {
                    if !normals.iter().any(|n| n.0 == c) {
                        normals.extend(limit_of(mesh, c).1);
                    }
                }
                made.clear();
                for &(c, n) in normals.iter().filter(|n| kept(n.0)) {
                    let normal = n.as_vec3().normalize_or_zero();
                    let uv = mesh.uvs.get(c as usize).copied().unwrap_or_default();
                    let key = [normal.x, normal.y, normal.z, uv.x, uv.y].map(f32::to_bits);
                    let index =
                        made.iter().find(|m| m.0 == key).map(|m| m.1).unwrap_or_else(|| {
                            block.positions.push(position.as_vec3());
                            block.normals.push(normal);
                            if !mesh.uvs.is_empty() {
                                block.uvs.push(uv);
                            }
                            made.push((key, block.positions.len() as u32 - 1));
                            block.positions.len() as u32 - 1
                        });
                    block.corners.push((c, index));
                }
            }
            block
        })
        .collect();
    let mut out = Mesh::default();
    let mut index_of = vec![0u32; mesh.vertex.len()];
    for block in blocks {
        let base = out.positions.len() as u32;
        block.corners.iter().for_each(|&(c, i)| index_of[c as usize] = base + i);
        out.positions.extend(block.positions);
        out.normals.extend(block.normals);
        out.uvs.extend(block.uvs);
    }
    for (quad, &material) in index_of.chunks_exact(4).zip(&mesh.materials) {
        let &[a, b, c, d] = quad else { continue };
        if material == NONE {
            continue;
        }
        let length =
            |i: u32, j: u32| out.positions[i as usize].distance_squared(out.positions[j as usize]);
        out.triangles.extend(if length(b, d) < length(a, c) {
            [[a, b, d], [b, c, d]]
        } else {
            [[a, b, c], [a, c, d]]
        });
        out.materials.extend([material; 2]);
    }
    out
}
