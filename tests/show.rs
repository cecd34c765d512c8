//! `nearfar cloud show`, looked at by a browser.

use std::path::{Path, PathBuf};

use glam::Vec3;
use nearfar::cloud::{Cloud, write_cloud};
use nearfar::page::viewer::{Table, write_page};
use nearfar::radiometry::Rgb;
use nearfar::run::Run;

use crate::support::Folder;
use crate::support::browser::Page;

fn show(ply: &Path) -> PathBuf {
    let html = ply.with_extension("html");
    let table = Table::read(ply).unwrap();
    Run::new(2).unwrap().install(|| write_page(&table, "a & b <cloud>", &html)).unwrap();
    html
}

/// Discs that face +z, in a grid around the origin; side length of the grid `n`.
fn grid(n: usize, light: impl Fn(usize) -> Rgb) -> Cloud {
    let place = |i: usize| {
        Vec3::new((i % n) as f32 - 0.5 * (n - 1) as f32, (i / n) as f32 - 0.5 * (n - 1) as f32, 0.0)
    };
    let count = n * n;
    let mut cloud = Cloud {
        p: (0..count).map(place).collect(),
        n: vec![Vec3::Z; count],
        area: vec![0.5; count],
        one_sided: vec![false; count],
        channels: vec![],
    };
    cloud.set(Cloud::RADIOSITY, (0..count).map(&light).collect());
    cloud.set("albedo", vec![Rgb::new(0.1, 1.0 / 3.0, 0.7); count]);
    cloud
}

/// Nine discs with colours of their own. The mean of all channels is 0.2, so the page's brightness
/// is 1.
const COLOURS: [[f32; 3]; 9] = [
    [0.6, 0.0, 0.0],
    [0.0, 0.6, 0.0],
    [0.0, 0.0, 0.6],
    [0.3, 0.3, 0.0],
    [0.0, 0.3, 0.3],
    [0.3, 0.0, 0.3],
    [0.2, 0.2, 0.2],
    [0.6, 0.0, 0.0],
    [0.1, 0.5, 0.0],
];

fn nine(name: &str) -> (Folder, PathBuf) {
    let folder = Folder::new(&format!("show-{name}"));
    let ply = folder.join("nine.ply");
    write_cloud(&ply, &grid(3, |i| Rgb::from_array(COLOURS[i])), &["</script> & comment".into()])
        .unwrap();
    (folder, show(&ply))
}

fn open(html: &Path, width: u32, height: u32) -> Option<Page> {
    let mut page = Page::open(html, width, height)?;
    page.wait_for(
        "document.getElementById('message').hidden || \
         document.getElementById('message').textContent !== 'Loading…'",
    );
    assert_eq!(
        page.evaluate("document.getElementById('message').textContent"),
        "Loading…",
        "{:?}",
        page.errors()
    );
    page.settle();
    Some(page)
}

fn places(page: &mut Page, count: usize) -> Vec<[f64; 2]> {
    let value =
        page.evaluate(&format!("Array.from({{ length: {count} }}, (_, k) => viewer.project(k))"));
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|p| [p[0].as_f64().unwrap(), p[1].as_f64().unwrap()])
        .collect()
}

fn choose(page: &mut Page, channel: &str) {
    page.evaluate(&format!(
        "(() => {{ const s = document.getElementById('channel'); s.value = [...s.options].find(o \
         => o.text === '{channel}').value; s.dispatchEvent(new Event('change')); }})()"
    ));
}

fn slide(page: &mut Page, id: &str, value: i32) {
    page.evaluate(&format!(
        "(() => {{ const s = document.getElementById('{id}'); s.value = {value}; \
         s.dispatchEvent(new Event('input')); }})()"
    ));
}

/// Values of the picked element, by name.
fn picked(page: &mut Page) -> serde_json::Value {
    page.evaluate(
        "Object.fromEntries([...document.querySelectorAll('#picked tr')].map(r => \
         [r.cells[0].textContent, r.cells[1].textContent]))",
    )
}

#[test]
fn discs_have_their_places_colours_and_values() {
    let (_folder, html) = nine("nine");
    let Some(mut page) = open(&html, 1400, 900) else { return };
    page.assert_quiet();
    assert_eq!(page.evaluate("document.querySelector('h1').textContent"), "a & b <cloud>");
    assert_eq!(
        page.evaluate("document.getElementById('comments').textContent"),
        "</script> & comment"
    );
    let (shot, at) = (page.screenshot("nine"), places(&mut page, 9));
    let order: Vec<usize> = page
        .evaluate("[...viewer.data.order]")
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_u64().unwrap() as usize)
        .collect();
    for (k, p) in at.iter().enumerate() {
        let sum: f32 = COLOURS.iter().flatten().sum();
        let scale = 0.2 * 27.0 / sum;
        // 8 bits by a table of 4096 entries and the browser's own rounding: within 2.
        let expected = COLOURS[order[k]].map(|v| {
            let v = (v * scale).min(1.0);
            255.0 * if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
        });
        let seen = shot.get_pixel(p[0] as u32, p[1] as u32).0;
        assert!(
            seen.iter().zip(expected).all(|(&s, e)| (f32::from(s) - e).abs() <= 2.0),
            "disc {}: {seen:?}, not {expected:?}",
            order[k]
        );
    }
    let k = order.iter().position(|&i| i == 8).unwrap();
    page.click(at[k]);
    assert_eq!(page.evaluate("document.getElementById('picked-title').textContent"), "Element 8");
    let values = picked(&mut page);
    for (name, value) in [
        ("x", "1"),
        ("y", "1"),
        ("z", "0"),
        ("nz", "1"),
        ("_area", "0.5"),
        ("_one_sided", "0"),
        ("_radiosity_g", "0.5"),
        ("albedo_g", "0.33333334"),
    ] {
        assert_eq!(values[name], value, "{name} in {values}");
    }
    page.click([3.0, 3.0]);
    assert_eq!(picked(&mut page), serde_json::json!({}));
    page.assert_quiet();
}

#[test]
fn controls_change_the_picture() {
    let (_folder, html) = nine("controls");
    let Some(mut page) = open(&html, 800, 600) else { return };
    // The drawing alone: texts beside it change with every control.
    let mut last = None;
    let mut changed = |page: &mut Page, what: &str| {
        let drawing = image::imageops::crop_imm(&page.screenshot(what), 0, 0, 480, 560).to_image();
        assert!(last.as_ref() != Some(&drawing), "{what} changes nothing");
        last = Some(drawing);
    };
    changed(&mut page, "elements");
    choose(&mut page, "albedo");
    changed(&mut page, "albedo");
    choose(&mut page, "y");
    changed(&mut page, "scalar");
    slide(&mut page, "level", 0);
    changed(&mut page, "root");
    let root = places(&mut page, 1)[0];
    choose(&mut page, "_radiosity");
    changed(&mut page, "root, radiosity");
    page.click(root);
    let values = picked(&mut page);
    let mean = f64::from(COLOURS.iter().map(|c| c[1]).sum::<f32>()) / 9.0;
    let told: f64 = values["mean _radiosity g"].as_str().unwrap().parse().unwrap();
    // Means are floats.
    assert!(
        (values["elements"] == "9", values["area"] == "4.5") == (true, true)
            && (told / mean - 1.0).abs() < 1e-6,
        "{values}"
    );
    changed(&mut page, "picked");
    page.evaluate("document.getElementById('point').click()");
    changed(&mut page, "points");
    page.evaluate("document.getElementById('disc').click()");
    slide(&mut page, "size", -1);
    changed(&mut page, "size");
    slide(&mut page, "level", 1000);
    changed(&mut page, "elements again");
    page.drag([200.0, 200.0], [260.0, 220.0], "left");
    changed(&mut page, "orbit");
    page.drag([200.0, 200.0], [260.0, 220.0], "right");
    changed(&mut page, "pan");
    page.wheel([200.0, 200.0], -200.0);
    page.settle();
    changed(&mut page, "zoom");
    page.evaluate("document.getElementById('view').focus()");
    for key in ["ArrowLeft", "+", "0"] {
        page.key(key);
        changed(&mut page, key);
    }
    page.touch("touchStart", &[[200.0, 200.0], [240.0, 200.0]]);
    page.touch("touchMove", &[[180.0, 200.0], [260.0, 200.0]]);
    page.touch("touchEnd", &[]);
    changed(&mut page, "pinch");
    page.assert_quiet();
}

#[test]
fn a_phone_shows_it_too() {
    let (_folder, html) = nine("phone");
    let Some(mut page) = open(&html, 400, 800) else { return };
    page.screenshot("phone");
    assert_eq!(page.evaluate("document.documentElement.scrollWidth"), 400);
    let at = places(&mut page, 9);
    assert!(
        at.iter().all(|p| (0.0..400.0).contains(&p[0]) && (0.0..440.0).contains(&p[1])),
        "{at:?}"
    );
    page.touch("touchStart", &[at[4]]);
    page.touch("touchEnd", &[]);
    page.wait_for("document.getElementById('picked-title').textContent.startsWith('Element')");
    page.assert_quiet();
}

#[test]
fn points_without_normals_and_other_types_are_shown() {
    let folder = Folder::new("show-types");
    let ply = folder.join("types.ply");
    let mut bytes = b"ply\nformat binary_little_endian 1.0\ncomment types\nelement vertex \
                      2\nproperty double x\nproperty float y\nproperty float z\nproperty uint \
                      id\nproperty short s\nproperty float bad\nelement face 0\nproperty list \
                      uchar int v\nend_header\n"
        .to_vec();
    for (x, id) in [(0.1f64, u32::MAX), (2.0, 16_777_217)] {
        bytes.extend(x.to_le_bytes());
        bytes.extend([1.0f32, 0.1].iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend(id.to_le_bytes());
        bytes.extend((-7i16).to_le_bytes());
        bytes.extend(f32::NAN.to_le_bytes());
    }
    std::fs::write(&ply, bytes).unwrap();
    let html = show(&ply);
    let Some(mut page) = open(&html, 800, 600) else { return };
    assert_eq!(page.evaluate("document.getElementById('disc').disabled"), true);
    let at = places(&mut page, 2);
    let second = page.evaluate("[...viewer.data.order].indexOf(1)").as_u64().unwrap() as usize;
    page.click(at[second]);
    assert_eq!(
        picked(&mut page),
        serde_json::json!({
            "x": "2", "y": "1", "z": "0.1", "id": "16777217", "s": "-7", "bad": "NaN"
        })
    );
    choose(&mut page, "bad");
    page.assert_quiet();
}

#[test]
#[ignore = "slow: a million discs by software WebGL, half a minute on an idle machine"]
fn a_million_discs() {
    let folder = Folder::new("show-million");
    let ply = folder.join("million.ply");
    write_cloud(
        &ply,
        &grid(1000, |i| Rgb::new((i % 1000) as f32 / 1000.0, (i as f32 * 0.37).sin().abs(), 0.2)),
        &[],
    )
    .unwrap();
    let start = std::time::Instant::now();
    let html = show(&ply);
    let written = start.elapsed();
    let Some(mut page) = open(&html, 1400, 900) else { return };
    let shot = page.screenshot("million");
    eprintln!(
        "{} MB, written in {written:.1?}, shown after {:.1?}",
        std::fs::metadata(&html).unwrap().len() / 1_000_000,
        start.elapsed()
    );
    let ground = shot.get_pixel(5, 5);
    assert!(shot.pixels().filter(|p| *p != ground).count() > 200_000);
    page.assert_quiet();
}

#[test]
fn files_that_cannot_be_shown_are_refused() {
    let folder = Folder::new("show-refused");
    let ply = folder.join("bad.ply");
    let error = |text: &str| {
        std::fs::write(&ply, text).unwrap();
        Table::read(&ply).unwrap_err().to_string().rsplit("bad.ply").next().unwrap().to_owned()
    };
    let head = "ply\nformat binary_little_endian 1.0\n";
    assert_eq!(
        error(&format!("{head}element vertex 0\nproperty float x\nend_header\n")),
        ": has no points: there is nothing to show"
    );
    assert_eq!(
        error(&format!("{head}element vertex 1\nproperty float x\nend_header\n1234")),
        ": has no property \"y\": points need x, y and z"
    );
    assert!(
        error(&format!("{head}element vertex 100\nproperty float x\nend_header\n1234"))
            .starts_with(": is cut short")
    );
    assert_eq!(error("solid\n"), ":1: is not a PLY file");
}
