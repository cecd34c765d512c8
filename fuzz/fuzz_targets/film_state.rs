//! What frames of a film share.
#![no_main]

nearfar_fuzz::target!("film_state");
