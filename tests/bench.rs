//! `nearfar bench --methods` as a user types it, on a small Cornell box: rows, resuming, refusals.

use std::process::{Command, Output};
use std::time::SystemTime;

use serde_json::Value;

use crate::support::Folder;

/// A folder with a small ground truth in it.
struct Measured(Folder);

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box/cornell-box.toml");
/// Little of everything, so that a render takes a tenth of a second.
const SMALL: [&str; 10] = [
    "--threads",
    "2",
    "--set",
    "proxy.photons=2000",
    "--set",
    "record.spp=4",
    "--set",
    "decompose.rays=64",
    "--backend",
    "bvh",
];

fn nearfar(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_nearfar")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

impl Measured {
    fn new(name: &str) -> Self {
        Self(Folder::new(&format!("bench-{name}")))
    }
    fn at(&self, name: &str) -> String {
        self.0.at(name)
    }
    /// A path traced picture of the Cornell box.
    fn truth(&self, name: &str, size: &str) -> String {
        let path = self.at(name);
        let done = nearfar(&[
            "reference",
            SCENE,
            "--size",
            size,
            "--spp",
            "32",
            "--no-state",
            "-q",
            "-o",
            &path,
        ]);
        assert!(done.status.success(), "{}", text(&done.stderr));
        path
    }
    fn bench(&self, truth: &str, more: &[&str]) -> Output {
        let work = self.at("work");
        let mut arguments = vec![
            "bench",
            SCENE,
            "--methods",
            "--size",
            "32x32",
            "--reference",
            truth,
            "--output",
            &work,
        ];
        arguments.extend(SMALL);
        arguments.extend(more);
        nearfar(&arguments)
    }
    /// Names and times of the images in the work folder.
    fn images(&self) -> Vec<(String, SystemTime)> {
        let entries = std::fs::read_dir(self.0.join("work")).unwrap().map(|e| e.unwrap());
        let mut found: Vec<_> = entries
            .map(|e| {
                (e.file_name().into_string().unwrap(), e.metadata().unwrap().modified().unwrap())
            })
            .collect();
        found.retain(|f| f.0.ends_with(".exr"));
        found.sort();
        found
    }
}

const TWO_KNOBS: [&str; 4] = ["--sweep", "decomposition=4%,2%", "--sweep", "gather=4,16"];

#[test]
fn a_small_comparison_measures_and_resumes() {
    let folder = Measured::new("small");
    let truth = folder.truth("truth.exr", "32x32");
    let friend = folder.at("friend.exr");
    assert!(
        nearfar(&[
            "render", SCENE, "--size", "32x32", "--method", "path", "--spp", "4", "-q", "-o",
            &friend
        ])
        .status
        .success()
    );
    let (json, chart, point) =
        (folder.at("m.json"), folder.at("m.svg"), format!("a friend,2.5,{friend}"));
    let (json_option, only) =
        (format!("--json={json}"), ["--only", "decomposition,gather", "--gather-reference", "64"]);
    let mut more = vec![json_option.as_str(), "--chart", &chart, "--point", &point];
    more.extend(TWO_KNOBS.iter().chain(&only));
    let first = folder.bench(&truth, &more);
    assert!(first.status.success(), "{}", text(&first.stderr));
    let table = text(&first.stdout);
    for word in [
        "alpha 4%",
        "alpha 2% *",
        "rays 16",
        "a friend",
        "CPU seconds over those of decomposition, at equal error",
    ] {
        assert!(table.contains(word), "{word} not in\n{table}");
    }
    let report: Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    let rows = report["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 4);
    for row in rows {
        let (name, error) = (&row["line"], row["truth"]["relmse_trimmed"].as_f64().unwrap());
        assert!(
            row["cpu_seconds"].as_f64().unwrap() > 0.0
                && row["wall_seconds"].as_f64().unwrap() > 0.0,
            "{row}"
        );
        assert!(
            error.is_finite() && error.abs() < 1.0 && row["rays"].as_u64().unwrap() > 1000,
            "{row}"
        );
        assert!(row["gather"]["relmse_trimmed"].as_f64().unwrap() > 0.0, "{row}");
        assert_eq!(
            name == "decomposition",
            row["places"].as_u64().is_some_and(|n| n > 10),
            "{row}"
        );
    }
    let error = |i: usize, to: &str| rows[i][to]["relmse_trimmed"].as_f64().unwrap();
    assert!(
        error(2, "truth") > error(3, "truth") && error(2, "gather") > error(3, "gather"),
        "more rays, less error: {rows:?}"
    );
    assert!(rows[0]["places"].as_u64() < rows[1]["places"].as_u64());
    assert!(std::fs::read_to_string(&chart).unwrap().contains("a friend"));
    // Four configurations and the gather; the same images once more, nothing rendered again.
    let images = folder.images();
    assert_eq!(images.len(), 5);
    let again = folder.bench(&truth, &more);
    assert!(again.status.success(), "{}", text(&again.stderr));
    assert_eq!(text(&again.stdout), table);
    assert_eq!(folder.images(), images);
    // Another setting is another image; the old ones stay. Another round measures the same image
    // once more.
    let other = folder.bench(
        &truth,
        &["--only", "gather", "--sweep", "gather=4", "--set", "gather.rays=8", "--seed", "3"],
    );
    assert!(other.status.success(), "{}", text(&other.stderr));
    assert_eq!(folder.images().len(), 6);
    let rounds = folder
        .bench(&truth, &["--only", "gather", "--sweep", "gather=4", "--rounds", "2", "--json"]);
    let report: Value = serde_json::from_slice(&rounds.stdout).unwrap();
    assert_eq!((report["rows"][0]["rounds"].as_u64(), folder.images().len()), (Some(2), 6));
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let folder = Measured::new("refusals");
    let truth = folder.truth("truth.exr", "32x32");
    let wide = folder.truth("wide.exr", "40x32");
    let point = format!("x,1,{wide}");
    for (reference, more, expected) in [
        (&wide, vec![], "use --size 40x32"),
        (&truth, vec!["--point", &point], "use --size 40x32"),
        (&truth, vec!["--point", "x,1"], "write NAME,SECONDS,FILE.exr"),
        (&truth, vec!["--point", "x,-1,y.exr"], "write NAME,SECONDS,FILE.exr"),
        (&truth, vec!["--point", "x,1,none.exr"], "none.exr"),
        (&truth, vec!["--sweep", "magic=1"], "no line \"magic\""),
        (&truth, vec!["--sweep", "decomposition"], "write LINE=VALUE"),
        (
            &truth,
            vec!["--sweep", "decomposition=wide"],
            "line decomposition: setting \"decompose.alpha\"",
        ),
        (&truth, vec!["--sweep", "path:path.sppp=3"], "unknown key"),
        (&truth, vec!["--only", "nothing"], "no line \"nothing\""),
        (&truth, vec!["--chart", "/nowhere/c.svg"], "does not exist"),
    ] {
        let output = folder.bench(reference, &more);
        let said = text(&output.stderr);
        assert!(
            output.status.code() == Some(2) && said.contains(expected) && output.stdout.is_empty(),
            "{more:?}: {said}"
        );
    }
    let output = nearfar(&["bench", SCENE, "--methods"]);
    assert!(
        output.status.code() == Some(2)
            && text(&output.stderr).contains("--reference TRUTH.exr, or --gather-reference")
    );
    let output = nearfar(&["bench", SCENE, "--sweep", "path=1"]);
    assert!(output.status.code() == Some(2) && text(&output.stderr).contains("--methods"));
}

/// `--quality` and `--set` given to the bench are the children's too: the same picture as a render
/// with these options, bit for bit, and another one than without them.
#[test]
fn children_get_the_resolved_settings() {
    let folder = Measured::new("resolved");
    let truth = folder.truth("truth.exr", "32x32");
    let sweep = ["--only", "decomposition", "--sweep", "decomposition=4%", "--seed", "7"];
    let beauty = |path: &str| {
        let film = nearfar::film::read_exr(path.as_ref()).unwrap();
        ["R", "G", "B"].map(|c| film.channels[c].iter().map(|v| v.to_bits()).collect::<Vec<_>>())
    };
    let mut pictures = Vec::new();
    for quality in ["draft", "normal"] {
        let known = if folder.0.join("work").is_dir() { folder.images() } else { Vec::new() };
        let done = folder.bench(&truth, &[&sweep[..], &["--quality", quality]].concat());
        assert!(done.status.success(), "{}", text(&done.stderr));
        let made: Vec<_> =
            folder.images().into_iter().filter(|image| !known.contains(image)).collect();
        assert_eq!(made.len(), 1, "another quality is another image");
        let direct = folder.at("direct.exr");
        let mut render = vec!["render", SCENE, "--size", "32x32", "--quality", quality];
        render.extend(["--seed", "7", "--set", "decompose.alpha=4%", "-q", "-o", &direct]);
        render.extend(SMALL);
        assert!(nearfar(&render).status.success());
        let child = beauty(&folder.at(&format!("work/{}", made[0].0)));
        assert!(child == beauty(&direct), "{quality}");
        pictures.push(child);
    }
    assert!(pictures[0] != pictures[1], "draft and normal are told apart");
}
