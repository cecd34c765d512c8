//! Partial pictures that are gone on with.
#![no_main]

nearfar_fuzz::target!("checkpoint");
