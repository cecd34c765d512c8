//! Clouds of points.
#![no_main]

nearfar_fuzz::target!("cloud");
