//! Textures: PNG, JPEG, BMP, TGA, TIFF.
#![no_main]

nearfar_fuzz::target!("texture");
