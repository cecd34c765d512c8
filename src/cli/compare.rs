//! `nearfar compare`.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::{check_png, parse_finite};
use crate::compare::{self, Comparison, Octaves, Truth};
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
    /// Also tell the error by octave of size (pixels), and in plain regions, where clouds show.
    #[arg(long)]
    bands: bool,
    /// Factor of the difference image.
    #[arg(long, default_value_t = 4.0, value_name = "X", value_parser = parse_finite)]
    amplify: f32,
    /// Write the amplified absolute difference to the cleaned reference, at its exposure.
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

/// What `--json` prints.
#[derive(Serialize)]
struct Json<'a> {
    #[serde(flatten)]
    figures: &'a Comparison,
    warnings: Vec<String>,
    #[serde(flatten)]
    octaves: Option<&'a Octaves>,
}

/// Standard errors that are printed: 19 of 20 figures lie within.
const STATED: f64 = 2.0;

fn print(found: &Comparison, octaves: Option<&Octaves>) {
    let e = &found.errors;
    let relative = |v: f64, error: f64| format!("{v:.6} ± {:.6}", STATED * error);
    let line = |name: &str, value: &str| println!("{name:<22} {value}");
    line("relMSE", &relative(e.relmse, e.relmse_standard_error));
    let trimmed = relative(e.relmse_trimmed, e.relmse_trimmed_standard_error);
    line("relMSE without 0.1 %", &trimmed);
    let percent =
        |v: f64, error: f64| format!("{:+.4} ± {:.4} %", 100.0 * v, 100.0 * STATED * error);
    line("bias", &percent(e.bias, e.bias_standard_error));
    line("MSE", &format!("{:.6e} ± {:.1e}", e.mse, STATED * e.mse_standard_error));
    let against = if found.halves { ", against the cleaned reference" } else { "" };
    line("MAE", &format!("{:.6e} ± {:.1e}{against}", e.mae, STATED * e.mae_standard_error));
    let (flip, error, stops) = (found.flip, STATED * found.flip_standard_error, found.exposure);
    line("FLIP", &format!("{flip:.4} ± {error:.4} at {stops:+.2} stops{against}"));
    if e.non_finite > 0 {
        line("not finite", &format!("{} pixels, left out above", e.non_finite));
    }
    if let Some(octaves) = octaves {
        for b in &octaves.bands {
            let to = b.to.map_or("and above".to_owned(), |to| format!("to {to}"));
            let error = b.standard_error.map_or(String::new(), |e| format!(" ± {:.6}", STATED * e));
            line(&format!("  {} {to} pixels", b.from), &format!("{:.6}{error}", b.relmse));
        }
        if let Some(plain) = octaves.plain {
            let error = 100.0 * STATED * octaves.plain_standard_error.unwrap_or(0.0);
            let plain = 100.0 * plain;
            line("plain regions", &format!("{plain:.3} ± {error:.3} % in 4 to 32 pixels"));
        }
    }
    let halves = match found.truth_noise {
        Some(noise) => {
            format!("two halves, whose noise (relMSE {noise:.1e}) cancels but in MAE and FLIP")
        }
        None => "one image: its noise counts as error".to_owned(),
    };
    line("reference", &format!("{halves}; cleaned by {}", found.cleaned));
    line("±", "two standard errors over blocks of pixels, the reference's noise included");
}

/// # Errors
/// For unreadable or unequal images, and [`Error::OverBound`].
pub(super) fn compare(args: &CompareArgs) -> Result<()> {
    if let Some(path) = &args.output {
        check_png(path)?;
    }
    let film = read_exr(&args.image)?;
    let truth = Truth::read(&args.reference)?;
    let found = compare::compare(&film, &args.image, &truth)?;
    let octaves =
        film.rgb("").filter(|_| args.bands).map(|pixels| compare::octaves(&pixels, &truth));
    let warnings = [compare::notes(&film, &truth), found.warnings()].concat();
    let e = &found.errors;
    if args.json {
        let all = Json { figures: &found, warnings, octaves: octaves.as_ref() };
        let text = serde_json::to_string_pretty(&all)
            .map_err(|e| Error::Render(format!("figures: {e}")))?;
        println!("{text}");
    } else {
        print(&found, octaves.as_ref());
        warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    }
    if let (Some(path), Some(pixels)) = (&args.output, film.rgb("")) {
        let difference = compare::difference(&pixels, truth.quiet(), args.amplify);
        write_png_rgb(&difference, film.width, film.height, path, found.exposure)?;
    }
    if args.max_relmse.is_some_and(f64::is_nan) {
        return Err(Error::Usage("--max-relmse NaN: write a number; nothing is below NaN".into()));
    }
    match args.max_relmse {
        Some(bound)
            if e.non_finite > 0 || e.relmse_trimmed.is_nan() || e.relmse_trimmed > bound =>
        {
            let pixels = match e.non_finite {
                0 => String::new(),
                n => format!("; {n} pixels are not finite"),
            };
            let relmse = e.relmse_trimmed;
            Err(Error::OverBound(format!("relMSE {relmse:.6}, allowed {bound}{pixels}")))
        }
        _ => Ok(()),
    }
}
