//! Points that are shown.
#![no_main]

nearfar_fuzz::target!("table");
