//! The folder of a film: frames that say in their headers whose they are.
//!
//! `nearfar.film` holds the mark of the film ([`crate::render::Shots::mark`]) and of how its frames
//! are written. Frames of another mark, or of none, are never mixed with those of this film: they
//! are refused, or made again and removed where the user says so.

use std::path::{Path, PathBuf};

use super::options::Job;
use super::picture::ImageOptions;
use crate::error::{Error, Result};
use crate::film::{Film, read_header, read_whole_exr};
use crate::sampling::Words;

/// Header attribute of the mark.
const MARK: &str = "nearfar.film";

/// A folder of frames.
pub(super) struct Shelf<'a> {
    folder: &'a Path,
    mark: String,
    image: &'a ImageOptions,
    replace: bool,
}

impl<'a> Shelf<'a> {
    pub(super) fn new(
        folder: &'a Path,
        mark: &str,
        image: &'a ImageOptions,
        replace: bool,
    ) -> Self {
        let mut written = Words(0);
        written.bytes(format!("{image:?}").as_bytes());
        Self { folder, mark: format!("{mark}-{:016x}", written.0), image, replace }
    }

    /// The file of a frame, 0-based.
    pub(super) fn frame(&self, i: usize) -> PathBuf {
        self.folder.join(format!("frame_{:04}.exr", i + 1))
    }

    fn is_own(&self, file: &Path) -> bool {
        read_header(file).is_ok_and(|h| h.get(MARK) == Some(&self.mark))
    }

    /// Every frame in the folder, with its number from 0.
    fn all(&self) -> Result<Vec<(usize, PathBuf)>> {
        let io = |source| Error::Io { path: self.folder.into(), source };
        let mut found = Vec::new();
        for entry in std::fs::read_dir(self.folder).map_err(io)? {
            let path = entry.map_err(io)?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let number = name.strip_prefix("frame_").and_then(|n| n.strip_suffix(".exr"));
            if let Some(i) = number.and_then(|n| n.parse::<usize>().ok()?.checked_sub(1)) {
                found.push((i, path));
            }
        }
        found.sort();
        Ok(found)
    }

    /// Refuses a folder that holds frames of another film.
    ///
    /// # Errors
    /// [`Error::Input`] with the first of them.
    pub(super) fn check(&self) -> Result<()> {
        self.all()?.iter().try_for_each(|(_, file)| self.may_replace(file))
    }

    fn may_replace(&self, file: &Path) -> Result<()> {
        if self.replace || !file.exists() || self.is_own(file) {
            return Ok(());
        }
        let message = "is a frame of another film, or of other settings: give another folder, or \
                       --replace";
        Err(Error::input(file, None, message))
    }

    /// How many frames from the first on are there, whole and of this film.
    pub(super) fn done(&self, frames: usize) -> usize {
        (0..frames).take_while(|&i| self.read(i).is_ok()).count()
    }

    /// A frame of this film.
    ///
    /// # Errors
    /// When it is not there, damaged, or of another film.
    pub(super) fn read(&self, i: usize) -> Result<Film> {
        let file = self.frame(i);
        let film = read_whole_exr(&file)?;
        let png = !self.image.png || file.with_extension("png").is_file();
        if film.header.get(MARK) == Some(&self.mark) && png {
            return Ok(film);
        }
        let message = "is not of this film any more: without --resume all frames are made again";
        Err(Error::input(&file, None, message))
    }

    /// Writes a frame, unless one of another film has come there meanwhile.
    ///
    /// # Errors
    /// As [`Self::check`]; when the system refuses.
    pub(super) fn write(&self, film: &mut Film, i: usize, job: &Job) -> Result<()> {
        let file = self.frame(i);
        self.may_replace(&file)?;
        film.header.insert(MARK.into(), self.mark.clone());
        self.image.write(film, &file, job)
    }

    /// Removes frames of other films beyond the last of this one, where they may be replaced.
    ///
    /// # Errors
    /// When the system refuses.
    pub(super) fn remove_beyond(&self, frames: usize) -> Result<()> {
        for (_, file) in self.all()?.into_iter().filter(|(i, _)| self.replace && *i >= frames) {
            drop(std::fs::remove_file(file.with_extension("png")));
            std::fs::remove_file(&file).map_err(|source| Error::Io { path: file, source })?;
        }
        Ok(())
    }
}
