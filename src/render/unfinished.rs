//! Jobs that are not progressive and yet outlive their process: what is made so far, as a file
//! beside the finished one.
//!
//! ```text
//! blocks of phases (crate::journal)  →  every `Checkpoint::every`  →  `Checkpoint::file`
//! file  →  `Kept::resume`  →  the same job again, without what the file has
//! ```
//! The file is an OpenEXR image like those of [`super::checkpoint`](mod@super::checkpoint), written
//! whole and with a checksum, but there is nothing to see in it: its one channel `state.bytes` has
//! three bytes in every value, a whole number below 2²⁴. The header has the version of the content
//! and the key of the job: a hash of the program's version, the scene, the camera, all settings,
//! the seed among them, and of the file that the job starts from.
//!
//! Guarantees  a job that was killed at whatever moment and gone on with has the bits of one that
//!             never stopped. A file that is damaged or of another job is refused.
//! Not         what lies before the kept phases: the scene is read, its ray structure, the proxy,
//!             guides, clusters and trees are made again, which takes seconds where the kept phases
//!             take minutes. The light of clusters is kept when all of it is there.
//! Cost        a job of 640×360 pixels keeps about 40 MB; as much memory.

use std::sync::Arc;

use super::Kept;
use crate::config::RenderConfig;
use crate::error::{Error, Result};
use crate::film::{self, Film, Precision, SUMS_OF};
use crate::input_file;
use crate::journal::{Blocks, Journal};
use crate::run::Run;
use crate::sampling::Words;
use crate::scene::{Fingerprint, Scene};

/// Version of the content.
const VERSION: &str = "1";
/// What such a file is, in the header.
const KIND: &str = "unfinished job";
const CONTENT: &str = "nearfar.content_version";
const KEY: &str = "nearfar.job_key";
const LENGTH: &str = "nearfar.bytes";
const CHANNEL: &str = "state.bytes";
/// Values in a row.
const WIDTH: usize = 1024;
/// Bytes in a value.
const BYTES: usize = 3;

/// What a job is known by; `name`: what it makes.
///
/// # Errors
/// When settings cannot be written as text, or the file it starts from cannot be read.
pub fn job_key(name: &str, scene: &Scene, config: &RenderConfig, kept: &Kept) -> Result<String> {
    let mut hash = Words(0);
    let (version, settings) = (env!("CARGO_PKG_VERSION"), config.to_table()?);
    let Scene { camera, origin, .. } = scene;
    let of_scene = Fingerprint::new(scene);
    let (backend, view) = (config.backend, format!("{camera:?} {origin:?}"));
    hash.bytes(format!("{version} {name} {of_scene} {view} {backend:?} {settings}").as_bytes());
    if let Some(path) = &kept.load {
        hash.bytes(&input_file::read(path)?);
    }
    Ok(format!("{:016x}", hash.0))
}

/// Runs a job that goes on from `kept.resume`, and leaves what it has made in `kept.checkpoint`:
/// now and then, and when it is interrupted.
///
/// # Errors
/// Those of the job; [`Error::Usage`] when the file is of another job, [`Error::Image`] when it is
/// damaged.
pub fn keeping<T>(
    run: &Run,
    kept: &Kept,
    key: impl FnOnce() -> Result<String>,
    job: impl FnOnce() -> Result<T>,
) -> Result<T> {
    let Some(checkpoint) = kept.checkpoint.clone() else { return job() };
    let key = key()?;
    let blocks = match &kept.resume {
        Some(file) => blocks_of(&film::read_whole_exr(file)?, &key)?,
        None => Blocks::default(),
    };
    let write = move |blocks: &Blocks| {
        let film = film_of(blocks, &key);
        film::write_exr(&film, &checkpoint.file, Precision::Full).map_err(|e| e.to_string())
    };
    let journal = Arc::new(Journal::new(blocks, checkpoint.every, Box::new(write)));
    let before = run.keep(Some(Arc::clone(&journal)));
    let done = job();
    run.keep(before);
    if !run.cancelled() {
        return done;
    }
    if !journal.is_empty()
        && let Err(message) = journal.write()
    {
        run.warn(format!("what is done so far is not kept: {message}"));
    }
    done.and(Err(Error::Interrupted))
}

fn film_of(blocks: &Blocks, key: &str) -> Film {
    let bytes = blocks.bytes();
    let height = bytes.len().div_ceil(BYTES).div_ceil(WIDTH).max(1);
    let mut values = Vec::with_capacity(WIDTH * height);
    values.extend(bytes.chunks(BYTES).map(|chunk| {
        let at = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        (at(0) | at(1) << 8 | at(2) << 16) as f32
    }));
    values.resize(WIDTH * height, 0.0);
    let mut film = Film::new(WIDTH as u32, height as u32);
    film.set(CHANNEL, values);
    for (name, value) in [
        (SUMS_OF, KIND),
        (CONTENT, VERSION),
        (KEY, key),
        (LENGTH, &bytes.len().to_string()),
        (film::COMPLETE, "false"),
    ] {
        film.header.insert(name.into(), value.into());
    }
    film
}

fn blocks_of(film: &Film, key: &str) -> Result<Blocks> {
    let other = |what: &str| Error::Usage(format!("cannot resume: {what}; start a new file"));
    let header = |name: &str| film.header.get(name).map_or("", String::as_str);
    if header(SUMS_OF) != KIND {
        return Err(other("the file was not left by a job of this kind"));
    }
    if header(CONTENT) != VERSION {
        return Err(other("the file was written by another version of this program"));
    }
    if header(KEY) != key {
        return Err(other(
            "the file is of another job: another scene, camera, method, seed, setting or version",
        ));
    }
    let damaged = || other("the file is damaged");
    let length: usize = header(LENGTH).parse().map_err(|_| damaged())?;
    let values = film.channels.get(CHANNEL).ok_or_else(damaged)?;
    let bytes = values.iter().flat_map(|&v| {
        let [a, b, c, _] = (v as u32).to_le_bytes();
        [a, b, c]
    });
    let bytes: Vec<u8> = bytes.take(length).collect();
    Blocks::from_bytes(&bytes).filter(|_| bytes.len() == length).ok_or_else(damaged)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_film_holds_all_bytes_and_tells_other_jobs() {
        let last = Arc::new(std::sync::Mutex::new(Blocks::default()));
        let kept = Arc::clone(&last);
        let write = move |blocks: &Blocks| {
            *kept.lock().unwrap() = blocks.clone();
            Ok(())
        };
        let run = Run::new(1).unwrap();
        let journal = Journal::new(Blocks::default(), Duration::ZERO, Box::new(write));
        run.keep(Some(Arc::new(journal)));
        let values = |_: &mut (), range: std::ops::Range<usize>| {
            range.map(|i| f32::from_bits(0x9e37_79b9u32.wrapping_mul(i as u32))).collect()
        };
        run.blocks("bits", (5000, 7), (), values).unwrap();
        let blocks = last.lock().unwrap().clone();
        let film = film_of(&blocks, "a");
        assert_eq!(blocks_of(&film, "a").unwrap(), blocks);
        assert_eq!(blocks_of(&film_of(&Blocks::default(), "a"), "a").unwrap(), Blocks::default());
        let refused = |film: &Film, key: &str| blocks_of(film, key).unwrap_err().to_string();
        assert!(refused(&film, "b").contains("another job"));
        let mut changed = film.clone();
        changed.header.insert(CONTENT.into(), "0".into());
        assert!(refused(&changed, "a").contains("another version"));
        changed = film.clone();
        changed.header.insert(SUMS_OF.into(), "path".into());
        assert!(refused(&changed, "a").contains("not left by a job of this kind"));
        changed = film;
        changed.header.insert(LENGTH.into(), "17".into());
        assert!(refused(&changed, "a").contains("damaged"));
    }
}
