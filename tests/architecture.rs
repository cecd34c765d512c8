//! The house rules of `src/lib.rs`, read off the source text.

use std::fs;
use std::path::{Path, PathBuf};

/// Rooms that may be imported by rooms of the same or a higher rank.
const RANKS: &[(&str, u32)] = &[
    ("error", 0),
    ("run", 0),
    ("atomic_file", 1),
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
    ("photon", 6),
    ("film", 6),
    ("denoise", 6),
    ("record", 6),
    ("cloud", 6),
    ("method", 7),
    ("config", 8),
    ("compare", 7),
    ("bench", 8),
    ("page", 8),
    ("export", 8),
    ("info", 8),
    ("cli", 9),
];

const LONGEST_FILE: usize = 600;

fn rank(room: &str) -> Option<u32> {
    RANKS.iter().find(|(name, _)| *name == room).map(|(_, rank)| *rank)
}

/// Every source file under `folder`: path below the repository, text.
fn sources(folder: &str) -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut open, mut found): (Vec<PathBuf>, Vec<_>) = (vec![root.join(folder)], Vec::new());
    while let Some(dir) = open.pop() {
        for entry in fs::read_dir(dir).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let name = path.strip_prefix(root).unwrap().to_string_lossy().into_owned();
                found.push((name, fs::read_to_string(&path).unwrap()));
            }
        }
    }
    found.sort();
    found
}

/// Lines with their numbers, without comments, up to the unit tests at the end of the file.
fn code(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines()
        .enumerate()
        .take_while(|(_, line)| *line != "#[cfg(test)]")
        .map(|(i, line)| (i + 1, line.split("//").next().unwrap_or_default()))
}

/// The room of a file: `src/accel/bvh.rs` → `accel`, `src/run.rs` → `run`; none for `lib.rs` and
/// `main.rs`.
fn room(file: &str) -> Option<&str> {
    let name = file.strip_prefix("src/")?.split('/').next()?.trim_end_matches(".rs");
    (name != "lib" && name != "main").then_some(name)
}

/// First path segments after `crate::` in a line, braces opened.
fn imports(line: &str) -> Vec<&str> {
    line.match_indices("crate::")
        .flat_map(|(at, found)| {
            let rest = &line[at + found.len()..];
            let word =
                |s: &str| s.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(s.len());
            match rest.strip_prefix('{') {
                Some(list) => {
                    split_top(list).into_iter().map(|s| &s[..word(s)]).collect::<Vec<_>>()
                }
                None => vec![&rest[..word(rest)]],
            }
        })
        .collect()
}

/// Comma-separated parts at the outermost level of a brace list.
fn split_top(list: &str) -> Vec<&str> {
    let (mut parts, mut level, mut start) = (Vec::new(), 0, 0);
    for (i, c) in list.char_indices() {
        match c {
            '{' => level += 1,
            '}' if level == 0 => {
                parts.push(list[start..i].trim());
                return parts;
            }
            '}' => level -= 1,
            ',' if level == 0 => {
                parts.push(list[start..i].trim());
                start = i + 1;
            }
            _ => {}
        }
    }
    parts.push(list[start..].trim());
    parts
}

#[test]
fn imports_are_found() {
    assert_eq!(imports("use crate::math::{Hit, Ray};"), ["math"]);
    assert_eq!(imports("use crate::{math::{Hit, Ray}, run::Run, cli};"), ["math", "run", "cli"]);
    assert_eq!(imports("fn f(x: crate::error::Error) -> crate::film::Film {"), ["error", "film"]);
}

#[test]
fn imports_go_from_higher_rank_to_lower() {
    let mut wrong = Vec::new();
    for (file, text) in sources("src") {
        let Some(room) = room(&file) else { continue };
        let own = rank(room).unwrap_or_else(|| {
            panic!("{file}: room \"{room}\" has no rank; add it to the list and to src/lib.rs")
        });
        for (line, text) in code(&text) {
            for import in imports(text) {
                if rank(import).is_some_and(|r| r > own) {
                    wrong.push(format!("{file}:{line}: {room} ({own}) imports {import}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn methods_do_not_import_each_other() {
    let methods = [
        "path",
        "decompose",
        "cache",
        "point_based",
        "direct",
        "gather",
        "local_correction",
        "photon_map",
    ];
    let mut wrong = Vec::new();
    for (file, text) in sources("src/method") {
        let own = file
            .trim_start_matches("src/method/")
            .split('/')
            .next()
            .unwrap_or_default()
            .trim_end_matches(".rs")
            .to_owned();
        if !methods.contains(&own.as_str()) {
            continue;
        }
        for (line, text) in code(&text) {
            for other in methods.iter().filter(|m| **m != own) {
                if text.contains(&format!("method::{other}"))
                    || text.contains(&format!("super::{other}::")) && file.matches('/').count() == 2
                {
                    wrong.push(format!("{file}:{line}: {own} imports {other}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn files_are_short_and_open_with_a_page() {
    for (file, text) in sources("src").into_iter().chain(sources("tests")) {
        let lines = text.lines().count();
        assert!(lines <= LONGEST_FILE, "{file}: {lines} lines, over {LONGEST_FILE}");
        let unit_tests = file.ends_with("/tests.rs");
        assert!(unit_tests || text.starts_with("//!"), "{file}: does not open with its page");
    }
}

#[test]
fn the_library_is_silent_and_safe() {
    let mut wrong = Vec::new();
    for (file, text) in sources("src") {
        let (cli, border) = (file.starts_with("src/cli/"), file.starts_with("src/ffi/"));
        for (line, text) in code(&text) {
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

#[test]
fn no_catch_all_files() {
    for (file, _) in sources("src").into_iter().chain(sources("tests")) {
        let stem = Path::new(&file).file_stem().unwrap().to_string_lossy().into_owned();
        assert!(
            !["utils", "util", "helpers", "common", "misc"].contains(&stem.as_str()),
            "{file}: name it after what it holds"
        );
    }
}
