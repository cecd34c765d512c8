//! The reference as a page of Markdown.

use std::fmt::Write;

use super::{Group, Setting};

/// Columns of the page.
const WIDTH: usize = 100;

/// The page of all settings, wrapped at 100 columns.
pub fn page(groups: &[Group]) -> String {
    let mut out = String::from(HEAD);
    for group in groups {
        let _ = match group.name {
            "" => writeln!(out, "\n## Without a section\n"),
            name => writeln!(out, "\n## `[{name}]`\n"),
        };
        out.push_str(&wrapped(&group.meaning, ""));
        for setting in &group.settings {
            out.push_str(&of(setting));
        }
    }
    out
}

const HEAD: &str = "\
# Settings

Every setting that a picture can be made with. In a scene file it stands in a section,

```toml
[settings.path]
spp = 64
```

on the command line it is `--set path.spp=64`, and `nearfar settings PATTERN` looks it up. Later
wins: defaults, `--quality`, the scene file, `--set`, an option of its own such as `--spp`. A
setting that *follows* another does so until it is set. A length is a number in scene units (`0.5`,
`inf`) or a percentage of the scene's extent (`\"2%\"`).

This page is made from the source text; write it anew with
`nearfar settings --markdown > docs/guide/settings.md`.
";

fn of(setting: &Setting) -> String {
    let Setting { key, kind, default, range, unit, meaning, choices } = setting;
    let mut facts = vec![(*kind).to_owned()];
    facts.extend((!range.is_empty()).then(|| range.clone()));
    facts.extend((!unit.is_empty()).then(|| format!("in {unit}")));
    facts.push(match default.strip_prefix("follows: ") {
        Some(other) => format!("follows {other}"),
        None => format!("default `{default}`"),
    });
    let mut out = format!("\n### `{key}`\n\n");
    out.push_str(&wrapped(&format!("*{}.* {meaning}", capital(&facts.join("; "))), ""));
    if !choices.is_empty() {
        out.push('\n');
    }
    for choice in choices {
        let text = format!("- `{}`: {}", choice.name, choice.meaning.trim());
        out.push_str(&wrapped(&text, "  "));
    }
    out
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |c| c.to_uppercase().chain(letters).collect())
}

/// The words in lines, all but the first indented.
fn wrapped(text: &str, indent: &str) -> String {
    let (mut out, mut column) = (String::new(), 0);
    for word in text.split_whitespace() {
        let long = word.chars().count();
        if column > 0 && column + 1 + long > WIDTH {
            let _ = write!(out, "\n{indent}");
            column = indent.len();
        } else if column > 0 {
            out.push(' ');
            column += 1;
        }
        out.push_str(word);
        column += long;
    }
    out.push('\n');
    out
}
