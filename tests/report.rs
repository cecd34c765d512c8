//! `nearfar report`: the page of a folder, looked at by a browser.

use std::path::Path;

use nearfar::film::{Film, Precision, write_exr};
use nearfar::page::report::page;
use nearfar::radiometry::Rgb;
use nearfar::run::Run;

use crate::support::Folder;
use crate::support::browser::Page;

const WIDTH: u32 = 32;
const HEIGHT: u32 = 20;

/// A ramp with a value of its own in every pixel, `gain` times.
fn ramp(gain: f32, width: u32) -> Film {
    let mut film = Film::new(width, HEIGHT);
    let pixels: Vec<Rgb> = (0..width * HEIGHT)
        .map(|i| {
            Rgb::new(0.1 + 0.01 * (i % width) as f32, 0.2 + 0.02 * (i / width) as f32, 0.35) * gain
        })
        .collect();
    film.set_rgb("", &pixels);
    film.set("location", (0..width * HEIGHT).map(|i| f32::from(i % 37 == 0)).collect());
    film
}

fn put(dir: &Path, name: &str, film: &Film, method: &str, cpu_seconds: f64) {
    std::fs::create_dir_all(dir).unwrap();
    write_exr(film, &dir.join(format!("{name}.exr")), Precision::Full).unwrap();
    let statistics = serde_json::json!({
        "method": method,
        "cpu_seconds": cpu_seconds,
        "seconds": { "total": cpu_seconds / 2.0 },
    });
    std::fs::write(dir.join(format!("{name}.json")), statistics.to_string()).unwrap();
}

/// A section `room` with a truth of two halves that differ by 2 % of it, a picture 10 % too bright,
/// and a black one.
fn room(name: &str) -> Folder {
    let dir = Folder::new(&format!("report-{name}"));
    let mut truth = ramp(1.0, WIDTH);
    for (half, gain) in [("half0", 1.01), ("half1", 0.99)] {
        truth.set_rgb(half, &ramp(gain, WIDTH).rgb("").unwrap());
    }
    put(&dir.join("room"), "truth", &truth, "path", 100.0);
    put(&dir.join("room"), "bright", &ramp(1.1, WIDTH), "decomposition", 2.0);
    put(&dir.join("room"), "cache", &ramp(0.0, WIDTH), "irradiance-cache", 5.0);
    dir
}

fn html(dir: &Path) -> Result<(String, Vec<String>), nearfar::error::Error> {
    let run = Run::new(2)?;
    let html = run.install(|| page(dir, &run))?;
    Ok((html, run.warnings()))
}

fn data(html: &str) -> serde_json::Value {
    let start = html.find("id=\"data\">").unwrap() + 10;
    let end = start + html[start..].find("</script>").unwrap();
    serde_json::from_str(&html[start..end]).unwrap()
}

#[test]
fn figures_are_those_of_compare() {
    let dir = room("figures");
    let (html, warnings) = html(&dir).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    let data = data(&html);
    let section = &data["sections"][0];
    assert_eq!(
        (section["title"].as_str(), section["reference"].as_str()),
        (Some("room"), Some("truth"))
    );
    assert_eq!(section["pair"], serde_json::json!(["bright", "truth"]));
    let bright =
        section["shown"].as_array().unwrap().iter().find(|s| s["name"] == "bright").unwrap();
    assert!((bright["error"]["bias"].as_f64().unwrap() - 0.1).abs() < 1e-6);
    // (x − half0)(x − half1) = (0.1² − 0.01²) r².
    let relmse = bright["error"]["relmse"].as_f64().unwrap();
    assert!((0.0080..0.0099).contains(&relmse), "{relmse}");
    assert!((section["ratio"]["cache_over_ours"].as_f64().unwrap() - 2.5).abs() < 1e-9);
    // The mean of the halves is off by (half0 − half1) / 2 = 1 %: its noise is 0.01² / (0.1² −
    // 0.01²) of our error; 100 s against 2 s.
    let monte_carlo = section["ratio"]["monte_carlo_over_ours"].as_f64().unwrap();
    assert!((monte_carlo - 50.0 * 1e-4 / (0.01 - 1e-4)).abs() < 2e-3, "{monte_carlo}");
}

#[test]
fn what_is_wrong_is_named() {
    let dir = Folder::new("report-wrong");
    let message = html(&dir).unwrap_err().to_string();
    assert!(message.contains("no EXR pictures"), "{message}");
    let dir = room("wrong-names");
    let say = |text: &str| {
        std::fs::write(dir.join("report.toml"), text).unwrap();
        html(&dir).unwrap_err().to_string()
    };
    let message =
        say("title = \"x\"\n[[section]]\nfolder = \"room\"\npair = [\"bright\", \"dark\"]");
    assert!(
        message.contains("pair: there is no picture \"dark\"; there are: bright, cache, truth"),
        "{message}"
    );
    let message = say("title = \"x\"\ntitel = \"y\"");
    assert!(message.contains("report.toml:2") && message.contains("titel"), "{message}");
    let message = say(
        "[[section]]\nfolder = \"room\"\nsweep = { label = \"a\", values = [1], pictures = [] }",
    );
    assert!(message.contains("1 values and 0 pictures"), "{message}");
    std::fs::remove_file(dir.join("report.toml")).unwrap();
    put(&dir.join("room"), "wide", &ramp(1.0, 40), "path", 1.0);
    let (_, warnings) = html(&dir).unwrap();
    assert!(
        warnings.len() == 1 && warnings[0].contains("wide.exr: left out: 40×20 pixels"),
        "{warnings:?}"
    );
    std::fs::write(dir.join("room/bright.json"), "{\n oops").unwrap();
    let message = html(&dir).unwrap_err().to_string();
    assert!(message.contains("bright.json:2"), "{message}");
}

#[test]
fn text_of_the_user_cannot_end_the_page() {
    let dir = room("hostile");
    std::fs::write(dir.join("report.toml"), "title = \"</script><b>\"\ntext = \"</script>\"")
        .unwrap();
    let (html, _) = html(&dir).unwrap();
    assert_eq!(data(&html)["text"], "</script>");
    assert!(html.contains("<title>&lt;/script&gt;&lt;b&gt;</title>"));
}

fn open(dir: &Path, width: u32, height: u32) -> Option<Page> {
    std::fs::write(dir.join("index.html"), html(dir).unwrap().0).unwrap();
    let mut page = Page::open(&dir.join("index.html"), width, height)?;
    page.wait_for("document.querySelector('section').dataset.ready === 'true'");
    page.settle();
    Some(page)
}

/// The viewer's place on the screen: left, top, width, height.
fn stage(page: &mut Page) -> [f64; 4] {
    let found = page.evaluate(
        "(() => { \
        const r = document.querySelector('.stage canvas').getBoundingClientRect(); \
        return [r.left, r.top, r.width, r.height]; })()",
    );
    std::array::from_fn(|i| found[i].as_f64().unwrap())
}

#[test]
fn divider_zoom_and_values_in_a_browser() {
    let dir = room("browser");
    let (section, toggle) = (
        "[[section]]\nfolder = \"room\"\n",
        "[[section.toggle]]\nlabel = \"light\"\noff = \"cache\"\non = \"bright\"\n",
    );
    std::fs::write(dir.join("report.toml"), format!("title = \"Rooms\"\n{section}{toggle}"))
        .unwrap();
    let Some(mut page) = open(&dir, 1400, 1000) else { return };
    page.assert_quiet();
    let [left, top, width, height] = stage(&mut page);
    let pixel = |x: u32, y: u32| {
        [
            left + (f64::from(x) + 0.5) * width / f64::from(WIDTH),
            top + (f64::from(y) + 0.5) * height / f64::from(HEIGHT),
        ]
    };

    // Values under the pointer: of the files, to the page's 9 bits.
    page.mouse_move(pixel(5, 3), "none");
    page.settle();
    let values =
        page.evaluate("document.querySelector('.values').textContent").as_str().unwrap().to_owned();
    assert!(values.starts_with("pixel 5, 3"), "{values}");
    let row = values.lines().last().unwrap();
    let numbers = |name: &str| -> Vec<f64> {
        let rest = &row[row.find(&format!("{name}: ")).unwrap() + name.len() + 2..];
        rest.split_whitespace().take(3).map(|v| v.parse().unwrap()).collect()
    };
    for (name, gain) in [("bright", 1.1), ("truth", 1.0)] {
        for (got, want) in numbers(name).into_iter().zip([0.15 * gain, 0.26 * gain, 0.35 * gain]) {
            assert!(
                (got / want - 1.0).abs() < 0.0076,
                "{name}: {got} is not {want} (9 bits and 3 digits: 0.25 % + 0.5 %)"
            );
        }
    }

    // The divider: what was left of it shows the other picture afterwards.
    let shade = |page: &mut Page, at: [f64; 2]| {
        page.screenshot("report").get_pixel(at[0] as u32, at[1] as u32).0
    };
    let probe = pixel(12, 10);
    let before = shade(&mut page, probe);
    let middle = [left + 0.5 * width, top + 0.25 * height];
    page.drag(middle, [left + 0.1 * width, middle[1]], "left");
    page.settle();
    let after = shade(&mut page, probe);
    assert!(before[0] > after[0] + 3, "10 % brighter on the left: {before:?}, {after:?}");
    for _ in 0..40 {
        page.key("ArrowRight");
    }
    page.settle();
    assert_eq!(shade(&mut page, probe), before, "the keyboard brings the divider back over it");

    // The wheel zooms about the pointer: the same pixel stays under it, and the maps below zoom
    // along.
    page.wheel(probe, -240.0);
    page.settle();
    page.mouse_move([probe[0] + 1.0, probe[1]], "none");
    page.settle();
    assert_eq!(page.evaluate("VIEWS[0].zoom"), 2.0);
    assert!(
        page.evaluate("document.querySelector('.values').textContent")
            .as_str()
            .unwrap()
            .starts_with("pixel 12, 10")
    );

    page.evaluate("document.querySelector('[data-picture=cache]').click()");
    page.wait_for("VIEWS[0].pair[0] === 'cache' && VIEWS[0].pictures.get('cache').bits");
    page.settle();
    assert_eq!(shade(&mut page, probe)[..3], [0, 0, 0]);
    assert_eq!(
        page.evaluate(
            "document.querySelector('[data-picture=cache]').getAttribute('aria-pressed')"
        ),
        "true"
    );
    page.evaluate("document.querySelector('.dots').click()");
    page.settle();
    let dotted = page.screenshot("report-dots");
    assert!(dotted.pixels().filter(|p| p.0 == [255, 220, 40]).count() > 100, "sample locations");
    page.assert_quiet();
    drop(page);

    let Some(mut narrow) = open(&dir, 400, 900) else { return };
    assert_eq!(
        narrow.evaluate("document.documentElement.scrollWidth <= 400"),
        true,
        "nothing sticks out at 400 px"
    );
    narrow.screenshot("report-narrow");
    narrow.assert_quiet();
}
