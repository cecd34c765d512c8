//! OpenEXR pictures, compared with themselves and written again.
#![no_main]

nearfar_fuzz::target!("film");
