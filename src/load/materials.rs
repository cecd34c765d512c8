//! Materials of meshes and of the scene file, and their textures.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use toml::Spanned;

use super::assemble::Assembly;
use super::find::{Found, find};
use super::image::read_texture;
use super::mtl::{MtlMaterial, taken_for_diffuse};
use super::mtl_texture::TextureStatement;
use super::path::resolve;
use super::scene_file::{MaterialEntry, MeshEntry, Shading, Triple};
use crate::error::Result;
use crate::radiometry::Rgb;
use crate::scene::{Material, Placement, TextureId};

impl Assembly<'_> {
    pub(super) fn add_material(&mut self, material: Material) -> u32 {
        let list = &mut self.loaded.scene.materials;
        // Materials of equal name in different meshes stay apart unless they are equal.
        if let Some(&id) = self.materials.get(&material.name)
            && list[id as usize] == material
        {
            return id;
        }
        let id = list.len() as u32;
        self.materials.insert(material.name.clone(), id);
        list.push(material);
        id
    }

    /// Numbers of the materials of the file that a mesh entry names. Those that nobody defines are
    /// called what the entry says.
    pub(super) fn mtl(
        &mut self,
        path: &Path,
        entry: &MeshEntry,
        mut materials: Vec<MtlMaterial>,
    ) -> Result<Vec<u32>> {
        if entry.materials != Shading::Diffuse
            && let Some(told) = taken_for_diffuse(materials.iter())
        {
            self.loaded.warnings.push(format!("{}: {told}", path.display()));
        }
        /// Undefined materials that are named in warnings.
        const NAMED: usize = 8;
        let undefined: Vec<&mut MtlMaterial> =
            materials.iter_mut().filter(|m| m.undefined.is_some()).collect();
        let warnings = &mut self.loaded.warnings;
        let more = undefined.len().saturating_sub(NAMED);
        for (i, m) in undefined.into_iter().enumerate() {
            match (&entry.material, &m.undefined) {
                (Some(name), _) => m.name.clone_from(name),
                (None, Some(why)) if i < NAMED => {
                    warnings.push(format!("{}: {why}", path.display()));
                }
                _ => {}
            }
        }
        if more > 0 && entry.material.is_none() {
            warnings.push(format!(
                "{}: {more} further materials are not defined and become grey",
                path.display()
            ));
        }
        materials.into_iter().map(|m| self.add_mtl(m)).collect()
    }

    fn add_mtl(&mut self, m: MtlMaterial) -> Result<u32> {
        let [albedo_texture, emission_texture, opacity_texture] =
            [&m.albedo_texture, &m.emission_texture, &m.opacity_texture]
                .map(|t| t.as_ref().map_or(Ok(None), |t| self.named_texture(t, &m)));
        let mut emission = m.emission;
        if let Some(id) = emission_texture? {
            emission *= self.loaded.scene.textures[id as usize].mean();
            self.loaded.warnings.push(format!(
                "{}: material \"{}\" emits evenly, the mean of its map_Ke",
                m.folder.display(),
                m.name
            ));
        }
        Ok(self.add_material(Material {
            albedo: m.albedo,
            albedo_texture: albedo_texture?,
            emission,
            opacity: m.opacity,
            opacity_texture: opacity_texture?,
            name: m.name,
        }))
    }

    /// The texture of an MTL file; none, and a warning, where it cannot be found.
    fn named_texture(
        &mut self,
        t: &TextureStatement,
        m: &MtlMaterial,
    ) -> Result<Option<TextureId>> {
        let Some(Found { path, elsewhere }) = find(&t.file, &m.folder, &self.search_paths) else {
            self.loaded.warnings.push(format!(
                "{}: texture of material \"{}\" is missing; the plain colour is used; name its \
                 folder in search_paths",
                m.folder.join(&t.file).display(),
                m.name
            ));
            return Ok(None);
        };
        if elsewhere {
            let note = format!("texture \"{}\" is taken from {}", t.file, path.display());
            if !self.loaded.notes.contains(&note) {
                self.loaded.notes.push(note);
            }
        }
        self.texture(&path, t.placement).map(Some)
    }

    fn texture(&mut self, path: &Path, placement: Placement) -> Result<TextureId> {
        let key = (PathBuf::from(path), placement.numbers().map(f32::to_bits));
        if let Some(&id) = self.textures.get(&key) {
            return Ok(id);
        }
        let mut texture = read_texture(path)?;
        texture.placement = placement;
        let id = self.loaded.scene.textures.len() as TextureId;
        self.loaded.scene.textures.push(texture);
        self.textures.insert(key, id);
        Ok(id)
    }

    pub(super) fn material(&mut self, name: &str, entry: &Spanned<MaterialEntry>) -> Result<()> {
        let (span, e) = (entry.span(), entry.get_ref());
        let ids: BTreeSet<u32> = self
            .loaded
            .scene
            .materials
            .iter()
            .enumerate()
            .filter(|(_, m)| m.name == name)
            .map(|(i, _)| i as u32)
            .collect();
        if ids.is_empty() {
            let names: BTreeSet<&str> =
                self.loaded.scene.materials.iter().map(|m| m.name.as_str()).collect();
            let listed = names.into_iter().take(12).collect::<Vec<_>>().join(", ");
            return self
                .fail(&span, format!("no mesh has a material \"{name}\"; there are: {listed}"));
        }
        let channels = |t: Triple, key: &str| {
            let c = Rgb::from(t);
            if c.is_finite() && c.min_element() >= 0.0 {
                Ok(c)
            } else {
                self.fail(&span, format!("{key} must be finite and not negative"))
            }
        };
        let albedo = e.albedo.map(|a| channels(a, "albedo")).transpose()?;
        let emission = e.emission.map(|a| channels(a, "emission")).transpose()?;
        if albedo.is_some_and(|a| a.max_element() > 1.0) {
            return self.fail(&span, "albedo may not exceed 1");
        }
        if e.opacity.is_some_and(|o| !(0.0..=1.0).contains(&o)) {
            return self.fail(&span, "opacity must lie from 0 to 1");
        }
        let mut texture = |t: &Option<String>| -> Result<Option<Option<TextureId>>> {
            let Some(t) = t else { return Ok(None) };
            if t.is_empty() {
                return Ok(Some(None));
            }
            let path = resolve(t, self.file).or_else(|m| self.fail(&span, m))?;
            if !path.exists() {
                return self.fail(
                    &span,
                    format!("texture \"{}\" does not exist; correct the path", path.display()),
                );
            }
            self.texture(&path, Placement::default()).map(|id| Some(Some(id)))
        };
        let albedo_texture = texture(&e.albedo_texture)?;
        let opacity_texture = texture(&e.opacity_texture)?;
        for &id in &ids {
            let m = &mut self.loaded.scene.materials[id as usize];
            m.albedo = albedo.unwrap_or(m.albedo);
            m.emission = emission.unwrap_or(m.emission);
            m.opacity = e.opacity.unwrap_or(m.opacity);
            m.albedo_texture = albedo_texture.unwrap_or(m.albedo_texture);
            m.opacity_texture = opacity_texture.unwrap_or(m.opacity_texture);
        }
        if e.drop {
            for mesh in &mut self.loaded.scene.meshes {
                let mut keep = mesh.materials.iter().map(|m| !ids.contains(m));
                mesh.triangles.retain(|_| keep.next().unwrap_or(true));
                mesh.materials.retain(|m| !ids.contains(m));
            }
        }
        Ok(())
    }
}
