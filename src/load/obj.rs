//! OBJ files → one [`Mesh`] and its materials, parsed by `tobj`.
//!
//! The text goes through [`super::obj_text`] first, so that what programs really write is read.
//! Polygons are cut by [`triangulate`]; relative indices are allowed; groups become one mesh whose
//! triangles keep their materials. A face without normals in a file that has some gets a zero
//! normal, which means "face normal", one without texture coordinates the coordinate (0, 0).
//! Smoothing groups and colours of vertices are left out, with a warning. Materials that are used
//! but not defined, and libraries that are missing, become a grey and a warning. On an error, and
//! for non-finite numbers, the text is looked over again for the line. Cost: the file's text and
//! `tobj`'s arrays in memory at once, about 200 B a triangle.

use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::Path;

use glam::{DVec2, DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::find::{Found, find};
use super::mtl::{MtlMaterial, read_mtl};
use super::obj_fault::find_fault;
use super::obj_text::{UNNAMED, decode, joined, name, plain};
use super::origin::origin_of;
use super::polygon::Cutter;
use crate::error::{Error, Result};
use crate::input_file;
use crate::scene::Mesh;

/// A mesh whose material indices refer to `materials`.
#[derive(Debug)]
pub struct Obj {
    /// All groups, relative to `origin`.
    pub mesh: Mesh,
    /// Zero of the mesh's coordinates, the file's space.
    pub origin: DVec3,
    /// Materials of the libraries, then the undefined ones.
    pub materials: Vec<MtlMaterial>,
}

/// What the first look at the text says.
enum Note {
    Library(String),
    Use(String),
    Smoothing,
    Normal,
    Suspicious,
}

fn note(line: &str) -> Option<Note> {
    match line.split_ascii_whitespace().next()? {
        "usemtl" => Some(Note::Use(name(line).into())),
        "mtllib" => Some(Note::Library(name(line).into())),
        "s" => (!matches!(name(line), "" | "0" | "off")).then_some(Note::Smoothing),
        "vn" => Some(Note::Normal),
        "f" | "l" => {
            // Indices that do not fit 32 bits would overflow in the parser.
            let mut run = 0;
            line.bytes()
                .any(|b| {
                    run = if b.is_ascii_digit() { run + 1 } else { 0 };
                    run > 10
                })
                .then_some(Note::Suspicious)
        }
        _ => None,
    }
}

/// The groups of an OBJ file as `tobj` gives them.
#[derive(Debug)]
pub struct Groups {
    /// The file's text.
    pub text: String,
    /// Groups, whose materials are numbers of `materials`.
    pub models: Vec<tobj::Model>,
    /// Where single precision should have its zero, the file's space.
    pub origin: DVec3,
    /// Materials of the libraries, then the undefined ones.
    pub materials: Vec<MtlMaterial>,
}

/// Reads an OBJ file and its material libraries. Polygons stay what they are; with `single_index`
/// positions, normals and texture coordinates share one index, else each has its own.
///
/// # Errors
/// [`Error::Io`] when it cannot be read; [`Error::Input`] with the line of what is wrong.
pub fn read_groups(path: &Path, single_index: bool, warnings: &mut Vec<String>) -> Result<Groups> {
    let bytes = input_file::read(path)?;
    let text = match joined(&decode(bytes)) {
        Cow::Owned(text) => text,
        Cow::Borrowed(text) => text.to_owned(),
    };
    let fail = |reason: String| match find_fault(&text) {
        Some((line, message)) => Error::input(path, line, message),
        None => {
            Error::input(path, None, format!("is no readable OBJ file ({reason}); export it again"))
        }
    };
    let notes: Vec<Note> = text.par_lines().filter_map(note).collect();
    let (mut smoothing, mut normals) = (false, false);
    for note in &notes {
        smoothing |= matches!(note, Note::Smoothing);
        normals |= matches!(note, Note::Normal);
    }
    if notes.iter().any(|n| matches!(n, Note::Suspicious)) {
        return Err(fail("an index is too large".into()));
    }
    let materials = collect_materials(path, &notes, warnings)?;
    let all: Vec<tobj::Material> = materials
        .iter()
        .map(|m| tobj::Material { name: m.name.clone(), ..Default::default() })
        .collect();
    let known: HashSet<&str> = materials.iter().map(|m| m.name.as_str()).collect();
    let (plain, changed) = plain(&text, |name| meant(name, &known).to_owned());
    let mut warn = |message: String| warnings.push(format!("{}: {message}", path.display()));
    if changed.normals > 0 {
        let count = changed.normals;
        warn(format!("{count} normals are not finite; the faces' own take their place"));
    }
    if changed.colours > 0 {
        warn(format!("the colours of {} vertices are left out; give a texture", changed.colours));
    }
    if smoothing && !normals {
        warn("smoothing groups are left out; normals = \"smooth\" in the [[mesh]] smooths".into());
    }
    // The first line makes every material known from the start, whichever library defines it.
    let mut input = b"mtllib *\n".as_slice();
    let mut input = std::io::BufReader::new(std::io::Read::chain(&mut input, plain.as_bytes()));
    let options = tobj::LoadOptions {
        single_index,
        triangulate: false,
        ignore_points: true,
        ignore_lines: true,
    };
    let (models, _) = tobj::load_obj_buf(&mut input, &options, |library| {
        let known = if library == Path::new("*") { all.clone() } else { Vec::new() };
        let map = known.iter().enumerate().map(|(i, m)| (m.name.clone(), i)).collect();
        Ok((known, map))
    })
    .map_err(|e| fail(e.to_string()))?;
    let finite = |m: &tobj::Mesh| {
        m.positions.iter().chain(&m.normals).chain(&m.texcoords).all(|&x| (x as f32).is_finite())
    };
    if !models.iter().all(|m| finite(&m.mesh)) {
        return Err(fail("a number is not finite".into()));
    }
    let count = models.iter().map(|m| m.mesh.positions.len() / 3).sum::<usize>();
    if count >= u32::MAX as usize {
        return Err(Error::input(
            path,
            None,
            "has more vertices than 32-bit indices can count; split it into several meshes",
        ));
    }
    if models.iter().all(|m| m.mesh.indices.is_empty()) {
        let message = "holds no faces; export it again, or take it out of the scene";
        return Err(Error::input(path, None, message));
    }
    let vertices = models.iter().flat_map(|m| m.mesh.positions.chunks_exact(3));
    let origin =
        origin_of(count, vertices, DVec3::from_slice).map_err(|m| Error::input(path, None, m))?;
    Ok(Groups { text, models, origin, materials })
}

/// Reads an OBJ file as triangles.
///
/// # Errors
/// Those of [`read_groups`].
pub fn read_obj(path: &Path, warnings: &mut Vec<String>) -> Result<Obj> {
    let Groups { models, materials, origin, .. } = read_groups(path, true, warnings)?;
    let mut obj = Obj {
        mesh: Mesh { name: path.display().to_string(), ..Mesh::default() },
        origin,
        materials,
    };
    let (mut without_material, mut cutter) = (0, Cutter::default());
    for model in models {
        let added = append(&mut obj, &model, &mut cutter);
        without_material += added.ok_or_else(|| {
            let message = "has polygons of very many corners that are not convex; triangulate it";
            Error::input(path, None, message)
        })?;
    }
    if without_material > 0 {
        let why = format!(
            "{without_material} triangles have no material and become grey; assign one with \
             usemtl, or name one by material in the [[mesh]]"
        );
        obj.materials.push(MtlMaterial::stand_in(UNNAMED, why));
    }
    if obj.mesh.normals.iter().all(|&n| n == Vec3::ZERO) {
        obj.mesh.normals.clear();
    }
    Ok(obj)
}

/// The material that a name in `usemtl` means: the name, or what stands before a comment.
fn meant<'a>(name: &'a str, known: &HashSet<&str>) -> &'a str {
    match name.split_once(" #") {
        Some((start, _)) if !known.contains(name) && known.contains(start.trim_end()) => {
            start.trim_end()
        }
        _ => name,
    }
}

/// The libraries that an `mtllib` statement names: one file, or several.
fn libraries(statement: &str, folder: &Path) -> Vec<String> {
    let statement = statement.replace('\\', "/");
    if folder.join(&statement).exists() {
        return vec![statement];
    }
    let mut names: Vec<String> = Vec::new();
    // A name ends with its extension; what comes before one may hold spaces.
    for word in statement.split_whitespace() {
        match names.last_mut() {
            Some(last) if !last.to_ascii_lowercase().ends_with(".mtl") => {
                last.push(' ');
                last.push_str(word);
            }
            _ => names.push(word.into()),
        }
    }
    names
}

fn collect_materials(
    path: &Path,
    notes: &[Note],
    warnings: &mut Vec<String>,
) -> Result<Vec<MtlMaterial>> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let mut index: HashMap<String, usize> = HashMap::new();
    let mut seen = HashSet::new();
    let statements = notes.iter().filter_map(|note| match note {
        Note::Library(statement) => Some(libraries(statement, folder)),
        _ => None,
    });
    for name in statements.flatten().filter(|name| seen.insert(name.clone())) {
        let found = match find(&name, folder, &[]) {
            Some(Found { path, .. }) => read_mtl(&path, warnings),
            None => read_mtl(&folder.join(&name), warnings),
        };
        let list = match found {
            Err(Error::Io { .. }) => {
                warnings.push(format!(
                    "{}: material library \"{name}\" cannot be read; its materials become grey",
                    path.display()
                ));
                continue;
            }
            found => found?,
        };
        for m in list {
            match index.get(&m.name) {
                Some(&i) => materials[i] = m,
                None => {
                    index.insert(m.name.clone(), materials.len());
                    materials.push(m);
                }
            }
        }
    }
    let known: HashSet<&str> = index.keys().map(String::as_str).collect();
    let used = notes.iter().filter_map(|note| match note {
        Note::Use(name) if name.is_empty() => Some(UNNAMED),
        Note::Use(name) => Some(meant(name, &known)),
        _ => None,
    });
    let undefined: BTreeSet<&str> = used.filter(|name| !known.contains(name)).collect();
    let stand_in = |name: &str| {
        let why = match name {
            UNNAMED => format!(
                "usemtl without a name, or with the name \"{UNNAMED}\" that nothing defines, \
                 becomes grey; give [material.{UNNAMED}]"
            ),
            _ => format!(
                "material \"{name}\" is not defined and becomes grey; define it in an MTL file \
                 or as [material.{name}]"
            ),
        };
        MtlMaterial::stand_in(name, why)
    };
    let undefined: Vec<MtlMaterial> = undefined.into_iter().map(stand_in).collect();
    materials.extend(undefined);
    Ok(materials)
}

/// Adds a group; returns how many of its triangles have no material. None when its polygons have
/// more corners than can be cut.
fn append(obj: &mut Obj, model: &tobj::Model, cutter: &mut Cutter) -> Option<usize> {
    let (m, mesh) = (&model.mesh, &mut obj.mesh);
    let base = mesh.positions.len();
    let count = m.positions.len() / 3;
    let origin = obj.origin;
    let near = |p: &[f64]| (DVec3::from_slice(p) - origin).as_vec3();
    mesh.positions.extend(m.positions.chunks_exact(3).map(near));
    if m.normals.len() == count * 3 {
        mesh.normals.extend(
            m.normals.chunks_exact(3).map(|n| DVec3::from_slice(n).as_vec3().normalize_or_zero()),
        );
    }
    mesh.normals.resize(base + count, Vec3::ZERO);
    if m.texcoords.len() == count * 2 && count > 0 {
        mesh.uvs.resize(base, Vec2::ZERO);
        mesh.uvs.extend(m.texcoords.chunks_exact(2).map(|t| DVec2::from_slice(t).as_vec2()));
    } else if !mesh.uvs.is_empty() {
        mesh.uvs.resize(base + count, Vec2::ZERO);
    }
    let before = mesh.triangles.len();
    let shift = base as u32;
    if m.face_arities.is_empty() {
        mesh.triangles
            .extend(m.indices.chunks_exact(3).map(|t| [t[0] + shift, t[1] + shift, t[2] + shift]));
    } else {
        let mut at = 0;
        for &arity in &m.face_arities {
            let face = &m.indices[at..at + arity as usize];
            at += arity as usize;
            if let &[a, b, c] = face {
                mesh.triangles.push([a + shift, b + shift, c + shift]);
            } else {
                let corner = |&i: &u32| DVec3::from_slice(&m.positions[3 * i as usize..]) - origin;
                let corners: Vec<DVec3> = face.iter().map(corner).collect();
                let cut = cutter.cut(&corners)?;
                mesh.triangles.extend(cut.into_iter().map(|t| t.map(|k| face[k] + shift)));
            }
        }
    }
    let added = mesh.triangles.len() - before;
    let material = m.material_id.unwrap_or(obj.materials.len()) as u32;
    mesh.materials.resize(before + added, material);
    Some(if m.material_id.is_none() { added } else { 0 })
}
