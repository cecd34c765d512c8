//! Files that are written whole or not at all.
//!
//! Everything that nearfar writes goes through here: a temporary file is filled in the folder of
//! the wanted one, flushed to the disk and renamed over it. A write that fails, panics or is
//! killed leaves the earlier file as it was; in the first two cases the temporary file is removed
//! as well. Two writers of the same path do not mix: the later rename wins.
//!
//! A path that is a symbolic link keeps being one: the file that it names is replaced. What is no
//! regular file (`/dev/null`, a pipe) is written directly, since it cannot be replaced. Permissions
//! of the earlier file are not kept.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};

/// Buffer of a file that is written piece by piece.
const BUFFER: usize = 1 << 18;

/// Lets `fill` write the content of the file at `path`.
///
/// # Errors
/// [`Error::Io`] when `fill` fails or the system refuses; the earlier file is then still there.
pub fn write(path: &Path, fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<()> {
    replace(path, fill).map_err(|source| Error::Io { path: path.into(), source })
}

/// Writes `content` as the file at `path`.
///
/// # Errors
/// As [`write()`].
pub fn write_bytes(path: &Path, content: impl AsRef<[u8]>) -> Result<()> {
    write(path, |out| out.write_all(content.as_ref()))
}

/// A file that is removed unless it gets its name.
struct Temporary {
    path: PathBuf,
    named: bool,
}

impl Temporary {
    /// A new file in the folder of `target`.
    fn beside(target: &Path) -> io::Result<(Self, File)> {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        let Some(name) = target.file_name() else {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, "names no file"));
        };
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let mut hidden = std::ffi::OsString::from(".");
        hidden.push(name);
        hidden.push(format!(".{}-{number}.part", std::process::id()));
        let path = target.with_file_name(hidden);
        let file = File::create(&path)?;
        Ok((Self { path, named: false }, file))
    }

    fn rename(mut self, target: &Path) -> io::Result<()> {
        fs::rename(&self.path, target)?;
        self.named = true;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.named {
            drop(fs::remove_file(&self.path));
        }
    }
}

fn replace(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let earlier = fs::metadata(path);
    if earlier.as_ref().is_ok_and(|m| !m.is_file() && !m.is_dir()) {
        let mut out = BufWriter::with_capacity(BUFFER, File::options().write(true).open(path)?);
        return fill(&mut out).and_then(|()| out.flush());
    }
    let target = if earlier.is_ok() { fs::canonicalize(path)? } else { path.to_owned() };
    let (temporary, file) = Temporary::beside(&target)?;
    let mut out = BufWriter::with_capacity(BUFFER, file);
    fill(&mut out)?;
    out.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()?;
    temporary.rename(&target)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let folder =
                std::env::temp_dir().join(format!("nearfar-atomic-{}-{name}", std::process::id()));
            fs::create_dir_all(&folder).unwrap();
            Self(folder)
        }
        fn names(&self) -> Vec<String> {
            let entries = fs::read_dir(&self.0).unwrap();
            entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect()
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            fs::remove_dir_all(&self.0).unwrap();
        }
    }

    #[test]
    fn a_write_that_fails_leaves_the_earlier_file_and_no_other() {
        let folder = Folder::new("fails");
        let path = folder.0.join("a.txt");
        write_bytes(&path, "first").unwrap();
        let error = write(&path, |out| {
            out.write_all(&vec![b'x'; 2 * BUFFER])?;
            Err(io::Error::other("the disk is full"))
        });
        assert_eq!(error.unwrap_err().to_string(), format!("{}: the disk is full", path.display()));
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert_eq!(folder.names(), ["a.txt"]);
        let panicked = std::panic::catch_unwind(|| {
            write(&path, |out| {
                out.write_all(b"second")?;
                panic!("in the middle")
            })
        });
        assert!(panicked.is_err() && fs::read(&path).unwrap() == b"first");
        assert_eq!(folder.names(), ["a.txt"]);
        write_bytes(&path, "second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
    }

    #[test]
    fn a_folder_is_not_replaced() {
        let folder = Folder::new("folder");
        let inner = folder.0.join("inner");
        fs::create_dir(&inner).unwrap();
        assert!(write_bytes(&inner, "x").is_err() && inner.is_dir());
        assert_eq!(folder.names(), ["inner"]);
        assert!(write_bytes(&folder.0.join("absent/a.txt"), "x").is_err());
    }

    #[test]
    #[cfg(unix)]
    fn links_stay_links_and_devices_devices() {
        let folder = Folder::new("links");
        let (file, link) = (folder.0.join("file"), folder.0.join("link"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_bytes(&link, "new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"new");
        write_bytes(Path::new("/dev/null"), "nothing").unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }
}
