//! Material libraries.
#![no_main]

nearfar_fuzz::target!("mtl");
