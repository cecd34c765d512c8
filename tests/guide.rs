//! The guide and the README: every command that they show is run, small.
//!
//! A page's blocks marked `sh` hold the commands, one a line; those of `nearfar` are run in the
//! order of the page, in a folder of their own that has the scenes, so that files which one command
//! makes are there for the next. Blocks marked `file=NAME` are saved under that name first.
//! Commands in a block marked `needs-oidn` are left out, visibly, unless `NEARFAR_OIDN` is set.
//! [`small`] says what is made small; a command that is refused, fails, or does not make its file
//! fails the page.

use std::path::Path;
use std::process::Command;

use nearfar::Method;

use crate::support::Folder;

const TOP: &str = env!("CARGO_MANIFEST_DIR");
const SIZE: &str = "16x12";

/// Settings of every command that takes a scene, before those that the page gives.
const SMALL: &[&str] = &[
    "record.spp=1",
    "path.spp=2",
    "proxy.photons=1000",
    "proxy.gather_rays=2",
    "proxy.direct_samples=1",
    "decompose.near_cell=10%",
    "decompose.rays=16",
    "decompose.near_rays=2",
    "cache.rays=64",
    "gather.rays=16",
    "point_based.elements=500",
    "point_based.bounces=1",
    "local.elements=500",
];

/// A block of a page between its fences.
struct Block {
    info: Vec<String>,
    lines: Vec<String>,
}

fn read(page: &str) -> String {
    let path = Path::new(TOP).join(page);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn blocks(text: &str) -> Vec<Block> {
    let (mut found, mut open) = (Vec::new(), None::<Block>);
    for line in text.lines() {
        if let Some(info) = line.strip_prefix("```") {
            if let Some(block) = open.take() {
                found.push(block);
            } else {
                let info = info.split_whitespace().map(str::to_owned).collect();
                open = Some(Block { info, lines: Vec::new() });
            }
        } else if let Some(block) = &mut open {
            block.lines.push(line.to_owned());
        }
    }
    assert!(open.is_none(), "a block is not closed");
    found
}

impl Block {
    /// The block's commands; a line that ends with a backslash goes on in the next.
    fn commands(&self) -> Vec<String> {
        let text = self.lines.join("\n").replace("\\\n", " ");
        text.lines().map(str::to_owned).collect()
    }
}

/// The words of a command, without its comment. Single quotes may keep a shell from words without
/// spaces.
fn words(line: &str) -> Vec<String> {
    assert!(!line.contains(['"', '\\', '|', '>']), "write this more plainly: {line}");
    let command = line.split(" #").next().unwrap_or(line);
    command.split_whitespace().map(|word| word.trim_matches('\'').to_owned()).collect()
}

/// Whether a command reads a scene and takes size and settings.
fn takes_scene(words: &[String]) -> bool {
    let of_scene = ["render", "reference", "fly", "bench", "info", "export"];
    match words {
        [first, second, ..] if first == "cloud" => second != "show",
        [first, ..] => of_scene.contains(&first.as_str()),
        [] => false,
    }
}

/// What an option's value becomes; none when it stays as it is.
fn small_value(option: &str, value: &str) -> Option<String> {
    let number = || value.parse::<u32>().unwrap_or_else(|_| panic!("{option} {value}"));
    match option {
        "--size" => Some(SIZE.into()),
        "--spp" => Some((number() / 16).max(4).to_string()),
        "--time-limit" => Some("0.3s".into()),
        "--frames" => Some(number().min(2).to_string()),
        "--elements" => Some(number().min(500).to_string()),
        "--traced" => Some(number().min(8).to_string()),
        "--rays" => Some(number().min(200).to_string()),
        _ => None,
    }
}

/// The arguments of a command of the page, small: size, samples, times and counts are cut down, the
/// settings of [`SMALL`] stand before the page's own, and scenes made by code get few triangles.
fn small(words: &[String], folder: &Path) -> Vec<String> {
    if !takes_scene(words) {
        return words.to_vec();
    }
    let at = if words[0] == "cloud" { 2 } else { 1 };
    let mut made = words[..at].to_vec();
    let mut add = |option: &str, value: &str| made.extend([option.to_owned(), value.to_owned()]);
    let has = |option: &str| words.iter().any(|w| w == option);
    SMALL.iter().for_each(|setting| add("--set", setting));
    let scene = words.iter().find(|w| w.ends_with(".toml") && w.starts_with("scenes"));
    let text = scene.map(|s| std::fs::read_to_string(folder.join(s)).unwrap());
    if text.is_some_and(|t| t.contains("detail =")) {
        add("--set", "mesh.0.parameters.detail=0.25");
    }
    if !has("--size") {
        add("--size", SIZE);
    }
    if words[0] == "bench" {
        add("--rounds", "1");
        add("--gather-rays", "16");
        if !has("--rays") {
            add("--rays", "200");
        }
    }
    let mut given = words[at..].iter().peekable();
    while let Some(word) = given.next() {
        made.push(word.clone());
        if let Some(value) = given.peek().and_then(|value| small_value(word, value)) {
            given.next();
            made.push(value);
        }
    }
    made
}

/// A folder with the scenes; the committed ground truth, where a page uses it, is made anew in the
/// size of the pictures.
fn workplace(name: &str, text: &str) -> Folder {
    let folder = Folder::new(&format!("guide-{name}"));
    for scene in std::fs::read_dir(Path::new(TOP).join("scenes")).unwrap() {
        let scene = scene.unwrap().path();
        if !scene.is_dir() {
            continue;
        }
        let copy = folder.join("scenes").join(scene.file_name().unwrap());
        std::fs::create_dir_all(&copy).unwrap();
        for file in std::fs::read_dir(&scene).unwrap() {
            let file = file.unwrap().path();
            std::fs::copy(&file, copy.join(file.file_name().unwrap())).unwrap();
        }
    }
    if text.contains("cornell-box.exr") {
        let truth = "reference scenes/cornell-box/cornell-box.toml --spp 128 --no-state --half \
                     --aov half0,half1 -o scenes/cornell-box/cornell-box.exr --seed 99";
        run(&small(&words(truth), &folder), &folder, truth);
    }
    folder
}

fn run(arguments: &[String], folder: &Path, shown: &str) {
    let output = Command::new(env!("CARGO_BIN_EXE_nearfar"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    let said = || format!("{shown}\nas: nearfar {}\n{error}", arguments.join(" "));
    assert_eq!(output.status.code(), Some(0), "{}", said());
    let named = |option: &str| arguments.iter().position(|w| w == option).map(|i| i + 1);
    if let Some(i) = named("-o").or_else(|| named("--output")) {
        assert!(folder.join(&arguments[i]).exists(), "{} is not there: {}", arguments[i], said());
    }
}

/// Runs the commands of a page and gives their number.
fn follow(page: &str) -> usize {
    let text = read(page);
    let folder = workplace(&page.replace(['/', '.'], "-"), &text);
    let mut count = 0;
    for block in blocks(&text) {
        if let Some(name) = block.info.iter().find_map(|w| w.strip_prefix("file=")) {
            std::fs::write(folder.join(name), block.lines.join("\n") + "\n").unwrap();
        }
        if block.info.first().is_none_or(|language| language != "sh") {
            continue;
        }
        let oidn = std::env::var_os("NEARFAR_OIDN").filter(|value| value != "none");
        let needs_oidn = block.info.iter().any(|w| w == "needs-oidn");
        for line in block.commands() {
            let words = words(&line);
            match words.first().map(String::as_str) {
                Some("mkdir") => std::fs::create_dir_all(folder.join(&words[1])).unwrap(),
                Some("nearfar") if needs_oidn && oidn.is_none() => {
                    eprintln!("SKIPPED: {page}: {line}: NEARFAR_OIDN names no library");
                }
                Some("nearfar") => {
                    run(&small(&words[1..], &folder), &folder, &format!("{page}: {line}"));
                    count += 1;
                }
                _ => {}
            }
        }
    }
    count
}

macro_rules! pages {
    ($($name:ident: $page:literal, $commands:literal;)*) => {
        /// Pages with commands.
        const PAGES: &[&str] = &[$($page),*];
        $(#[test]
        fn $name() {
            assert_eq!(follow($page), $commands, "{}: commands that were run", $page);
        })*
    };
}

pages! {
    readme: "README.md", 1;
    first_picture: "docs/guide/first-picture.md", 9;
    own_scene: "docs/guide/own-scene.md", 3;
    surfaces: "docs/guide/surfaces.md", 3;
    lights: "docs/guide/lights.md", 4;
    quality: "docs/guide/quality.md", 9;
    films: "docs/guide/films.md", 4;
    ground_truth: "docs/guide/ground-truth.md", 14;
    comparing: "docs/guide/comparing.md", 11;
    methods: "docs/guide/methods.md", 12;
    point_clouds: "docs/guide/point-clouds.md", 11;
    backends: "docs/guide/backends.md", 3;
    file_formats: "docs/guide/file-formats.md", 1;
    troubleshooting: "docs/guide/troubleshooting.md", 5;
}

/// The pages of the guide.
fn guide() -> Vec<String> {
    let files = std::fs::read_dir(Path::new(TOP).join("docs/guide")).unwrap();
    let names = files.map(|f| f.unwrap().file_name().into_string().unwrap());
    names.filter(|n| n.ends_with(".md")).collect()
}

#[test]
fn every_page_is_in_the_contents_and_tried() {
    let contents = read("docs/guide/SUMMARY.md");
    for name in guide().iter().filter(|n| *n != "SUMMARY.md") {
        assert!(contents.contains(&format!("({name})")), "SUMMARY.md does not list {name}");
        let page = format!("docs/guide/{name}");
        let of_sh = |b: &Block| b.info.first().is_some_and(|w| w == "sh");
        let shows = blocks(&read(&page))
            .iter()
            .any(|b| of_sh(b) && b.lines.iter().any(|l| l.starts_with("nearfar ")));
        assert!(!shows || PAGES.contains(&page.as_str()), "{page} is not among the pages tried");
    }
}

#[test]
fn links_lead_somewhere() {
    let guide = guide().into_iter().map(|n| format!("docs/guide/{n}"));
    let others = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/architecture.md"];
    let records = ["docs/records/README.md", "scenes/README.md"];
    for page in guide.chain(others.into_iter().chain(records).map(str::to_owned)) {
        let (text, folder) = (read(&page), Path::new(TOP).join(&page));
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let path = link.split('#').next().unwrap_or(link);
            let there = path.is_empty()
                || path.contains("://")
                || folder.parent().is_some_and(|f| f.join(path).exists());
            assert!(there, "{page}: {link} is not there");
        }
    }
}

/// The page is that of the program with Embree, whose default backend it names.
#[cfg(feature = "embree")]
#[test]
fn the_page_of_settings_is_the_programs() {
    let output =
        Command::new(env!("CARGO_BIN_EXE_nearfar")).args(["settings", "--markdown"]).output();
    let made = String::from_utf8(output.unwrap().stdout).unwrap();
    assert!(
        made == read("docs/guide/settings.md"),
        "docs/guide/settings.md is old: nearfar settings --markdown > docs/guide/settings.md"
    );
}

#[test]
fn methods_and_layers_are_described() {
    let (methods, formats) = (read("docs/guide/methods.md"), read("docs/guide/file-formats.md"));
    for method in Method::ALL {
        let name = method.name();
        assert!(methods.contains(&format!("| `{name}`")), "methods.md has no line of {name}");
        for layer in method.layers() {
            let named = format!("`{}`", layer.name);
            assert!(formats.contains(&named), "file-formats.md has no layer {named} of {name}");
        }
    }
}
