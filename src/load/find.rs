//! Files that models name, where they really are.
//!
//! Models are moved from machine to machine, and the paths in them are not. A name is tried as it
//! stands, then without regard to case, then by its file name alone in the folder of the file that
//! names it and in the scene's `search_paths`.

use std::path::{Path, PathBuf};

/// A file, and whether it is elsewhere than its name says.
#[derive(Debug, PartialEq)]
pub struct Found {
    /// The file.
    pub path: PathBuf,
    /// It was found by its file name alone.
    pub elsewhere: bool,
}

/// Looks for `name` from `folder`. Backslashes count as slashes.
pub fn find(name: &str, folder: &Path, search_paths: &[PathBuf]) -> Option<Found> {
    let name = name.replace('\\', "/");
    let as_named = folder.join(&name);
    let here = |path| Found { path, elsewhere: false };
    if as_named.is_file() {
        return Some(here(as_named));
    }
    if let Some(path) = without_case(folder, Path::new(&name)) {
        return Some(here(path));
    }
    let last = Path::new(name.rsplit('/').next()?);
    let mut folders = std::iter::once(folder).chain(search_paths.iter().map(PathBuf::as_path));
    let path = folders.find_map(|folder| without_case(folder, last))?;
    Some(Found { path, elsewhere: true })
}

/// The file that a relative path names if case does not count; the first in order of names.
fn without_case(folder: &Path, path: &Path) -> Option<PathBuf> {
    if path.is_absolute() {
        return None;
    }
    let start = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let found = path.components().try_fold(start.to_path_buf(), |folder, part| {
        let exact = folder.join(part);
        if exact.exists() {
            return Some(exact);
        }
        let wanted = part.as_os_str().to_str()?.to_lowercase();
        let entries = std::fs::read_dir(&folder).ok()?.flatten();
        let same = |name: &std::ffi::OsString| {
            name.to_str().is_some_and(|name| name.to_lowercase() == wanted)
        };
        let name = entries.map(|entry| entry.file_name()).filter(same).min()?;
        Some(folder.join(name))
    })?;
    found.is_file().then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_named_without_case_and_elsewhere() {
        let root = std::env::temp_dir().join(format!("nearfar-find-{}", std::process::id()));
        for file in ["m/Tex/Wood.PNG", "m/b.png", "more/c.png"] {
            let path = root.join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        let (m, more) = (root.join("m"), [root.join("more")]);
        let at = |name: &str| find(name, &m, &more).map(|f| (f.path, f.elsewhere));
        assert_eq!(at("b.png"), Some((m.join("b.png"), false)));
        assert_eq!(at("tex\\wood.png"), Some((m.join("Tex/Wood.PNG"), false)));
        assert_eq!(at("C:\\Users\\me\\B.png"), Some((m.join("b.png"), true)));
        assert_eq!(at("/home/me/C.png"), Some((root.join("more/c.png"), true)));
        assert_eq!(at("d.png"), None);
        assert_eq!(at("Tex"), None);
        std::fs::remove_dir_all(&root).unwrap();
    }
}
