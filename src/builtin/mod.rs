//! Scenes made by code: parametric, deterministic, with their materials; asked for by `[[mesh]]
//! builtin = "…"` in a scene file.

mod atrium;
mod cathedral;
mod cloth;
mod corridor;
mod foliage;
mod fur;
mod garden_room;
mod hairball;
mod interior;
mod lamp_hall;
mod rotunda;
mod slats;
mod solid;
mod study;
mod subdivision;

pub use atrium::{AtriumParameters, atrium};
pub use cathedral::{CathedralParameters, cathedral};
pub use corridor::{CorridorParameters, corridor};
pub use foliage::{FoliageParameters, foliage};
pub use fur::{FurParameters, fur};
pub use garden_room::{GardenRoomParameters, garden_room};
pub use hairball::{HairballParameters, hairball};
pub use interior::{InteriorParameters, interior};
pub use lamp_hall::{LampHallParameters, lamp_hall};
pub use rotunda::{RotundaParameters, rotunda};
pub use slats::{SlatsParameters, slats};
pub use study::{StudyParameters, study};
pub use subdivision::{SubdivisionParameters, subdivision};

use crate::radiometry::Rgb;
use crate::scene::{Cage, Curves, Material, Mesh};

/// Surfaces whose material indices refer to `materials`.
#[derive(Clone, Debug, Default)]
pub struct Generated {
    /// The triangles.
    pub mesh: Mesh,
    /// Cages of subdivision surfaces.
    pub cages: Vec<Cage>,
    /// Curves.
    pub curves: Vec<Curves>,
    /// Their materials.
    pub materials: Vec<Material>,
}

/// Diffuse materials of names and albedos.
fn diffuse(names: &[(&str, [f32; 3])]) -> Vec<Material> {
    let material = |&(name, albedo): &(&str, [f32; 3])| Material {
        name: name.into(),
        albedo: Rgb::from(albedo),
        ..Material::default()
    };
    names.iter().map(material).collect()
}

/// Makes the built-in mesh `name`.
///
/// # Errors
/// A message that lists the names or parameters there are.
pub fn generate(name: &str, parameters: &toml::Table) -> Result<Generated, String> {
    fn read<T: serde::de::DeserializeOwned>(t: &toml::Table) -> Result<T, String> {
        t.clone()
            .try_into()
            .map_err(|e: toml::de::Error| format!("parameters: {}", e.message().trim_end()))
    }
    let mut made = match name {
        "atrium" => atrium(&read(parameters)?)?,
        "cathedral" => cathedral(&read(parameters)?)?,
        "corridor" => corridor(&read(parameters)?)?,
        "foliage" => foliage(&read(parameters)?)?,
        "fur" => fur(&read(parameters)?)?,
        "garden-room" => garden_room(&read(parameters)?)?,
        "hairball" => hairball(&read(parameters)?)?,
        "interior" => interior(&read(parameters)?)?,
        "lamp-hall" => lamp_hall(&read(parameters)?)?,
        "rotunda" => rotunda(&read(parameters)?)?,
        "slats" => slats(&read(parameters)?)?,
        "study" => study(&read(parameters)?)?,
        "subdivision" => subdivision(&read(parameters)?)?,
        _ => {
            return Err(format!(
                "there is no builtin \"{name}\"; there are: atrium, cathedral, corridor, foliage, \
                 fur, garden-room, hairball, interior, lamp-hall, rotunda, \
                 slats, study, subdivision"
            ));
        }
    };
    made.mesh.name = name.into();
    made.cages.iter_mut().for_each(|c| c.name = name.into());
    made.curves.iter_mut().for_each(|c| c.name = name.into());
    Ok(made)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Scene};
    use crate::tessellate::{Geometry, analyze_topology};

    #[test]
    fn all_parts_are_closed_and_outward() {
        for name in [
            "atrium",
            "cathedral",
            "corridor",
            "foliage",
            "garden-room",
            "hairball",
            "interior",
            "lamp-hall",
            "rotunda",
            "slats",
            "study",
        ] {
            let made = generate(name, &toml::Table::new()).unwrap();
            let count = made.mesh.triangles.len();
            assert!(name != "interior" || (50_000..200_000).contains(&count), "{count}");
            assert!(name != "atrium" || (700_000..800_000).contains(&count), "{count}");
            let geometry = Geometry::new(&Scene {
                meshes: vec![made.mesh],
                materials: made.materials,
                camera: Camera { eye: glam::Vec3::splat(1e4), ..Camera::default() },
                ..Scene::default()
            });
            assert_eq!(geometry.dropped_degenerate + geometry.dropped_duplicate, 0, "{name}");
            let topology = analyze_topology(&geometry);
            let open = topology.closed_of_triangle.iter().filter(|c| !**c).count();
            // Leaves and palm fronds are sheets; the walls of the study have their backs to this
            // eye, and those around lamps are seen from inside.
            let sheets = match name {
                "foliage" => 12_000,
                "atrium" => 14 * 22 * 8 * 4,
                "study" => 12,
                "corridor" => 188,
                "lamp-hall" => 120,
                _ => 0,
            };
            assert_eq!(open, sheets, "{name}: open triangles");
        }
    }

    #[test]
    fn same_every_time_and_growing_with_detail() {
        let with = |detail: f64| {
            generate(
                "interior",
                &toml::Table::from_iter([("detail".to_owned(), toml::Value::Float(detail))]),
            )
            .unwrap()
            .mesh
        };
        assert_eq!(with(0.5).positions, with(0.5).positions);
        assert!(with(1.0).triangles.len() > 2 * with(0.5).triangles.len());
        for name in ["foliage", "hairball"] {
            let with = |detail: f64| {
                generate(
                    name,
                    &toml::Table::from_iter([("detail".to_owned(), toml::Value::Float(detail))]),
                )
                .unwrap()
                .mesh
            };
            assert_eq!(with(0.5).positions, with(0.5).positions);
            assert!(with(1.0).triangles.len() * 10 > with(0.5).triangles.len() * 19, "{name}");
        }
        let coarse = generate(
            "atrium",
            &toml::Table::from_iter([("detail".to_owned(), toml::Value::Float(0.05))]),
        )
        .unwrap()
        .mesh;
        assert!((15_000..30_000).contains(&coarse.triangles.len()), "{}", coarse.triangles.len());
        assert!(
            generate(
                "interior",
                &toml::Table::from_iter([("detail".to_owned(), toml::Value::Float(99.0))])
            )
            .is_err()
        );
        assert!(
            generate("castle", &toml::Table::new())
                .unwrap_err()
                .contains("rotunda, slats, study, subdivision")
        );
    }
}
