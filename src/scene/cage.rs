//! A control cage: the polygons, creases and corners of a subdivision surface.

use glam::{Vec2, Vec3};

use super::Sides;

/// Sharpness from which an edge or vertex counts as sharp for ever.
pub const INFINITE_SHARPNESS: f32 = 10.0;

/// What happens at open edges; they are creases in any case but `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Boundary {
    /// Faces at open edges are left out; the surface ends where their neighbours do.
    None,
    /// Open edges are creases; a vertex of a single face stays where it is.
    #[default]
    EdgeAndCorner,
    /// Open edges are creases without corners.
    Edge,
}

/// How texture coordinates are refined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UvRule {
    /// Bilinear in every face.
    #[default]
    Linear,
    /// By the rules of the surface, seams being creases.
    Smooth,
}

/// Polygons of three corners or more, with one material and one crease sharpness each per face and
/// edge.
#[derive(Clone, Debug, Default)]
pub struct Cage {
    /// Name for messages.
    pub name: String,
    /// Vertices.
    pub positions: Vec<Vec3>,
    /// First corner of every face, then the number of corners.
    pub faces: Vec<u32>,
    /// Vertex of every corner, counter-clockwise seen from the front.
    pub corners: Vec<u32>,
    /// Texture coordinates, referred to by `uv_corners`.
    pub uvs: Vec<Vec2>,
    /// Texture coordinate of every corner; empty without any.
    pub uv_corners: Vec<u32>,
    /// Material of every face: indices into [`super::Scene::materials`].
    pub materials: Vec<u32>,
    /// Edges by their two vertices, with the levels they stay sharp for; [`INFINITE_SHARPNESS`] or
    /// more is for ever.
    pub creases: Vec<([u32; 2], f32)>,
    /// Vertices with the levels they stay sharp for.
    pub sharp_vertices: Vec<(u32, f32)>,
    /// Faces that shape the surface but are not part of it.
    pub holes: Vec<u32>,
    /// Open edges; `None` leaves it to whoever tessellates.
    pub boundary: Option<Boundary>,
    /// Which sides count.
    pub sides: Sides,
}

impl Cage {
    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.faces.len().saturating_sub(1)
    }

    /// Corner numbers of a face.
    pub fn face(&self, face: usize) -> std::ops::Range<usize> {
        self.faces[face] as usize..self.faces[face + 1] as usize
    }

    /// Adds a face with a material.
    pub fn push_face(&mut self, corners: &[u32], material: u32) {
        if self.faces.is_empty() {
            self.faces.push(0);
        }
        self.corners.extend_from_slice(corners);
        self.faces.push(self.corners.len() as u32);
        self.materials.push(material);
    }

    /// Turns every face over.
    pub fn flip(&mut self) {
        for f in 0..self.face_count() {
            let range = self.face(f);
            self.corners[range.clone()].reverse();
            if !self.uv_corners.is_empty() {
                self.uv_corners[range].reverse();
            }
        }
    }

    /// The parts that share no vertex, by their first faces. Indices must be in range.
    pub fn parts(&self) -> Vec<Self> {
        let mut parent: Vec<u32> = (0..self.positions.len() as u32).collect();
        let find = |parent: &mut [u32], mut i: u32| {
            while parent[i as usize] != i {
                parent[i as usize] = parent[parent[i as usize] as usize];
                i = parent[i as usize];
            }
            i
        };
        for f in 0..self.face_count() {
            let corners = &self.corners[self.face(f)];
            for pair in corners.windows(2) {
                let (a, b) = (find(&mut parent, pair[0]), find(&mut parent, pair[1]));
                parent[a.max(b) as usize] = a.min(b);
            }
        }
        let mut part_of_root = vec![u32::MAX; self.positions.len()];
        let (mut vertex_of, mut uv_of) =
            (vec![u32::MAX; self.positions.len()], vec![(u32::MAX, 0); self.uvs.len()]);
        let mut parts: Vec<Self> = Vec::new();
        let mut face_of = Vec::with_capacity(self.face_count());
        for f in 0..self.face_count() {
            let root = find(&mut parent, self.corners[self.faces[f] as usize]) as usize;
            if part_of_root[root] == u32::MAX {
                part_of_root[root] = parts.len() as u32;
                parts.push(Self {
                    name: self.name.clone(),
                    boundary: self.boundary,
                    sides: self.sides,
                    ..Self::default()
                });
            }
            let index = part_of_root[root];
            let part = &mut parts[index as usize];
            face_of.push((index, part.face_count() as u32));
            let mut corners = Vec::new();
            for c in self.face(f) {
                let v = self.corners[c] as usize;
                if vertex_of[v] == u32::MAX {
                    vertex_of[v] = part.positions.len() as u32;
                    part.positions.push(self.positions[v]);
                }
                corners.push(vertex_of[v]);
                if let Some(&uv) = self.uv_corners.get(c) {
                    // Parts may share texture coordinates; each gets a copy when it first needs one
                    // after another part did.
                    if uv_of[uv as usize].0 != index {
                        uv_of[uv as usize] = (index, part.uvs.len() as u32);
                        part.uvs.push(self.uvs[uv as usize]);
                    }
                    part.uv_corners.push(uv_of[uv as usize].1);
                }
            }
            part.push_face(&corners, self.materials[f]);
        }
        let mut own = |v: u32| {
            let root = find(&mut parent, v);
            (part_of_root[root as usize], vertex_of[v as usize])
        };
        for &([a, b], s) in &self.creases {
            let ((part, a), (_, b)) = (own(a), own(b));
            if let Some(part) = parts.get_mut(part as usize) {
                part.creases.push(([a, b], s));
            }
        }
        for &(v, s) in &self.sharp_vertices {
            let (part, v) = own(v);
            if let Some(part) = parts.get_mut(part as usize) {
                part.sharp_vertices.push((v, s));
            }
        }
        for &hole in &self.holes {
            let (part, face) = face_of[hole as usize];
            parts[part as usize].holes.push(face);
        }
        parts
    }
}
