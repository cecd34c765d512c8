//! Knobs of the irradiance cache.
//!
//! `error` is the one for quality. Its meaning belongs to the mode; 0.1 is a good picture in all of
//! them, and half of it about doubles the records (`hessian`) or quadruples them (the others):
//!
//! | Mode | Reach of a record |
//! |---|---|
//! | `hessian` | r⁴ = 4 ε A / (π abs λ), ε = (0.03 · error)² |
//! | `production-2006` | 5 · error · smallest distance |
//! | `split-sphere` | 2 · error · harmonic mean distance (Ward's a = 2 · error) |
//!
//! A is the picture's area at the record's depth (`allocation = "pixel"`) or the scene's squared
//! extent (`area`).

use crate::error::{Error, Result};
use crate::length::Length;
use crate::settings::{choices, section};

choices! {
    /// How the reach of a record is found.
    pub enum Mode default Hessian {
        /// From the curvature of the irradiance, by the occlusion-aware Hessian.
        Hessian = "hessian",
        /// From the smallest distance, clamped by neighbours: the standard of production about
        /// 2006.
        Production2006 = "production-2006",
        /// From the harmonic mean distance, without gradients: the first irradiance cache.
        SplitSphere = "split-sphere",
    }
}

choices! {
    /// What `hessian` keeps equal between records.
    pub enum Allocation default Pixel {
        /// The error summed over the pixels that a record covers.
        Pixel = "pixel",
        /// The error summed over the surface that a record covers.
        Area = "area",
    }
}

section! {
    /// The irradiance cache.
    pub struct CacheSettings in "cache", checked by together {
        /// How the reach of a record is found.
        mode: Mode = Mode::Hessian;
        /// Quality: smaller is better and dearer.
        error: f32 = 0.1, in from(1e-6).to(1000.0);
        /// Rays per record.
        rays: u32 = 512, in from(1.0).to(1_048_576.0), unit "rays";
        /// What `hessian` keeps equal between records.
        allocation: Allocation = Allocation::Pixel;
        /// Least reach of a record.
        min_spacing: f32 = 1.5, in from(0.01), unit "pixels";
        /// Greatest reach of a record.
        max_spacing: f32 = 60.0, in from(0.01).or_inf(), unit "pixels";
        /// Greatest reach of a record.
        max_radius: Length = Length::Percent(10.0), in above(0.0);
        /// Greatest reach of a record in smallest distances, neighbours clamping one another, at
        /// `error` 0.1 (`hessian`); inf for no limit.
        clearance: f32 = 0.5, in above(0.0).or_inf(), unit "smallest distances";
        /// Largest ratio of the axes of a record's ellipse.
        aspect: f32 = 2.0, in from(1.0).to(100.0);
        /// Largest angle between the normals of a record and of a point; shrinks with `error` below
        /// 0.1.
        angle: f32 = 20.0, in above(0.0).to(60.0), unit "degrees";
        /// Largest distance of a point from the plane midway between its own and the record's, as a
        /// share of the shorter radius (`hessian`).
        plane: f32 = 0.25, in above(0.0).to(1.0);
        /// Reach in the final pass, times that of the fill; more than 1 overlaps records.
        reach: f32 = 1.7, in from(1.0).to(4.0);
        /// An extrapolated value lies between the record's value over this and times this; inf for
        /// no limit.
        extrapolation: f32 = 1.5, in above(1.0).or_inf();
        /// Test rays towards points behind low occluders (`hessian`).
        leak_guard: bool = true;
    }
}

impl CacheSettings {
    fn together(&self) -> Result<()> {
        if self.max_spacing < self.min_spacing {
            return Err(Error::setting(
                "cache.max_spacing",
                "must be at least cache.min_spacing; inf for no limit",
            ));
        }
        Ok(())
    }
}
