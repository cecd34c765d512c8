//! OBJ files.
#![no_main]

nearfar_fuzz::target!("obj");
