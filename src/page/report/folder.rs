//! The pictures of a folder: read, told apart by name and header, with the statistics beside them.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::error::{Error, Result};
use crate::film::{Film, read_exr};
use crate::input_file;
use crate::run::Run;

/// One picture with what is known of its making.
#[derive(Debug)]
pub(super) struct Picture {
    pub name: String,
    pub path: PathBuf,
    pub film: Film,
    /// The `--stats` file `NAME.json`; null without.
    pub statistics: Value,
}

impl Picture {
    /// The method by statistics or header.
    pub(super) fn method(&self) -> Option<&str> {
        self.statistics["method"]
            .as_str()
            .or_else(|| self.film.header.get("nearfar.method").map(String::as_str))
    }
    pub(super) fn cpu_seconds(&self) -> Option<f64> {
        self.statistics["cpu_seconds"].as_f64()
    }
    pub(super) fn wall_seconds(&self) -> Option<f64> {
        self.statistics["seconds"]["total"]
            .as_f64()
            .or_else(|| self.film.header.get("nearfar.seconds")?.parse().ok())
    }
    fn has_halves(&self) -> bool {
        ["half0.R", "half1.R"].iter().all(|c| self.film.channels.contains_key(*c))
    }
}

/// The EXR files of `dir`, by name; files of halves (`NAME.half0.exr`) belong to their picture, and
/// partial ones are none yet.
pub(super) fn pictures_in(dir: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(dir)
        .into_iter()
        .flatten()
        .flatten()
        .filter_map(|e| e.file_name().into_string().ok()?.strip_suffix(".exr").map(str::to_owned))
        .filter(|n| {
            !n.starts_with('.')
                && !n.ends_with(".half0")
                && !n.ends_with(".half1")
                && !n.ends_with(".var")
                && !n.ends_with(".partial")
        })
        .collect();
    names.sort();
    names
}

/// The folders of sections: `dir` itself as "." when it holds pictures, then its subfolders that
/// do.
pub(super) fn sections_in(dir: &Path) -> Vec<String> {
    let mut folders: Vec<String> = std::fs::read_dir(dir)
        .into_iter()
        .flatten()
        .flatten()
        .filter(|e| e.path().is_dir())
        .filter_map(|e| e.file_name().into_string().ok())
        .filter(|n| !pictures_in(&dir.join(n)).is_empty())
        .collect();
    folders.sort();
    if !pictures_in(dir).is_empty() {
        folders.insert(0, ".".into());
    }
    folders
}

/// Reads `names` in `dir`. Pictures without R, G, B are left out with a warning.
///
/// # Errors
/// Unreadable images, malformed statistics, Ctrl-C.
pub(super) fn read_pictures(dir: &Path, names: &[String], run: &Run) -> Result<Vec<Picture>> {
    let mut pictures = Vec::new();
    for name in names {
        run.check()?;
        let path = dir.join(format!("{name}.exr"));
        let film = read_exr(&path)?;
        if film.rgb("").is_none() {
            run.warn(format!("{}: left out: it has no channels R, G, B", path.display()));
            continue;
        }
        let beside = path.with_extension("json");
        let statistics = match input_file::read_text(&beside) {
            Err(Error::Io { .. }) => Value::Null,
            text => serde_json::from_str(&text?).map_err(|e| {
                Error::Usage(format!(
                    "{}:{}: {e}; render again and write the statistics",
                    beside.display(),
                    e.line()
                ))
            })?,
        };
        pictures.push(Picture { name: name.clone(), path, film, statistics });
    }
    Ok(pictures)
}

/// The ground truth among `pictures`: the one asked for, else named truth or reference, else with
/// two halves, else the path-traced one of the most samples.
pub(super) fn find_reference(pictures: &[Picture], asked: Option<&str>) -> Option<usize> {
    let named = |wanted: &str| pictures.iter().position(|p| p.name == wanted);
    let mean_samples = |p: &Picture| {
        p.film
            .channels
            .get("samples")
            .map_or(0.0, |s| s.iter().sum::<f32>() / s.len().max(1) as f32)
    };
    let path_traced = || {
        let traced = pictures.iter().enumerate().filter(|(_, p)| p.method() == Some("path"));
        traced.max_by(|a, b| mean_samples(a.1).total_cmp(&mean_samples(b.1))).map(|(i, _)| i)
    };
    match asked {
        Some(name) => named(name),
        None => named("truth")
            .or_else(|| named("reference"))
            .or_else(|| pictures.iter().position(Picture::has_halves))
            .or_else(path_traced),
    }
}
