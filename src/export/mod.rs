//! A scene for another renderer: a Mitsuba 3 scene with binary PLY meshes and PNG textures in one
//! folder.
//!
//! Input      a [`Scene`] and a folder.
//! Output     in the user's space (mesh files relative to the scene's origin): `scene.xml`, one
//!            `mesh-N-M.ply` for every mesh and material that meet, `texture-N.png`, `mask-N.png`,
//!            `environment-N.exr`. `scene.xml` takes the parameters
//!            `spp`, `width`, `height`, `integrator` (default `path`, with masks `volpath`).
//!            Guarantees the same radiometry: radiance, irradiance and radiant intensity mean the
//!            same there; sensor with box filter, `max_depth` unlimited.
//! Not        exact: a sun with extent becomes a distant disc of the same irradiance; sphere lights
//!            are exact spheres, here they are tessellated; a spot's penumbra falls off linearly in
//!            the angle there, by smoothstep in the cosine here; albedo times texture is rounded to
//!            8 bits; masks are cut at ½ texel by texel; bright texels of an environment are
//!            constant here, interpolated there.
//! Cost       one pass over the triangles; the PLY files take 36 B a vertex and 13 B a triangle.

mod mesh_file;
mod xml;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::Vec3;

use crate::atomic_file;
use crate::error::{Error, Result};
use crate::film::write_png_bytes;
use crate::radiometry::srgb_from_linear;
use crate::scene::{Light, Material, Scene, Texture};

/// Writes `scene` into `folder`, which is made if absent, and returns the files written,
/// `scene.xml` last.
///
/// # Errors
/// [`Error::Io`] and [`Error::Image`] when a file cannot be written.
pub fn export(scene: &Scene, folder: &Path) -> Result<Vec<PathBuf>> {
    std::fs::create_dir_all(folder).map_err(|source| Error::Io { path: folder.into(), source })?;
    let mut files = Vec::new();
    let mut document = xml::Document::new(scene);
    let mut used = BTreeMap::new();
    for (number, mesh) in scene.meshes.iter().enumerate() {
        let mut of_material = BTreeMap::<u32, Vec<[u32; 3]>>::new();
        for (t, &m) in mesh.triangles.iter().zip(&mesh.materials) {
            of_material.entry(m).or_default().push(*t);
        }
        for (m, triangles) in of_material {
            let material = &scene.materials[m as usize];
            let name = format!("mesh-{number}-{m}.ply");
            // Emitters shine by their faces' sides: no shading normals there.
            let normals = !material.emits() && !mesh.normals.is_empty();
            mesh_file::write(&folder.join(&name), mesh, &triangles, normals)?;
            files.push(folder.join(&name));
            used.insert(m, ());
            document.mesh(&name, m, material, normals);
        }
    }
    for &m in used.keys() {
        let material = &scene.materials[m as usize];
        let albedo = material
            .albedo_texture
            .map(|id| &scene.textures[id as usize])
            .filter(|t| !t.srgb.is_empty());
        if let Some(texture) = albedo {
            let path = folder.join(format!("texture-{m}.png"));
            save(&path, texture, image::ExtendedColorType::Rgb8, &tinted(material, texture))?;
            files.push(path);
        }
        let mask = material
            .opacity_texture
            .map(|id| &scene.textures[id as usize])
            .filter(|t| !t.mask.is_empty());
        if let Some(texture) = mask {
            let path = folder.join(format!("mask-{m}.png"));
            let cut: Vec<u8> = texture
                .mask
                .iter()
                .map(|&v| {
                    if material.opacity * texture.placement.value(f32::from(v) / 255.0) >= 0.5 {
                        255
                    } else {
                        0
                    }
                })
                .collect();
            save(&path, texture, image::ExtendedColorType::L8, &cut)?;
            files.push(path);
        }
        document.material(m, material, [albedo, mask]);
    }
    let around = bounds(scene);
    for (number, light) in scene.lights.iter().enumerate() {
        if let Light::Quad { corner, edge1, edge2, .. } = *light {
            let name = format!("quad-{number}.ply");
            mesh_file::write_quad(&folder.join(&name), corner, edge1, edge2)?;
            files.push(folder.join(&name));
        }
        if let Light::Environment { map } = light {
            let path = folder.join(format!("environment-{number}.exr"));
            let mut film = crate::film::Film::new(map.width, map.height);
            film.set_rgb("", &map.texels);
            crate::film::write_exr(&film, &path, crate::film::Precision::Full)?;
            files.push(path);
        }
        document.light(number, light, around);
    }
    let path = folder.join("scene.xml");
    atomic_file::write_bytes(&path, document.finish())?;
    files.push(path);
    Ok(files)
}

/// Centre and radius of a ball around all meshes.
fn bounds(scene: &Scene) -> (Vec3, f32) {
    let points = scene.meshes.iter().flat_map(|m| m.positions.iter().copied());
    let around = crate::math::Aabb::around(points);
    if around.is_empty() { (Vec3::ZERO, 1.0) } else { (around.center(), 0.5 * around.diagonal()) }
}

/// The texture's texels times the material's albedo, as sRGB bytes.
fn tinted(material: &Material, texture: &Texture) -> Vec<u8> {
    let byte = |linear: f32| (srgb_from_linear(linear) * 255.0).round().clamp(0.0, 255.0) as u8;
    let decode: Vec<f32> =
        (0..=255u8).map(|c| crate::radiometry::linear_from_srgb(f32::from(c) / 255.0)).collect();
    texture
        .srgb
        .iter()
        .flat_map(|t| {
            material
                .albedo_with(Vec3::from_array(
                    t.map(|c| texture.placement.value(decode[c as usize]).max(0.0)),
                ))
                .to_array()
                .map(byte)
        })
        .collect()
}

fn save(
    path: &Path,
    texture: &Texture,
    kind: image::ExtendedColorType,
    bytes: &[u8],
) -> Result<()> {
    write_png_bytes(path, bytes, (texture.width, texture.height), kind)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin;
    use crate::scene::Mesh;

    #[test]
    fn every_file_named_is_there_and_of_the_size_its_header_promises() {
        let made = builtin::generate("slats", &toml::Table::new()).unwrap();
        let light =
            Light::Quad { corner: Vec3::Y, edge1: Vec3::X, edge2: Vec3::Z, radiance: Vec3::ONE };
        let scene = Scene {
            meshes: vec![made.mesh],
            materials: made.materials,
            lights: vec![light],
            ..Scene::default()
        };
        let folder = std::env::temp_dir().join(format!("nearfar-export-{}", std::process::id()));
        let files = export(&scene, &folder).unwrap();
        let text = std::fs::read_to_string(folder.join("scene.xml")).unwrap();
        let mut faces = 0;
        for file in &files[..files.len() - 1] {
            assert!(text.contains(&*file.file_name().unwrap().to_string_lossy()));
            let bytes = std::fs::read(file).unwrap();
            let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
            let header = std::str::from_utf8(&bytes[..end]).unwrap();
            let count = |what: &str| {
                header
                    .split(&format!("element {what} "))
                    .nth(1)
                    .unwrap()
                    .lines()
                    .next()
                    .unwrap()
                    .parse::<usize>()
                    .unwrap()
            };
            let floats = header.matches("property float").count();
            assert_eq!(bytes.len() - end, count("vertex") * floats * 4 + count("face") * 13);
            faces += count("face");
        }
        assert_eq!(faces, scene.meshes.iter().map(|m: &Mesh| m.triangles.len()).sum::<usize>() + 2);
        assert_eq!(text.matches("<shape").count(), text.matches("</shape>").count());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
