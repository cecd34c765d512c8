//! Paths in scene files: relative to the file that names them, with environment variables.
//!
//! `$NAME` and `${NAME}` are replaced by the variable's value, `${NAME:-default}` by `default`
//! where it is unset or empty. `$$` is a dollar sign.

use std::path::{Path, PathBuf};

/// Replaces environment variables, looked up by `lookup`.
///
/// # Errors
/// A message that names the variable and the fix.
pub fn expand(text: &str, lookup: impl Fn(&str) -> Option<String>) -> Result<String, String> {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find('$') {
        out.push_str(&rest[..at]);
        rest = &rest[at + 1..];
        if let Some(after) = rest.strip_prefix('$') {
            out.push('$');
            rest = after;
            continue;
        }
        let (name, default, after) = if let Some(inner) = rest.strip_prefix('{') {
            let end = inner.find('}').ok_or_else(|| {
                format!("\"{text}\" has no closing brace; write ${{NAME}} or ${{NAME:-default}}")
            })?;
            let (name, default) =
                inner[..end].split_once(":-").map_or((&inner[..end], None), |(n, d)| (n, Some(d)));
            (name, default, &inner[end + 1..])
        } else {
            let end =
                rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
            (&rest[..end], None, &rest[end..])
        };
        if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
            return Err(format!(
                "\"{text}\" names no environment variable after \"$\"; write ${{NAME}}, or $$ for \
                 a dollar sign"
            ));
        }
        match (lookup(name).filter(|v| !v.is_empty()), default) {
            (Some(value), _) => out.push_str(&value),
            (None, Some(default)) => out.push_str(default),
            (None, None) => {
                return Err(format!(
                    "environment variable {name} in \"{text}\" is not set; set it, or write \
                     ${{{name}:-default}}"
                ));
            }
        }
        rest = after;
    }
    out.push_str(rest);
    Ok(out)
}

/// The path `text` as named in the file `from`.
///
/// # Errors
/// As [`expand`].
pub fn resolve(text: &str, from: &Path) -> Result<PathBuf, String> {
    let expanded = expand(text, |name| std::env::var(name).ok())?;
    Ok(from.parent().unwrap_or(Path::new("")).join(expanded))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lookup(name: &str) -> Option<String> {
        match name {
            "MODELS" => Some("/m".into()),
            "EMPTY" => Some(String::new()),
            _ => None,
        }
    }

    #[test]
    fn variables() {
        let ok = |s: &str| expand(s, lookup).unwrap();
        assert_eq!(ok("a/b.obj"), "a/b.obj");
        assert_eq!(ok("$MODELS/x"), "/m/x");
        assert_eq!(ok("${MODELS}x"), "/mx");
        assert_eq!(ok("${NONE:-../d}/x"), "../d/x");
        assert_eq!(ok("${EMPTY:-d}"), "d");
        assert_eq!(ok("${MODELS:-d}"), "/m");
        assert_eq!(ok("5$$"), "5$");
        assert!(expand("$NONE/x", lookup).unwrap_err().contains("NONE in \"$NONE/x\" is not set"));
        assert!(expand("${MODELS", lookup).unwrap_err().contains("closing brace"));
        assert!(expand("$/x", lookup).is_err());
    }

    #[test]
    fn relative_to_the_naming_file() {
        assert_eq!(
            resolve("m/a.obj", Path::new("scenes/s.toml")).unwrap(),
            Path::new("scenes/m/a.obj")
        );
        assert_eq!(resolve("/abs.obj", Path::new("scenes/s.toml")).unwrap(), Path::new("/abs.obj"));
        assert_eq!(resolve("a.obj", Path::new("s.toml")).unwrap(), Path::new("a.obj"));
    }
}
