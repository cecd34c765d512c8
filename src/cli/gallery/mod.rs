//! `nearfar gallery`: every scene of the checkout by several methods with its ground truth, and one
//! page of it all.
//!
//! Pictures are rendered one after another by this very program as child processes, so that each
//! has its own time and memory. They go to FOLDER/SCENE/NAME.exr, with statistics NAME.json and a
//! key NAME.key beside them. A picture whose key is there and equal is not made again; a ground
//! truth that was stopped goes on from where it was. A picture that fails is named at the end and
//! makes the command fail; the others and the page are made all the same.

mod child;
mod key;
mod manifest;
mod plan;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::Args;

use self::key::Key;
use self::plan::{Picture, Plan, SceneEntry};
use super::{parse_size, stop};
use crate::atomic_file;
use crate::error::{Error, Result};
use crate::page::report::page;
use crate::run::Run;

/// Options of `nearfar gallery`.
#[derive(Debug, Args)]
pub(super) struct GalleryArgs {
    /// Where pictures and page go; default gallery, with --quick gallery/quick.
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Small pictures and ground truths of few samples: the whole page in minutes.
    #[arg(long)]
    quick: bool,
    /// Size of the pictures; square ones get its height. Default 640x360, with --quick 384x216.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Samples per pixel of the ground truths. Default 1024, with --quick 64.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Only this scene; may be repeated.
    #[arg(long, value_name = "SCENE")]
    only: Vec<String>,
    /// Redo what is done.
    #[arg(long)]
    again: bool,
    /// Render nothing: only the page of what is there.
    #[arg(long, conflicts_with = "again")]
    page: bool,
}

/// # Errors
/// Folders without scenes, pictures that failed, a page that cannot be written,
/// [`Error::Interrupted`].
pub(super) fn gallery(args: &GalleryArgs, cancel: &Arc<AtomicBool>) -> Result<()> {
    let plan = Plan {
        size: args.size.unwrap_or(if args.quick { (384, 216) } else { (640, 360) }),
        spp: args.spp.unwrap_or(if args.quick { 64 } else { 1024 }),
        quick: args.quick,
    };
    let output = args
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(if args.quick { "gallery/quick" } else { "gallery" }));
    let scenes = plan::present(&args.only)?;
    stop::keeps();
    let pictures: Vec<Picture> = scenes.iter().flat_map(|s| plan.pictures(s)).collect();
    let failed =
        if args.page { Vec::new() } else { render(&plan, &pictures, &output, args.again, cancel)? };
    let made = write_page(&plan, &scenes, &output);
    if failed.is_empty() {
        made
    } else {
        Err(Error::Render(format!("failed: {}", failed.join(", "))))
    }
}

/// Writes the page of what is there.
fn write_page(plan: &Plan, scenes: &[&SceneEntry], output: &Path) -> Result<()> {
    let text = toml::to_string(&manifest::manifest(plan, scenes, output))
        .map_err(|e| Error::Render(format!("report.toml: {e}")))?;
    std::fs::create_dir_all(output).map_err(|source| Error::Io { path: output.into(), source })?;
    atomic_file::write_bytes(
        &output.join("report.toml"),
        format!("# Written by nearfar gallery.\n{text}"),
    )?;
    let at = output.join("index.html");
    atomic_file::write_bytes(&at, page(output, &Run::new(0)?)?)?;
    println!("{}", at.display());
    Ok(())
}

/// Minutes and seconds.
fn clock(time: Duration) -> String {
    format!("{}:{:02}", time.as_secs() / 60, time.as_secs() % 60)
}

/// Renders what is missing; the names of what failed.
fn render(
    plan: &Plan,
    pictures: &[Picture],
    output: &Path,
    again: bool,
    cancel: &Arc<AtomicBool>,
) -> Result<Vec<String>> {
    let sources = key::Sources::read();
    let mut todo = Vec::new();
    for picture in pictures {
        let at = output.join(picture.scene.name).join(&picture.name);
        let key = Key::new(picture, plan, &sources)?;
        if again || !key.is_done(&at) {
            todo.push((picture, at, key));
        }
    }
    eprintln!(
        "{} of {} pictures are there; ground truths of {} samples at {}x{}",
        pictures.len() - todo.len(),
        pictures.len(),
        plan.spp,
        plan.size.0,
        plan.size.1
    );
    let (begin, whole) = (Instant::now(), todo.iter().map(|(p, ..)| p.weight).sum::<f64>());
    let (mut done, mut failed) = (0.0, Vec::new());
    for (number, (picture, at, key)) in todo.iter().enumerate() {
        let left = if done > 0.0 {
            let left = begin.elapsed().mul_f64((whole - done) / done);
            format!(", about {} left", clock(left))
        } else {
            String::new()
        };
        eprintln!(
            "[{}/{}] {}: {}  ({} passed{left})",
            number + 1,
            todo.len(),
            picture.scene.name,
            picture.name,
            clock(begin.elapsed())
        );
        match child::render(plan, picture, at, key, again, cancel) {
            Ok(()) => {}
            Err(Error::Interrupted) => {
                let kept = "what is done is kept: the same command goes on from here";
                return Err(Error::Stopped(kept.into()));
            }
            Err(error) => {
                eprintln!("warning: {}: {}: {error}", picture.scene.name, picture.name);
                failed.push(format!("{}/{}", picture.scene.name, picture.name));
            }
        }
        done += picture.weight;
    }
    Ok(failed)
}
