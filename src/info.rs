//! What a scene holds and what is odd about it.
//!
//! Lengths in scene units; powers in watts per channel summed by luminance. The power of sun and
//! sky is what crosses the scene's bounding sphere: `π R² E` and `4 π² R² L`. The proposed alpha is
//! what a decomposition takes by default: a share of the extent.

use std::f64::consts::PI;

use glam::Vec3;
use serde::Serialize;

use crate::load::Loaded;
use crate::memory;
use crate::method::decompose::DecomposeSettings;
use crate::radiometry::{MAX_ALBEDO, Rgb, luminance};
use crate::render::{CAMERA_INSIDE_WALL, camera_inside_wall};
use crate::scene::{Environment, Light, Scene};
use crate::shading::World;
use crate::tessellate::{Geometry, analyze_topology};

/// A material in use.
#[derive(Clone, Debug, Serialize)]
pub struct MaterialLine {
    /// Name.
    pub name: String,
    /// Triangles.
    pub triangles: usize,
    /// Reflectance, before textures.
    pub albedo: [f32; 3],
    /// Greatest channel of the reflectance anywhere.
    pub brightest: f32,
    /// Texture file.
    pub texture: Option<String>,
    /// Emitted radiance.
    pub emission: [f32; 3],
    /// Has a mask or is transparent.
    pub masked: bool,
}

/// A light source.
#[derive(Clone, Debug, Serialize)]
pub struct LightLine {
    /// Kind, or the emitting material's name.
    pub kind: String,
    /// Emitted power, W.
    pub power: f64,
}

/// Everything `nearfar info` says.
#[derive(Clone, Debug, Serialize)]
pub struct SceneInfo {
    /// Scene name.
    pub name: String,
    /// Triangles that rays see.
    pub triangles: usize,
    /// Meshes.
    pub meshes: usize,
    /// Lower corner of the bounds, the user's space.
    pub min: [f64; 3],
    /// Upper corner of the bounds, the user's space.
    pub max: [f64; 3],
    /// Diagonal of the bounds.
    pub diagonal: f32,
    /// How large the surroundings of what the camera sees are.
    pub extent: f32,
    /// About the most that a render of this picture holds, bytes.
    pub memory_bytes: f64,
    /// Shortest, 10 %, median, 90 % and longest edge.
    pub edges: [f32; 5],
    /// Connected parts.
    pub parts: usize,
    /// Closed and consistently wound parts.
    pub closed_parts: usize,
    /// Edges of one triangle.
    pub boundary_edges: usize,
    /// Edges of more than two triangles.
    pub nonmanifold_edges: usize,
    /// Edges whose two triangles are wound against each other.
    pub inconsistent_edges: usize,
    /// Share of triangles whose back is never seen.
    pub one_sided_share: f32,
    /// Materials in use.
    pub materials: Vec<MaterialLine>,
    /// Light sources.
    pub lights: Vec<LightLine>,
    /// Proposed near/far distance: the default of the decomposition.
    pub alpha: f32,
    /// What was chosen at load.
    pub notes: Vec<String>,
    /// What is odd.
    pub warnings: Vec<String>,
}

/// Collects what there is to say about a loaded scene and the world made of it.
pub fn scene_info(loaded: &Loaded, world: &World) -> SceneInfo {
    let g = &*world.geometry;
    let topology = analyze_topology(g);
    let mut warnings = loaded.warnings.clone();
    let mut warn = |count: usize, text: &str| {
        if count > 0 {
            warnings.push(format!("{count} {text}"));
        }
    };
    warn(g.dropped_degenerate, "triangles have no area and are left out");
    warn(g.dropped_duplicate, "triangles are exact duplicates and are left out");
    warn(inverted_normals(g), "triangles have vertex normals against their winding");
    warn(
        topology.inconsistent_edges,
        "edges have triangles wound against each other; such parts are treated as two-sided",
    );
    warn(
        topology.inside_out,
        "closed parts are wound inside out; such parts are treated as two-sided",
    );
    let materials = materials(g);
    for m in &materials {
        if m.brightest > MAX_ALBEDO {
            warnings.push(format!(
                "material \"{}\" has an albedo above {MAX_ALBEDO} and is darkened to it",
                m.name
            ));
        }
    }
    if camera_inside_wall(world) {
        warnings.push(CAMERA_INSIDE_WALL.into());
    }
    let edges = edge_quantiles(g);
    SceneInfo {
        name: loaded.scene.name.clone(),
        triangles: g.len(),
        meshes: loaded.scene.meshes.len(),
        min: (g.bounds.min.as_dvec3() + loaded.scene.origin).to_array(),
        max: (g.bounds.max.as_dvec3() + loaded.scene.origin).to_array(),
        diagonal: world.diagonal,
        extent: world.around.extent,
        memory_bytes: memory::of_render(
            u64::from(world.camera.width) * u64::from(world.camera.height),
            g.len() as u64,
        ),
        edges,
        parts: topology.components,
        closed_parts: topology.closed_components,
        boundary_edges: topology.boundary_edges,
        nonmanifold_edges: topology.nonmanifold_edges,
        inconsistent_edges: topology.inconsistent_edges,
        one_sided_share: topology.closed_of_triangle.iter().filter(|c| **c).count() as f32
            / g.len().max(1) as f32,
        lights: lights(&loaded.scene, g),
        alpha: DecomposeSettings::default().lengths(world.around.extent).alpha,
        materials,
        notes: loaded.notes.clone(),
        warnings,
    }
}

fn inverted_normals(g: &Geometry) -> usize {
    let against = |(t, n): (&[u32; 3], &Vec3)| {
        t.iter().map(|&i| g.normals[i as usize]).sum::<Vec3>().dot(*n) < 0.0
    };
    g.triangles.iter().zip(&g.face_normals).filter(|&pair| against(pair)).count()
}

fn edge_quantiles(g: &Geometry) -> [f32; 5] {
    let corners = (0..g.len() as u32).map(|t| g.corners(t));
    let mut lengths: Vec<f32> =
        corners.flat_map(|[a, b, c]| [a.distance(b), b.distance(c), c.distance(a)]).collect();
    if lengths.is_empty() {
        return [0.0; 5];
    }
    lengths.sort_unstable_by(f32::total_cmp);
    [0.0, 0.1, 0.5, 0.9, 1.0].map(|q| lengths[((lengths.len() - 1) as f64 * q) as usize])
}

fn materials(g: &Geometry) -> Vec<MaterialLine> {
    let mut counts = vec![0; g.materials.len()];
    for (&m, &light) in g.material_of.iter().zip(&g.light_of) {
        if light == u32::MAX {
            counts[m as usize] += 1;
        }
    }
    let used = g.materials.iter().zip(counts).filter(|(_, n)| *n > 0);
    used.map(|(m, triangles)| MaterialLine {
        name: m.name.clone(),
        triangles,
        albedo: m.albedo.to_array(),
        brightest: {
            let texel = m.albedo_texture.map_or(Rgb::ONE, |t| g.textures[t as usize].brightest());
            (m.albedo * texel).max_element()
        },
        texture: m.albedo_texture.map(|t| g.textures[t as usize].name.clone()),
        emission: m.emission.to_array(),
        masked: m.opacity_texture.is_some() || m.opacity < 0.5,
    })
    .collect()
}

fn lights(scene: &Scene, g: &Geometry) -> Vec<LightLine> {
    let lum = |c: Rgb| f64::from(luminance(c));
    let disc = PI * (f64::from(g.bounds.diagonal()) * 0.5).powi(2);
    let mut lines: Vec<LightLine> = scene
        .lights
        .iter()
        .map(|l| {
            let (kind, power) = match *l {
                Light::Quad { edge1, edge2, radiance, .. } => {
                    ("quad", PI * f64::from(edge1.cross(edge2).length()) * lum(radiance))
                }
                Light::Sphere { radius, radiance, .. } => {
                    ("sphere", 4.0 * PI * PI * f64::from(radius).powi(2) * lum(radiance))
                }
                Light::Sun { irradiance, .. } => ("sun", disc * lum(irradiance)),
                Light::Sky { radiance } => ("sky", 4.0 * PI * disc * lum(radiance)),
                Light::Environment { ref map } => {
                    let bright: Rgb =
                        Environment { texels: map.split().1, ..(**map).clone() }.integral();
                    let share = 100.0 * lum(bright) / lum(map.integral()).max(f64::MIN_POSITIVE);
                    let kind = format!(
                        "environment {} {}×{}, {share:.0} % of it direct light",
                        map.name, map.width, map.height
                    );
                    return LightLine { kind, power: disc * lum(map.integral()) };
                }
                Light::Point { intensity, .. } => ("point", 4.0 * PI * lum(intensity)),
                Light::Spot { intensity, inner_deg, outer_deg, .. } => {
                    let edge = (f64::from(inner_deg).to_radians().cos()
                        + f64::from(outer_deg).to_radians().cos())
                        * 0.5;
                    ("spot", 2.0 * PI * (1.0 - edge) * lum(intensity))
                }
            };
            LightLine { kind: kind.into(), power }
        })
        .collect();
    let mut powers = vec![0.0; g.materials.len()];
    for t in 0..g.len() as u32 {
        if g.light_of[t as usize] == u32::MAX {
            powers[g.material_of[t as usize] as usize] +=
                PI * f64::from(g.area(t)) * lum(g.material(t).emission);
        }
    }
    lines.extend(powers.iter().enumerate().filter(|(_, p)| **p > 0.0).map(|(m, &power)| {
        LightLine { kind: format!("material \"{}\"", g.materials[m].name), power }
    }));
    lines
}

impl std::fmt::Display for SceneInfo {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let v = |a: [f64; 3]| format!("[{:.4}, {:.4}, {:.4}]", a[0], a[1], a[2]);
        writeln!(f, "scene       {}", self.name)?;
        writeln!(f, "triangles   {} in {} meshes", self.triangles, self.meshes)?;
        writeln!(
            f,
            "bounds      {} to {}, diagonal {:.4}",
            v(self.min),
            v(self.max),
            self.diagonal
        )?;
        let [least, low, median, high, most] = self.edges.map(|e| e / self.diagonal);
        writeln!(
            f,
            "edges       {least:.2e} shortest, {low:.2e} 10 %, {median:.2e} median, {high:.2e} 90 \
             %, {most:.2e} longest (of the diagonal)"
        )?;
        writeln!(
            f,
            "parts       {}, closed {}; {:.0} % of the triangles are one-sided",
            self.parts,
            self.closed_parts,
            100.0 * self.one_sided_share
        )?;
        writeln!(
            f,
            "edge faults {} open, {} of more than two triangles, {} wound inconsistently",
            self.boundary_edges, self.nonmanifold_edges, self.inconsistent_edges
        )?;
        writeln!(
            f,
            "extent      {:.4} around what is seen; percentages are of it (diagonal × {:.3})",
            self.extent,
            self.extent / self.diagonal
        )?;
        writeln!(
            f,
            "alpha       {:.4} proposed ({:.3} of the extent)",
            self.alpha,
            self.alpha / self.extent
        )?;
        writeln!(f, "memory      about {} for a picture", memory::size(self.memory_bytes))?;
        writeln!(f, "materials")?;
        for m in &self.materials {
            write!(
                f,
                "  {:<24} {:>9} triangles  albedo {}",
                m.name,
                m.triangles,
                v(m.albedo.map(f64::from))
            )?;
            if let Some(texture) = &m.texture {
                write!(f, " × {texture}")?;
            }
            if m.emission != [0.0; 3] {
                write!(f, "  emits {}", v(m.emission.map(f64::from)))?;
            }
            writeln!(f, "{}", if m.masked { "  masked" } else { "" })?;
        }
        writeln!(f, "lights")?;
        for l in &self.lights {
            writeln!(f, "  {:<24} {:.4e} W", l.kind, l.power)?;
        }
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        for warning in &self.warnings {
            writeln!(f, "warning: {warning}")?;
        }
        Ok(())
    }
}
