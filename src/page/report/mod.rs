//! `nearfar report`: a folder of renders as one HTML page.
//!
//! Computes   per section (a folder of EXR pictures of one size) every picture's figures against
//!            the section's ground truth, by the same code as `nearfar compare`; the page's script
//!            shows them: a pair parted by a divider, zoom with pixel values, differences signed
//!            and absolute, FLIP, sample locations, sweeps and switches.
//! Input      a folder, its subfolders one section each; `report.toml` in it may order and describe
//!            them (`manifest`).
//! Output     one page without any other file: pictures are half floats in PNG in base64
//!            (`encode`), about 4.5 bytes a pixel. Guarantees the page asks the network for
//!            nothing; figures are computed from the files' 32-bit values, not from the page's.
//! Not        for big pictures in numbers: ten pictures of 1280×720 are 45 MB.
//! Cost       0.3 s a picture of 640×360, most of it PNG compression and FLIP.

mod encode;
mod folder;
pub(crate) mod manifest;
mod section;

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::error::{Error, Result};
use crate::run::Run;
use folder::{Picture, pictures_in, read_pictures, sections_in};
use manifest::{SectionPlan, read_manifest};
use section::Section;

#[derive(Debug, Serialize)]
struct Page {
    title: String,
    text: String,
    version: &'static str,
    sections: Vec<Section>,
}

/// The pictures of a section: of the size most of them have; the others are left out with a
/// warning.
fn of_one_size(pictures: Vec<Picture>, run: &Run) -> Vec<Picture> {
    let size = |p: &Picture| (p.film.width, p.film.height);
    let count = |s: (u32, u32)| pictures.iter().filter(|p| size(p) == s).count();
    let Some(common) = pictures.iter().map(size).rev().max_by_key(|s| count(*s)) else {
        return pictures;
    };
    let (kept, left): (Vec<_>, Vec<_>) = pictures.into_iter().partition(|p| size(p) == common);
    for p in left {
        run.warn(format!(
            "{}: left out: {}×{} pixels, the others {}×{}; put it into a folder of its own",
            p.path.display(),
            p.film.width,
            p.film.height,
            common.0,
            common.1
        ));
    }
    kept
}

fn check_names(dir: &Path, plan: &SectionPlan, names: &[String]) -> Result<()> {
    let lists = plan.pictures.iter().map(|n| ("pictures", n.as_str())).chain(plan.named());
    for (key, name) in lists {
        let whole =
            name.strip_suffix(" · far").or_else(|| name.strip_suffix(" · near")).unwrap_or(name);
        if !names.iter().any(|n| n == whole) {
            let message = format!(
                "{}: section \"{}\", {key}: there is no picture \"{name}\"; there are: {}",
                dir.join("report.toml").display(),
                plan.folder,
                names.join(", ")
            );
            return Err(Error::Usage(message));
        }
    }
    Ok(())
}

/// Makes the page of `dir`.
///
/// # Errors
/// A folder without pictures, a malformed `report.toml` or one that names what is not there,
/// unreadable images, Ctrl-C.
pub fn page(dir: &Path, run: &Run) -> Result<String> {
    let manifest = read_manifest(dir)?;
    let plans = if manifest.section.is_empty() {
        sections_in(dir)
            .into_iter()
            .map(|folder| SectionPlan { folder, ..SectionPlan::default() })
            .collect()
    } else {
        manifest.section
    };
    if plans.is_empty() {
        return Err(Error::Usage(format!(
            "{}: no EXR pictures in this folder or its subfolders; render some to {0}/NAME.exr, \
             with their statistics in {0}/NAME.json",
            dir.display()
        )));
    }
    let wanted: Vec<(PathBuf, Vec<String>)> = plans
        .iter()
        .map(|plan| {
            let folder = dir.join(&plan.folder);
            let there = pictures_in(&folder);
            check_names(dir, plan, &there)?;
            let names = if plan.pictures.is_empty() { there } else { plan.pictures.clone() };
            Ok((folder, names))
        })
        .collect::<Result<_>>()?;
    let phase = run.phase("pictures", wanted.iter().map(|w| w.1.len() as u64).sum());
    let mut sections = Vec::new();
    for (i, (plan, (folder, names))) in plans.iter().zip(&wanted).enumerate() {
        let pictures = of_one_size(read_pictures(folder, names, run)?, run);
        if pictures.is_empty() {
            run.warn(format!("{}: no pictures", folder.display()));
            continue;
        }
        sections.push(section::section(format!("s{i}"), plan, &pictures, run, &phase)?);
    }
    drop(phase);
    let title = manifest.title.unwrap_or_else(|| "Renders".into());
    let page = Page {
        title: title.clone(),
        text: manifest.text,
        version: env!("CARGO_PKG_VERSION"),
        sections,
    };
    // Inside a script element only "</" could end the data.
    let data = serde_json::to_string(&page)
        .map_err(|e| Error::Render(format!("page: {e}")))?
        .replace("</", "<\\/");
    Ok(include_str!("page.html")
        .replace("{{title}}", &escape(&title))
        .replace("{{style}}", include_str!("page.css"))
        .replace("{{script}}", concat!(include_str!("picture.js"), include_str!("page.js")))
        .replace("{{data}}", &data))
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
