//! Skies as Radiance pictures.
#![no_main]

nearfar_fuzz::target!("sky");
