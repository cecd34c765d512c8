//! What can go wrong, said so that a user can mend it: file, line, and the fix.
//!
//! One enum for the whole library. Messages are lower-case without a trailing dot; user data stands
//! in quotes. The library never prints or exits: the binary maps a kind to its exit code by
//! [`Error::exit_code`].

use std::path::PathBuf;

/// Any failure of the library.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A scene, mesh or material file is wrong at a known place.
    #[error("{}: {message}", at(file, *line))]
    Input {
        /// File as the user named it.
        file: PathBuf,
        /// 1-based line, where one is known.
        line: Option<usize>,
        /// What is wrong and how to mend it.
        message: String,
    },
    /// A setting is unknown, malformed or out of range.
    #[error("setting \"{key}\": {message}")]
    Setting {
        /// Dotted key as in the scene file.
        key: String,
        /// What is allowed.
        message: String,
    },
    /// The command line contradicts itself.
    #[error("{0}")]
    Usage(String),
    /// An image could not be read or written.
    #[error("{}: {message}", path.display())]
    Image {
        /// The image file.
        path: PathBuf,
        /// What happened.
        message: String,
    },
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file in question.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The ray query backend could not be made.
    #[error("ray backend: {0}")]
    Accel(String),
    /// The render cannot be done.
    #[error("{0}")]
    Render(String),
    /// A comparison exceeded its bound (exit code 1).
    #[error("{0}")]
    OverBound(String),
    /// A file could not be written.
    #[error("{}: cannot be written: {source}{}", path.display(), saved(rescue.as_deref()))]
    Write {
        /// The file in question.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
        /// Where its content is instead.
        rescue: Option<PathBuf>,
    },
    /// The user asked to stop; nothing is kept.
    #[error("interrupted; nothing of this run is kept")]
    Interrupted,
    /// The user asked to stop; what is kept is said.
    #[error("interrupted; {0}")]
    Stopped(String),
}

fn at(file: &std::path::Path, line: Option<usize>) -> String {
    match line {
        Some(line) => format!("{}:{line}", file.display()),
        None => file.display().to_string(),
    }
}

fn saved(rescue: Option<&std::path::Path>) -> String {
    rescue.map_or_else(String::new, |file| format!("; it is saved as {}", file.display()))
}

impl Error {
    /// An [`Error::Input`] at `file` and optional 1-based `line`.
    pub fn input(
        file: impl Into<PathBuf>,
        line: impl Into<Option<usize>>,
        message: impl Into<String>,
    ) -> Self {
        Self::Input { file: file.into(), line: line.into(), message: message.into() }
    }

    /// An [`Error::Setting`].
    pub fn setting(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Setting { key: key.into(), message: message.into() }
    }

    /// Process exit code: 1 over bound, 2 usage or input, 3 the render failed or could not be
    /// written, 130 interrupted.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::OverBound(_) => 1,
            Self::Input { .. }
            | Self::Setting { .. }
            | Self::Usage(_)
            | Self::Image { .. }
            | Self::Io { .. } => 2,
            Self::Accel(_) | Self::Render(_) | Self::Write { .. } => 3,
            Self::Interrupted | Self::Stopped(_) => 130,
        }
    }
}

/// Result of the library.
pub type Result<T> = std::result::Result<T, Error>;
