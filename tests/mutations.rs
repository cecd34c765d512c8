//! Every reader on the files of `fuzz/corpus` and on changed copies of them: bytes flipped, cut
//! out, doubled and replaced by extreme numbers or by characters that mean something. A reader
//! reads them or says what is wrong, and takes no memory that the file cannot fill.
//!
//! The corpus holds good files, from which the others are made, and files that once went wrong
//! (`fault-…`). `make fuzz` searches further with the same functions.

use std::path::Path;

use nearfar::sampling::{Rng, Stream};

use crate::support::readers::{READERS, clean};

/// Changed copies of each file.
const CASES: u64 = 150;
const EXTREMES: [u32; 8] =
    [0, 1, u32::MAX, 1 << 31, 0x7fff_ffff, 1 << 30, 0x7f80_0000, 0xffc0_0000];
const MEANING: &[u8] = b"0123456789-+./ \n\tefvnaxi#\"[]{}=$\\\0\xff";

/// One to six changes, by the number of the case.
fn mutated(good: &[u8], case: u64) -> Vec<u8> {
    let mut bytes = good.to_vec();
    let mut rng = Rng::new(7, Stream::Test, case, 0);
    for _ in 0..=rng.below(6) {
        if bytes.len() < 8 {
            break;
        }
        let at = rng.below(bytes.len() - 4);
        let end = (at + 1 + rng.below((bytes.len() - at).min(40))).min(bytes.len());
        match rng.below(8) {
            0 => bytes[at] ^= 1 << rng.below(8),
            1 => bytes[at] = rng.next_u64() as u8,
            2 => bytes[at..at + 4].copy_from_slice(&EXTREMES[rng.below(8)].to_le_bytes()),
            3 => drop(bytes.drain(at..end)),
            4 => {
                let again = bytes[at..end].to_vec();
                drop(bytes.splice(at..at, again));
            }
            5 => bytes[at] = MEANING[rng.below(MEANING.len())],
            6 => bytes.insert(at, MEANING[rng.below(MEANING.len())]),
            _ => bytes.truncate(at.max(bytes.len() / 2)),
        }
    }
    bytes
}

/// The files of a reader's corpus by name, in order.
fn corpus(reader: &str) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(reader);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{reader}: {e}"));
    let mut files: Vec<(String, Vec<u8>)> = entries
        .map(|entry| entry.unwrap().path())
        .map(|path| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            (name, std::fs::read(&path).unwrap())
        })
        .collect();
    files.sort();
    files
}

/// Good files are read, and those that once went wrong are read or told.
#[test]
fn the_corpus_is_read() {
    for (reader, read) in READERS {
        let files = corpus(reader);
        assert!(files.iter().any(|(name, _)| !name.starts_with("fault-")), "{reader}: no file");
        for (name, bytes) in files {
            match read(&bytes) {
                Ok(()) => {}
                Err(e) if name.starts_with("fault-") => {
                    assert_eq!(e.exit_code(), 2, "{reader}/{name}: {e}");
                }
                Err(e) => panic!("{reader}/{name}: {e}"),
            }
        }
    }
    clean();
}

/// No reader panics, and none believes everything: of each, some copies are read and some not.
#[test]
fn changed_files_are_read_or_told() {
    for (reader, read) in READERS {
        let (mut accepted, mut refused) = (0, 0);
        for (name, good) in corpus(reader) {
            for case in 0..CASES {
                match read(&mutated(&good, case)) {
                    Ok(()) => accepted += 1,
                    Err(e) => {
                        refused += 1;
                        let told = e.exit_code() == 2 && !e.to_string().is_empty();
                        assert!(told, "{reader}/{name}, change {case}: {e}");
                    }
                }
            }
        }
        assert!(accepted > 0 && refused > 0, "{reader}: {accepted} read, {refused} refused");
    }
    clean();
}

/// What is changed in the rows of a cloud is known by its checksum; only the header has slack.
#[test]
fn changed_clouds_are_noticed() {
    let (_, read) = READERS.into_iter().find(|(name, _)| *name == "cloud").unwrap();
    let good = corpus("cloud").into_iter().find(|(name, _)| name == "baked.ply").unwrap().1;
    let accepted = (0..400).filter(|&case| read(&mutated(&good, case)).is_ok()).count();
    assert!(accepted < 100, "{accepted} of 400 changed clouds were read");
    clean();
}
