//! Scene files.
#![no_main]

nearfar_fuzz::target!("scene");
