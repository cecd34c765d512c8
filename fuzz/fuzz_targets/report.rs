//! Manifests of reports.
#![no_main]

nearfar_fuzz::target!("report");
