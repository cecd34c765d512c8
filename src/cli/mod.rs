//! The command line: parsing, progress, exit codes. The only room that prints.
//!
//! Data goes to stdout; progress, notes, warnings and errors to stderr. Exit codes: 0 done, 1 a
//! comparison over its bound, 2 usage or input error, 3 the render failed or could not be written,
//! 130 interrupted (the message says what is kept).
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    clippy::exit,
    reason = "the command line is where output goes and the process ends"
)]

mod bench;
mod budget;
mod cloud;
mod compare;
mod export;
mod fly;
mod gallery;
mod info;
mod keep;
mod measure;
mod merge;
mod methods;
mod options;
mod picture;
mod progress;
mod render;
mod report;
mod settings;
mod shelf;
mod show;
mod stop;

use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, Subcommand};

use crate::atomic_file;
use crate::error::{Error, Result};

/// Offline renderer for diffuse global illumination by near/far irradiance decomposition.
#[derive(Debug, Parser)]
#[command(
    name = "nearfar",
    version,
    arg_required_else_help = true,
    subcommand_required = true,
    max_term_width = 100
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene: a scene TOML or an OBJ.
    Render(render::RenderArgs),
    /// Render the frames of a camera path; proxy and clusters are kept between them.
    Fly(fly::FlyArgs),
    /// Path trace the ground truth: unbiased, resumable, with two independent half images.
    Reference(render::ReferenceArgs),
    /// Add the samples of ground truths of one scene that differ by their seeds alone.
    Merge(merge::MergeArgs),
    /// Compare an image with a reference: relMSE, bias, MSE, MAE, FLIP.
    Compare(compare::CompareArgs),
    /// Turn layers of images into a PNG, side by side.
    Show(show::ShowArgs),
    /// Measure ray backends and methods.
    Bench(bench::BenchArgs),
    /// Surfaces as a cloud of discs: bake it, gather from it, look at it.
    Cloud(cloud::CloudArgs),
    #[command(hide = true, disable_help_flag = true)]
    Bake(Renamed),
    #[command(hide = true, disable_help_flag = true)]
    Gather(Renamed),
    /// Make one HTML page of a folder of renders: pairs with a divider, differences, FLIP, errors,
    /// times.
    Report(report::ReportArgs),
    /// Render every scene of the checkout by several methods, and one page of it all.
    Gallery(gallery::GalleryArgs),
    /// Write a scene for other renderers (Mitsuba 3).
    Export(export::ExportArgs),
    /// Tell what a scene holds and what is odd about it.
    Info(info::InfoArgs),
    /// List the settings: key, type, default, range, unit, meaning.
    Settings(settings::SettingsArgs),
}

/// Whatever is given to a command that has another name now.
#[derive(Debug, Args)]
struct Renamed {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    arguments: Vec<std::ffi::OsString>,
}

fn renamed(old: &str, new: &str) -> Error {
    Error::Usage(format!("nearfar {old} is now nearfar {new}; its options are the same"))
}

/// A reader that has seen enough (`nearfar compare … | head`) ends the program, as it does for
/// others, without a word; any other reason why standard output cannot be written is told.
fn end_with_the_reader() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let message = panic.payload().downcast_ref::<String>();
        match message.and_then(|m| m.strip_prefix("failed printing to stdout: ")) {
            Some(reason) if reason.contains("Broken pipe") => std::process::exit(141),
            Some(reason) => {
                eprintln!("error: standard output: cannot be written: {reason}");
                std::process::exit(3);
            }
            None => usual(panic),
        }
    }));
}

/// Runs the program on the process's arguments.
pub fn run() -> ExitCode {
    end_with_the_reader();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    let cancel = stop::listen();
    let done: Result<()> = match cli.command {
        Command::Render(args) => render::render(&args, &cancel),
        Command::Fly(args) => fly::fly(&args, &cancel),
        Command::Reference(args) => render::reference(&args, &cancel),
        Command::Merge(args) => merge::merge(&args),
        Command::Compare(args) => compare::compare(&args),
        Command::Show(args) => show::show(&args),
        Command::Bench(args) => bench::bench(&args, &cancel),
        Command::Cloud(args) => cloud::cloud(&args, &cancel),
        Command::Bake(_) => Err(renamed("bake", "cloud bake")),
        Command::Gather(_) => Err(renamed("gather", "cloud gather")),
        Command::Gallery(args) => gallery::gallery(&args, &cancel),
        Command::Report(args) => report::write(&args, &cancel),
        Command::Export(args) => export::write(&args),
        Command::Info(args) => info::info(&args, &cancel),
        Command::Settings(args) => settings::settings(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

/// The command tree, for tests and generated documents.
pub fn command() -> clap::Command {
    Cli::command()
}

/// Prints the notes and warnings of loading.
fn tell(quiet: bool, notes: &[String], warnings: &[String]) {
    if !quiet {
        notes.iter().for_each(|n| eprintln!("note: {n}"));
        warnings.iter().for_each(|w| eprintln!("warning: {w}"));
    }
}

/// Parses a duration: seconds, or with a unit: `90`, `90s`, `1.5m`, `2h`.
fn parse_seconds(text: &str) -> std::result::Result<f64, String> {
    let (number, unit) = match text.strip_suffix(['s', 'm', 'h']) {
        Some(number) => (number, text.chars().last()),
        None => (text, None),
    };
    let factor = match unit {
        Some('m') => 60.0,
        Some('h') => 3600.0,
        _ => 1.0,
    };
    match number.parse::<f64>() {
        Ok(v) if v.is_finite() && v > 0.0 => Ok(v * factor),
        _ => Err("write seconds, or a number with s, m or h: 90, 1.5m".into()),
    }
}

/// Parses `WxH`.
fn parse_size(text: &str) -> std::result::Result<(u32, u32), String> {
    let fail = || "write WIDTHxHEIGHT, for example 640x360".to_owned();
    let (w, h) = text.split_once(['x', 'X', '×']).ok_or_else(fail)?;
    match (w.trim().parse(), h.trim().parse()) {
        (Ok(w), Ok(h)) if w > 0 && h > 0 => Ok((w, h)),
        _ => Err(fail()),
    }
}

/// Parses a number that is neither NaN nor infinite.
fn parse_finite(text: &str) -> std::result::Result<f32, String> {
    match text.trim().parse::<f32>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err("write a finite number".into()),
    }
}

/// Refuses a picture that would be a PNG by another name.
fn check_png(path: &std::path::Path) -> Result<()> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        return atomic_file::check(path);
    }
    Err(Error::Usage(format!("{}: the picture is a PNG, name it .png", path.display())))
}

/// Writes a value as indented JSON.
fn write_json(path: &std::path::Path, value: &impl serde::Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value)
        .map_err(|e| Error::Render(format!("{}: {e}", path.display())))?;
    atomic_file::write_bytes(path, text + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_is_consistent() {
        command().debug_assert();
    }

    #[test]
    fn sizes_and_durations() {
        assert_eq!(parse_size("640x360"), Ok((640, 360)));
        assert!(parse_size("640").is_err() && parse_size("0x3").is_err());
        assert_eq!(parse_seconds("1.5m"), Ok(90.0));
        assert!(parse_seconds("-1").is_err() && parse_seconds("soon").is_err());
        assert_eq!(parse_finite("-1.5"), Ok(-1.5));
        assert!(parse_finite("nan").is_err() && parse_finite("1e99").is_err());
    }
}
