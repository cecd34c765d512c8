//! `nearfar report`: one page of a folder of renders.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;

use super::options::with_bar;
use super::tell;
use crate::atomic_file;
use crate::error::Result;
use crate::page::report::page;
use crate::run::Run;

/// Options of `nearfar report`.
#[derive(Debug, Args)]
pub(super) struct ReportArgs {
    /// Folder of EXR pictures or of subfolders with them, a section each; statistics (`NAME.json`
    /// by --stats) beside them, `report.toml` for titles, order, sweeps.
    dir: PathBuf,
    /// Page to write; default index.html in the folder.
    #[arg(short, long, value_name = "PAGE.html")]
    output: Option<PathBuf>,
    /// No progress bar.
    #[arg(short, long)]
    quiet: bool,
}

/// # Errors
/// A folder without pictures, a malformed `report.toml`, unreadable images, a page that cannot be
/// written.
pub(super) fn write(args: &ReportArgs, cancel: &Arc<AtomicBool>) -> Result<()> {
    let output = args.output.clone().unwrap_or_else(|| args.dir.join("index.html"));
    atomic_file::check(&output)?;
    let run = with_bar(Run::new(0)?, args.quiet, None, cancel);
    let html = page(&args.dir, &run)?;
    tell(false, &[], &run.warnings());
    atomic_file::write_bytes(&output, html)?;
    println!("{}", output.display());
    Ok(())
}
