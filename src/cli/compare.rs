//! `nearfar compare`.

use std::path::PathBuf;

use clap::Args;

use crate::error::{Error, Result};

/// Options of `nearfar compare`.
#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    /// Image to judge.
    image: PathBuf,
    /// Reference image.
    reference: PathBuf,
}

/// # Errors
/// Always, for now.
pub(super) fn compare(args: &CompareArgs) -> Result<()> {
    Err(Error::Usage(format!("compare {} {}: not built yet", args.image.display(), args.reference.display())))
}
