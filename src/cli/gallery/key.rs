//! What a picture of the gallery depends on, as a text beside it: equal texts, equal pictures.
//!
//! The text holds the program's version, the committed sources that make geometry and light (by
//! their names in git, where it is there), what the picture is told, its size, and a hash of every
//! file of its scene. Changes that are not committed are not seen.

use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;

use super::plan::{Picture, Plan, TRUTH};
use crate::atomic_file;
use crate::error::Result;
use crate::input_file;

/// Rooms that decide what ground truths look like.
const OF_TRUTHS: [&str; 4] = ["src/scene", "src/builtin", "src/shading", "src/method/path"];
/// Rooms that decide what the other pictures look like.
const OF_PICTURES: [&str; 8] = [
    "src/scene",
    "src/builtin",
    "src/shading",
    "src/method",
    "src/photon",
    "src/proxy",
    "src/cloud",
    "src/record",
];

/// Names of the committed sources.
#[derive(Debug)]
pub(super) struct Sources {
    of_truths: String,
    of_pictures: String,
}

impl Sources {
    /// Asks git; nothing where there is none.
    pub(super) fn read() -> Self {
        let name = |room: &&str| {
            let tree = Command::new("git").args(["rev-parse", &format!("HEAD:{room}")]).output();
            let tree = tree.ok().filter(|o| o.status.success())?.stdout;
            Some(format!("{room} {}", String::from_utf8_lossy(&tree)))
        };
        let names = |rooms: &[&str]| rooms.iter().filter_map(name).collect::<String>();
        Self { of_truths: names(&OF_TRUTHS), of_pictures: names(&OF_PICTURES) }
    }
}

/// All that a picture depends on.
#[derive(Debug)]
pub(super) struct Key(String);

impl Key {
    /// # Errors
    /// [`Error::Io`] when a file of the scene cannot be read.
    pub(super) fn new(picture: &Picture, plan: &Plan, sources: &Sources) -> Result<Self> {
        let made = if picture.name == TRUTH { &sources.of_truths } else { &sources.of_pictures };
        let (width, height) = plan.size_of(picture.scene);
        let mut text = format!(
            "nearfar {}\n{made}{} {}\n{width}x{height}\n",
            env!("CARGO_PKG_VERSION"),
            picture.command,
            picture.options.join(" ")
        );
        for file in picture.scene.files()? {
            let content = input_file::read(&file)?;
            let mut hash = DefaultHasher::new();
            hash.write(&content);
            text += &format!("{:016x} {}\n", hash.finish(), file.display());
        }
        Ok(Self(text))
    }

    /// True when the picture `at` (a path without extension) is there and was made by this key.
    pub(super) fn is_done(&self, at: &Path) -> bool {
        with(at, "exr").is_file() && self.is_in(&with(at, "key"))
    }

    /// True when the picture was begun by this key.
    pub(super) fn is_begun(&self, at: &Path) -> bool {
        self.is_in(&with(at, "begun"))
    }

    fn is_in(&self, file: &Path) -> bool {
        input_file::read_text(file).is_ok_and(|text| text == self.0)
    }

    /// Notes that the picture is begun.
    ///
    /// # Errors
    /// [`Error::Write`] when the system refuses.
    pub(super) fn begin(&self, at: &Path) -> Result<()> {
        drop(std::fs::remove_file(with(at, "key")));
        atomic_file::write_bytes(&with(at, "begun"), &self.0)
    }

    /// Notes that the picture is done.
    ///
    /// # Errors
    /// [`Error::Write`] when the system refuses.
    pub(super) fn end(&self, at: &Path) -> Result<()> {
        atomic_file::write_bytes(&with(at, "key"), &self.0)?;
        drop(std::fs::remove_file(with(at, "begun")));
        Ok(())
    }
}

/// A file beside a picture. (Names hold dots: `alpha-0.5`.)
pub(super) fn with(at: &Path, extension: &str) -> PathBuf {
    let mut name = at.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    name.into()
}
