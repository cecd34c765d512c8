//! The house rules of `src/lib.rs`, read off the source text.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::support::source::{Function, functions, imports, module, sources, without_literals};

/// Rooms that may be imported by rooms of the same or a higher rank.
const RANKS: &[(&str, u32)] = &[
    ("error", 0),
    ("run", 0),
    ("forecast", 0),
    ("journal", 0),
    ("process", 0),
    ("memory", 0),
    ("input_file", 0),
    ("atomic_file", 1),
    ("settings", 1),
    ("length", 1),
    ("ffi", 1),
    ("math", 1),
    ("sampling", 1),
    ("sh", 1),
    ("radiometry", 1),
    ("ply", 2),
    ("scene", 2),
    ("builtin", 3),
    ("load", 3),
    ("tessellate", 3),
    ("accel", 4),
    ("shading", 5),
    ("proxy", 6),
    ("guide", 6),
    ("film", 2),
    ("denoise", 6),
    ("record", 6),
    ("cloud", 6),
    ("method", 7),
    ("config", 8),
    ("compare", 7),
    ("render", 8),
    ("bench", 8),
    ("page", 8),
    ("export", 8),
    ("info", 8),
    ("cli", 9),
];

/// The one method that is another under settings of its own.
const A_METHOD_OF: (&str, &str) = ("course", "decompose");

/// What the methods share: files of `src/method` that are no methods.
const SHARED_BY_METHODS: &[&str] = &["key", "locations", "stage", "statistics"];

const LONGEST_FILE: usize = 600;
const LONGEST_LINE: usize = 100;
/// Bytes of the largest file that git keeps.
const LARGEST_FILE: u64 = 1_000_000;
/// Most arguments of a function, and how many functions may have more, each with its reason in an
/// `#[expect(clippy::too_many_arguments)]`.
const MOST_ARGUMENTS: usize = 7;
const EXCEPTIONS: usize = 3;

fn rank(room: &str) -> Option<u32> {
    RANKS.iter().find(|(name, _)| *name == room).map(|(_, rank)| *rank)
}

/// The room of a file: `src/accel/bvh.rs` → `accel`, `src/run.rs` → `run`; none for `lib.rs` and
/// `main.rs`.
fn room(file: &str) -> Option<String> {
    module(file).into_iter().next()
}

/// Every import of a room by another: place, from, to.
fn between_rooms() -> Vec<(String, String, String)> {
    let mut found = Vec::new();
    for source in sources("src") {
        let Some(from) = room(&source.file) else { continue };
        for import in imports(&source.file, &source.code) {
            if let Some(to) = import.path.first().filter(|to| **to != from && rank(to).is_some()) {
                let place = format!("{}:{}", source.file, import.line);
                found.push((place, from.clone(), to.clone()));
            }
        }
    }
    found
}

#[test]
fn imports_are_found() {
    let found = |file: &str, code: &str| -> Vec<String> {
        imports(file, &without_literals(code)).iter().map(|i| i.path.join("::")).collect()
    };
    assert_eq!(found("src/a/b.rs", "use crate::math::{Hit, Ray};"), ["math::Hit", "math::Ray"]);
    assert_eq!(
        found("src/a/b.rs", "use crate::{\n  math::{Hit, Ray as R},\n  run::Run,\n  cli,\n};"),
        ["math::Hit", "math::Ray", "run::Run", "cli"]
    );
    assert_eq!(
        found("src/a/b.rs", "fn f(x: crate::error::Error) -> crate::film::Film {"),
        ["error::Error", "film::Film"]
    );
    assert_eq!(found("src/a/b.rs", "use super::{self, c::{D, E}};"), ["a", "a::c::D", "a::c::E"]);
    assert_eq!(found("src/a/b.rs", "super::super::run::Run"), ["run::Run"]);
    assert_eq!(found("src/a/mod.rs", "use super::{math, run::Run};"), ["math", "run::Run"]);
    assert_eq!(found("src/run.rs", "use super::cli::*;"), ["cli::*"]);
    assert!(found("src/a/b.rs", "// crate::cli\nlet s = \"crate::cli\\\" crate::x\";").is_empty());
    assert!(found("src/a/b.rs", "let r = r#\"\" crate::cli \"#; let c = '\"';").is_empty());
    let line = imports("src/a.rs", "\n\nuse crate::b;")[0].line;
    assert_eq!(line, 3);
}

#[test]
fn arguments_are_counted() {
    let counted = |code: &str| -> Vec<usize> {
        functions(code).into_iter().map(|f: Function| f.arguments).collect()
    };
    assert_eq!(
        counted("fn none() {}\nfn one(&self) {}\nfn two(\n    a: A,\n    b: B,\n) {}"),
        [0, 1, 2]
    );
    assert_eq!(counted("fn f<F: Fn(A, B) -> C, const N: usize>(f: F, (a, b): (A, B)) {}"), [2]);
    assert_eq!(counted("fn g(f: impl Fn(A, B) -> Vec<C, D>, x: [f32; 3], m: Map<K, V>) {}"), [3]);
}

#[test]
fn imports_go_from_higher_rank_to_lower() {
    for source in sources("src") {
        if let Some(room) = room(&source.file) {
            let known = rank(&room).is_some();
            assert!(
                known,
                "{}: room \"{room}\" has no rank: add it here and to src/lib.rs",
                source.file
            );
        }
    }
    let wrong: Vec<_> = between_rooms()
        .into_iter()
        .filter(|(_, from, to)| rank(to) > rank(from))
        .map(|(place, from, to)| format!("{place}: {from} imports {to}, which ranks higher"))
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Whether `to` can be reached from `from` along the edges.
fn reaches(edges: &BTreeMap<String, BTreeSet<String>>, from: &str, to: &str) -> bool {
    let (mut open, mut seen) = (vec![from], BTreeSet::new());
    while let Some(at) = open.pop() {
        for next in edges.get(at).into_iter().flatten() {
            if next == to {
                return true;
            }
            if seen.insert(next) {
                open.push(next);
            }
        }
    }
    false
}

/// The imports that lie on a circle, as lines to report.
fn circles(imports: &[(String, String, String)]) -> Vec<String> {
    let mut edges = BTreeMap::<_, BTreeSet<_>>::new();
    for (_, from, to) in imports {
        edges.entry(from.clone()).or_default().insert(to.clone());
    }
    let back = imports.iter().filter(|(_, from, to)| reaches(&edges, to, from));
    back.map(|(place, from, to)| format!("{place}: {from} imports {to}, which leads back"))
        .collect()
}

#[test]
fn rooms_of_equal_rank_do_not_import_in_circles() {
    let import = |from: &str, to: &str| ("place".to_owned(), from.to_owned(), to.to_owned());
    let chain = [import("a", "b"), import("b", "c"), import("d", "a")];
    assert!(circles(&chain).is_empty());
    let circle = [&chain[..], &[import("c", "a")]].concat();
    assert_eq!(circles(&circle).len(), 3, "all but d: {:?}", circles(&circle));

    let equal: Vec<_> =
        between_rooms().into_iter().filter(|(_, from, to)| rank(from) == rank(to)).collect();
    let wrong = circles(&equal);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn methods_do_not_import_each_other() {
    let files = sources("src/method");
    let of = |path: &[String]| path.get(1).filter(|_| path[0] == "method").cloned();
    let methods: BTreeSet<String> = files
        .iter()
        .filter_map(|s| of(&module(&s.file)))
        .filter(|name| !SHARED_BY_METHODS.contains(&name.as_str()))
        .collect();
    assert!(methods.contains("converge") && methods.contains("path"), "{methods:?}");
    let mut wrong = Vec::new();
    for source in &files {
        let Some(own) = of(&module(&source.file)).filter(|o| methods.contains(o)) else {
            continue;
        };
        for import in imports(&source.file, &source.code) {
            if let Some(other) = of(&import.path).filter(|o| *o != own && methods.contains(o))
                && (own.as_str(), other.as_str()) != A_METHOD_OF
            {
                wrong.push(format!("{}:{}: {own} imports {other}", source.file, import.line));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_test_file_is_compiled() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let main = std::fs::read_to_string(root.join("main.rs")).unwrap();
    let mut lost = Vec::new();
    for entry in std::fs::read_dir(root).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if let Some(stem) = name.strip_suffix(".rs").filter(|s| *s != "main") {
            let found = main.lines().any(|line| line == format!("mod {stem};"));
            if !found {
                lost.push(format!("tests/{name}: tests/main.rs has no \"mod {stem};\""));
            }
        }
    }
    assert!(lost.is_empty(), "{}", lost.join("\n"));
}

#[test]
fn lines_are_short() {
    let build = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/build.rs")).unwrap();
    let mut texts = vec![("build.rs".to_owned(), build)];
    for folder in ["src", "tests", "examples"] {
        texts.extend(sources(folder).into_iter().map(|s| (s.file, s.text)));
    }
    let mut wrong = Vec::new();
    for (file, text) in &texts {
        for (i, line) in text.lines().enumerate() {
            let columns = line.chars().count();
            if columns > LONGEST_LINE {
                wrong.push(format!("{file}:{}: {columns} columns", i + 1));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What the repository keeps, every clone carries for ever. Skipped where it is no checkout.
#[test]
fn files_are_small() {
    let listed = std::process::Command::new("git").args(["ls-files", "-z"]).output();
    let Ok(listed) = listed.map(|o| String::from_utf8_lossy(&o.stdout).into_owned()) else {
        return;
    };
    let size = |name: &str| Path::new(name).metadata().map_or(0, |data| data.len());
    let large: Vec<&str> = listed.split('\0').filter(|name| size(name) > LARGEST_FILE).collect();
    assert!(large.is_empty(), "files over {LARGEST_FILE} bytes: {large:?}");
}

#[test]
fn functions_take_few_arguments() {
    let mut long = Vec::new();
    for folder in ["src", "tests", "examples"] {
        for source in sources(folder) {
            for f in functions(&without_literals(&source.text)) {
                if f.arguments > MOST_ARGUMENTS {
                    let (file, Function { line, name, arguments }) = (&source.file, f);
                    long.push(format!("{file}:{line}: {name} takes {arguments} arguments"));
                }
            }
        }
    }
    assert!(long.len() <= EXCEPTIONS, "{}", long.join("\n"));
}

#[test]
fn files_are_short_and_open_with_a_page() {
    for source in sources("src").into_iter().chain(sources("tests")) {
        let (file, text) = (source.file, source.text);
        let lines = text.lines().count();
        assert!(lines <= LONGEST_FILE, "{file}: {lines} lines, over {LONGEST_FILE}");
        let unit_tests = file.ends_with("/tests.rs");
        assert!(unit_tests || text.starts_with("//!"), "{file}: does not open with its page");
    }
}

#[test]
fn the_library_is_silent_and_safe() {
    let mut wrong = Vec::new();
    for source in sources("src") {
        let file = &source.file;
        let (cli, border) = (file.starts_with("src/cli/"), file.starts_with("src/ffi/"));
        for (line, text) in source.code.lines().enumerate().map(|(i, text)| (i + 1, text)) {
            for word in [
                "println!",
                "print!",
                "eprintln!",
                "eprint!",
                "process::exit",
                "todo!",
                "unimplemented!",
                "dbg!",
            ] {
                if text.contains(word) && !cli {
                    wrong.push(format!("{file}:{line}: {word}"));
                }
            }
            let mut words = text.split(|c: char| !c.is_alphanumeric() && c != '_');
            if words.any(|w| w == "unsafe") && !border {
                wrong.push(format!("{file}:{line}: unsafe"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Options belong to the command line; a library's error names settings, files and what to do. The
/// page of settings says by which command it is made.
#[test]
fn library_errors_name_no_options() {
    let mut wrong = Vec::new();
    for source in sources("src")
        .iter()
        .filter(|s| !s.file.starts_with("src/cli/") && s.file != "src/settings/page.rs")
    {
        let own = source.text.lines().take_while(|line| *line != "#[cfg(test)]");
        for (line, text) in own.enumerate() {
            let code = text.split("//").next().unwrap_or_default();
            let option = code.match_indices("--").any(|(at, _)| {
                let before = code[..at].ends_with([' ', '"', '(']);
                before && code[at + 2..].starts_with(|c: char| c.is_ascii_lowercase())
            });
            if option {
                wrong.push(format!("{}:{}: {}", source.file, line + 1, text.trim()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_catch_all_files() {
    for source in sources("src").into_iter().chain(sources("tests")) {
        let file = source.file;
        let stem = Path::new(&file).file_stem().unwrap().to_string_lossy().into_owned();
        assert!(
            !["utils", "util", "helpers", "common", "misc"].contains(&stem.as_str()),
            "{file}: name it after what it holds"
        );
    }
}
