//! The program of every target: its name says which reader it is.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| nearfar_fuzz::look(env!("CARGO_BIN_NAME"), bytes));
