//! `nearfar bench SCENE --budget --reference REF.exr`: where the error of the decomposition sits.

use std::path::Path;

use super::options::Job;
use crate::bench::budget::{BudgetRow, budget};
use crate::compare::Truth;
use crate::error::{Error, Result};
use crate::shading::World;

/// The rows of a budget as a table.
pub(super) struct Table<'a>(pub(super) &'a [BudgetRow]);

/// Computes the budget.
///
/// # Errors
/// A reference that cannot be read or has another size; whatever stops a render.
pub(super) fn run(
    job: &Job,
    world: &World,
    reference: &Path,
    stride: u32,
    gather_rays: u32,
) -> Result<Vec<BudgetRow>> {
    let truth = Truth::read(reference)?;
    let pixels = (world.camera.width * world.camera.height) as usize;
    if truth.reference().mean.len() != pixels {
        return Err(Error::Usage(format!(
            "{} is not of the size {}x{}; use --size",
            reference.display(),
            world.camera.width,
            world.camera.height
        )));
    }
    budget(
        world,
        &job.config.decompose,
        job.config.inputs(world.around.extent),
        &truth,
        stride,
        gather_rays,
        &job.run,
    )
}

impl std::fmt::Display for Table<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(
            f,
            "{:<34} {:>10} {:>10} {:>12} {:>9}",
            "part", "relMSE", "± s.e.", "less 0.1 %", "bias %"
        )?;
        for BudgetRow { part, errors: e } in self.0 {
            writeln!(
                f,
                "{part:<34} {:>10.6} {:>10.6} {:>12.6} {:>+9.3}",
                e.relmse,
                e.relmse_standard_error,
                e.relmse_trimmed,
                100.0 * e.bias
            )?;
        }
        Ok(())
    }
}
