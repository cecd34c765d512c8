//! What the header of an image file says of its making.
//!
//! Text attributes `nearfar.version`, `.method`, `.seed`, `.settings` (every setting as TOML) and
//! `.complete` (false when it was ended before its time). Methods add what only they know before;
//! the command line adds the scene's path. No time is told, so that equal pictures are equal files:
//! the statistics have it.

use crate::config::RenderConfig;
use crate::error::Result;
use crate::film::{COMPLETE, Film};
use crate::run::Run;

/// Fills in the header.
///
/// # Errors
/// [`crate::error::Error::Render`] when settings cannot be written as text.
pub fn describe(film: &mut Film, method: &str, config: &RenderConfig, run: &Run) -> Result<()> {
    for (key, value) in [
        ("nearfar.version", env!("CARGO_PKG_VERSION").to_owned()),
        ("nearfar.method", method.to_owned()),
        ("nearfar.seed", config.seed.to_string()),
        ("nearfar.settings", config.to_table()?.to_string()),
    ] {
        film.header.insert(key.into(), value);
    }
    film.header.entry(COMPLETE.into()).or_insert_with(|| (!run.cancelled()).to_string());
    Ok(())
}
