//! The command line: parsing, progress, exit codes. The only room that prints.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "the command line is where output goes")]

use std::process::ExitCode;

/// Runs the program on the process's arguments.
pub fn run() -> ExitCode {
    ExitCode::SUCCESS
}
