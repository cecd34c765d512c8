//! Assignments of settings.
#![no_main]

nearfar_fuzz::target!("settings");
