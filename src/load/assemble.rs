//! A parsed scene file and the files it names → [`Scene`].

use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DQuat, DVec3, EulerRot, Vec3};
use toml::Spanned;

use super::Loaded;
use super::curve_file::{is_curve_file, read_curves};
use super::environment::read_environment;
use super::normals::smooth;
use super::obj::{Obj, read_obj};
use super::obj_cage::read_cage;
use super::origin::{Pose, origin_of};
use super::path::resolve;
use super::scene_file::{
    CameraEntry, CurvesEntry, LightEntry, MeshEntry, Normals, SceneFile, Triple, line_at,
};
use super::shape::{Shape, curve_settings};
use super::validate::{MAX_DIAGONAL, bounds, check_camera, check_lens};
use super::view::{framing, guess_up};
use crate::builtin;
use crate::error::{Error, Result};
use crate::math::Aabb;
use crate::radiometry::Rgb;
use crate::scene::{Camera, Environment, Light, Material, TextureId};
use crate::tessellate::CurveSettings;

/// What is put together, and where messages point.
#[derive(Debug)]
pub struct Assembly<'a> {
    pub(super) file: &'a Path,
    text: &'a str,
    pub(super) loaded: Loaded,
    /// The last material of each name.
    pub(super) materials: HashMap<String, u32>,
    /// By file and placement.
    pub(super) textures: HashMap<(PathBuf, [u32; 7]), TextureId>,
    /// Folders where missing textures are looked for.
    pub(super) search_paths: Vec<PathBuf>,
}

const DEFAULT_CREASE_DEG: f32 = 40.0;

impl<'a> Assembly<'a> {
    /// An empty scene; `text` is that of `file`.
    pub fn new(file: &'a Path, text: &'a str) -> Self {
        Self {
            file,
            text,
            loaded: Loaded::default(),
            materials: HashMap::new(),
            textures: HashMap::new(),
            search_paths: Vec::new(),
        }
    }

    pub(super) fn fail<T>(&self, span: &Range<usize>, message: impl Into<String>) -> Result<T> {
        Err(Error::input(self.file, self.line(span), message))
    }

    fn line(&self, span: &Range<usize>) -> Option<usize> {
        (!self.text.is_empty()).then(|| line_at(self.text, span.start))
    }

    /// Everything but the checks of the whole.
    ///
    /// # Errors
    /// [`Error::Input`] and the errors of reading the files named.
    pub fn scene(mut self, entry: SceneFile) -> Result<Loaded> {
        let stem = self.file.file_stem().map(|s| s.to_string_lossy().into_owned());
        self.loaded.scene.name = entry.name.or(stem).unwrap_or_default();
        self.loaded.settings = entry.settings;
        self.loaded.setting_lines = entry.setting_lines;
        let folder = self.file.parent().unwrap_or(Path::new(""));
        self.search_paths.push(folder.into());
        for path in &entry.search_paths {
            let path = resolve(path, self.file).map_err(|m| Error::input(self.file, None, m))?;
            self.search_paths.push(path);
        }
        let mut shapes = Vec::new();
        for (index, mesh) in entry.mesh.iter().enumerate() {
            shapes.extend(self.shapes(mesh)?.into_iter().map(|(s, at)| (index, s, at)));
        }
        self.loaded.scene.origin = self.origin(&shapes, &entry.light)?;
        let mut around = Aabb::EMPTY;
        for (index, shape, pose) in &mut shapes {
            if let Some(matrix) = pose.world_from_shape(self.loaded.scene.origin) {
                let span = entry.mesh[*index].span();
                shape.transform(&matrix).or_else(|m| self.fail(&span, m))?;
            }
            let of = shape.bounds();
            around = Aabb { min: around.min.min(of.min), max: around.max.max(of.max) };
        }
        for (index, shape, _) in shapes {
            self.mesh(shape, &entry.mesh[index], around.diagonal())?;
        }
        for light in entry.light {
            self.light(&light)?;
        }
        for (name, material) in &entry.material {
            self.material(name, material)?;
        }
        self.camera(entry.camera)?;
        Ok(self.loaded)
    }

    /// Where the scene should have its zero.
    fn origin(
        &self,
        shapes: &[(usize, Shape, Pose)],
        lights: &[Spanned<LightEntry>],
    ) -> Result<DVec3> {
        let lamps: Vec<DVec3> = lights
            .iter()
            .filter_map(|light| match *light.get_ref() {
                LightEntry::Quad { corner, .. } => Some(corner),
                LightEntry::Sphere { center, .. } => Some(center),
                _ => None,
            })
            .collect();
        let count = shapes.iter().map(|(_, shape, _)| shape.points().len()).sum::<usize>();
        let of_shapes = shapes
            .iter()
            .flat_map(|(_, shape, pose)| shape.points().iter().map(move |p| (*pose, p.as_dvec3())));
        let of_lamps = lamps.iter().map(|&p| (Pose::default(), p));
        let scene = |m: String| Error::input(self.file, None, format!("the scene {m}"));
        origin_of(count + lamps.len(), of_shapes.chain(of_lamps), |(pose, p)| pose.user(p))
            .map_err(scene)
    }

    /// What an entry gives, and where it is.
    fn shapes(&mut self, entry: &Spanned<MeshEntry>) -> Result<Vec<(Shape, Pose)>> {
        let (span, e) = (entry.span(), entry.get_ref());
        let (mut shapes, object_origin, names) = match (&e.file, &e.builtin) {
            (Some(file), None) => {
                let path = resolve(file, self.file).or_else(|m| self.fail(&span, m))?;
                if !path.exists() {
                    return self.fail(
                        &span,
                        format!("mesh \"{}\" does not exist; correct the path", path.display()),
                    );
                }
                self.read(&path, e, &span)?
            }
            (None, Some(name)) => {
                let made =
                    builtin::generate(name, &e.parameters).or_else(|m| self.fail(&span, m))?;
                let ids = made.materials.into_iter().map(|m| self.add_material(m)).collect();
                let (cages, curves) = (
                    e.subdivision.clone().unwrap_or_default(),
                    e.curves.clone().unwrap_or_default(),
                );
                let settings = self.curve_settings(&curves, &span)?;
                if e.subdivision.is_some() && made.cages.is_empty() {
                    return self.fail(
                        &span,
                        format!(
                            "builtin \"{name}\" has no subdivision surface; remove subdivision"
                        ),
                    );
                }
                if e.curves.is_some() && made.curves.is_empty() {
                    return self
                        .fail(&span, format!("builtin \"{name}\" has no curves; remove curves"));
                }
                if curves.basis.is_some() || curves.width.is_some() || curves.material.is_some() {
                    return self.fail(
                        &span,
                        "basis, width and material belong to curves of a file; remove them",
                    );
                }
                let mut shapes = Vec::new();
                if !made.mesh.triangles.is_empty() {
                    shapes.push(Shape::Mesh(made.mesh));
                }
                shapes.extend(made.cages.into_iter().map(|c| Shape::Cage(c, cages.clone())));
                for mut c in made.curves {
                    c.widths.iter_mut().for_each(|w| *w *= curves.width_scale.unwrap_or(1.0));
                    shapes.push(Shape::Curves(c, settings));
                }
                (shapes, DVec3::ZERO, ids)
            }
            _ => {
                return self.fail(&span, "a mesh needs either file = \"….obj\" or builtin = \"…\"");
            }
        };
        if e.builtin.is_none() && !e.parameters.is_empty() {
            return self.fail(&span, "parameters belong to builtin meshes; remove them");
        }
        let user_from_object = self.user_from_object(e, &span)?;
        for m in shapes.iter_mut().flat_map(Shape::materials_mut) {
            *m = names[*m as usize];
        }
        let pose = Pose { object_origin, user_from_object };
        Ok(shapes.into_iter().map(|shape| (shape, pose)).collect())
    }

    fn curve_settings(&self, e: &CurvesEntry, span: &Range<usize>) -> Result<CurveSettings> {
        curve_settings(e).or_else(|m| self.fail(span, m))
    }

    /// The shape of a file, the zero of its coordinates, and the numbers of its materials.
    fn read(
        &mut self,
        path: &Path,
        e: &MeshEntry,
        span: &Range<usize>,
    ) -> Result<(Vec<Shape>, DVec3, Vec<u32>)> {
        if is_curve_file(path) {
            if e.subdivision.is_some() {
                return self.fail(span, "subdivision belongs to .obj files; remove it");
            }
            let entry = e.curves.clone().unwrap_or_default();
            let settings = self.curve_settings(&entry, span)?;
            let file = read_curves(path, entry.width, &mut self.loaded.warnings)?;
            let mut curves = file.curves;
            curves.basis = entry.basis.unwrap_or_default();
            curves.widths.iter_mut().for_each(|w| *w *= entry.width_scale.unwrap_or(1.0));
            let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned());
            let name = entry.material.or(stem).unwrap_or_default();
            let id = self.add_material(Material {
                name,
                albedo: file.albedo.unwrap_or(Rgb::splat(0.5)),
                ..Material::default()
            });
            return Ok((vec![Shape::Curves(curves, settings)], file.origin, vec![id]));
        }
        if !path.extension().is_some_and(|x| x.eq_ignore_ascii_case("obj")) {
            return self.fail(
                span,
                format!(
                    "mesh \"{}\" is no .obj, .hair, .curves or .txt file; convert it",
                    path.display()
                ),
            );
        }
        if e.curves.is_some() {
            return self.fail(span, "curves belongs to .hair, .curves and .txt files; remove it");
        }
        let (shape, origin, materials) = match &e.subdivision {
            Some(settings) => {
                let (cage, origin, materials) = read_cage(path, &mut self.loaded.warnings)?;
                (Shape::Cage(cage, settings.clone()), origin, materials)
            }
            None => {
                let Obj { mesh, origin, materials } = read_obj(path, &mut self.loaded.warnings)?;
                (Shape::Mesh(mesh), origin, materials)
            }
        };
        let ids = self.mtl(path, e, materials)?;
        Ok((vec![shape], origin, ids))
    }

    /// Makes a shape a mesh of the scene.
    fn mesh(&mut self, shape: Shape, entry: &Spanned<MeshEntry>, diagonal: f32) -> Result<()> {
        let (span, e) = (entry.span(), entry.get_ref());
        let Loaded { notes, warnings, .. } = &mut self.loaded;
        let mut mesh =
            shape.tessellate(diagonal, notes, warnings).or_else(|m| self.fail(&span, m))?;
        match e.normals {
            Normals::File => {}
            Normals::Face => mesh.normals.clear(),
            Normals::Smooth => {
                let crease = e.crease_deg.unwrap_or(DEFAULT_CREASE_DEG);
                if !(0.0..=180.0).contains(&crease) {
                    return self
                        .fail(&span, format!("crease_deg is {crease} but must lie from 0 to 180"));
                }
                smooth(&mut mesh, crease);
            }
        }
        if e.crease_deg.is_some() && e.normals != Normals::Smooth {
            return self.fail(
                &span,
                "crease_deg belongs to normals = \"smooth\"; add it or remove crease_deg",
            );
        }
        mesh.sides = e.sides;
        self.loaded.scene.meshes.push(mesh);
        Ok(())
    }

    fn user_from_object(&self, e: &MeshEntry, span: &Range<usize>) -> Result<Option<DAffine3>> {
        let parts = e.scale.is_some() || e.rotate_deg.is_some() || e.translate.is_some();
        if e.matrix.is_none() && !parts {
            return Ok(None);
        }
        Ok(Some(match e.matrix {
            Some(_) if parts => {
                return self.fail(
                    span,
                    "matrix stands alone; remove it or scale, rotate_deg and translate",
                );
            }
            Some(rows) => {
                let column = |k: usize| DVec3::from_array(rows.map(|row| row[k]));
                let linear = DMat3::from_cols(column(0), column(1), column(2));
                DAffine3::from_mat3_translation(linear, column(3))
            }
            None => {
                let angles = e.rotate_deg.unwrap_or_default() * (std::f64::consts::PI / 180.0);
                let rotation = DQuat::from_euler(EulerRot::XYZEx, angles.x, angles.y, angles.z);
                DAffine3::from_scale_rotation_translation(
                    e.scale.map_or(DVec3::ONE, |s| DVec3::from_array(s.three())),
                    rotation,
                    e.translate.unwrap_or_default(),
                )
            }
        }))
    }

    fn light(&mut self, entry: &Spanned<LightEntry>) -> Result<()> {
        let span = entry.span();
        if let LightEntry::Environment { file, scale, rotation_deg, up } = entry.get_ref() {
            return self.environment(
                &span,
                file,
                scale.map_or(Rgb::ONE, Rgb::from),
                *rotation_deg,
                up.unwrap_or(Vec3::Y),
            );
        }
        let (light, problem) = light(entry.get_ref(), self.loaded.scene.origin);
        if let Some(problem) = problem {
            return self.fail(&span, problem);
        }
        self.loaded.scene.lights.push(light);
        Ok(())
    }

    fn environment(
        &mut self,
        span: &Range<usize>,
        file: &str,
        scale: Rgb,
        rotation_deg: f32,
        up: Vec3,
    ) -> Result<()> {
        if !(scale.is_finite() && scale.min_element() >= 0.0 && scale.max_element() > 0.0) {
            return self.fail(span, "scale must be finite and above 0");
        }
        let up = up.normalize_or_zero();
        if !rotation_deg.is_finite() || !up.is_finite() || up == Vec3::ZERO {
            return self.fail(span, "rotation_deg must be finite, up finite and not zero");
        }
        if self.loaded.scene.lights.iter().any(|l| matches!(l, Light::Environment { .. })) {
            return self.fail(span, "a scene has one environment; remove the other");
        }
        let path = resolve(file, self.file).or_else(|m| self.fail(span, m))?;
        let map = match read_environment(&path, scale, Environment::rotation(up, rotation_deg)) {
            Err(Error::Image { path, message }) => {
                return self.fail(span, format!("environment \"{}\" {message}", path.display()));
            }
            other => other?,
        };
        self.loaded.scene.lights.push(Light::Environment { map: std::sync::Arc::new(map) });
        Ok(())
    }

    fn camera(&mut self, entry: Option<Spanned<CameraEntry>>) -> Result<()> {
        let line = entry.as_ref().and_then(|e| self.line(&e.span()));
        let e = entry.map(Spanned::into_inner).unwrap_or_default();
        let base = Camera::default();
        let mut camera = Camera {
            up: e.up.unwrap_or(base.up),
            vfov_deg: e.vfov_deg.unwrap_or(base.vfov_deg),
            width: e.width.unwrap_or(base.width),
            height: e.height.unwrap_or(base.height),
            ..base
        };
        check_lens(&camera, self.file, line)?;
        match (e.eye, e.target) {
            (Some(eye), Some(target)) => {
                let near = |p: DVec3| (p - self.loaded.scene.origin).as_vec3();
                (camera.eye, camera.target) = (near(eye), near(target));
            }
            (None, None) => {
                let around = bounds(&self.loaded.scene);
                if !around.is_empty() && around.diagonal() <= MAX_DIAGONAL {
                    let mut guessed = "";
                    if e.up.is_none() {
                        camera.up = guess_up(&self.loaded.scene);
                        guessed = if camera.up == Vec3::Z { ", z upwards" } else { ", y upwards" };
                    }
                    camera = framing(&self.loaded.scene, &camera);
                    let user = |p: Vec3| numbers(p.as_dvec3() + self.loaded.scene.origin);
                    let (eye, target) = (user(camera.eye), user(camera.target));
                    self.loaded.notes.push(format!(
                        "no camera given: a framing one was set, eye = {eye}, target = \
                         {target}{guessed}"
                    ));
                }
            }
            _ => {
                return Err(Error::input(
                    self.file,
                    line,
                    "a camera needs both eye and target, or neither for a framing view",
                ));
            }
        }
        check_camera(&camera, self.file, line)?;
        self.loaded.scene.camera = camera;
        Ok(())
    }
}

fn numbers(v: DVec3) -> String {
    format!("[{:.4}, {:.4}, {:.4}]", v.x, v.y, v.z)
}

/// The light in a scene with this origin, and what is wrong with it.
fn light(entry: &LightEntry, origin: DVec3) -> (Light, Option<&'static str>) {
    let near = |p: DVec3| (p - origin).as_vec3();
    let color = |t: Triple, name: &'static str| {
        let c = Rgb::from(t);
        let ok = c.is_finite() && c.min_element() >= 0.0;
        (c, (!ok).then_some(name))
    };
    let unit = |v: Vec3| v.normalize_or_zero();
    const RADIANCE: &str = "radiance must be finite and not negative";
    const INTENSITY: &str = "intensity must be finite and not negative";
    match *entry {
        LightEntry::Quad { corner, edge1, edge2, radiance } => {
            let (radiance, problem) = color(radiance, RADIANCE);
            let span = edge1.cross(edge2);
            let ok = span.length() > 0.0 && span.is_finite() && corner.is_finite();
            let problem = if ok {
                problem
            } else {
                Some(
                    "the quad light has no area; edge1 and edge2 must be finite and span a \
                     parallelogram",
                )
            };
            (Light::Quad { corner: near(corner), edge1, edge2, radiance }, problem)
        }
        LightEntry::Sphere { center, radius, radiance } => {
            let (radiance, problem) = color(radiance, RADIANCE);
            let ok = radius > 0.0 && radius.is_finite() && center.is_finite();
            (
                Light::Sphere { center: near(center), radius, radiance },
                if ok {
                    problem
                } else {
                    Some("a sphere light needs a finite center and a radius above 0")
                },
            )
        }
        LightEntry::Sun { direction_to_sun, irradiance, angular_radius_deg } => {
            let (irradiance, problem) =
                color(irradiance, "irradiance must be finite and not negative");
            let direction = unit(direction_to_sun);
            let problem = if direction == Vec3::ZERO || !direction.is_finite() {
                Some("direction_to_sun may not be zero or infinite")
            } else if !(0.0..90.0).contains(&angular_radius_deg) {
                Some("angular_radius_deg must lie from 0 to 90; the sun's is 0.27")
            } else {
                problem
            };
            (Light::Sun { direction_to_sun: direction, irradiance, angular_radius_deg }, problem)
        }
        LightEntry::Sky { radiance } => {
            let (radiance, problem) = color(radiance, RADIANCE);
            (Light::Sky { radiance }, problem)
        }
        // Read from its file, not from here.
        LightEntry::Environment { .. } => {
            (Light::Sky { radiance: Rgb::ZERO }, Some("the environment was not read"))
        }
        LightEntry::Point { position, intensity } => {
            let (intensity, problem) = color(intensity, INTENSITY);
            (
                Light::Point { position: near(position), intensity },
                if position.is_finite() { problem } else { Some("position must be finite") },
            )
        }
        LightEntry::Spot { position, direction, intensity, inner_deg, outer_deg } => {
            let (intensity, problem) = color(intensity, INTENSITY);
            let direction = unit(direction);
            let problem =
                if direction == Vec3::ZERO || !direction.is_finite() || !position.is_finite() {
                    Some("a spot needs a finite position and a direction that is not zero")
                } else if !(inner_deg >= 0.0
                    && inner_deg <= outer_deg
                    && outer_deg > 0.0
                    && outer_deg <= 180.0)
                {
                    Some("a spot needs 0 <= inner_deg <= outer_deg <= 180, and outer_deg above 0")
                } else {
                    problem
                };
            (
                Light::Spot {
                    position: near(position),
                    direction,
                    intensity,
                    inner_deg,
                    outer_deg,
                },
                problem,
            )
        }
    }
}
