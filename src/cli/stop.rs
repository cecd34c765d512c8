//! Ctrl-C: what it ends, and what is said of it.
//!
//! Until a command says by [`keeps`] that it has something to finish (a picture to keep, a child to
//! end), the first Ctrl-C ends the program at once, for nothing is lost by it: loading and building
//! do not wait. After that the first one asks the command to stop, and whoever stops says what is
//! kept ([`crate::error::Error::Stopped`]) or that nothing is. A second one always ends at once.
//! Temporary files are removed in any case; finished ones are never half replaced.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::atomic_file;
use crate::error::Error;
use crate::ffi::exit::exit_at_once;

/// Whether a first Ctrl-C asks.
static ASKS: AtomicBool = AtomicBool::new(false);

/// From now on a first Ctrl-C asks the command to stop.
pub(super) fn keeps() {
    ASKS.store(true, Ordering::SeqCst);
}

/// Listens to Ctrl-C and to requests to end; the flag is set by the first one.
pub(super) fn listen() -> Arc<AtomicBool> {
    let cancel = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&cancel);
    let handler = ctrlc::set_handler(move || {
        let first = !flag.swap(true, Ordering::SeqCst);
        if first && ASKS.load(Ordering::SeqCst) {
            eprintln!("stopping; what is kept will be told (press Ctrl-C again to end at once)");
            return;
        }
        if first {
            eprintln!("{}", Error::Interrupted);
        }
        atomic_file::abandon();
        exit_at_once(Error::Interrupted.exit_code());
    });
    if let Err(error) = handler {
        eprintln!("warning: Ctrl-C will end the program at once: {error}");
    }
    cancel
}
