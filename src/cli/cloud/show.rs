//! `nearfar cloud show`: one file of points as a page for a browser.
//!
//! Any binary PLY whose first element is `vertex` can be shown: discs of `nearfar cloud bake`,
//! clusters and cache records of `--save-cache`, sample locations of `--locations`, photons of
//! `--photons`, and those of other programs. The page holds all data and needs no network; channel
//! and exposure are chosen in it.

use std::path::PathBuf;

use clap::Args;

use crate::atomic_file;
use crate::cli::show::has_extension;
use crate::error::{Error, Result};
use crate::page::viewer::{Table, write_page};
use crate::run::Run;

/// Options of `nearfar cloud show`.
#[derive(Debug, Args)]
pub(in crate::cli) struct ShowCloudArgs {
    /// Points: discs of `nearfar cloud bake`, clusters and records of `--save-cache`, samples of
    /// `--locations`, photons of `--photons`, or any other's.
    #[arg(value_name = "POINTS.ply")]
    points: PathBuf,
    /// Page to write; default NAME.html beside NAME.ply.
    #[arg(short, long, value_name = "OUT.html")]
    output: Option<PathBuf>,
}

/// # Errors
/// Files that hold no points or cannot be read, pages that cannot be written.
pub(super) fn show_cloud(args: &ShowCloudArgs) -> Result<()> {
    let output = args.output.clone().unwrap_or_else(|| args.points.with_extension("html"));
    if !has_extension(&output, "html") && !has_extension(&output, "htm") {
        return Err(Error::Usage(format!(
            "{}: points become a page; name it OUT.html",
            output.display()
        )));
    }
    atomic_file::check(&output)?;
    let title = args.points.file_name().unwrap_or_default().to_string_lossy();
    let (run, table) = (Run::new(0)?, Table::read(&args.points)?);
    run.install(|| write_page(&table, &title, &output))?;
    println!("{}", output.display());
    Ok(())
}
