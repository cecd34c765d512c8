//! Camera paths.
#![no_main]

nearfar_fuzz::target!("camera_path");
