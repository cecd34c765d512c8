//! nearfar: diffuse global illumination by irradiance decomposition.
//!
//! The line that data walks, one room a step; every arrow is a free function from borrowed inputs
//! to one owned output:
//!
//! ```text
//! files → Scene → Geometry → RayQuery → Proxy → ShadingPoints → Clusters → Film → files
//!         load    tessellate  accel     proxy    record  method::decompose → film
//! ```
//!
//! | Room (rank) | In → out |
//! |---|---|
//! | [`error`], [`run`], [`process`] (0) | errors with their fix; progress, cancel; CPU time |
//! | [`forecast`], [`journal`] (0) | how long a job still takes; what is made so far, by blocks |
//! | [`memory`], [`input_file`] (0) | whether what is to be made fits; files that may be read |
//! | [`settings`], [`length`] (1) | how a room declares what it can be told; a length in settings |
//! | [`math`], [`sampling`], [`sh`], [`radiometry`] (1) | maths without rendering knowledge |
//! | [`atomic_file`] (1) | files that are written whole or not at all |
//! | [`ffi`] (1) | the only folder with unsafe code: Embree, Open Image Denoise, vectors |
//! | [`ply`] (2) | columns of numbers to and from PLY files |
//! | [`scene`] (2) | data only: camera, meshes, materials, lights, textures |
//! | [`builtin`] (3) | scenes made by code: names and parameters → meshes and materials |
//! | [`mod@load`] (3) | OBJ/MTL, cages, curves, TOML, images → [`scene::Scene`] of triangles |
//! | [`tessellate`] (3) | cages, curves → [`tessellate::Geometry`]: world-space triangles |
//! | [`accel`] (4) | `Geometry` → [`accel::RayQuery`]: Embree, pure-Rust BVH, brute force |
//! | [`shading`] (5) | hit → surface; lights, direct light; [`shading::World`] |
//! | [`proxy`] (6) | `World` → [`proxy::Proxy`]: light of surfaces, read where rays land |
//! | [`guide`] (6) | `World`, `Proxy` → [`guide::Guide`]: where light comes from, learned |
//! | [`film`] (6) | layers → EXR, PNG |
//! | [`denoise`] (6) | the finished picture denoised, by a library opened at run time |
//! | [`record`] (6) | pass 1: camera samples and shading points, shared by the methods |
//! | [`cloud`] (6) | `Geometry` → `Cloud` of discs → occlusion and irradiance without rays |
//! | [`method`] (7) | path (ground truth), decompose (the three passes), cache, …: siblings |
//! | [`compare`] (7) | a picture and its reference → errors, by octave of size too; FLIP; flicker |
//! | [`mod@render`] (8) | scene, settings and method → the finished picture and its statistics |
//! | [`mod@bench`] (8) | backends, methods and the parts of an error, measured side by side |
//! | [`page`], [`export`], [`info`] (8) | HTML pages; files for others; what a scene holds |
//! | [`config`], [`cli`] (8–9) | settings, the command line |
//!
//! Imports go from higher rank to lower; `tests/architecture.rs` checks it.
//!
//! # References
//! * `[Course07]` Arikan: irradiance decomposition, SIGGRAPH 2007 course. `[AFO05]` Arikan,
//!   Forsyth, O'Brien, "Fast and detailed approximate global illumination by irradiance
//!   decomposition", SIGGRAPH 2005.
//! * `[Lambert60]` Lambert's polygon form factor; `[Arvo95]` Arvo, "Applications of irradiance
//!   tensors".
//! * `[RH01]` Ramamoorthi, Hanrahan, "An efficient representation for irradiance environment maps".
//! * `[Ward88]` Ward, Rubinstein, Clear, "A ray tracing solution for diffuse interreflection".
//!   `[Ward92]` Ward, Heckbert, "Irradiance gradients". `[Tabellion04]` Tabellion, Lamorlette, "An
//!   approximate global illumination system for computer generated films". `[Krivanek06]` Křivánek
//!   et al., "Making radiance and irradiance caching practical". `[Schwarzhaupt12]` Schwarzhaupt,
//!   Jensen, Jarosz, "Practical Hessian-based error control for irradiance caching".
//! * `[Jensen96]` Jensen, "Global illumination using photon maps". `[Veach97]` Veach, PhD thesis
//!   (MIS, §9.2).
//! * `[Rath20]` Rath, Grittmann, Herholz, Vévoda, Slusallek, Křivánek, "Variance-aware path
//!   guiding". `[Vevoda18]` Vévoda, Kondapaneni, Křivánek, "Bayesian online regression for adaptive
//!   direct illumination sampling".
//! * `[VanOosterom83]` van Oosterom, Strackee, "The solid angle of a plane triangle".
//! * `[CC78]` Catmull, Clark, "Recursively generated B-spline surfaces on arbitrary topological
//!   meshes". `[DKT98]` DeRose, Kass, Truong, "Subdivision surfaces in character animation".
//!   `[HKD93]` Halstead, Kass, DeRose, "Efficient, fair interpolation using Catmull-Clark
//!   surfaces". `[WJZL08]` Wang, Jüttler, Zheng, Liu, "Computation of rotation minimizing frames".
//! * `[Bunnell05]` Bunnell, "Dynamic ambient occlusion and indirect lighting", GPU Gems 2.
//!   `[Christensen08]` Christensen, "Point-based approximate color bleeding", Pixar technical memo
//!   08-01.
//! * `[Burley20]` Burley, "Practical hash-based Owen scrambling". `[Duff17]` Duff et al., "Building
//!   an orthonormal basis, revisited".
#![cfg_attr(
    test,
    allow(clippy::unwrap_used, clippy::print_stderr, reason = "tests stop at the first surprise")
)]

pub mod accel;
pub mod atomic_file;
pub mod bench;
pub mod builtin;
#[cfg(feature = "cli")]
pub mod cli;
pub mod cloud;
pub mod compare;
pub mod config;
pub mod denoise;
pub mod error;
pub mod export;
pub mod ffi;
pub mod film;
pub mod forecast;
pub mod guide;
pub mod info;
pub mod input_file;
pub mod journal;
pub mod length;
pub mod load;
pub mod math;
pub mod memory;
pub mod method;
pub mod page;
pub mod ply;
pub mod process;
pub mod proxy;
pub mod radiometry;
pub mod record;
pub mod render;
pub mod run;
pub mod sampling;
pub mod scene;
pub mod settings;
pub mod sh;
pub mod shading;
pub mod tessellate;

pub use config::RenderConfig;
pub use error::{Error, Result};
pub use load::load;
pub use method::Method;
pub use render::{Rendered, Renderer, render};
pub use run::Run;
pub use scene::Scene;
