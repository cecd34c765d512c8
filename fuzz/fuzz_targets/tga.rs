//! Textures of TGA, which nothing but their name tells.
#![no_main]

nearfar_fuzz::target!("tga");
