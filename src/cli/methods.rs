//! `nearfar bench SCENE --methods`: sweeps of every method's own quality knob, measured and
//! compared.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;
use std::io::IsTerminal;
use toml::{Table, Value};

use super::measure::{Configuration, Measured, Workshop};
use super::options::{Job, SceneOptions};
use super::stop;
use crate::atomic_file;
use crate::bench::chart::chart;
use crate::bench::methods::{Against, ForeignPoint, MethodsReport, Row, verdict};
use crate::compare::{Comparison, Reference, Truth, compare, notes, read_reference};
use crate::config::{self, RenderConfig};
use crate::error::{Error, Result};
use crate::ffi::oidn::Denoiser;
use crate::film::read_exr;
use crate::method::Method;

/// Options of `nearfar bench --methods`.
#[derive(Debug, Args)]
#[command(next_help_heading = "Options of --methods")]
pub(super) struct MethodsOptions {
    /// Lines to draw; default all: decomposition, course, hessian, production-2006, split-sphere,
    /// gather, path, photon-map, and path+oidn where Open Image Denoise is.
    #[arg(long, requires = "methods", value_name = "LINES", value_delimiter = ',')]
    only: Vec<String>,
    /// Values of a line's knob, or of another KEY, which makes a line of its own; further settings
    /// after ";". May be repeated.
    #[arg(
        long,
        requires = "methods",
        value_name = "LINE[:KEY]=V,V[;KEY=V]",
        value_parser = parse_sweep
    )]
    sweep: Vec<Sweep>,
    /// Measure errors also to a gather of so many rays per point through the same proxy: what
    /// decomposition and caching can at best reach.
    #[arg(
        long,
        requires = "methods",
        num_args = 0..=1,
        default_missing_value = "4096",
        value_name = "RAYS",
        value_parser = clap::value_parser!(u32).range(1..=1 << 20)
    )]
    gather_reference: Option<u32>,
    /// An image of another renderer and its CPU seconds; may be repeated.
    #[arg(
        long,
        requires = "methods",
        value_name = "NAME,SECONDS,FILE.exr",
        value_parser = parse_point
    )]
    point: Vec<Point>,
    /// Work folder: images and figures stay there, and are used again; default out/bench-SCENE.
    #[arg(long, requires = "methods", value_name = "DIR")]
    output: Option<PathBuf>,
    /// Write the chart: error over CPU seconds.
    #[arg(long, requires = "methods", value_name = "FILE.svg")]
    chart: Option<PathBuf>,
}

/// Values that replace a line's own.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sweep {
    line: String,
    key: Option<String>,
    values: Vec<String>,
}

/// A foreign image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Point {
    name: String,
    seconds: f64,
    file: PathBuf,
}

/// A method, the settings that make it this line, and its knob.
struct Line {
    name: &'static str,
    method: Method,
    fixed: &'static [(&'static str, &'static str)],
    knob: &'static str,
    values: &'static [&'static str],
    /// The value of a plain render joins the sweep.
    with_default: bool,
}

/// The line that needs a library which may not be there.
const PATH_DENOISED: &str = "path+oidn";

const LINES: [Line; 9] = [
    Line {
        name: "decomposition",
        method: Method::Decomposition,
        fixed: &[],
        knob: "decompose.alpha",
        values: &["4%", "2%", "1%", "0.5%"],
        with_default: true,
    },
    Line {
        name: "course",
        method: Method::Course,
        fixed: &[],
        knob: "decompose.alpha",
        values: &["4%", "2%", "1%"],
        with_default: true,
    },
    Line {
        name: "hessian",
        method: Method::IrradianceCache,
        fixed: &[("cache.mode", "hessian")],
        knob: "cache.error",
        values: &["0.8", "0.4", "0.2", "0.1", "0.05"],
        with_default: true,
    },
    Line {
        name: "production-2006",
        method: Method::IrradianceCache,
        fixed: &[("cache.mode", "production-2006")],
        knob: "cache.error",
        values: &["0.4", "0.2", "0.1", "0.05"],
        with_default: false,
    },
    Line {
        name: "split-sphere",
        method: Method::IrradianceCache,
        fixed: &[("cache.mode", "split-sphere")],
        knob: "cache.error",
        values: &["0.4", "0.2", "0.1", "0.05"],
        with_default: false,
    },
    Line {
        name: "gather",
        method: Method::Gather,
        fixed: &[],
        knob: "gather.rays",
        values: &["4", "16", "64", "256"],
        with_default: false,
    },
    Line {
        name: "path",
        method: Method::Path,
        fixed: &[],
        knob: "path.spp",
        values: &["1", "4", "16", "64"],
        with_default: false,
    },
    Line {
        name: PATH_DENOISED,
        method: Method::Path,
        fixed: &[("denoise", "oidn")],
        knob: "path.spp",
        values: &["1", "4", "16", "64"],
        with_default: false,
    },
    Line {
        name: "photon-map",
        method: Method::PhotonMap,
        fixed: &[],
        knob: "proxy.photons",
        values: &[],
        with_default: true,
    },
];

/// One configuration of the comparison.
struct Entry {
    line: String,
    knob: String,
    value: String,
    default: bool,
    configuration: Configuration,
}

fn parse_sweep(text: &str) -> std::result::Result<Sweep, String> {
    let fail = || {
        "write LINE=VALUE,VALUE or LINE:KEY=VALUE,VALUE, for example decomposition=4%,2%,1%"
            .to_owned()
    };
    let (name, values) = text.split_once('=').ok_or_else(fail)?;
    let (line, key) =
        name.split_once(':').map_or((name, None), |(l, k)| (l, Some(k.trim().to_owned())));
    let line = line.trim().to_owned();
    check_line(&line)?;
    let values: Vec<String> = values.split(',').map(|v| v.trim().to_owned()).collect();
    if values.iter().any(|v| v.is_empty() || v.starts_with(';'))
        || key.as_ref().is_some_and(String::is_empty)
    {
        return Err(fail());
    }
    Ok(Sweep { line, key, values })
}

fn check_line(name: &str) -> std::result::Result<(), String> {
    if LINES.iter().any(|l| l.name == name) {
        return Ok(());
    }
    Err(format!("no line \"{name}\"; choose among {}", LINES.map(|l| l.name).join(", ")))
}

fn parse_point(text: &str) -> std::result::Result<Point, String> {
    let parts: Vec<&str> = text.splitn(3, ',').collect();
    let fail = || "write NAME,SECONDS,FILE.exr, the CPU seconds above 0".to_owned();
    let [name, seconds, file] = parts[..] else { return Err(fail()) };
    match seconds.trim().parse::<f64>() {
        Ok(seconds)
            if seconds.is_finite()
                && seconds > 0.0
                && !name.trim().is_empty()
                && !file.is_empty() =>
        {
            Ok(Point { name: name.trim().to_owned(), seconds, file: file.into() })
        }
        _ => Err(fail()),
    }
}

/// The value at a dotted key.
fn lookup<'a>(settings: &'a Table, key: &str) -> Option<&'a Value> {
    match key.split_once('.') {
        None => settings.get(key),
        Some((section, rest)) => lookup(settings.get(section)?.as_table()?, rest),
    }
}

/// Whether two values of a setting are the same number or text.
fn same(a: &Value, b: &Value) -> bool {
    let number = |v: &Value| v.as_float().or_else(|| v.as_integer().map(|i| i as f64));
    match (number(a), number(b)) {
        (Some(a), Some(b)) => (a - b).abs() <= 1e-6 * b.abs(),
        _ => a == b,
    }
}

/// All configurations, every setting checked.
fn entries(options: &MethodsOptions, given: &Table) -> Result<Vec<Entry>> {
    let settings = &RenderConfig::from_table(given.clone())?.to_table()?;
    for name in &options.only {
        check_line(name).map_err(|e| Error::Usage(format!("--only: {e}")))?;
    }
    let mut found = Vec::new();
    for line in &LINES {
        let named = options.only.iter().any(|n| n == line.name);
        let wanted = named
            || options.only.is_empty() && (line.name != PATH_DENOISED || Denoiser::open(1).is_ok());
        let own: Vec<&Sweep> = options.sweep.iter().filter(|s| s.line == line.name).collect();
        if !wanted && own.is_empty() {
            continue;
        }
        if line.name == PATH_DENOISED {
            Denoiser::open(1)?;
        }
        let default = lookup(settings, line.knob);
        let plain: Vec<&&Sweep> = own.iter().filter(|s| s.key.is_none()).collect();
        let mut values: Vec<String> = plain.iter().flat_map(|s| s.values.iter().cloned()).collect();
        if plain.is_empty() && wanted {
            values = line.values.iter().map(|v| (*v).to_owned()).collect();
            if let Some(default) = default.filter(|d| {
                line.with_default && !values.iter().any(|v| same(&config::parse_value(v), d))
            }) {
                values.push(default.as_str().map_or_else(|| default.to_string(), str::to_owned));
            }
        }
        for value in values {
            found.push(entry(line, line.name.to_owned(), line.knob, value, given)?);
        }
        for sweep in own {
            let Some(key) = &sweep.key else { continue };
            for value in &sweep.values {
                found.push(entry(line, format!("{}:{key}", line.name), key, value.clone(), given)?);
            }
        }
    }
    Ok(found)
}

fn entry(line: &Line, name: String, knob: &str, value: String, given: &Table) -> Result<Entry> {
    let mut parts = value.split(';').map(str::trim);
    let mut changes: Vec<(String, String)> =
        line.fixed.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
    changes.push((knob.to_owned(), parts.next().unwrap_or_default().to_owned()));
    for part in parts {
        changes.push(config::parse_assignment(part)?);
    }
    let of = |name: &str, changes: &[(String, String)]| {
        Configuration::new(name.to_owned(), line.method, given, changes)
    };
    let configuration = of(&format!("{name}-{value}"), &changes)
        .map_err(|e| Error::Usage(format!("line {name}: {e}")))?;
    let plain = of("plain", &[])?;
    let default = knob == line.knob && configuration.settings() == plain.settings();
    Ok(Entry { line: name, knob: knob.to_owned(), value, default, configuration })
}

/// Reads a truth and checks its size.
fn truth_of(path: &Path, job: &Job) -> Result<Truth> {
    let truth = Truth::read(path)?;
    check_size(path, truth.reference(), job)?;
    Ok(truth)
}

fn check_size(path: &Path, reference: &Reference, job: &Job) -> Result<()> {
    let camera = &job.scene.camera;
    if (reference.width, reference.height) != (camera.width, camera.height) {
        let (w, h) = (reference.width, reference.height);
        return Err(Error::Usage(format!(
            "{} has {w}x{h} pixels, the render {}x{}: use --size {w}x{h}",
            path.display(),
            camera.width,
            camera.height
        )));
    }
    Ok(())
}

/// The figures of an image, and a warning of everything that makes them doubtful.
fn against(path: &Path, truth: Option<&Truth>, job: &Job) -> Result<Option<Comparison>> {
    let Some(truth) = truth else { return Ok(None) };
    let film = read_exr(path)?;
    let found = compare(&film, path, truth)?;
    for warning in [notes(&film, truth), found.warnings()].concat() {
        job.run.warn(format!("{}: {warning}", path.display()));
    }
    Ok(Some(found))
}

/// Measures all configurations and compares them.
///
/// # Errors
/// Whatever is wrong with the scene, an option or an image; what a child says;
/// [`Error::Interrupted`] (finished renders stay).
pub(super) fn run(
    scene: &SceneOptions,
    options: &MethodsOptions,
    reference: Option<&Path>,
    rounds: usize,
    cancel: &Arc<AtomicBool>,
) -> Result<MethodsReport> {
    if reference.is_none() && options.gather_reference.is_none() {
        return Err(Error::Usage(
            "bench --methods needs something to measure errors to: \
            --reference TRUTH.exr, or --gather-reference"
                .into(),
        ));
    }
    if let Some(path) = &options.chart {
        atomic_file::check(path)?;
    }
    let job = scene.prepare(&[], None, cancel)?;
    let entries = entries(options, &job.given)?;
    let truth = reference.map(|path| truth_of(path, &job)).transpose()?;
    let mut points = Vec::new();
    for p in &options.point {
        check_size(&p.file, &read_reference(&p.file)?, &job)?;
        points.push(ForeignPoint {
            name: p.name.clone(),
            cpu_seconds: p.seconds,
            truth: against(&p.file, truth.as_ref(), &job)?,
            image: p.file.display().to_string(),
        });
    }
    let stem = scene.scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folder =
        options.output.clone().unwrap_or_else(|| PathBuf::from(format!("out/bench-{stem}")));
    let workshop = Workshop::new(&folder, scene, &job)?;
    let exact_gather = |rays: u32| {
        let changes = [("gather.rays".to_owned(), rays.to_string())];
        Configuration::new(format!("gather-reference-{rays}"), Method::Gather, &job.given, &changes)
    };
    let gather = options.gather_reference.map(exact_gather).transpose()?;
    stop::keeps();
    let measured = measure(&workshop, &entries, gather.as_ref(), rounds, scene, &job);
    measured.map_err(|error| match error {
        Error::Interrupted => Error::Stopped(format!(
            "renders that are done are kept in {}: the same command goes on from there",
            folder.display()
        )),
        other => other,
    })?;
    let gather = gather.map(|g| Truth::read(&workshop.image(&g))).transpose()?;
    let mut rows = Vec::new();
    for entry in &entries {
        let Some(measured) = workshop.known(&entry.configuration) else { continue };
        let image = workshop.image(&entry.configuration);
        rows.push(row(
            entry,
            &measured,
            &image,
            against(&image, truth.as_ref(), &job)?,
            against(&image, gather.as_ref(), &job)?,
        ));
    }
    let report = MethodsReport {
        scene: scene.scene.display().to_string(),
        width: job.scene.camera.width,
        height: job.scene.camera.height,
        triangles: job.scene.meshes.iter().map(|m| m.triangles.len()).sum(),
        threads: job.run.threads(),
        reference: reference.map(|p| p.display().to_string()),
        gather_reference_rays: options.gather_reference,
        against_truth: verdict(&rows, &points, Against::Truth),
        against_gather: verdict(&rows, &[], Against::Gather),
        rows,
        points,
    };
    if let Some(path) = &options.chart {
        atomic_file::write_bytes(path, chart(&report)?)?;
    }
    Ok(report)
}

/// Renders what is missing: first the gather that others are compared with, then round by round,
/// all configurations in turn.
fn measure(
    workshop: &Workshop,
    entries: &[Entry],
    gather: Option<&Configuration>,
    rounds: usize,
    scene: &SceneOptions,
    job: &Job,
) -> Result<()> {
    let known = |c: &Configuration| workshop.known(c).map_or(0, |m| m.runs.len());
    let mut todo: Vec<&Configuration> = gather.filter(|g| known(g) == 0).into_iter().collect();
    for round in 0..rounds {
        todo.extend(entries.iter().map(|e| &e.configuration).filter(|c| known(c) <= round));
    }
    let phase = job.run.phase("bench", todo.len() as u64);
    let tell = scene.verbose || (!scene.quiet && std::io::stderr().is_terminal());
    for (i, configuration) in todo.iter().enumerate() {
        job.run.check()?;
        let measured = workshop.render(configuration, job.run.cancel_flag())?;
        phase.advance(1);
        if tell {
            let [cpu, wall] = measured.runs.last().copied().unwrap_or_default();
            eprintln!(
                "{}/{} {}: {cpu:.2} s of CPU, {wall:.2} s",
                i + 1,
                todo.len(),
                configuration.name
            );
        }
    }
    Ok(())
}

fn row(
    entry: &Entry,
    measured: &Measured,
    image: &Path,
    truth: Option<Comparison>,
    gather: Option<Comparison>,
) -> Row {
    let stats = &measured.stats;
    let number = |key: &str| stats.get(key).and_then(serde_json::Value::as_f64);
    let places = ["records", "clusters"].into_iter().find_map(|k| stats.get(k)?.as_u64());
    // Samples of all places take the threads of the phase for as long as it lasts.
    let sampling = stats
        .pointer("/seconds/sample")
        .and_then(serde_json::Value::as_f64)
        .zip(number("threads"))
        .map(|(s, t)| s * t * 1e6);
    let [cpu_seconds, wall_seconds] = measured.seconds();
    // What a denoiser leaves does not fall as 1/samples.
    let denoised = stats.get("denoiser").is_some();
    Row {
        line: entry.line.clone(),
        knob: entry.knob.clone(),
        value: entry.value.clone(),
        default: entry.default,
        cpu_seconds,
        wall_seconds,
        rounds: measured.runs.len(),
        places,
        rays: stats
            .get("rays")
            .and_then(|r| r.as_object())
            .map_or(0, |r| r.values().filter_map(serde_json::Value::as_u64).sum()),
        microseconds_per_place: ["microseconds_per_record", "microseconds_per_cluster"]
            .into_iter()
            .find_map(number)
            .or_else(|| sampling.zip(places).filter(|(_, n)| *n > 0).map(|(s, n)| s / n as f64)),
        samples: stats
            .get("spp")
            .and_then(serde_json::Value::as_u64)
            .filter(|_| !denoised && entry.line.starts_with("path")),
        truth,
        gather,
        image: image.display().to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_and_points_are_read() {
        let sweep = parse_sweep("decomposition=4%, 2%;decompose.rays=64").unwrap();
        assert_eq!(
            sweep,
            Sweep {
                line: "decomposition".into(),
                key: None,
                values: vec!["4%".into(), "2%;decompose.rays=64".into()]
            }
        );
        assert_eq!(
            parse_sweep("gather:proxy.photons=1000").unwrap().key.as_deref(),
            Some("proxy.photons")
        );
        for wrong in ["decomposition", "magic=1", "path=", "path=1,,2", "path:=1"] {
            assert!(parse_sweep(wrong).is_err(), "{wrong}");
        }
        assert_eq!(
            parse_point("a b,2.5,x,y.exr").unwrap(),
            Point { name: "a b".into(), seconds: 2.5, file: "x,y.exr".into() }
        );
        for wrong in ["a", "a,1", "a,0,x.exr", "a,soon,x.exr", ",1,x.exr", "a,1,"] {
            assert!(parse_point(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_default_is_known_and_joins_the_sweep() {
        let options = |sweep: &[&str]| MethodsOptions {
            only: vec!["decomposition".into()],
            sweep: sweep.iter().map(|s| parse_sweep(s).unwrap()).collect(),
            gather_reference: None,
            point: Vec::new(),
            output: None,
            chart: None,
        };
        let mut settings = RenderConfig::default().to_table().unwrap();
        let values = |options: &MethodsOptions, settings: &Table| -> Vec<(String, bool)> {
            entries(options, settings).unwrap().into_iter().map(|e| (e.value, e.default)).collect()
        };
        let plain = values(&options(&[]), &settings);
        assert_eq!(plain.iter().map(|v| v.1).collect::<Vec<_>>(), [false, true, false, false]);
        config::set(&mut settings, "decompose.alpha", Value::Float(0.25)).unwrap();
        assert_eq!(values(&options(&[]), &settings)[4], ("0.25".to_owned(), true));
        assert_eq!(
            values(&options(&["decomposition=0.25,0.5"]), &settings),
            [("0.25".to_owned(), true), ("0.5".to_owned(), false)]
        );
        let more = entries(&options(&["decomposition:decompose.rays=64"]), &settings).unwrap();
        assert_eq!(
            (more.len(), more[5].line.as_str(), more[5].knob.as_str()),
            (6, "decomposition:decompose.rays", "decompose.rays")
        );
        assert_eq!(lookup(more[5].configuration.settings(), "decompose.rays"), Some(&64.into()));
        assert!(entries(&options(&["decomposition=many"]), &settings).is_err());
    }
}
