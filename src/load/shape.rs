//! What a `[[mesh]]` entry is before it is triangles: a mesh, a cage, or curves; its transform, its
//! settings, its tessellation.
//!
//! Cages and curves are tessellated when all entries are read, since lengths may be shares of the
//! scene's diagonal: that of all meshes, control points of cages and curves included, lamps not.

use glam::{Mat3, Mat4, Vec3};

use super::scene_file::{CurvesEntry, Length, SubdivisionEntry};
use crate::math::Aabb;
use crate::scene::{Cage, Curves, Mesh};
use crate::tessellate::{CurveSettings, Levels, SubdivisionSettings, subdivide, tessellate_curves};

/// A surface as the file gives it.
#[derive(Debug)]
pub enum Shape {
    /// Triangles.
    Mesh(Mesh),
    /// The cage of a subdivision surface.
    Cage(Cage, SubdivisionEntry),
    /// Curves.
    Curves(Curves, CurveSettings),
}

/// Settings of curves.
///
/// # Errors
/// What is wrong with them.
pub fn curve_settings(e: &CurvesEntry) -> Result<CurveSettings, String> {
    let base = CurveSettings::default();
    for (key, value) in [("width", e.width), ("width_scale", e.width_scale)] {
        if value.is_some_and(|w| !(w.is_finite() && w > 0.0)) {
            return Err(format!("curves.{key} must be finite and above 0"));
        }
    }
    Ok(CurveSettings {
        shape: e.shape,
        sides: e.sides.unwrap_or(base.sides),
        segments: e.segments.unwrap_or(base.segments),
        normal: e.normal,
    })
}

fn subdivision_settings(
    e: &SubdivisionEntry,
    diagonal: f32,
) -> Result<SubdivisionSettings, String> {
    let base = SubdivisionSettings::default();
    let levels = match (e.levels, &e.edge) {
        (Some(_), Some(_)) => {
            return Err("subdivision has levels and edge; remove one of them".into());
        }
        (Some(0), None) => return Err(
            "levels is 0 but must be at least 1; remove subdivision for the polygons themselves"
                .into(),
        ),
        (Some(n), None) => Levels::Fixed(n),
        (None, None) => base.levels,
        (None, Some(edge)) => {
            let length = match edge {
                Length::Units(x) => Some(*x),
                Length::Share(text) => text
                    .trim()
                    .strip_suffix('%')
                    .and_then(|n| n.trim().parse::<f32>().ok())
                    .map(|x| x * 0.01 * diagonal),
            };
            let fine = length.filter(|x| x.is_finite() && *x > 0.0);
            Levels::Edge(fine.ok_or(
                "subdivision.edge must be a length above 0, or a share of the diagonal like \
                 \"0.5%\"",
            )?)
        }
    };
    if e.crease_angle_deg.is_some_and(|a| !(0.0..=180.0).contains(&a)) {
        return Err("crease_angle_deg must lie from 0 to 180".into());
    }
    if e.crease_sharpness.is_some_and(|s| !(s.is_finite() && s >= 0.0)) {
        return Err("crease_sharpness must be finite and not negative; 10 is always sharp".into());
    }
    if e.crease_sharpness.is_some() && e.crease_angle_deg.is_none() {
        return Err(
            "crease_sharpness belongs to crease_angle_deg; add it or remove crease_sharpness"
                .into(),
        );
    }
    Ok(SubdivisionSettings {
        levels,
        boundary: e.boundary.unwrap_or(base.boundary),
        uv: e.uv,
        crease_angle_deg: e.crease_angle_deg,
        crease_sharpness: e.crease_sharpness.unwrap_or(base.crease_sharpness),
    })
}

impl Shape {
    /// Material numbers, to be renumbered.
    pub fn materials_mut(&mut self) -> &mut [u32] {
        match self {
            Self::Mesh(mesh) => &mut mesh.materials,
            Self::Cage(cage, _) => &mut cage.materials,
            Self::Curves(curves, _) => std::slice::from_mut(&mut curves.material),
        }
    }

    /// All (control) points.
    pub fn points(&self) -> &[Vec3] {
        match self {
            Self::Mesh(mesh) => &mesh.positions,
            Self::Cage(cage, _) => &cage.positions,
            Self::Curves(curves, _) => &curves.points,
        }
    }

    /// Box around all (control) points.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Mesh(mesh) => {
                Aabb::around(mesh.triangles.iter().flatten().map(|&i| mesh.positions[i as usize]))
            }
            Self::Cage(cage, _) => Aabb::around(cage.positions.iter().copied()),
            Self::Curves(curves, _) => Aabb::around(curves.points.iter().copied()),
        }
    }

    /// Moves everything. Widths of curves grow with the cube root of the volume.
    ///
    /// # Errors
    /// When the transform has no inverse or makes coordinates infinite.
    pub fn transform(&mut self, world_from_object: &Mat4) -> Result<(), String> {
        let linear = Mat3::from_mat4(*world_from_object);
        let determinant = linear.determinant();
        if !world_from_object.is_finite() || determinant == 0.0 {
            return Err(
                "the transform is not invertible; scale may not be 0 and all numbers must be finite"
                    .into(),
            );
        }
        let normal_from_object = linear.inverse().transpose();
        let points = match self {
            Self::Mesh(mesh) => {
                for n in &mut mesh.normals {
                    *n = (normal_from_object * *n).normalize_or_zero();
                }
                if determinant < 0.0 {
                    // A mirror turns counter-clockwise into clockwise; fronts stay fronts.
                    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
                }
                &mut mesh.positions
            }
            Self::Cage(cage, _) => {
                if determinant < 0.0 {
                    cage.flip();
                }
                &mut cage.positions
            }
            Self::Curves(curves, settings) => {
                let scale = determinant.abs().cbrt();
                curves.widths.iter_mut().for_each(|w| *w *= scale);
                settings.normal = settings.normal.map(|n| (normal_from_object * n).normalize_or(n));
                &mut curves.points
            }
        };
        for p in points.iter_mut() {
            *p = world_from_object.transform_point3(*p);
        }
        if points.iter().any(|p: &Vec3| !p.is_finite()) {
            return Err("the transform makes coordinates infinite; scale less".into());
        }
        Ok(())
    }

    /// Triangles; notes say what was made.
    ///
    /// # Errors
    /// What does not fit, or is out of range.
    pub fn tessellate(
        self,
        diagonal: f32,
        notes: &mut Vec<String>,
        warnings: &mut Vec<String>,
    ) -> Result<Mesh, String> {
        match self {
            Self::Mesh(mesh) => Ok(mesh),
            Self::Cage(mut cage, entry) => {
                let settings = subdivision_settings(&entry, diagonal)?;
                cage.boundary = entry.boundary.or(cage.boundary);
                let (mesh, faulty) = subdivide(&cage, &settings)?;
                if faulty > 0 {
                    warnings.push(format!(
                        "{}: {faulty} edges have more than two faces, or two wound against each \
                         other; they become creases",
                        cage.name
                    ));
                }
                notes.push(format!(
                    "{}: {} faces subdivided into {} triangles",
                    cage.name,
                    cage.face_count(),
                    mesh.triangles.len()
                ));
                Ok(mesh)
            }
            Self::Curves(curves, settings) => {
                let mesh = tessellate_curves(&curves, &settings)?;
                notes.push(format!(
                    "{}: {} curves made into {} triangles",
                    curves.name,
                    curves.len(),
                    mesh.triangles.len()
                ));
                Ok(mesh)
            }
        }
    }
}
