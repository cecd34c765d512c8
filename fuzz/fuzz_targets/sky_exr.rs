//! Skies as OpenEXR pictures.
#![no_main]

nearfar_fuzz::target!("sky_exr");
