//! Polygons as half-edges, and one level of Catmull–Clark refinement of them.
//!
//! Half-edge `c` is corner `c` of a face and runs to the face's next corner. Refinement is by index
//! alone, without a search: the vertices of the next level are the old vertices, then one point an
//! edge, then one a face; its faces are the corners of this one, so that face `c` has the corners
//! `4c…4c+3` at vertex, edge point, face point, edge point of the edge before.
//!
//! Rules   `[CC78]`: face point = mean of the corners; edge point = mean of both ends and both face
//!         points; vertex point `(n−2)/n v + (Σ eᵢ + Σ fᵢ)/n²`. `[DKT98]`: a sharp edge's point is
//!         its middle; a vertex of two sharp edges moves to `(e₀ + 6 v + e₁)/8`, one of three or
//!         more, or a sharp one, stays. Sharpness falls by 1 a level (from [`INFINITE_SHARPNESS`]
//!         on it never does), between 0 and 1 smooth and sharp points are blended; a vertex whose
//!         rule changes from this level to the next blends both rules by the mean sharpness of what
//!         fades, as OpenSubdiv does.
//! Guarantees  the same bits for any thread count. Open edges and edges of more than two faces, or
//!             of two wound against each other, are sharp.
//! Cost    O(corners); 60 B a corner of the finer level.

use glam::{DVec3, Vec2};

use crate::scene::{Boundary, Cage, INFINITE_SHARPNESS};

/// No twin: an open edge.
pub(super) const NONE: u32 = u32::MAX;

/// A mesh of polygons; of quads from the first refinement on.
#[derive(Clone, Debug, Default)]
pub(super) struct HalfEdges {
    pub positions: Vec<DVec3>,
    /// Start vertex of every half-edge.
    pub vertex: Vec<u32>,
    /// Edge of every half-edge.
    pub edge: Vec<u32>,
    /// The half-edge that runs against it, or [`NONE`].
    pub twin: Vec<u32>,
    /// Following half-edge of the face; empty for quads.
    next: Vec<u32>,
    /// Ends of every edge.
    pub ends: Vec<[u32; 2]>,
    pub edge_sharpness: Vec<f32>,
    pub vertex_sharpness: Vec<f32>,
    /// Material of every face, [`NONE`] for holes.
    pub materials: Vec<u32>,
    /// Bilinearly refined texture coordinates of every corner, or empty.
    pub uvs: Vec<Vec2>,
    /// Edges of more than two faces, or of two wound against each other.
    pub faulty_edges: usize,
}

/// Sharpness one level on.
pub(super) fn fade(sharpness: f32) -> f32 {
    if sharpness >= INFINITE_SHARPNESS { sharpness } else { (sharpness - 1.0).max(0.0) }
}

/// What a vertex rule sums over the edges and faces around the vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct VertexSums {
    edges: u32,
    edge_sum: DVec3,
    face_sum: DVec3,
    /// Sharp edges and the sum of their far ends, at this level and at the next.
    sharp: [(u32, DVec3); 2],
    fading: (u32, f64),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rule {
    Smooth,
    Crease,
    Corner,
}

impl VertexSums {
    pub fn add_edge(&mut self, far_end: DVec3, sharpness: f32) {
        self.edges += 1;
        self.edge_sum += far_end;
        for (level, s) in [sharpness, fade(sharpness)].into_iter().enumerate() {
            if s > 0.0 {
                self.sharp[level].0 += 1;
                self.sharp[level].1 += far_end;
            }
        }
        self.note_fading(sharpness);
    }

    pub fn add_face(&mut self, face_point: DVec3) {
        self.face_sum += face_point;
    }

    fn note_fading(&mut self, sharpness: f32) {
        if sharpness > 0.0 && fade(sharpness) <= 0.0 {
            self.fading.0 += 1;
            self.fading.1 += f64::from(sharpness);
        }
    }

    fn apply(&self, rule: Rule, level: usize, v: DVec3) -> DVec3 {
        match rule {
            Rule::Corner => v,
            Rule::Crease => v * 0.75 + self.sharp[level].1 * 0.125,
            Rule::Smooth => {
                let n = f64::from(self.edges);
                v * ((n - 2.0) / n) + (self.edge_sum + self.face_sum) / (n * n)
            }
        }
    }

    /// Where the vertex goes.
    pub fn point(mut self, v: DVec3, sharpness: f32) -> DVec3 {
        if self.edges == 0 {
            return v;
        }
        self.note_fading(sharpness);
        let rule = |level: usize, s: f32| match self.sharp[level].0 {
            _ if s > 0.0 => Rule::Corner,
            0 | 1 => Rule::Smooth,
            2 => Rule::Crease,
            _ => Rule::Corner,
        };
        let (now, then) = (rule(0, sharpness), rule(1, fade(sharpness)));
        if now == then {
            return self.apply(now, 0, v);
        }
        let share = (self.fading.1 / f64::from(self.fading.0.max(1))).clamp(0.0, 1.0);
        self.apply(now, 0, v) * share + self.apply(then, 1, v) * (1.0 - share)
    }
}

/// An edge's point: of both ends, and of both face points where there are two.
pub(super) fn edge_point(ends: [DVec3; 2], faces: Option<[DVec3; 2]>, sharpness: f32) -> DVec3 {
    let middle = (ends[0] + ends[1]) * 0.5;
    match faces {
        Some([a, b]) if sharpness < 1.0 => {
            let smooth = (ends[0] + ends[1] + a + b) * 0.25;
            if sharpness > 0.0 { smooth.lerp(middle, f64::from(sharpness)) } else { smooth }
        }
        _ => middle,
    }
}

impl HalfEdges {
    /// # Errors
    /// A message when an index is out of range or a face has fewer than three corners.
    pub fn check(cage: &Cage) -> Result<(), String> {
        if (0..cage.face_count()).any(|f| cage.face(f).len() < 3) {
            return Err("a face has fewer than three corners".into());
        }
        let (vertices, faces) = (cage.positions.len(), cage.face_count());
        let within =
            |mut list: std::slice::Iter<'_, u32>, n: usize| list.all(|&i| (i as usize) < n);
        let uvs = cage.uv_corners.is_empty() || cage.uv_corners.len() == cage.corners.len();
        let indices = within(cage.corners.iter(), vertices)
            && within(cage.uv_corners.iter(), cage.uvs.len())
            && within(cage.holes.iter(), faces);
        let sharp = cage.creases.iter().all(|c| within(c.0.iter(), vertices))
            && cage.sharp_vertices.iter().all(|s| (s.0 as usize) < vertices);
        if indices && sharp && uvs && cage.materials.len() == faces {
            Ok(())
        } else {
            Err("an index of the cage is out of range".into())
        }
    }

    /// Connects the faces of a cage.
    ///
    /// # Errors
    /// A message when an index is out of range or a face has fewer than three corners.
    pub fn new(cage: &Cage, boundary: Boundary) -> Result<Self, String> {
        Self::check(cage)?;
        let vertices = cage.positions.len();
        let mut next = vec![0; cage.corners.len()];
        for r in (0..cage.face_count()).map(|f| cage.face(f)) {
            for c in r.clone() {
                next[c] = if c + 1 == r.end { r.start } else { c + 1 } as u32;
            }
        }
        let mut materials = cage.materials.clone();
        for &hole in &cage.holes {
            if let Some(m) = materials.get_mut(hole as usize) {
                *m = NONE;
            }
        }
        let mut mesh = Self {
            positions: cage.positions.iter().map(|p| p.as_dvec3()).collect(),
            vertex: cage.corners.clone(),
            next,
            vertex_sharpness: vec![0.0; vertices],
            materials,
            uvs: cage.uv_corners.iter().map(|&i| cage.uvs[i as usize]).collect(),
            ..Self::default()
        };
        for &(v, s) in &cage.sharp_vertices {
            if let Some(own) = mesh.vertex_sharpness.get_mut(v as usize) {
                *own = own.max(s);
            }
        }
        mesh.connect(cage);
        mesh.sharpen_vertices(boundary);
        if boundary == Boundary::None {
            mesh.drop_boundary_faces(cage);
        }
        Ok(mesh)
    }

    fn connect(&mut self, cage: &Cage) {
        let key = |a: u32, b: u32| (a.min(b), a.max(b));
        let mut sorted: Vec<((u32, u32), u32)> = (0..self.vertex.len())
            .map(|c| (key(self.vertex[c], self.vertex[self.next[c] as usize]), c as u32))
            .collect();
        sorted.sort_unstable();
        self.edge = vec![0; sorted.len()];
        self.twin = vec![NONE; sorted.len()];
        for group in sorted.chunk_by(|a, b| a.0 == b.0) {
            let (a, b) = group[0].0;
            for &(_, c) in group {
                self.edge[c as usize] = self.ends.len() as u32;
            }
            self.ends.push([a, b]);
            let [first, second] = [group[0].1, group[group.len() - 1].1];
            if group.len() == 2 && self.vertex[first as usize] != self.vertex[second as usize] {
                self.twin[first as usize] = second;
                self.twin[second as usize] = first;
                self.edge_sharpness.push(0.0);
            } else {
                self.faulty_edges += usize::from(group.len() > 1);
                self.edge_sharpness.push(INFINITE_SHARPNESS);
            }
        }
        for &([a, b], s) in &cage.creases {
            let (a, b) = key(a, b);
            if let Ok(e) = self.ends.binary_search(&[a, b]) {
                self.edge_sharpness[e] = self.edge_sharpness[e].max(s);
            }
        }
    }

    /// Vertices where several surfaces touch stay where they are, and so do those of one face at an
    /// open edge.
    fn sharpen_vertices(&mut self, boundary: Boundary) {
        let (offsets, list) = self.corners_of_vertices();
        for v in 0..self.positions.len() {
            let own = &list[offsets[v] as usize..offsets[v + 1] as usize];
            let Some(&first) = own.first() else { continue };
            let mut around: Vec<u32> = own
                .iter()
                .flat_map(|&c| [self.edge[c as usize], self.edge[self.prev(c) as usize]])
                .collect();
            around.sort_unstable();
            around.dedup();
            let sharp = around
                .iter()
                .filter(|&&e| self.edge_sharpness[e as usize] >= INFINITE_SHARPNESS)
                .count();
            let several = self.fan(first).0.len() < own.len() && sharp != 2;
            let lone = boundary == Boundary::EdgeAndCorner && own.len() == 1;
            if several || lone {
                self.vertex_sharpness[v] = INFINITE_SHARPNESS;
            }
        }
    }

    fn drop_boundary_faces(&mut self, cage: &Cage) {
        let mut open = vec![false; self.positions.len()];
        for (c, _) in self.twin.iter().enumerate().filter(|(_, t)| **t == NONE) {
            open[self.vertex[c] as usize] = true;
            open[self.vertex[self.next[c] as usize] as usize] = true;
        }
        for f in 0..cage.face_count() {
            if cage.face(f).any(|c| open[self.vertex[c] as usize]) {
                self.materials[f] = NONE;
            }
        }
    }

    /// Following half-edge of the face.
    pub fn next(&self, c: u32) -> u32 {
        if self.next.is_empty() { c & !3 | (c + 1) & 3 } else { self.next[c as usize] }
    }

    /// Half-edge before it in the face.
    pub fn prev(&self, c: u32) -> u32 {
        if self.next.is_empty() {
            return c & !3 | (c + 3) & 3;
        }
        let mut at = c;
        while self.next[at as usize] != c {
            at = self.next[at as usize];
        }
        at
    }

    /// Half-edges by their start vertex: offsets (one more than vertices) and the list, ascending.
    pub fn corners_of_vertices(&self) -> (Vec<u32>, Vec<u32>) {
        let mut offsets = vec![0u32; self.positions.len() + 1];
        for &v in &self.vertex {
            offsets[v as usize + 1] += 1;
        }
        for v in 1..offsets.len() {
            offsets[v] += offsets[v - 1];
        }
        let mut at = offsets.clone();
        let mut list = vec![0; self.vertex.len()];
        for (c, &v) in self.vertex.iter().enumerate() {
            list[at[v as usize] as usize] = c as u32;
            at[v as usize] += 1;
        }
        (offsets, list)
    }

    /// The corners around the start vertex of `c` that hang together by edges, counter-clockwise,
    /// and whether they close. An open fan starts at its open edge.
    pub fn fan(&self, c: u32) -> (Vec<u32>, bool) {
        let mut start = c;
        loop {
            let t = self.twin[start as usize];
            if t == NONE {
                break;
            }
            start = self.next(t);
            if start == c {
                break;
            }
        }
        let mut list = vec![start];
        loop {
            let t = self.twin[self.prev(*list.last().unwrap_or(&start)) as usize];
            if t == NONE {
                return (list, false);
            }
            if t == start {
                return (list, true);
            }
            list.push(t);
        }
    }

    /// Longest edge.
    pub fn longest_edge(&self) -> f64 {
        self.ends
            .iter()
            .map(|e| self.positions[e[0] as usize].distance_squared(self.positions[e[1] as usize]))
            .fold(0.0, f64::max)
            .sqrt()
    }

    /// Faces of the next level.
    pub fn next_faces(&self) -> usize {
        self.vertex.len()
    }

    /// One level of refinement.
    pub fn refine(&self) -> Self {
        let (vertices, edges, corners) = (self.positions.len(), self.ends.len(), self.vertex.len());
        let face_of = self.faces_of_corners();
        let face_count = self.materials.len();
        let mut face_points = vec![DVec3::ZERO; face_count];
        let mut sizes = vec![0u32; face_count];
        let mut uv_means = vec![Vec2::ZERO; if self.uvs.is_empty() { 0 } else { face_count }];
        for c in 0..corners {
            let f = face_of(c) as usize;
            face_points[f] += self.positions[self.vertex[c] as usize];
            sizes[f] += 1;
            if let Some(mean) = uv_means.get_mut(f) {
                *mean += self.uvs[c];
            }
        }
        for (f, &n) in sizes.iter().enumerate() {
            face_points[f] /= f64::from(n.max(1));
            if let Some(mean) = uv_means.get_mut(f) {
                *mean /= n.max(1) as f32;
            }
        }
        let mut half_of_edge = vec![NONE; edges];
        for c in (0..corners).rev() {
            half_of_edge[self.edge[c] as usize] = c as u32;
        }
        let mut sums = vec![VertexSums::default(); vertices];
        let mut edge_points = Vec::with_capacity(edges);
        for (e, (&[a, b], &s)) in self.ends.iter().zip(&self.edge_sharpness).enumerate() {
            let ends = [a, b].map(|v| self.positions[v as usize]);
            sums[a as usize].add_edge(ends[1], s);
            sums[b as usize].add_edge(ends[0], s);
            let c = half_of_edge[e] as usize;
            let t = self.twin[c];
            let faces =
                (t != NONE).then(|| [c, t as usize].map(|c| face_points[face_of(c) as usize]));
            edge_points.push(edge_point(ends, faces, s));
        }
        for c in 0..corners {
            sums[self.vertex[c] as usize].add_face(face_points[face_of(c) as usize]);
        }
        let mut positions: Vec<DVec3> = sums
            .iter()
            .zip(&self.positions)
            .zip(&self.vertex_sharpness)
            .map(|((sum, &v), &s)| sum.point(v, s))
            .collect();
        drop(sums);
        positions.append(&mut edge_points);
        positions.append(&mut face_points);

        let mut fine = Self { faulty_edges: self.faulty_edges, ..Self::default() };
        fine.vertex_sharpness = self.vertex_sharpness.iter().map(|&s| fade(s)).collect();
        fine.vertex_sharpness.resize(positions.len(), 0.0);
        fine.positions = positions;
        fine.vertex.reserve_exact(4 * corners);
        fine.edge.reserve_exact(4 * corners);
        fine.twin.reserve_exact(4 * corners);
        fine.materials.reserve_exact(corners);
        fine.uvs.reserve_exact(4 * self.uvs.len());
        for c in 0..corners as u32 {
            let (p, n, f) = (self.prev(c), self.next(c), face_of(c as usize));
            let (v, e, before) =
                (self.vertex[c as usize], self.edge[c as usize], self.edge[p as usize]);
            let middle = |e: u32| vertices as u32 + e;
            let half = |e: u32| 2 * e + u32::from(self.ends[e as usize][0] != v);
            let inner = |c: u32| 2 * edges as u32 + c;
            let across = |half: u32, child: fn(&Self, u32) -> u32| {
                let t = self.twin[half as usize];
                if t == NONE { NONE } else { child(self, t) }
            };
            fine.vertex.extend([v, middle(e), (vertices + edges) as u32 + f, middle(before)]);
            fine.edge.extend([half(e), inner(c), inner(p), half(before)]);
            fine.twin.extend([
                across(c, |m, t| 4 * m.next(t) + 3),
                4 * n + 2,
                4 * p + 1,
                across(p, |_, t| 4 * t),
            ]);
            fine.materials.push(self.materials[f as usize]);
            if !self.uvs.is_empty() {
                let [own, after, back] = [c, n, p].map(|k| self.uvs[k as usize]);
                fine.uvs.extend([
                    own,
                    (own + after) * 0.5,
                    uv_means[f as usize],
                    (back + own) * 0.5,
                ]);
            }
        }
        fine.ends.reserve_exact(2 * edges + corners);
        for (e, &[a, b]) in self.ends.iter().enumerate() {
            let middle = (vertices + e) as u32;
            fine.ends.extend([[a, middle], [b, middle]]);
            fine.edge_sharpness.extend([fade(self.edge_sharpness[e]); 2]);
        }
        for c in 0..corners {
            fine.ends
                .push([vertices as u32 + self.edge[c], (vertices + edges) as u32 + face_of(c)]);
        }
        fine.edge_sharpness.resize(fine.ends.len(), 0.0);
        fine
    }

    fn faces_of_corners(&self) -> impl Fn(usize) -> u32 + use<> {
        let mut list = Vec::new();
        if !self.next.is_empty() {
            let mut face = 0;
            for (c, &n) in self.next.iter().enumerate() {
                list.push(face);
                face += u32::from((n as usize) < c);
            }
        }
        move |c| if list.is_empty() { (c / 4) as u32 } else { list[c] }
    }
}
