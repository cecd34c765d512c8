//! Binary hair.
#![no_main]

nearfar_fuzz::target!("hair");
