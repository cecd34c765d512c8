//! The chart of a comparison of methods: error over CPU seconds, both logarithmic, one line a
//! method, as SVG.
//!
//! Points carry the value of their knob; a ring marks the default. The dashed line is the 1/samples
//! law beyond the last measured point. Images of other renderers are triangles with their names. An
//! error that is not above 0 (a picture as good as its reference) cannot be drawn. Text is left to
//! the viewer's sans-serif font.

use plotters::element::DashedPathElement;
use plotters::prelude::*;

use super::methods::{Against, MethodsReport, lines, time_curve};
use crate::error::{Error, Result};

/// Colours of the lines, in order; told apart by readers who do not see all colours (Okabe and
/// Ito).
const COLOURS: [RGBColor; 8] = [
    RGBColor(213, 94, 0),
    RGBColor(0, 114, 178),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
    RGBColor(150, 75, 0),
];
const SIZE: (u32, u32) = (1000, 680);

type Plane<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<LogCoord<f64>, LogCoord<f64>>>;

/// Boxes of pixels (left, top, right, bottom) that labels must not cover.
#[derive(Debug, Default)]
struct Taken(Vec<[i32; 4]>);

impl Taken {
    /// Where the text of a label at `at` (pixels) should begin, relative to `at`: the first free
    /// place around it, else the first of all.
    fn place(&mut self, at: (i32, i32), text: &str) -> (i32, i32) {
        let width = text.chars().count() as i32 * 7 + 2;
        let sides = [9, -9 - width];
        let places = [-16, 4, -28, 16, -6].into_iter().flat_map(|dy| sides.map(|dx| (dx, dy)));
        let covers =
            |(dx, dy): (i32, i32)| [at.0 + dx, at.1 + dy, at.0 + dx + width, at.1 + dy + 12];
        let free = |b: [i32; 4]| {
            !self.0.iter().any(|o| b[0] < o[2] && o[0] < b[2] && b[1] < o[3] && o[1] < b[3])
        };
        let chosen = places.clone().find(|p| free(covers(*p))).unwrap_or((sides[0], -16));
        self.0.push(covers(chosen));
        chosen
    }
}

#[derive(Debug)]
struct Line {
    name: String,
    colour: RGBColor,
    points: Vec<(f64, f64, String, bool)>,
    beyond: Vec<(f64, f64)>,
}

/// The chart as SVG text, of the errors to the ground truth, or to the gather where there is none.
///
/// # Errors
/// [`Error::Render`] when no point can stand on logarithmic axes.
pub fn chart(report: &MethodsReport) -> Result<String> {
    let against = if report.reference.is_some() { Against::Truth } else { Against::Gather };
    let drawable = |p: &(f64, f64)| p.0 > 0.0 && p.1 > 0.0 && p.0.is_finite() && p.1.is_finite();
    let foreign: Vec<((f64, f64), &str)> = report
        .points
        .iter()
        .filter_map(|p| Some(((p.cpu_seconds, p.truth?.errors.relmse_trimmed), p.name.as_str())))
        .filter(|(p, _)| against == Against::Truth && drawable(p))
        .collect();
    let mut drawn: Vec<Line> = Vec::new();
    for (i, name) in lines(&report.rows).into_iter().enumerate() {
        let rows = report.rows.iter().filter(|r| r.line == name);
        let mut points: Vec<_> = rows
            .filter_map(|r| Some((r.cpu_seconds, r.error(against)?, r.value.clone(), r.default)))
            .collect();
        points.retain(|p| drawable(&(p.0, p.1)));
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        if !points.is_empty() {
            drawn.push(Line {
                name: name.to_owned(),
                colour: COLOURS[i % COLOURS.len()],
                points,
                beyond: Vec::new(),
            });
        }
    }
    let measured: Vec<(f64, f64)> = drawn
        .iter()
        .flat_map(|l| l.points.iter().map(|p| (p.0, p.1)))
        .chain(foreign.iter().map(|f| f.0))
        .collect();
    if measured.is_empty() {
        return Err(Error::Render("nothing to draw: no configuration has an error above 0".into()));
    }
    let least = measured.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
    for line in &mut drawn {
        let curve = time_curve(&report.rows, &line.name, against);
        if let Some(x) = curve.extension().filter(|x| x.last[2] > least) {
            line.beyond = vec![(x.last[1], x.last[2])];
            line.beyond.extend(
                (1..=24)
                    .map(|k| x.last[2] * (least / x.last[2]).powf(f64::from(k) / 24.0))
                    .map(|e| (x.cost(e), e)),
            );
        }
    }
    let mut svg = String::new();
    draw(report, against, &drawn, &foreign, &mut svg)
        .map_err(|e| Error::Render(format!("chart: {e}")))?;
    Ok(svg)
}

fn draw(
    report: &MethodsReport,
    against: Against,
    drawn: &[Line],
    foreign: &[((f64, f64), &str)],
    svg: &mut String,
) -> std::result::Result<(), Box<dyn std::error::Error>> {
    let all = || {
        drawn
            .iter()
            .flat_map(|l| l.points.iter().map(|p| (p.0, p.1)).chain(l.beyond.iter().copied()))
            .chain(foreign.iter().map(|f| f.0))
    };
    let span = |pick: fn((f64, f64)) -> f64| {
        let (low, high) =
            all().map(pick).fold((f64::INFINITY, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
        // Room for labels; at least a factor of 4, so that a single point stands in the middle.
        let margin = (high / low).powf(0.08).max(1.5);
        (low / margin)..(high * margin)
    };
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let error =
        if against == Against::Truth { "ground truth" } else { "gather through the same proxy" };
    let mut plane = ChartBuilder::on(&root)
        .caption(
            format!(
                "{}, {}x{}, {} threads",
                report.scene, report.width, report.height, report.threads
            ),
            ("sans-serif", 20),
        )
        .margin(14)
        .x_label_area_size(48)
        .y_label_area_size(84)
        .build_cartesian_2d(span(|p| p.0).log_scale(), span(|p| p.1).log_scale())?;
    plane
        .configure_mesh()
        .x_desc("CPU seconds of the whole process")
        .y_desc(format!("relMSE without the 0.1 % worst pixels, to the {error}"))
        .axis_desc_style(("sans-serif", 15))
        .label_style(("sans-serif", 13))
        .light_line_style(RGBColor(238, 238, 238))
        .bold_line_style(RGBColor(205, 205, 205))
        .x_label_formatter(&|v| tick(*v))
        .y_label_formatter(&|v| tick(*v))
        .draw()?;
    let mut taken = Taken::default();
    for at in drawn
        .iter()
        .flat_map(|l| l.points.iter().map(|p| (p.0, p.1)))
        .chain(foreign.iter().map(|f| f.0))
    {
        let (x, y) = plane.backend_coord(&at);
        taken.0.push([x - 5, y - 5, x + 5, y + 5]);
    }
    for line in drawn {
        draw_line(&mut plane, line, &mut taken)?;
    }
    let grey = RGBColor(40, 40, 40);
    for (at, name) in foreign {
        let place = taken.place(plane.backend_coord(at), name);
        plane.draw_series(std::iter::once(
            EmptyElement::at(*at)
                + TriangleMarker::new((0, 0), 6, grey.filled())
                + label(name, place, grey),
        ))?;
    }
    plane
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.9))
        .border_style(RGBColor(160, 160, 160))
        .label_font(("sans-serif", 15))
        .draw()?;
    root.present()?;
    Ok(())
}

fn draw_line(
    plane: &mut Plane<'_, '_>,
    line: &Line,
    taken: &mut Taken,
) -> std::result::Result<(), Box<dyn std::error::Error>> {
    let colour = line.colour;
    plane
        .draw_series(LineSeries::new(
            line.points.iter().map(|p| (p.0, p.1)),
            colour.stroke_width(2),
        ))?
        .label(line.name.clone())
        .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 22, y)], colour.stroke_width(3)));
    if !line.beyond.is_empty() {
        plane
            .draw_series(DashedLineSeries::new(
                line.beyond.iter().copied(),
                7,
                5,
                colour.stroke_width(2),
            ))?
            .label(format!("{}, extended by 1/samples", line.name))
            .legend(move |(x, y)| {
                DashedPathElement::new([(x, y), (x + 22, y)], 5, 4, colour.stroke_width(2))
            });
    }
    for (x, y, value, default) in &line.points {
        let (ring, place) =
            (if *default { 8 } else { 0 }, taken.place(plane.backend_coord(&(*x, *y)), value));
        let marks = EmptyElement::at((*x, *y))
            + Circle::new((0, 0), 4, colour.filled())
            + Circle::new((0, 0), ring, colour.stroke_width(2));
        plane.draw_series(std::iter::once(marks + label(value, place, colour)))?;
    }
    Ok(())
}

fn label(text: &str, place: (i32, i32), colour: RGBColor) -> Text<'static, (i32, i32), String> {
    Text::new(text.to_owned(), place, ("sans-serif", 13).into_font().color(&colour))
}

/// 0.01, 1, 300; 1e-4 and 1e5 beyond.
fn tick(v: f64) -> String {
    if (0.0099..99_999.0).contains(&v) {
        format!("{}", (v * 1000.0).round() / 1000.0)
    } else {
        format!("{v:.0e}")
    }
}

#[cfg(test)]
mod tests {
    use super::super::methods::tests::example;
    use super::super::methods::{Against, ForeignPoint, verdict};
    use super::*;

    fn report() -> MethodsReport {
        let rows = example();
        let points = vec![ForeignPoint {
            name: "mitsuba 16 + OIDN".into(),
            cpu_seconds: 20.0,
            truth: rows[0].truth,
            image: String::new(),
        }];
        MethodsReport {
            scene: "box <small>".into(),
            width: 3,
            height: 2,
            triangles: 1,
            threads: 2,
            reference: Some("t.exr".into()),
            gather_reference_rays: None,
            against_truth: verdict(&rows, &points, Against::Truth),
            against_gather: None,
            rows,
            points,
        }
    }

    #[test]
    fn every_line_and_point_is_drawn() {
        let svg = chart(&report()).unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
        for word in [
            "decomposition",
            "hessian",
            "production-2006",
            "path, extended by 1/samples",
            "mitsuba 16 + OIDN",
            "CPU seconds",
            "box &lt;small&gt;",
        ] {
            assert!(svg.contains(word), "{word}");
        }
        // One disc a point, beside the rings of the defaults.
        let discs = svg.matches("r=\"4\"").count();
        assert_eq!(discs, 10, "{svg}");
    }

    #[test]
    fn an_empty_chart_is_an_error() {
        let mut report = report();
        report.points.clear();
        report.rows.iter_mut().for_each(|r| r.truth = None);
        assert!(chart(&report).is_err());
    }

    #[test]
    fn labels_keep_off_each_other() {
        let mut taken = Taken::default();
        let places: Vec<_> = (0..6).map(|i| taken.place((100 + i, 100), "0.05")).collect();
        assert_eq!(places[0], (9, -16));
        for (i, a) in taken.0.iter().enumerate() {
            for b in &taken.0[..i] {
                assert!(
                    a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1],
                    "{a:?} {b:?}"
                );
            }
        }
    }

    #[test]
    fn ticks_are_short() {
        assert_eq!(
            [0.01, 0.1, 1.0, 30.0, 1e-4, 1e6].map(tick),
            ["0.01", "0.1", "1", "30", "1e-4", "1e6"]
        );
    }
}
