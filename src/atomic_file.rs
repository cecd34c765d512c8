//! Files that are written whole or not at all.
//!
//! Everything that nearfar writes goes through here: a temporary file is filled in the folder of
//! the wanted one, flushed to the disk and renamed over it. A write that fails, panics or is
//! killed leaves the earlier file as it was; in the first two cases the temporary file is removed
//! as well. Two writers of the same path do not mix: the later rename wins.
//!
//! A temporary file has a short name of its own, `.nearfar-PROCESS-NUMBER.part`, and is locked by
//! its writer. [`check`], which says before long work whether its outcome can be written, removes
//! those in the same folder that nobody holds any more. [`rescued`] puts what cannot be written
//! after all somewhere else.
//!
//! A path that is a symbolic link keeps being one: the file that it names is replaced, or made.
//! What is no regular file (`/dev/null`, a pipe) is written directly, since it cannot be replaced.
//! Permissions of the earlier file are not kept; one that is read-only is not replaced.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use crate::error::{Error, Result};

/// Buffer of a file that is written piece by piece.
const BUFFER: usize = 1 << 18;
/// Bytes that a folder is tried with.
const TRIAL: usize = 1 << 16;
/// Age of a temporary file from which nobody can be about to lock it.
const SETTLED: Duration = Duration::from_secs(2);
/// Most symbolic links to symbolic links.
const MOST_LINKS: usize = 40;

/// Temporary files that this process is filling.
static OPEN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Lets `fill` write the content of the file at `path`.
///
/// # Errors
/// [`Error::Write`] when `fill` fails or the system refuses; the earlier file is then still there.
pub fn write(path: &Path, fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<()> {
    replace(path, fill).map_err(|source| Error::Write { path: path.into(), source, rescue: None })
}

/// Writes `content` as the file at `path`.
///
/// # Errors
/// As [`write()`].
pub fn write_bytes(path: &Path, content: impl AsRef<[u8]>) -> Result<()> {
    write(path, |out| out.write_all(content.as_ref()))
}

/// Says whether a file can be written, before hours are spent on its content; removes what killed
/// writers left in its folder.
///
/// # Errors
/// [`Error::Input`] with what is in the way.
pub fn check(path: &Path) -> Result<()> {
    let fault = |message: String| Error::input(path, None, message);
    let target = target(path).map_err(|e| fault(e.to_string()))?;
    let tried = if is_special(&target) {
        device(&target).map(drop)
    } else {
        folder_of(&target).map_err(|e| fault(e.to_string())).map(sweep)?;
        Temporary::beside(&target).and_then(|(_temporary, mut file)| {
            file.write_all(&[0; TRIAL])?;
            file.sync_all()
        })
    };
    tried.map_err(|e| fault(format!("cannot be written: {e}")))
}

/// Writes to `path` by `write`; where that is not possible any more, to another place.
///
/// # Errors
/// As `write`; [`Error::Write`] tells the other place.
pub fn rescued(path: &Path, write: impl Fn(&Path) -> Result<()>) -> Result<()> {
    let (path, source) = match write(path) {
        Err(Error::Write { path, source, .. }) => (path, source),
        other => return other,
    };
    let mut name = std::ffi::OsString::from(format!("nearfar-rescue-{}", std::process::id()));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    let folders = [path.parent().map(Path::to_owned), Some(std::env::temp_dir())];
    let folders = folders.into_iter().flatten().chain(std::env::current_dir());
    let mut files = folders.map(|folder| folder.join(&name)).filter(|file| !file.exists());
    let rescue = files.find(|file| write(file).is_ok());
    Err(Error::Write { path, source, rescue })
}

/// Removes the temporary files that are being filled: for a process that ends at once.
pub fn abandon() {
    let open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    open.iter().for_each(|path| drop(fs::remove_file(path)));
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
        let folder = folder_of(target)?;
        loop {
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!(".nearfar-{}-{number}.part", std::process::id()));
            let file = match File::create_new(&path) {
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => continue,
                other => other?,
            };
            // Where there are no locks, nothing is swept either.
            drop(file.try_lock());
            OPEN.lock().unwrap_or_else(PoisonError::into_inner).push(path.clone());
            return Ok((Self { path, named: false }, file));
        }
    }

    fn rename(mut self, target: &Path) -> io::Result<()> {
        fs::rename(&self.path, target)?;
        self.named = true;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        OPEN.lock().unwrap_or_else(PoisonError::into_inner).retain(|path| *path != self.path);
        if !self.named {
            drop(fs::remove_file(&self.path));
        }
    }
}

/// Removes temporary files whose writers are gone.
fn sweep(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if !(name.starts_with(".nearfar-") && name.ends_with(".part")) {
            continue;
        }
        let age = entry.metadata().and_then(|m| m.modified()).ok().and_then(|t| t.elapsed().ok());
        let left = |path: &Path| File::open(path).is_ok_and(|file| file.try_lock().is_ok());
        if age.is_some_and(|age| age > SETTLED) && left(&entry.path()) {
            drop(fs::remove_file(entry.path()));
        }
    }
}

/// Where the content of a path goes: through symbolic links, which need not lead to a file yet.
fn target(path: &Path) -> io::Result<PathBuf> {
    let refuse = |message: &str| Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    let mut target = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::symlink_metadata(&target) {
            Ok(there) if there.is_symlink() => {
                let link = fs::read_link(&target)?;
                target = target.parent().map_or_else(|| link.clone(), |folder| folder.join(&link));
            }
            Ok(there) if there.is_dir() => {
                return refuse("is a folder: give the name of a file in it");
            }
            Ok(there) if there.is_file() && there.permissions().readonly() => {
                return refuse("is read-only: remove it, or give another name");
            }
            Err(error) if error.kind() == io::ErrorKind::InvalidFilename => return Err(error),
            _ => return Ok(target),
        }
    }
    refuse("is a symbolic link that leads nowhere")
}

/// The folder of a file.
fn folder_of(target: &Path) -> io::Result<&Path> {
    let (Some(_), Some(folder)) = (target.file_name(), target.parent()) else {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "names no file"));
    };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    if folder.is_dir() {
        return Ok(folder);
    }
    let fix = if folder.exists() { "is a file" } else { "does not exist: create it first" };
    Err(io::Error::new(io::ErrorKind::NotFound, format!("folder {} {fix}", folder.display())))
}

/// Whether there is something at a path that is no regular file.
fn is_special(target: &Path) -> bool {
    fs::metadata(target).is_ok_and(|there| !there.is_file())
}

/// Opens what is no regular file; readable too where it can be, as temporary files are.
fn device(target: &Path) -> io::Result<File> {
    let mut options = File::options();
    options.write(true);
    options.clone().read(true).open(target).or_else(|_| options.open(target))
}

fn replace(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let target = target(path)?;
    if is_special(&target) {
        let mut out = BufWriter::with_capacity(BUFFER, device(&target)?);
        return fill(&mut out).and_then(|()| out.flush());
    }
    let (temporary, file) = Temporary::beside(&target)?;
    let mut out = BufWriter::with_capacity(BUFFER, file);
    fill(&mut out)?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.sync_all()?;
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
        assert_eq!(
            error.unwrap_err().to_string(),
            format!("{}: cannot be written: the disk is full", path.display())
        );
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
    fn names_as_long_as_the_system_has_them_can_be_written() {
        let folder = Folder::new("long");
        let longest = "x".repeat(255);
        check(&folder.0.join(&longest)).unwrap();
        write_bytes(&folder.0.join(&longest), "x").unwrap();
        assert_eq!(folder.names(), [longest.as_str()]);
        assert!(check(&folder.0.join(longest.clone() + "x")).is_err());
        assert!(write_bytes(&folder.0.join(longest + "x"), "x").is_err());
        assert_eq!(folder.names().len(), 1);
    }

    #[test]
    fn what_is_in_the_way_is_told_before() {
        let folder = Folder::new("check");
        let at = |name: &str| folder.0.join(name);
        write_bytes(&at("kept"), "old").unwrap();
        let mut mode = fs::metadata(at("kept")).unwrap().permissions();
        mode.set_readonly(true);
        fs::set_permissions(at("kept"), mode).unwrap();
        fs::create_dir(at("inner")).unwrap();
        for (name, reason) in [
            ("kept", "is read-only"),
            ("inner", "is a folder"),
            ("absent/a", "absent does not exist: create it first"),
            ("kept/a", "kept is a file"),
        ] {
            let said = check(&at(name)).unwrap_err();
            assert!(said.to_string().contains(reason) && said.exit_code() == 2, "{said}");
            let said = write_bytes(&at(name), "new").unwrap_err();
            assert!(said.to_string().contains(reason) && said.exit_code() == 3, "{said}");
        }
        assert_eq!(fs::read(at("kept")).unwrap(), b"old");
        check(&at("new")).unwrap();
        assert_eq!(folder.names().len(), 2, "{:?}", folder.names());
    }

    #[test]
    fn only_what_nobody_holds_is_swept() {
        let folder = Folder::new("sweep");
        let old = std::time::SystemTime::now() - 2 * SETTLED;
        let (left, held, new) = (".nearfar-1-0.part", ".nearfar-1-1.part", ".nearfar-1-2.part");
        let make = |name: &str| File::create(folder.0.join(name)).unwrap();
        make(left).set_modified(old).unwrap();
        make(new);
        make("other.part").set_modified(old).unwrap();
        let file = make(held);
        file.set_modified(old).unwrap();
        file.lock().unwrap();
        check(&folder.0.join("a.exr")).unwrap();
        let mut names = folder.names();
        names.sort();
        assert_eq!(names, [held, new, "other.part"]);
    }

    #[test]
    fn what_cannot_be_written_is_rescued() {
        let folder = Folder::new("rescue");
        let wanted = folder.0.join("picture.exr");
        fs::create_dir(&wanted).unwrap();
        let error = rescued(&wanted, |path| write_bytes(path, "hours")).unwrap_err();
        let Error::Write { rescue: Some(file), .. } = &error else { panic!("{error}") };
        assert_eq!(fs::read(file).unwrap(), b"hours");
        assert!(error.to_string().ends_with(&format!("saved as {}", file.display())), "{error}");
        rescued(&folder.0.join("b"), |path| write_bytes(path, "x")).unwrap();
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
        fs::remove_file(&file).unwrap();
        write_bytes(&link, "again").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"again");
        write_bytes(Path::new("/dev/null"), "nothing").unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }
}
