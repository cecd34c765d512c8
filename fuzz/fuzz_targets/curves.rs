//! Text curves.
#![no_main]

nearfar_fuzz::target!("curves");
