//! `nearfar compare`.

use std::path::PathBuf;

use clap::Args;

use super::check_writable;
use crate::compare as error;
use crate::error::{Error, Result};
use crate::film::{read_exr, write_png_rgb};

/// Options of `nearfar compare`.
#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    /// Image to judge: OpenEXR.
    image: PathBuf,
    /// Reference image; its two halves are used where it has them (layers half0, half1 or files
    /// NAME.half0.exr, NAME.half1.exr).
    reference: PathBuf,
    /// Factor of the difference image.
    #[arg(long, default_value_t = 4.0, value_name = "X")]
    amplify: f32,
    /// Write the amplified absolute difference, at the reference's exposure.
    #[arg(short, long, value_name = "DIFF.png")]
    output: Option<PathBuf>,
    /// Print the figures as JSON.
    #[arg(long)]
    json: bool,
    /// Exit with 1 when relMSE without the 0.1 % worst pixels is above this, or a pixel is not
    /// finite.
    #[arg(long, value_name = "X")]
    max_relmse: Option<f64>,
}

/// # Errors
/// For unreadable or unequal images, and [`Error::OverBound`].
pub(super) fn compare(args: &CompareArgs) -> Result<()> {
    if let Some(path) = &args.output {
        check_writable(path)?;
    }
    let film = read_exr(&args.image)?;
    let reference = error::read_reference(&args.reference)?;
    let found = error::compare(&film, &args.image, &reference)?;
    let e = &found.errors;
    if args.json {
        let text = serde_json::to_string_pretty(&found)
            .map_err(|e| Error::Render(format!("figures: {e}")))?;
        println!("{text}");
    } else {
        println!("relMSE                 {:.6} ± {:.6}", e.relmse, e.relmse_standard_error);
        println!(
            "relMSE without 0.1 %   {:.6} ± {:.6}",
            e.relmse_trimmed, e.relmse_trimmed_standard_error
        );
        println!("bias                   {:+.4} %", e.bias * 100.0);
        println!("MSE                    {:.6e}", e.mse);
        println!("MAE                    {:.6e}", e.mae);
        println!("FLIP                   {:.4} at {:+.2} stops", found.flip, found.exposure);
        if e.non_finite > 0 {
            println!("not finite             {} pixels, left out above", e.non_finite);
        }
        println!(
            "reference              {}",
            if found.halves {
                "two halves: its noise does not count"
            } else {
                "one image: its noise counts as error"
            }
        );
    }
    if let (Some(path), Some(pixels)) = (&args.output, film.rgb("")) {
        let difference = error::difference(&pixels, &reference.mean, args.amplify);
        write_png_rgb(&difference, reference.width, reference.height, path, found.exposure)?;
    }
    match args.max_relmse {
        Some(bound)
            if e.non_finite > 0 || e.relmse_trimmed.is_nan() || e.relmse_trimmed > bound =>
        {
            Err(Error::OverBound(format!(
                "relMSE {:.6} is above {bound}, or of {} pixels that are not finite",
                e.relmse_trimmed, e.non_finite
            )))
        }
        _ => Ok(()),
    }
}
