//! The borders to C and to the CPU: the only folder with unsafe code. What is public here is safe
//! to call.
//!
//! | Border | Library |
//! |---|---|
//! | `embree` (feature) | Embree 4.3 or later, linked at build time through `ffi/embree_shim.c` |
//! | [`exit`] | the C library: the end of the process |
//! | [`lanes`] | none: vectors of the CPU, chosen at run time |
//! | [`oidn`] | Open Image Denoise 2, opened at run time where it is there |
#![expect(unsafe_code, reason = "the borders: every block says why it is sound")]

#[cfg(feature = "embree")]
pub mod embree;
pub mod exit;
pub mod lanes;
pub mod oidn;
