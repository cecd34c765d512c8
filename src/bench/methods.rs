//! The comparison of methods: what every configuration cost and how far it is from the truth;
//! times, places and errors at equal footing.
//!
//! Inputs     rows of sweeps ([`Row`]) and images of other renderers ([`ForeignPoint`]), measured
//!            by the caller.
//! Computes   for each of the two references (ground truth; a many-ray gather through the same
//!            proxy) a [`Verdict`]: the cost ratio of every line over the base line at equal error,
//!            the errors at equal cost, and the numbers of records or clusters at equal error, all
//!            read off [`super::curves`]. Error is relMSE without the 0.1 % worst pixels. The base
//!            line is the decomposition, else the first line.
//! Note       µs/place is thread time (wall-clock of the sampling, times threads): on a busy
//!            machine it counts the waiting too. The final image's error has a floor that no knob
//!            of indirect light lowers: the camera samples and direct light that all lines but path
//!            share (`record.spp`, `direct.*`), and for decomposition and caches the proxy's own
//!            error.
//! Note       alpha's sweep changes the cells, and so the proxy, with it; the gather's proxy is
//!            that of the scene's own alpha.
//! Not        in the verdict against the gather: path tracing and foreign renderers, which see the
//!            scene itself and not the proxy.

use std::fmt::{Display, Formatter};

use serde::Serialize;

use super::curves::{At, Curve, Extension, Ratio, levels, ratio};
use crate::compare::Comparison;

/// One configuration, measured.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Line it belongs to.
    pub line: String,
    /// Dotted key of the knob that the sweep turns.
    pub knob: String,
    /// Its value.
    pub value: String,
    /// True for the value that a render takes when nothing is said.
    pub default: bool,
    /// User and system seconds of the whole process, median of the rounds.
    pub cpu_seconds: f64,
    /// Wall-clock seconds of the whole process, median of the rounds.
    pub wall_seconds: f64,
    /// Runs measured.
    pub rounds: usize,
    /// Places where indirect light was sampled: clusters or records.
    pub places: Option<u64>,
    /// Rays of all kinds.
    pub rays: u64,
    /// CPU microseconds of sampling per place.
    pub microseconds_per_place: Option<f64>,
    /// Independent samples per pixel, for methods whose error falls as 1/n.
    pub samples: Option<u64>,
    /// Against the ground truth.
    pub truth: Option<Comparison>,
    /// Against the gather through the same proxy.
    pub gather: Option<Comparison>,
    /// The image.
    pub image: String,
}

/// An image of another renderer.
#[derive(Clone, Debug, Serialize)]
pub struct ForeignPoint {
    /// What to call it.
    pub name: String,
    /// CPU seconds, as given.
    pub cpu_seconds: f64,
    /// Against the ground truth.
    pub truth: Option<Comparison>,
    /// The image.
    pub image: String,
}

/// One line of a verdict: one figure per level.
#[derive(Clone, Debug, Serialize)]
pub struct VerdictRow {
    /// Line or foreign point.
    pub line: String,
    /// One figure per level.
    pub ratios: Vec<Ratio>,
}

/// What the curves say against one reference.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// The line that the others are compared with.
    pub base: String,
    /// Error of the base's default configuration; none when the sweep leaves it out.
    pub default_error: Option<f64>,
    /// Errors, falling.
    pub levels: Vec<f64>,
    /// CPU seconds of the base at these errors, over one second.
    pub base_seconds: Vec<Ratio>,
    /// CPU seconds of a line over the base's, at equal error.
    pub seconds_at_equal_error: Vec<VerdictRow>,
    /// CPU seconds of a foreign point over the base's, at the point's own error: one figure each.
    pub foreign: Vec<VerdictRow>,
    /// CPU seconds at which errors are compared: the base's own points.
    pub times: Vec<f64>,
    /// Error of a line over the base's, at these times.
    pub error_at_equal_seconds: Vec<VerdictRow>,
    /// Records or clusters of a line at the levels, over one.
    pub places: Vec<VerdictRow>,
    /// Records of production-2006 over those of hessian, at the levels.
    pub records_ratio: Option<VerdictRow>,
}

/// Everything that was measured.
#[derive(Clone, Debug, Serialize)]
pub struct MethodsReport {
    /// Scene as the user named it.
    pub scene: String,
    /// Columns of the images.
    pub width: u32,
    /// Rows of the images.
    pub height: u32,
    /// Triangles of the scene.
    pub triangles: usize,
    /// Worker threads.
    pub threads: usize,
    /// Ground truth.
    pub reference: Option<String>,
    /// Rays per point of the gather that stands for the proxy's own picture.
    pub gather_reference_rays: Option<u32>,
    /// All configurations.
    pub rows: Vec<Row>,
    /// Images of other renderers.
    pub points: Vec<ForeignPoint>,
    /// Against the ground truth.
    pub against_truth: Option<Verdict>,
    /// Against the gather.
    pub against_gather: Option<Verdict>,
}

/// Which reference an error is measured to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Against {
    /// Ground truth.
    Truth,
    /// The gather through the same proxy.
    Gather,
}

impl Row {
    /// The error on which curves are drawn.
    pub fn error(&self, against: Against) -> Option<f64> {
        let c = if against == Against::Truth { self.truth } else { self.gather };
        c.map(|c| c.errors.relmse_trimmed)
    }
}

/// Names of the lines, in order of appearance.
pub fn lines(rows: &[Row]) -> Vec<&str> {
    let mut found: Vec<&str> = Vec::new();
    for row in rows {
        if !found.contains(&row.line.as_str()) {
            found.push(&row.line);
        }
    }
    found
}

/// Error over CPU seconds of a line; with the 1/n law behind it where its samples are counted and
/// the ground truth is the reference.
pub fn time_curve(rows: &[Row], line: &str, against: Against) -> Curve {
    let own = || rows.iter().filter(move |r| r.line == line);
    let pairs = own().filter_map(|r| r.error(against).map(|e| (r.cpu_seconds, e)));
    let counted: Vec<[f64; 3]> =
        own().filter_map(|r| Some([r.samples? as f64, r.cpu_seconds, r.error(against)?])).collect();
    let extension = if against == Against::Truth { Extension::fit(&counted) } else { None };
    Curve::new(pairs).extended(extension)
}

/// Error over number of records or clusters of a line.
pub fn place_curve(rows: &[Row], line: &str, against: Against) -> Curve {
    Curve::new(
        rows.iter()
            .filter(|r| r.line == line)
            .filter_map(|r| Some((r.places? as f64, r.error(against)?))),
    )
}

/// What the rows say against one reference; none when no row has an error to it.
pub fn verdict(rows: &[Row], points: &[ForeignPoint], against: Against) -> Option<Verdict> {
    let sees_proxy = |line: &str| against == Against::Truth || !line.starts_with("path");
    let names: Vec<&str> = lines(rows).into_iter().filter(|l| sees_proxy(l)).collect();
    let curves: Vec<(&str, Curve)> = names
        .iter()
        .map(|l| (*l, time_curve(rows, l, against)))
        .filter(|(_, c)| !c.points().is_empty())
        .collect();
    let (base, curve) =
        curves.iter().find(|(l, _)| *l == "decomposition").or_else(|| curves.first())?;
    let default_error = rows
        .iter()
        .filter(|r| r.line == *base && r.default)
        .find_map(|r| r.error(against))
        .filter(|e| *e > 0.0);
    let levels = levels(curve);
    let others = || curves.iter().filter(|(l, _)| l != base);
    let times: Vec<f64> = curve.points().iter().map(|p| p.0).collect();
    let plain = |at: At| ratio(at, At::Known(1.0));
    let row = |line: &str, ratios| VerdictRow { line: line.to_owned(), ratios };
    let with_places: Vec<(&str, Curve)> = names
        .iter()
        .map(|l| (*l, place_curve(rows, l, against)))
        .filter(|(_, c)| !c.points().is_empty())
        .collect();
    let places_of = |line: &str| with_places.iter().find(|(l, _)| *l == line).map(|(_, c)| c);
    let records_ratio = places_of("production-2006").zip(places_of("hessian")).map(|(p, h)| {
        row(
            "production-2006 / hessian",
            levels.iter().map(|&e| ratio(p.cost_at(e), h.cost_at(e))).collect(),
        )
    });
    let foreign = points.iter().filter(|_| against == Against::Truth).filter_map(|p| {
        let error = p.truth?.errors.relmse_trimmed;
        Some(row(&p.name, vec![ratio(At::Known(p.cpu_seconds), curve.cost_at(error))]))
    });
    Some(Verdict {
        base: (*base).to_owned(),
        default_error,
        base_seconds: levels.iter().map(|&e| plain(curve.cost_at(e))).collect(),
        seconds_at_equal_error: others()
            .map(|(l, c)| {
                row(l, levels.iter().map(|&e| ratio(c.cost_at(e), curve.cost_at(e))).collect())
            })
            .collect(),
        foreign: foreign.collect(),
        error_at_equal_seconds: others()
            .map(|(l, c)| {
                row(l, times.iter().map(|&t| ratio(c.error_at(t), curve.error_at(t))).collect())
            })
            .collect(),
        places: with_places
            .iter()
            .map(|(l, c)| row(l, levels.iter().map(|&e| plain(c.cost_at(e))).collect()))
            .collect(),
        records_ratio,
        levels,
        times,
    })
}

impl Display for MethodsReport {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let reference = self.reference.as_deref().unwrap_or("none");
        writeln!(
            f,
            "{}, {}x{}, {} triangles, {} threads; ground truth: {reference}",
            self.scene, self.width, self.height, self.triangles, self.threads
        )?;
        if let Some(rays) = self.gather_reference_rays {
            writeln!(
                f,
                "to gather: relMSE without 0.1 % against {rays} rays per point through the proxy \
                 of the scene's own lengths"
            )?;
        }
        writeln!(
            f,
            "\n{:<18} {:<22} {:>9} {:>9} {:>9} {:>9} {:>9} {:>10} {:>11} {:>9} {:>8} {:>7} {:>11}",
            "method",
            "knob",
            "CPU s",
            "wall s",
            "places",
            "Mrays",
            "µs/place",
            "relMSE",
            "less 0.1 %",
            "± s.e.",
            "bias %",
            "FLIP",
            "to gather"
        )?;
        let or_dash = |v: Option<String>| v.unwrap_or_else(|| "-".into());
        let errors = |c: Option<Comparison>| match c {
            Some(c) => {
                let e = c.errors;
                let holes = if e.non_finite > 0 { " (pixels not finite!)" } else { "" };
                (
                    format!("{:.3e}", e.relmse),
                    format!("{:.3e}", e.relmse_trimmed),
                    format!("{:.0e}", e.relmse_trimmed_standard_error),
                    format!("{:+.3}", 100.0 * e.bias),
                    format!("{:.4}", c.flip),
                    holes,
                )
            }
            None => ("-".into(), "-".into(), "-".into(), "-".into(), "-".into(), ""),
        };
        for r in &self.rows {
            let (relmse, trimmed, spread, bias, flip, holes) = errors(r.truth);
            let key = r.knob.rsplit('.').next().unwrap_or_default();
            let knob = format!("{key} {}{}", r.value, if r.default { " *" } else { "" });
            let places = or_dash(r.places.map(|n| n.to_string()));
            let cost = or_dash(r.microseconds_per_place.map(|v| format!("{v:.1}")));
            let gather = or_dash(r.error(Against::Gather).map(|e| format!("{e:.3e}")));
            writeln!(
                f,
                "{:<18} {knob:<22} {:>9.2} {:>9.2} {places:>9} {:>9.2} {cost:>9} {relmse:>10} \
                 {trimmed:>11} {spread:>9} {bias:>8} {flip:>7} {gather:>11}{holes}",
                r.line,
                r.cpu_seconds,
                r.wall_seconds,
                r.rays as f64 * 1e-6
            )?;
        }
        for p in &self.points {
            let (relmse, trimmed, spread, bias, flip, holes) = errors(p.truth);
            writeln!(
                f,
                "{:<41} {:>9.2} {:>9} {:>9} {:>9} {:>9} {relmse:>10} {trimmed:>11} {spread:>9} \
                 {bias:>8} {flip:>7} {:>11}{holes}",
                p.name, p.cpu_seconds, "-", "-", "-", "-", "-"
            )?;
        }
        writeln!(f, "* what a render takes when nothing is said")?;
        for (verdict, name) in
            [(&self.against_truth, "ground truth"), (&self.against_gather, "gather")]
        {
            if let Some(v) = verdict {
                v.show(name, f)?;
            }
        }
        Ok(())
    }
}

impl Verdict {
    fn show(&self, reference: &str, f: &mut Formatter<'_>) -> std::fmt::Result {
        let base = &self.base;
        let head = |f: &mut Formatter<'_>, title: &str, numbers: &[String]| {
            writeln!(f, "\n{title}")?;
            if numbers.is_empty() {
                return Ok(());
            }
            write!(f, "{:<28}", "")?;
            numbers.iter().try_for_each(|n| write!(f, " {n:>13}"))?;
            writeln!(f)
        };
        let of = |v: &VerdictRow, f: &mut Formatter<'_>| {
            write!(f, "{:<28}", v.line)?;
            v.ratios.iter().try_for_each(|r| write!(f, " {r:>13}"))?;
            writeln!(f)
        };
        let mark =
            |e: &f64| format!("{e:.2e}{}", if Some(*e) == self.default_error { "*" } else { "" });
        let levels: Vec<String> = self.levels.iter().map(mark).collect();
        if !self.seconds_at_equal_error.is_empty() {
            head(
                f,
                &format!(
                    "CPU seconds over those of {base}, at equal error to the {reference} (≤, ≥: a \
                     cheapest point is better; e: extended by 1/samples)"
                ),
                &levels,
            )?;
            of(
                &VerdictRow { line: format!("{base}, CPU s"), ratios: self.base_seconds.clone() },
                f,
            )?;
            self.seconds_at_equal_error.iter().try_for_each(|v| of(v, f))?;
            let times: Vec<String> = self.times.iter().map(|t| format!("{t:.2} s")).collect();
            head(
                f,
                &format!("error to the {reference} over that of {base}, at equal CPU seconds"),
                &times,
            )?;
            self.error_at_equal_seconds.iter().try_for_each(|v| of(v, f))?;
        }
        if !self.foreign.is_empty() {
            head(f, &format!("CPU seconds over those of {base}, at the point's own error"), &[])?;
            self.foreign.iter().try_for_each(|v| of(v, f))?;
        }
        if !self.places.is_empty() {
            head(f, &format!("records or clusters at equal error to the {reference}"), &levels)?;
            self.places.iter().try_for_each(|v| of(v, f))?;
            self.records_ratio.iter().try_for_each(|v| of(v, f))?;
        }
        Ok(())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::compare::{Cleaned, Errors};

    fn comparison(error: f64) -> Comparison {
        let errors = Errors { relmse: error, relmse_trimmed: error, ..Errors::default() };
        Comparison {
            errors,
            flip: 0.05,
            flip_standard_error: 0.0,
            exposure: 0.0,
            halves: true,
            cleaned: Cleaned::Halves,
            truth_noise: None,
        }
    }

    pub(in crate::bench) fn row(
        line: &str,
        value: f64,
        seconds: f64,
        error: f64,
        places: Option<u64>,
    ) -> Row {
        Row {
            line: line.into(),
            knob: "decompose.alpha".into(),
            value: value.to_string(),
            default: value == 2.0,
            cpu_seconds: seconds,
            wall_seconds: seconds,
            rounds: 1,
            places,
            rays: 1_000_000,
            microseconds_per_place: Some(12.0),
            samples: (line == "path").then_some(value as u64),
            truth: Some(comparison(error)),
            gather: Some(comparison(error)),
            image: String::new(),
        }
    }

    /// decomposition: error 0.01 / t; path: error 1 / spp, a second each; caches: error 10 /
    /// records and 40 / records.
    pub(in crate::bench) fn example() -> Vec<Row> {
        let mut rows = Vec::new();
        rows.extend(
            [4.0, 2.0, 1.0]
                .map(|a| row("decomposition", a, 4.0 / a, 0.0025 * a, Some((100.0 / a) as u64))),
        );
        rows.extend([1.0, 4.0, 16.0].map(|n| row("path", n, n, 1.0 / n, None)));
        rows.extend(
            [1000u64, 4000]
                .map(|n| row("hessian", 0.3, n as f64 / 100.0, 10.0 / n as f64, Some(n))),
        );
        rows.extend(
            [4000u64, 16000]
                .map(|n| row("production-2006", 0.3, n as f64 / 100.0, 40.0 / n as f64, Some(n))),
        );
        rows
    }

    #[test]
    fn ratios_of_known_curves() {
        let v = verdict(
            &example(),
            &[ForeignPoint {
                name: "other".into(),
                cpu_seconds: 20.0,
                truth: Some(comparison(0.005)),
                image: String::new(),
            }],
            Against::Truth,
        )
        .unwrap();
        assert_eq!((v.base.as_str(), v.default_error), ("decomposition", Some(0.005)));
        assert_eq!(v.levels, [0.08, 0.04, 0.02, 0.01, 0.005, 0.0025]);
        let find = |rows: &[VerdictRow], line: &str| {
            rows.iter().find(|r| r.line == line).unwrap().ratios.clone()
        };
        let at_default = |line: &str| find(&v.seconds_at_equal_error, line)[4];
        // Path: 200 spp for an error of 1/200, so 200 s over 2 s, by extension; the caches: 20 s
        // and 80 s over 2 s.
        for (line, expected, extended) in
            [("path", 100.0, true), ("hessian", 10.0, false), ("production-2006", 40.0, false)]
        {
            let r = at_default(line);
            assert!(
                (r.value.unwrap() / expected - 1.0).abs() < 1e-9 && r.extended == extended,
                "{line}: {r:?}"
            );
        }
        assert!((v.foreign[0].ratios[0].value.unwrap() - 10.0).abs() < 1e-9);
        assert!((v.records_ratio.as_ref().unwrap().ratios[4].value.unwrap() - 4.0).abs() < 1e-9);
        assert!((find(&v.places, "hessian")[4].value.unwrap() - 2000.0).abs() < 1e-6);
        // At the default's two seconds path has 2 spp: error 1/2 over 0.005.
        assert!((find(&v.error_at_equal_seconds, "path")[1].value.unwrap() - 100.0).abs() < 1e-9);
    }

    #[test]
    fn path_tracing_is_not_judged_by_the_proxy() {
        let v = verdict(&example(), &[], Against::Gather).unwrap();
        assert!(
            v.seconds_at_equal_error.iter().all(|r| r.line != "path")
                && v.seconds_at_equal_error.len() == 2
        );
        let mut rows = example();
        rows.iter_mut().for_each(|r| r.gather = None);
        assert!(verdict(&rows, &[], Against::Gather).is_none());
    }

    #[test]
    fn the_table_names_everything() {
        let rows = example();
        let report = MethodsReport {
            scene: "a.toml".into(),
            width: 3,
            height: 2,
            triangles: 1,
            threads: 2,
            reference: Some("t.exr".into()),
            gather_reference_rays: Some(4096),
            against_truth: verdict(&rows, &[], Against::Truth),
            against_gather: verdict(&rows, &[], Against::Gather),
            rows,
            points: Vec::new(),
        };
        let text = report.to_string();
        for word in [
            "alpha 2 *",
            "production-2006 / hessian",
            "5.00e-3*",
            "100 e",
            "equal CPU seconds",
            "4096 rays",
        ] {
            assert!(text.contains(word), "{word} not in\n{text}");
        }
    }
}
