//! Kept cache records.
#![no_main]

nearfar_fuzz::target!("records");
