//! World-space triangles with what shading needs to know of them.
//!
//! Input   [`Scene`]. Output  [`Geometry`].
//! Zero-area and repeated-index triangles are dropped, exact duplicates too (they would tie in
//! every ray query); both are counted. Two faces back to back at one place that differ in material,
//! or emit, are two surfaces, and are moved apart by a millionth of their coordinates. Quad and
//! sphere lights are appended as triangles of a black emissive material, after all meshes, in the
//! order of the lights. Guarantee: triangle order is the scene's order; the result depends on
//! nothing else. Cost: O(triangles); 12 B per index triple + 12 B normal + 4 B material + the
//! vertices.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use glam::{Vec2, Vec3};

use super::eyes::Eyes;
use super::sphere::icosphere;
use crate::math::Aabb;
use crate::radiometry::Rgb;
use crate::scene::{Light, Material, Scene, Sides, Texture};

/// Triangles as the rays see them. Arrays over triangles have equal length.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals; a zero vector means "use the face normal".
    pub normals: Vec<Vec3>,
    /// Texture coordinates per vertex; empty when no mesh has any.
    pub uvs: Vec<Vec2>,
    /// Vertex indices per triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Unit face normal by winding, per triangle.
    pub face_normals: Vec<Vec3>,
    /// Index into [`Geometry::materials`], per triangle.
    pub material_of: Vec<u32>,
    /// Index of the scene light a triangle belongs to (quad, sphere), per triangle; `u32::MAX` for
    /// mesh triangles.
    pub light_of: Vec<u32>,
    /// Index of the mesh a triangle came from; lights follow the meshes.
    pub mesh_of: Vec<u32>,
    /// `sides` of every mesh.
    pub sides_of_mesh: Vec<Sides>,
    /// The scene's materials, then one per quad and sphere light.
    pub materials: Vec<Material>,
    /// The scene's textures.
    pub textures: Vec<Texture>,
    /// Whence it is seen and lit.
    pub eyes: Eyes,
    /// Box around everything.
    pub bounds: Aabb,
    /// Zero-area triangles left out.
    pub dropped_degenerate: usize,
    /// Exact duplicates left out.
    pub dropped_duplicate: usize,
}

/// Attributes of a surface point.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceAttributes {
    /// Position.
    pub p: Vec3,
    /// Unit face normal by winding.
    pub ng: Vec3,
    /// Unit shading normal, on the same side as `ng`.
    pub ns: Vec3,
    /// Diffuse reflectance.
    pub albedo: Rgb,
}

/// Triangles by the bits of their sorted corners: the number of the one that is there and whether
/// its corners run through the sorted ones forwards; none where two have been moved apart.
type Seen = HashMap<[[u32; 3]; 3], Option<(u32, bool)>>;

/// How far two faces at one place are moved apart, over their largest coordinate.
const APART: f32 = 1e-6;

/// Decides where masked surfaces exist; what ray backends ask at each candidate hit.
#[derive(Clone, Copy, Debug)]
pub struct Masks<'a>(&'a Geometry);

impl Geometry {
    /// Flattens a scene.
    pub fn new(scene: &Scene) -> Self {
        let mut g = Self {
            materials: scene.materials.clone(),
            textures: scene.textures.clone(),
            eyes: Eyes::new(scene),
            ..Self::default()
        };
        let any_uvs = scene.meshes.iter().any(|m| !m.uvs.is_empty());
        let mut seen = Seen::new();
        for (mesh_index, mesh) in scene.meshes.iter().enumerate() {
            let base = g.positions.len() as u32;
            g.positions.extend_from_slice(&mesh.positions);
            if mesh.normals.is_empty() {
                g.normals.resize(g.positions.len(), Vec3::ZERO);
            } else {
                g.normals.extend_from_slice(&mesh.normals);
            }
            if any_uvs {
                g.uvs.extend_from_slice(&mesh.uvs);
                g.uvs.resize(g.positions.len(), Vec2::ZERO);
            }
            g.sides_of_mesh.push(mesh.sides);
            for (t, &material) in mesh.triangles.iter().zip(&mesh.materials) {
                g.push_triangle(
                    t.map(|i| i + base),
                    material,
                    u32::MAX,
                    mesh_index as u32,
                    &mut seen,
                );
            }
        }
        for (index, light) in scene.lights.iter().enumerate() {
            let (positions, triangles, radiance) = match *light {
                Light::Quad { corner: c, edge1, edge2, radiance } => (
                    vec![c, c + edge1, c + edge1 + edge2, c + edge2],
                    vec![[0, 1, 2], [0, 2, 3]],
                    radiance,
                ),
                Light::Sphere { center, radius, radiance } => {
                    let (p, t) = icosphere(center, radius, 3);
                    (p, t, radiance)
                }
                _ => continue,
            };
            let base = g.positions.len() as u32;
            g.positions.extend(positions);
            g.normals.resize(g.positions.len(), Vec3::ZERO);
            if any_uvs {
                g.uvs.resize(g.positions.len(), Vec2::ZERO);
            }
            let material = g.materials.len() as u32;
            g.materials.push(Material {
                name: format!("light {index}"),
                albedo: Rgb::ZERO,
                emission: radiance,
                ..Material::default()
            });
            let mesh = g.sides_of_mesh.len() as u32;
            g.sides_of_mesh.push(if matches!(light, Light::Sphere { .. }) {
                Sides::One
            } else {
                Sides::Two
            });
            for t in triangles {
                g.push_triangle(t.map(|i: u32| i + base), material, index as u32, mesh, &mut seen);
            }
        }
        g.bounds = Aabb::around(g.triangles.iter().flatten().map(|&i| g.positions[i as usize]));
        g
    }

    fn push_triangle(
        &mut self,
        t: [u32; 3],
        material: u32,
        light: u32,
        mesh: u32,
        seen: &mut Seen,
    ) {
        let [a, b, c] = t.map(|i| self.positions[i as usize]);
        // In f64: products of small f32 edges must not vanish for tiny but honest triangles.
        let n = (b - a).as_dvec3().cross((c - a).as_dvec3());
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        if n.length() <= 1e-12 * f64::from(longest).powi(2) || n.length() == 0.0 {
            self.dropped_degenerate += 1;
            return;
        }
        // Adding zero turns −0 into +0, so that equal coordinates have equal bits.
        let corners = [a, b, c].map(|p| (p + Vec3::ZERO).to_array().map(f32::to_bits));
        let mut key = corners;
        key.sort_unstable();
        let first = corners.iter().position(|&c| c == key[0]).unwrap_or(0);
        let forward = corners[(first + 1) % 3] == key[1];
        let index = self.triangles.len() as u32;
        let mut t = t;
        match seen.entry(key) {
            Entry::Vacant(entry) => _ = entry.insert(Some((index, forward))),
            Entry::Occupied(mut entry) => {
                let differs = |other: u32| {
                    let known = self.material_of[other as usize];
                    known != material || self.materials[known as usize].emits()
                };
                match *entry.get() {
                    Some((other, turned)) if turned != forward && differs(other) => {
                        entry.insert(None);
                        let (at, normal) = (other as usize, self.face_normals[other as usize]);
                        self.triangles[at] = self.lifted(self.triangles[at], normal);
                        t = self.lifted(t, -normal);
                    }
                    _ => {
                        self.dropped_duplicate += 1;
                        return;
                    }
                }
            }
        }
        self.triangles.push(t);
        self.face_normals.push(n.normalize().as_vec3());
        self.material_of.push(material);
        self.light_of.push(light);
        self.mesh_of.push(mesh);
    }

    /// New vertices like those of a triangle, a little along `normal`.
    fn lifted(&mut self, t: [u32; 3], normal: Vec3) -> [u32; 3] {
        let largest = |i: u32| self.positions[i as usize].abs().max_element();
        let step = APART * t.map(largest).into_iter().fold(0.0, f32::max);
        t.map(|i| {
            let i = i as usize;
            self.positions.push(self.positions[i] + normal * step);
            self.normals.push(self.normals[i]);
            if !self.uvs.is_empty() {
                self.uvs.push(self.uvs[i]);
            }
            self.positions.len() as u32 - 1
        })
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }
    /// True without triangles.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }
    /// Corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|i| self.positions[i as usize])
    }
    /// Area of a triangle.
    pub fn area(&self, triangle: u32) -> f32 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).length() * 0.5
    }
    /// Material of a triangle.
    pub fn material(&self, triangle: u32) -> &Material {
        &self.materials[self.material_of[triangle as usize] as usize]
    }
    /// Texture coordinates at barycentrics (u, v).
    pub fn uv(&self, triangle: u32, u: f32, v: f32) -> Vec2 {
        if self.uvs.is_empty() {
            return Vec2::ZERO;
        }
        let [a, b, c] = self.triangles[triangle as usize].map(|i| self.uvs[i as usize]);
        a * (1.0 - u - v) + b * u + c * v
    }
    /// Albedo at barycentrics (u, v).
    pub fn albedo(&self, triangle: u32, u: f32, v: f32) -> Rgb {
        let m = self.material(triangle);
        let texel = m
            .albedo_texture
            .map_or(Rgb::ONE, |t| self.textures[t as usize].color(self.uv(triangle, u, v)));
        m.albedo_with(texel)
    }
    /// Position, normals and albedo at barycentrics (u, v).
    pub fn surface(&self, triangle: u32, u: f32, v: f32) -> SurfaceAttributes {
        let [a, b, c] = self.corners(triangle);
        let ng = self.face_normals[triangle as usize];
        let [na, nb, nc] = self.triangles[triangle as usize].map(|i| self.normals[i as usize]);
        let blended = (na * (1.0 - u - v) + nb * u + nc * v).normalize_or(ng);
        let ns = if na == Vec3::ZERO || nb == Vec3::ZERO || nc == Vec3::ZERO {
            ng
        } else if blended.dot(ng) >= 0.0 {
            blended
        } else {
            -blended
        };
        SurfaceAttributes {
            p: a * (1.0 - u - v) + b * u + c * v,
            ng,
            ns,
            albedo: self.albedo(triangle, u, v),
        }
    }
    /// True when the surface exists at barycentrics (u, v): always, unless its material has a mask.
    pub fn exists(&self, triangle: u32, u: f32, v: f32) -> bool {
        let m = self.material(triangle);
        let texel = m
            .opacity_texture
            .map_or(1.0, |t| self.textures[t as usize].mask(self.uv(triangle, u, v)));
        m.opacity * texel >= 0.5
    }
    /// The mask test, when any material has one. O(triangles): ask once, not per ray.
    pub fn masks(&self) -> Option<Masks<'_>> {
        let masked = |m: &Material| m.opacity_texture.is_some() || m.opacity < 0.5;
        self.material_of.iter().any(|&m| masked(&self.materials[m as usize])).then_some(Masks(self))
    }
}

impl Masks<'_> {
    /// True when the surface exists at barycentrics (u, v).
    pub fn exists(&self, triangle: u32, u: f32, v: f32) -> bool {
        self.0.exists(triangle, u, v)
    }
}
