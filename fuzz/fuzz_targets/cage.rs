//! OBJ files as subdivision cages.
#![no_main]

nearfar_fuzz::target!("cage");
