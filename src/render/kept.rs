//! Work of one render that the next can start from: proxy and clusters, or cache records, or what
//! is there of a picture that is not done yet, in files.

use std::path::PathBuf;

use super::checkpoint::Checkpoint;
use crate::error::{Error, Result};
use crate::method::Method;

/// Files of kept work; all may be left out.
#[derive(Clone, Debug, Default)]
pub struct Kept {
    /// Start from this file, whatever camera it was made for; what it does not cover is computed.
    /// A file of another scene, of other settings or of another version is refused.
    pub load: Option<PathBuf>,
    /// Write here what a later render can start from.
    pub save: Option<PathBuf>,
    /// Go on from the running sums of this picture, or from what is made so far of it, as if its
    /// render had never stopped.
    pub resume: Option<PathBuf>,
    /// Where a render keeps what it has so far.
    pub checkpoint: Option<Checkpoint>,
}

impl Kept {
    /// # Errors
    /// [`Error::Usage`] when files are named and the method keeps nothing.
    pub fn check(&self, method: Method) -> Result<()> {
        if (self.load.is_some() || self.save.is_some()) && !method.keeps() {
            let keeping: Vec<&str> =
                Method::ALL.iter().filter(|m| m.keeps()).map(|m| m.name()).collect();
            return Err(Error::Usage(format!(
                "method {} keeps nothing for later renders; those that do are {}",
                method.name(),
                keeping.join(", ")
            )));
        }
        Ok(())
    }
}
