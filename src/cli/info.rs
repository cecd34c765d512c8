//! `nearfar info`: what a scene holds.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;

use super::options::SceneOptions;
use crate::error::{Error, Result};
use crate::info::scene_info;
use crate::run::Run;
use crate::shading::World;

/// Options of `nearfar info`.
#[derive(Debug, Args)]
pub(super) struct InfoArgs {
    #[command(flatten)]
    scene: SceneOptions,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// # Errors
/// Whatever is wrong with the scene.
pub(super) fn info(args: &InfoArgs, _cancel: &Arc<AtomicBool>) -> Result<()> {
    let run = Run::new(args.scene.threads)?;
    let loaded = args.scene.load()?;
    let world = World::new(&loaded.scene, args.scene.backend.unwrap_or_default(), &run)?;
    let info = run.install(|| scene_info(&loaded, &world));
    if args.json {
        println!(
            "{}",
            serde_json::to_string_pretty(&info)
                .map_err(|e| Error::Render(format!("the report cannot be written: {e}")))?
        );
    } else {
        print!("{info}");
    }
    Ok(())
}
