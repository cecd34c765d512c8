//! One section's pictures with their figures, as the page's script reads them.

use serde::Serialize;
use serde_json::Value;

use super::encode;
use super::folder::{Picture, find_reference};
use super::manifest::{SectionPlan, Sweep, Toggle};
use crate::compare::{Comparison, Truth, compare_with_flip, exposure_of};
use crate::error::Result;
use crate::radiometry::Rgb;
use crate::run::{Phase, Run};

/// What the script gets of a section.
#[derive(Debug, Serialize)]
pub(super) struct Section {
    pub id: String,
    pub title: String,
    pub text: String,
    pub width: u32,
    pub height: u32,
    pub exposure: f32,
    pub reference: Option<String>,
    /// The reference's own relMSE, from its halves.
    pub reference_noise: Option<f64>,
    /// What to doubt in the figures, picture by picture.
    pub doubts: Vec<String>,
    pub pair: [String; 2],
    pub shown: Vec<Shown>,
    pub toggles: Vec<Toggle>,
    pub sweep: Option<Sweep>,
    pub ratio: Option<Ratio>,
}

/// One picture.
#[derive(Debug, Default, Serialize)]
pub(super) struct Shown {
    pub name: String,
    /// Half floats, see `encode`.
    pub colors: String,
    /// FLIP per pixel against the reference.
    pub flip: Option<String>,
    /// 1 where the method took a sample.
    pub locations: Option<String>,
    pub method: Option<String>,
    pub error: Option<Comparison>,
    pub cpu_seconds: Option<f64>,
    pub wall_seconds: Option<f64>,
    /// Of the statistics: what a reader asks for first.
    pub facts: Vec<(&'static str, Value)>,
}

/// Irradiance caching : ours : Monte Carlo, as the course states its result.
#[derive(Debug, Serialize)]
pub(super) struct Ratio {
    pub cache: String,
    pub ours: String,
    pub cache_over_ours: Option<f64>,
    /// The reference's time × (its own relMSE / ours) over ours: Monte Carlo's error falls as 1 /
    /// samples.
    pub monte_carlo_over_ours: Option<f64>,
}

const FACTS: [&str; 8] = [
    "clusters",
    "records",
    "rays_per_cluster",
    "alpha",
    "triangles",
    "cells",
    "peak_rss_bytes",
    "threads",
];

impl Shown {
    fn doubts(&self) -> Vec<String> {
        let warnings = self.error.as_ref().map(Comparison::warnings).unwrap_or_default();
        warnings.iter().map(|w| format!("{}: {w}.", self.name)).collect()
    }
}

fn shown(picture: &Picture, pixels: &[Rgb], truth: Option<&Truth>) -> Result<Shown> {
    let film = &picture.film;
    let judged = truth.map(|r| compare_with_flip(film, &picture.path, r)).transpose()?;
    let (error, flip) = judged.unzip();
    Ok(Shown {
        name: picture.name.clone(),
        colors: encode::colors(pixels, film.width, film.height)?,
        flip: flip.map(|f| encode::map(&f, film.width, film.height)).transpose()?,
        locations: film
            .channels
            .get("location")
            .map(|l| encode::map(l, film.width, film.height))
            .transpose()?,
        method: picture.method().map(str::to_owned),
        error,
        cpu_seconds: picture.cpu_seconds(),
        wall_seconds: picture.wall_seconds(),
        facts: FACTS
            .iter()
            .filter(|k| !picture.statistics[**k].is_null())
            .map(|k| (*k, picture.statistics[*k].clone()))
            .collect(),
    })
}

fn ratio(
    names: Option<&[String; 2]>,
    pictures: &[Picture],
    made: &[Shown],
    truth: Option<(&Picture, f64)>,
) -> Option<Ratio> {
    let by_method =
        |method: &str| pictures.iter().find(|p| p.method() == Some(method)).map(|p| p.name.clone());
    let [cache, ours] = match names {
        Some(names) => names.clone(),
        None => [by_method("irradiance-cache")?, by_method("decomposition")?],
    };
    let of = |name: &str| made.iter().find(|s| s.name == name);
    let (theirs, own) = (of(&cache)?, of(&ours)?);
    let own_seconds = own.cpu_seconds.filter(|s| *s > 0.0)?;
    let monte_carlo = truth.and_then(|(picture, noise)| {
        let error = own.error.as_ref()?.errors.relmse_trimmed;
        Some(picture.cpu_seconds()? * noise / error / own_seconds)
            .filter(|v| v.is_finite() && *v > 0.0)
    });
    Some(Ratio {
        cache_over_ours: theirs.cpu_seconds.map(|s| s / own_seconds),
        monte_carlo_over_ours: monte_carlo,
        cache,
        ours,
    })
}

/// Builds a section from its pictures, all of one size.
///
/// # Errors
/// Images that cannot be compared, Ctrl-C.
pub(super) fn section(
    id: String,
    plan: &SectionPlan,
    pictures: &[Picture],
    run: &Run,
    phase: &Phase<'_>,
) -> Result<Section> {
    let found = find_reference(pictures, plan.reference.as_deref());
    let truth = found.map(|i| Truth::read(&pictures[i].path)).transpose()?;
    let (width, height) = (pictures[0].film.width, pictures[0].film.height);
    let mut made = Vec::new();
    for (i, picture) in pictures.iter().enumerate() {
        run.check()?;
        let pixels = picture.film.rgb("").unwrap_or_default();
        made.push(shown(picture, &pixels, truth.as_ref().filter(|_| found != Some(i)))?);
        if plan.layers.contains(&picture.name) {
            for layer in ["far", "near"] {
                match picture.film.rgb(layer) {
                    Some(values) => made.push(Shown {
                        name: format!("{} · {layer}", picture.name),
                        colors: encode::colors(&values, width, height)?,
                        ..Shown::default()
                    }),
                    None => run.warn(format!(
                        "{}: no layer {layer}; render again and keep it",
                        picture.path.display()
                    )),
                }
            }
        }
        phase.advance(1);
    }
    let name = |i: usize| pictures[i].name.clone();
    let first = (0..pictures.len()).find(|i| found != Some(*i)).unwrap_or(0);
    let swept = |n: &str| plan.sweep.as_ref().is_some_and(|s| s.pictures.iter().any(|p| p == n));
    let ours = pictures
        .iter()
        .enumerate()
        .position(|(i, p)| {
            p.method() == Some("decomposition") && found != Some(i) && !swept(&p.name)
        })
        .unwrap_or(first);
    let last = pictures.len() - 1;
    let exposure = plan.exposure.unwrap_or_else(|| {
        truth.as_ref().map_or_else(
            || exposure_of(&pictures[0].film.rgb("").unwrap_or_default()),
            |r| exposure_of(&r.reference().mean),
        )
    });
    let noise = truth.as_ref().and_then(Truth::noise);
    Ok(Section {
        title: plan.title.clone().unwrap_or_else(|| {
            if plan.folder == "." { "Pictures".into() } else { plan.folder.clone() }
        }),
        text: plan.text.clone(),
        pair: plan.pair.clone().unwrap_or_else(|| [name(ours), name(found.unwrap_or(last))]),
        ratio: ratio(plan.ratio.as_ref(), pictures, &made, found.map(|i| &pictures[i]).zip(noise)),
        reference_noise: noise,
        doubts: made.iter().flat_map(Shown::doubts).collect(),
        reference: found.map(name),
        toggles: plan.toggle.clone(),
        sweep: plan.sweep.clone(),
        shown: made,
        id,
        width,
        height,
        exposure,
    })
}
