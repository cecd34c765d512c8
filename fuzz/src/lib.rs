//! Fuzz targets of the readers: the functions that the stable tests call, on bytes that libFuzzer
//! makes up.
//!
//! A target is a reader's name; its corpus is `corpus/NAME`. What goes wrong is left by libFuzzer
//! in `artifacts/NAME`; once it is mended, the input belongs into the corpus as `fault-WHAT`, so
//! that the tests replay it. What may go wrong is a panic, a fault that the address sanitizer sees,
//! more than ten seconds or two gigabytes, and an error that is not the file's.

#[path = "../../tests/support/readers.rs"]
pub mod readers;

/// What a reader may take while it is fuzzed, in bytes, with what libFuzzer holds itself.
const MEMORY: u64 = 1_500_000_000;

/// Lets the reader of this name look at `bytes`.
///
/// # Panics
/// When there is none, and when the error is not of the file.
pub fn look(name: &str, bytes: &[u8]) {
    nearfar::memory::set_limit(MEMORY);
    let found = readers::READERS.iter().find(|(reader, _)| *reader == name);
    let (_, read) = found.expect("every target is a reader");
    if let Err(error) = read(bytes) {
        assert_eq!(error.exit_code(), 2, "{error}");
    }
}
