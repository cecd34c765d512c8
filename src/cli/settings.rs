//! `nearfar settings`: the reference of all settings.

use clap::Args;

use crate::config::{RenderConfig, renamed};
use crate::error::{Error, Result};
use crate::settings::{Group, Setting, nearest, page};

/// Options of `nearfar settings`.
#[derive(Debug, Args)]
pub(super) struct SettingsArgs {
    /// Only settings with this text in their key, or else in their meaning.
    pattern: Option<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Print the page docs/guide/settings.md.
    #[arg(long, conflicts_with_all = ["json", "pattern"])]
    markdown: bool,
}

/// # Errors
/// A pattern that no setting has.
pub(super) fn settings(args: &SettingsArgs) -> Result<()> {
    let groups = RenderConfig::reference();
    if args.markdown {
        print!("{}", page(&groups));
        return Ok(());
    }
    let found = matching(groups, args.pattern.as_deref().unwrap_or_default())?;
    if args.json {
        let text = serde_json::to_string_pretty(&found)
            .map_err(|e| Error::Render(format!("the list cannot be written: {e}")))?;
        println!("{text}");
    } else {
        print!("{}", aligned(&found));
    }
    Ok(())
}

fn matching(groups: Vec<Group>, pattern: &str) -> Result<Vec<Setting>> {
    let wanted = pattern.to_lowercase();
    let all: Vec<Setting> = groups.into_iter().flat_map(|g| g.settings).collect();
    let in_key = |s: &&Setting| s.key.contains(&wanted);
    let in_meaning = |s: &&Setting| s.meaning.to_lowercase().contains(&wanted);
    let mut found: Vec<Setting> = all.iter().filter(in_key).cloned().collect();
    if found.is_empty() {
        found = all.iter().filter(in_meaning).cloned().collect();
    }
    if let (true, Some(now)) = (found.is_empty(), renamed(&wanted)) {
        return Err(Error::setting(wanted, now));
    }
    if found.is_empty() {
        let names = all.iter().flat_map(|s| [s.key.as_str()].into_iter().chain(s.key.split('.')));
        let meant = nearest(&wanted, names)
            .map_or_else(String::new, |meant| format!("; did you mean \"{meant}\"?"));
        return Err(Error::Usage(format!("settings: none has \"{pattern}\"{meant}")));
    }
    Ok(found)
}

/// One line a setting: key, type, default, range, unit; its meaning, and the words of a choice,
/// below, since they are sentences.
fn aligned(settings: &[Setting]) -> String {
    let of = |s: &Setting| {
        let words: Vec<&str> = s.choices.iter().map(|c| c.name).collect();
        let range = if words.is_empty() { s.range.clone() } else { words.join(", ") };
        [s.key.clone(), s.kind.to_owned(), s.default.clone(), range, s.unit.to_owned()]
    };
    let head = ["key", "type", "default", "range", "unit"].map(str::to_owned);
    let rows: Vec<[String; 5]> = settings.iter().map(of).collect();
    let wide = |i: usize| {
        let of_row = |row: &[String; 5]| row[i].chars().count();
        rows.iter().chain([&head]).map(of_row).max().unwrap_or_default().min(WIDEST)
    };
    let widths: Vec<usize> = (0..5).map(wide).collect();
    let line = |row: &[String; 5]| {
        let cells: Vec<String> =
            row.iter().zip(&widths).map(|(text, &width)| format!("{text:width$}")).collect();
        format!("{}\n", cells.join("  ").trim_end())
    };
    let meaning = |s: &Setting| format!("    {}\n", s.meaning);
    let below = settings.iter().zip(&rows).map(|(s, row)| line(row) + &meaning(s));
    [line(&head)].into_iter().chain(below).collect()
}

/// Columns of a cell before it pushes the next ones aside.
const WIDEST: usize = 32;
