//! OBJ files → the [`Cage`] of a subdivision surface.
//!
//! Polygons are kept. Vertices count as one where their positions are exactly equal, whatever the
//! file's groups, normals and texture coordinates; texture coordinates keep their own indices,
//! which are their seams. Creases are read from tag lines as OpenSubdiv's tools write and read
//! them:
//!
//! ```text
//! t NAME ints/floats/strings …          # numbers of arguments, then the arguments;
//!                                       # vertices and faces count from 0
//! t crease 2/1/0 4 7 2.5                # edge 4–7 stays sharp for 2.5 levels; n vertices are
//!                                       # a chain, with one sharpness or n − 1
//! t corner 1/1/0 4 10                   # vertex 4; n vertices with one sharpness or n
//! t hole 1/0/0 9                        # face 9 shapes the surface but is not part of it
//! t interpolateboundary 1/0/0 1         # open edges: 0 no faces, 1 creases and corners, 2 creases
//! ```
//!
//! Not  other tags: they are listed in a warning. Normals of the file: the surface has its own.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::Path;

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::mtl::MtlMaterial;
use super::obj::{Groups, read_groups};
use super::obj_text::UNNAMED;
use crate::error::{Error, Result};
use crate::scene::{Boundary, Cage};

fn key(p: Vec3) -> [u32; 3] {
    // Adding zero turns −0 into +0.
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// Vertices by position relative to an origin in the file's space.
struct Welded {
    ids: HashMap<[u32; 3], u32>,
    origin: DVec3,
}

impl Welded {
    fn near(&self, p: DVec3) -> Vec3 {
        (p - self.origin).as_vec3()
    }

    fn id(&mut self, p: DVec3, cage: &mut Cage) -> u32 {
        let p = self.near(p);
        *self.ids.entry(key(p)).or_insert_with(|| {
            cage.positions.push(p);
            cage.positions.len() as u32 - 1
        })
    }
}

/// Reads an OBJ file as a cage, with the zero of its coordinates in the file's space and its
/// materials.
///
/// # Errors
/// Those of reading OBJ files; [`Error::Input`] with the line of a tag that is wrong.
pub fn read_cage(
    path: &Path,
    warnings: &mut Vec<String>,
) -> Result<(Cage, DVec3, Vec<MtlMaterial>)> {
    let Groups { text, models, origin, mut materials } = read_groups(path, false, warnings)?;
    let mut cage = Cage { name: path.display().to_string(), ..Cage::default() };
    let mut welded = Welded { ids: HashMap::new(), origin };
    let (mut without_material, mut dropped) = (0, 0);
    // The cage's face of every face of the file.
    let mut faces: Vec<Option<u32>> = Vec::new();
    let any_uvs = models.iter().any(|m| !m.mesh.texcoord_indices.is_empty());
    if any_uvs {
        cage.uvs.push(Vec2::ZERO);
    }
    for model in &models {
        let m = &model.mesh;
        let ids: Vec<u32> = m
            .positions
            .chunks_exact(3)
            .map(|p| welded.id(DVec3::from_slice(p), &mut cage))
            .collect();
        let with_uvs = m.texcoord_indices.len() == m.indices.len() && !m.indices.is_empty();
        let uv_base = cage.uvs.len() as u32;
        if with_uvs {
            cage.uvs.extend(m.texcoords.chunks_exact(2).map(|t| DVec2::from_slice(t).as_vec2()));
        }
        let material = m.material_id.unwrap_or(materials.len()) as u32;
        let mut at = 0;
        let arities: Vec<u32> = if m.face_arities.is_empty() {
            vec![3; m.indices.len() / 3]
        } else {
            m.face_arities.clone()
        };
        for arity in arities {
            let range = at..at + arity as usize;
            at = range.end;
            let mut corners: Vec<(u32, u32)> = range
                .map(|c| {
                    (
                        ids[m.indices[c] as usize],
                        if with_uvs { uv_base + m.texcoord_indices[c] } else { 0 },
                    )
                })
                .collect();
            // A vertex that follows itself makes an edge without length.
            corners.dedup_by_key(|c| c.0);
            while corners.len() > 1 && corners[0].0 == corners[corners.len() - 1].0 {
                corners.pop();
            }
            let distinct: BTreeSet<u32> = corners.iter().map(|c| c.0).collect();
            if distinct.len() < 3 || distinct.len() < corners.len() {
                dropped += 1;
                faces.push(None);
                continue;
            }
            faces.push(Some(cage.face_count() as u32));
            without_material += usize::from(m.material_id.is_none());
            cage.push_face(&corners.iter().map(|c| c.0).collect::<Vec<_>>(), material);
            if any_uvs {
                cage.uv_corners.extend(corners.iter().map(|c| c.1));
            }
        }
    }
    if dropped > 0 {
        warnings.push(format!(
            "{}: {dropped} faces have fewer than three distinct corners, or one twice, and are \
             left out",
            path.display()
        ));
    }
    if without_material > 0 {
        let why = format!(
            "{without_material} faces have no material and become grey; assign one with usemtl, or \
             name one by material in the [[mesh]]"
        );
        materials.push(MtlMaterial::stand_in(UNNAMED, why));
    }
    tags(path, &text, &mut cage, &welded, &faces, warnings)?;
    Ok((cage, origin, materials))
}

/// Positions of the file's vertices, in its order, read as `tobj` reads them.
fn vertices(text: &str) -> Vec<DVec3> {
    let read = |line: &str| {
        let rest = line.trim_start().strip_prefix('v')?;
        if !rest.starts_with(char::is_whitespace) {
            return None;
        }
        let n: Vec<f64> = rest.split_whitespace().filter_map(|w| w.parse().ok()).collect();
        let p = DVec3::from_slice(n.get(..3)?);
        Some(if n.len() == 4 { p / n[3] } else { p })
    };
    text.lines().filter_map(read).collect()
}

/// The arguments of a tag.
struct Tag<'a> {
    name: &'a str,
    ints: Vec<usize>,
    floats: Vec<f32>,
}

fn parse_tag(line: &str) -> std::result::Result<Tag<'_>, String> {
    let form = || {
        format!(
            "\"{}\" is no tag; write t NAME ints/floats/strings and as many arguments, e.g. t \
             crease 2/1/0 4 7 2.5",
            line.trim()
        )
    };
    let mut words = line.split_whitespace().skip(1);
    let (name, counts) = words.next().zip(words.next()).ok_or_else(form)?;
    let counts: Vec<usize> = counts.split('/').map_while(|n| n.parse().ok()).collect();
    let &[ints, floats, strings] = &counts[..] else { return Err(form()) };
    let rest: Vec<&str> = words.collect();
    if Some(rest.len()) != ints.checked_add(floats).and_then(|n| n.checked_add(strings)) {
        return Err(format!(
            "the tag announces {ints} + {floats} + {strings} arguments and has {}; correct the \
             counts",
            rest.len()
        ));
    }
    let whole = |w: &&str| {
        w.parse::<usize>()
            .map_err(|_| format!("\"{w}\" is no index; vertices and faces count from 0 in tags"))
    };
    let number = |w: &&str| {
        let x = w.parse::<f32>().ok().filter(|x| x.is_finite() && *x >= 0.0);
        x.ok_or_else(|| {
            format!("\"{w}\" is no sharpness; give a number from 0 on, 10 for always sharp")
        })
    };
    Ok(Tag {
        name,
        ints: rest[..ints].iter().map(whole).collect::<std::result::Result<_, _>>()?,
        floats: rest[ints..ints + floats]
            .iter()
            .map(number)
            .collect::<std::result::Result<_, _>>()?,
    })
}

fn tags(
    path: &Path,
    text: &str,
    cage: &mut Cage,
    welded: &Welded,
    faces: &[Option<u32>],
    warnings: &mut Vec<String>,
) -> Result<()> {
    let lines: Vec<(usize, &str)> = text
        .lines()
        .enumerate()
        .filter(|(_, l)| l.split_whitespace().next() == Some("t"))
        .collect();
    if lines.is_empty() {
        return Ok(());
    }
    let file_vertices = vertices(text);
    let mut edges: HashSet<[u32; 2]> = HashSet::new();
    for f in 0..cage.face_count() {
        let corners = &cage.corners[cage.face(f)];
        edges.extend(
            (0..corners.len()).map(|k| sorted([corners[k], corners[(k + 1) % corners.len()]])),
        );
    }
    let mut missing = 0;
    let mut ignored = BTreeSet::new();
    for (index, line) in lines {
        let fail = |message: String| Error::input(path, index + 1, message);
        let tag = parse_tag(line).map_err(fail)?;
        let each = |count: usize, what: &str| -> Result<Vec<f32>> {
            match tag.floats.len() {
                1 => Ok(vec![tag.floats[0]; count]),
                n if n == count => Ok(tag.floats.clone()),
                n => Err(fail(format!(
                    "the tag has {n} values of sharpness for {count} {what}; give one, or one each"
                ))),
            }
        };
        let vertex = |i: usize| -> Result<Option<u32>> {
            let count = file_vertices.len();
            let p = file_vertices.get(i).ok_or_else(|| {
                fail(format!(
                    "vertex {i} is out of range: the file has {count}, counted from 0 in tags"
                ))
            })?;
            Ok(welded.ids.get(&key(welded.near(*p))).copied())
        };
        match tag.name {
            "crease" => {
                if tag.ints.len() < 2 {
                    return Err(fail(
                        "a crease needs at least two vertices; write t crease 2/1/0 V0 V1 SHARPNESS"
                            .into(),
                    ));
                }
                let sharpness = each(tag.ints.len() - 1, "edges")?;
                for (pair, s) in tag.ints.windows(2).zip(sharpness) {
                    match (vertex(pair[0])?, vertex(pair[1])?) {
                        (Some(a), Some(b)) if edges.contains(&sorted([a, b])) => {
                            cage.creases.push(([a, b], s))
                        }
                        _ => missing += 1,
                    }
                }
            }
            "corner" => {
                let sharpness = each(tag.ints.len(), "vertices")?;
                for (&i, s) in tag.ints.iter().zip(sharpness) {
                    if let Some(v) = vertex(i)? {
                        cage.sharp_vertices.push((v, s));
                    }
                }
            }
            "hole" => {
                for &i in &tag.ints {
                    let face = faces.get(i).ok_or_else(|| {
                        fail(format!(
                            "face {i} is out of range: the file has {}, counted from 0 in tags",
                            faces.len()
                        ))
                    })?;
                    cage.holes.extend(*face);
                }
            }
            "interpolateboundary" => match tag.ints[..] {
                [0] => cage.boundary = Some(Boundary::None),
                [1] => cage.boundary = Some(Boundary::EdgeAndCorner),
                [2] => cage.boundary = Some(Boundary::Edge),
                _ => {
                    return Err(fail(
                        "interpolateboundary takes 0 (faces left out), 1 (creases with corners) \
                         or 2 (creases)"
                            .into(),
                    ));
                }
            },
            // The default of either.
            "creasemethod" if line.trim_end().ends_with("normal") => {}
            other => _ = ignored.insert(other.to_owned()),
        }
    }
    if missing > 0 {
        warnings.push(format!(
            "{}: {missing} creases run along no edge of the mesh and are left out; tags count \
             vertices from 0",
            path.display()
        ));
    }
    if !ignored.is_empty() {
        let names = ignored.into_iter().collect::<Vec<_>>().join(", ");
        warnings.push(format!(
            "{}: tags that are not understood are left out: {names}",
            path.display()
        ));
    }
    Ok(())
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
