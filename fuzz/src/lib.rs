//! What the fuzz targets share: the readers, which the stable tests call too, and the entry of a
//! target.

#[path = "../../tests/support/folder.rs"]
pub mod folder;
#[path = "../../tests/support/readers.rs"]
pub mod readers;

pub use libfuzzer_sys::fuzz_target;

thread_local! {
    static FOLDER: folder::Folder = readers::Reader::folder("fuzz");
}

/// Gives a reader some bytes.
pub fn look(reader: &str, bytes: &[u8]) {
    let known = readers::READERS.iter().find(|known| known.name == reader);
    let known = known.unwrap_or_else(|| panic!("there is no reader {reader}"));
    FOLDER.with(|folder| known.look(folder, bytes));
}

/// The fuzz target of a reader.
#[macro_export]
macro_rules! target {
    ($reader:literal) => {
        $crate::fuzz_target!(|bytes: &[u8]| $crate::look($reader, bytes));
    };
}
