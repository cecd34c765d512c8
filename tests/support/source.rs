//! Rust source read as text, enough to check the house rules: comments and literals blanked,
//! imports resolved to paths from the crate's root, functions with the number of their arguments.

use std::fs;
use std::path::{Path, PathBuf};

/// One source file.
pub struct Source {
    /// Path below the repository, with slashes.
    pub file: String,
    /// As it is.
    pub text: String,
    /// Without the unit tests at its end; comments, strings and characters are blanks.
    pub code: String,
}

/// Every source file under `folder`, by name.
pub fn sources(folder: &str) -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut open, mut found): (Vec<PathBuf>, Vec<_>) = (vec![root.join(folder)], Vec::new());
    while let Some(dir) = open.pop() {
        for entry in fs::read_dir(dir).into_iter().flatten() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let file = path.strip_prefix(root).unwrap().to_string_lossy().into_owned();
                let text = fs::read_to_string(&path).unwrap();
                found.push(Source { code: without_literals(shipped(&text)), file, text });
            }
        }
    }
    found.sort_by(|a, b| a.file.cmp(&b.file));
    found
}

/// The text up to the unit tests at the end of the file.
fn shipped(text: &str) -> &str {
    text.find("\n#[cfg(test)]\nmod ").map_or(text, |end| &text[..end])
}

/// Comments, strings and characters as blanks; line breaks stay.
pub fn without_literals(text: &str) -> String {
    let mut code = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let after_word = code.ends_with(|c: char| c.is_alphanumeric() || c == '_');
        let skipped = match c {
            '/' if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            '/' if rest.starts_with("/*") => rest.find("*/").map_or(rest.len(), |end| end + 2),
            '"' => string(rest),
            'r' if !after_word => raw_string(rest),
            '\'' => character(rest),
            _ => 0,
        };
        if skipped == 0 {
            code.push(c);
            rest = &rest[c.len_utf8()..];
        } else {
            code.extend(rest[..skipped].chars().map(|c| if c == '\n' { c } else { ' ' }));
            rest = &rest[skipped..];
        }
    }
    code
}

fn string(rest: &str) -> usize {
    let mut escaped = false;
    for (i, c) in rest.char_indices().skip(1) {
        match c {
            '"' if !escaped => return i + 1,
            _ => escaped = c == '\\' && !escaped,
        }
    }
    rest.len()
}

fn raw_string(rest: &str) -> usize {
    let hashes = rest[1..].bytes().take_while(|b| *b == b'#').count();
    if rest.as_bytes().get(1 + hashes) != Some(&b'"') {
        return 0;
    }
    let end = format!("\"{}", "#".repeat(hashes));
    let start = 2 + hashes;
    rest[start..].find(&end).map_or(rest.len(), |at| start + at + end.len())
}

/// A character, or 0 for a lifetime.
fn character(rest: &str) -> usize {
    let mut chars = rest.char_indices().skip(1);
    match chars.next() {
        Some((_, '\\')) => rest[3..].find('\'').map_or(0, |end| end + 4),
        Some(_) => chars.next().filter(|c| c.1 == '\'').map_or(0, |(i, _)| i + 1),
        None => 0,
    }
}

/// A path that code names.
#[derive(Debug, PartialEq)]
pub struct Import {
    /// From 1.
    pub line: usize,
    /// Segments from the crate's root.
    pub path: Vec<String>,
}

/// Modules from the crate's root down to a file: `src/a/b.rs` → a, b; `src/a/mod.rs` → a.
pub fn module(file: &str) -> Vec<String> {
    let inside = file.strip_prefix("src/").unwrap_or(file).trim_end_matches(".rs");
    let mut segments: Vec<String> = inside.split('/').map(str::to_owned).collect();
    if segments.last().is_some_and(|s| ["mod", "lib", "main"].contains(&s.as_str())) {
        segments.pop();
    }
    segments
}

/// Every path in `code` that begins with `crate::`, `self::` or `super::`, braces opened.
pub fn imports(file: &str, code: &str) -> Vec<Import> {
    let mut found = Vec::new();
    let mut at = 0;
    while at < code.len() {
        let here = &code[at..];
        let inside = code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':');
        let begins = ["crate::", "self::", "super::"].iter().any(|s| here.starts_with(s));
        if inside || !begins {
            at += here.chars().next().map_or(1, char::len_utf8);
            continue;
        }
        let line = 1 + code[..at].matches('\n').count();
        let (paths, length) = tree(here);
        for path in paths {
            if let Some(path) = absolute(file, &path) {
                found.push(Import { line, path });
            }
        }
        at += length.max(1);
    }
    found
}

fn absolute(file: &str, path: &[String]) -> Option<Vec<String>> {
    let mut from = module(file);
    let mut rest = path;
    while let Some((first, after)) = rest.split_first() {
        match first.as_str() {
            "crate" => from.clear(),
            "self" => {}
            "super" => drop(from.pop()?),
            _ => break,
        }
        rest = after;
    }
    from.extend(rest.iter().cloned());
    Some(from)
}

/// The paths of a use tree at the head of `text`, and the bytes it takes.
fn tree(text: &str) -> (Vec<Vec<String>>, usize) {
    let mut prefix = Vec::new();
    let mut at = 0;
    loop {
        at += blanks(&text[at..]);
        if text[at..].starts_with('{') {
            at += 1;
            let mut paths = Vec::new();
            while at < text.len() {
                at += blanks(&text[at..]);
                match text[at..].chars().next() {
                    Some('}') | None => break,
                    Some(',') => at += 1,
                    Some(_) => {
                        let (inner, length) = tree(&text[at..]);
                        paths.extend(inner.into_iter().map(|p| [prefix.clone(), p].concat()));
                        at += length;
                        // Past `as name`.
                        at += text[at..].find([',', '}']).unwrap_or(text.len() - at);
                    }
                }
            }
            return (paths, (at + 1).min(text.len()));
        }
        let word = text[at..].find(|c: char| !c.is_alphanumeric() && c != '_' && c != '*');
        let length = word.unwrap_or(text.len() - at);
        if length == 0 {
            return (vec![prefix], at.max(1));
        }
        prefix.push(text[at..at + length].to_owned());
        at += length;
        if !text[at..].starts_with("::") {
            return (vec![prefix], at);
        }
        at += 2;
    }
}

fn blanks(text: &str) -> usize {
    text.len() - text.trim_start().len()
}

/// A function that code defines.
#[derive(Debug, PartialEq)]
pub struct Function {
    /// From 1.
    pub line: usize,
    /// Its name.
    pub name: String,
    /// Arguments, `self` counted.
    pub arguments: usize,
}

/// Every function with a name in `code`.
pub fn functions(code: &str) -> Vec<Function> {
    let mut found = Vec::new();
    for (at, _) in code.match_indices("fn ") {
        if code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_') {
            continue;
        }
        let rest = &code[at + 3..];
        let name = &rest[..rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(0)];
        let mut rest = &rest[name.len()..];
        if rest.starts_with('<') {
            rest = &rest[bracket(rest).1..];
        }
        if name.is_empty() || !rest.starts_with('(') {
            continue;
        }
        let line = 1 + code[..at].matches('\n').count();
        found.push(Function { line, name: name.to_owned(), arguments: bracket(rest).0 });
    }
    found
}

/// Comma-separated parts inside the bracket at the head of `text`, and the bytes up to its end.
fn bracket(text: &str) -> (usize, usize) {
    let (mut level, mut parts, mut filled, mut before) = (0, 0, false, ' ');
    for (i, c) in text.char_indices() {
        let closes = matches!(c, ')' | ']' | '}') || c == '>' && before != '-';
        before = c;
        if closes {
            level -= 1;
            if level == 0 {
                return (parts + usize::from(filled), i + 1);
            }
        } else if c == ',' && level == 1 {
            parts += usize::from(filled);
            filled = false;
        } else if !c.is_whitespace() && level > 0 {
            filled = true;
        }
        level += i32::from(matches!(c, '(' | '[' | '{' | '<'));
    }
    (parts, text.len())
}
