//! `nearfar bench`.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;

use crate::error::{Error, Result};

/// Options of `nearfar bench`.
#[derive(Debug, Args)]
pub(super) struct BenchArgs {
    /// Scene TOML or OBJ.
    scene: PathBuf,
}

/// # Errors
/// Always, for now.
pub(super) fn bench(args: &BenchArgs, _cancel: &Arc<AtomicBool>) -> Result<()> {
    Err(Error::Usage(format!("bench {}: not built yet", args.scene.display())))
}
