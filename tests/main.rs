//! All integration tests in one binary; one module a rung of the ladder.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "tests stop at the first surprise")]

mod architecture;
mod bench;
mod broken;
mod budget;
mod cache;
mod cache_record;
mod cli;
mod conformance;
mod converge;
mod convergence;
mod course;
mod curves;
mod decompose;
mod denoise;
mod export;
mod gallery;
mod info;
mod install;
mod near_far;
mod path;
mod photon;
mod pixel_filter;
mod point_based;
mod references;
mod render;
mod report;
mod reuse;
mod settings;
mod show;
mod sky;
mod subdivision;
mod support;
mod truth;
