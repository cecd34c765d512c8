//! Scenes made by code, parametric and deterministic.

use super::{Material, Mesh};

/// A mesh whose material indices refer to `materials`.
#[derive(Clone, Debug)]
pub struct Generated {
    /// The triangles.
    pub mesh: Mesh,
    /// Their materials.
    pub materials: Vec<Material>,
}

/// Makes the built-in mesh `name`.
///
/// # Errors
/// A message that lists the names or parameters there are.
pub fn generate(name: &str, parameters: &toml::Table) -> Result<Generated, String> {
    let _ = parameters;
    Err(format!("there is no builtin \"{name}\""))
}
