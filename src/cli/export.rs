//! `nearfar export`: a scene for other renderers.

use std::path::PathBuf;

use clap::Args;

use super::options::SceneOptions;
use super::tell;
use crate::atomic_file;
use crate::error::Result;
use crate::export;
use crate::load::Loaded;

/// Options of `nearfar export`.
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// Folder to write: `scene.xml` (Mitsuba 3) with meshes and textures beside it.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// # Errors
/// Whatever is wrong with the scene, or files that cannot be written.
pub(super) fn write(args: &ExportArgs) -> Result<()> {
    if args.output.exists() {
        atomic_file::check(&args.output.join("scene.xml"))?;
    }
    let Loaded { scene, notes, warnings, .. } = args.scene.load()?;
    tell(args.scene.quiet, &notes, &warnings);
    if let Some(last) = export::export(&scene, &args.output)?.last() {
        println!("{}", last.display());
    }
    Ok(())
}
