//! `nearfar merge`: several ground truths of one scene as one, by adding their samples.

use std::path::PathBuf;

use clap::Args;

use super::picture::ImageOptions;
use crate::atomic_file;
use crate::error::{Error, Result};
use crate::film::{self, Precision, read_whole_exr};
use crate::method::path;
use crate::run::Run;

/// Options of `nearfar merge`.
#[derive(Debug, Args)]
pub(super) struct MergeArgs {
    /// Pictures of `nearfar reference`, with their running sums, that differ by their seeds alone;
    /// partial ones too.
    #[arg(required = true, num_args = 2.., value_name = "PICTURE.exr")]
    pictures: Vec<PathBuf>,
    /// Picture to write: OpenEXR with all layers.
    #[arg(short, long, value_name = "OUT.exr")]
    output: PathBuf,
    /// Leave out the running sums: a smaller file that cannot be merged again.
    #[arg(long)]
    no_state: bool,
    #[command(flatten)]
    image: ImageOptions,
}

/// # Errors
/// Pictures that cannot be read, are damaged, or do not belong together; files that cannot be
/// written.
pub(super) fn merge(args: &MergeArgs) -> Result<()> {
    args.image.check()?;
    if args.output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("exr")) {
        return Err(Error::Usage(format!(
            "--output {}: the image is OpenEXR, name it .exr",
            args.output.display()
        )));
    }
    atomic_file::check(&args.output)?;
    let films = args.pictures.iter().map(|p| read_whole_exr(p)).collect::<Result<Vec<_>>>()?;
    let mut film = path::merge(&films)?;
    if args.no_state {
        film.forget_sums();
    }
    let run = Run::new(1)?;
    args.image.keep(&mut film, &run);
    run.warnings().iter().for_each(|w| eprintln!("warning: {w}"));
    let precision = if args.image.half { Precision::Half } else { Precision::Full };
    atomic_file::rescued(&args.output, |path| film::write_exr(&film, path, precision))?;
    if args.image.png {
        film::write_png(&film, &args.output.with_extension("png"), args.image.exposure)?;
    }
    let told = |name: &str| film.header.get(name).map_or("", String::as_str);
    println!("{} samples a pixel, seeds {}", told("nearfar.spp"), told("nearfar.seed"));
    Ok(())
}
