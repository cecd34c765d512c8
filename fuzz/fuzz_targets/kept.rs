//! Kept proxies and clusters.
#![no_main]

nearfar_fuzz::target!("kept");
