//! `nearfar info`.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;

use crate::error::{Error, Result};

/// Options of `nearfar info`.
#[derive(Debug, Args)]
pub(super) struct InfoArgs {
    /// Scene TOML or OBJ.
    scene: PathBuf,
}

/// # Errors
/// Always, for now.
pub(super) fn info(args: &InfoArgs, _cancel: &Arc<AtomicBool>) -> Result<()> {
    Err(Error::Usage(format!("info {}: not built yet", args.scene.display())))
}
