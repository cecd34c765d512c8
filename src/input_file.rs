//! Files that are read: only regular ones, and only such as memory can hold.
//!
//! Opening a pipe waits for a writer that may never come, and a device may never end; both are
//! refused before they are opened. Everything that the user names and that is read whole or through
//! a reader of ours goes through here.

use std::fs::File;
use std::path::Path;

use crate::error::{Error, Result};
use crate::memory;

/// Checks that there is a regular file, and gives its length in bytes.
///
/// # Errors
/// [`Error::Io`] when there is none or it may not be looked at; [`Error::Input`] when it is a
/// folder, a pipe or a device.
pub fn check(path: &Path) -> Result<u64> {
    let found =
        std::fs::metadata(path).map_err(|source| Error::Io { path: path.into(), source })?;
    if found.is_dir() {
        return Err(Error::input(path, None, "is a folder; give a file"));
    }
    if !found.is_file() {
        return Err(Error::input(
            path,
            None,
            "is a pipe or a device; save it as a file and give that",
        ));
    }
    Ok(found.len())
}

/// Opens a file.
///
/// # Errors
/// As [`check`], and [`Error::Io`] when the system refuses.
pub fn open(path: &Path) -> Result<File> {
    check(path)?;
    File::open(path).map_err(|source| Error::Io { path: path.into(), source })
}

/// Reads a whole file.
///
/// # Errors
/// As [`open`]; [`Error::Input`] when it is larger than the memory.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let length = check(path)?;
    if !memory::fits(length as f64) {
        let size = memory::size(length as f64);
        return Err(Error::input(path, None, format!("has {size}, more than memory holds")));
    }
    std::fs::read(path).map_err(|source| Error::Io { path: path.into(), source })
}

/// Reads a whole file of text.
///
/// # Errors
/// As [`read`]; [`Error::Input`] when it is not UTF-8.
pub fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(read(path)?)
        .map_err(|_| Error::input(path, None, "is not UTF-8 text; save it as UTF-8"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_are_read() {
        let told = |path: &Path| read(path).unwrap_err().to_string();
        assert!(told(&std::env::temp_dir()).contains("is a folder"));
        assert!(matches!(read(Path::new("/no/such")), Err(Error::Io { .. })));
        let device = Path::new("/dev/zero");
        if device.exists() {
            assert!(told(device).contains("is a pipe or a device"));
        }
    }
}
