//! Statistics beside pictures.
#![no_main]

nearfar_fuzz::target!("statistics");
