//! Where a method took its samples of indirect light: cluster centres, cache records. One list for
//! the picture, the file and the counts.

use std::path::Path;

use glam::Vec3;

use crate::error::Result;
use crate::film::Layer;
use crate::ply::{self, Columns};
use crate::radiometry::Rgb;
use crate::record::CameraSamples;

/// Layer of [`Locations::marks`].
pub const LOCATION: Layer = Layer::alone("location", "1 in pixels that have a sample, else 0");

/// Sample locations; arrays of equal length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Locations {
    /// Position, world space.
    pub p: Vec<Vec3>,
    /// Unit normal.
    pub n: Vec<Vec3>,
    /// Reach of the sample, scene units.
    pub radius: Vec<f32>,
    /// Irradiance on the sample's own plane, W·m⁻².
    pub irradiance: Vec<Rgb>,
    /// Pixel whose shading point the sample belongs to; none when it was made for another camera.
    pub pixel: Vec<Option<u32>>,
}

impl Locations {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.p.len()
    }
    /// True without samples.
    pub fn is_empty(&self) -> bool {
        self.p.is_empty()
    }
    /// Layer `location`: 1 in every pixel that has a sample, 0 elsewhere.
    pub fn marks(&self, samples: &CameraSamples) -> Vec<f32> {
        let mut marks = vec![0.0; (samples.width * samples.height) as usize];
        for pixel in self.pixel.iter().flatten() {
            marks[*pixel as usize] = 1.0;
        }
        marks
    }

    /// Writes them as binary PLY: `x y z nx ny nz radius irradiance_r irradiance_g irradiance_b`,
    /// and `red green blue` for viewers.
    ///
    /// # Errors
    /// [`crate::error::Error::Write`] when the system refuses.
    pub fn write_ply(&self, path: &Path) -> Result<()> {
        let scale = ply::colour_scale(self.irradiance.iter().copied());
        let columns = Columns::new("vertex")
            .floats(["x", "y", "z", "nx", "ny", "nz", "radius"])
            .floats(["irradiance_r", "irradiance_g", "irradiance_b"])
            .bytes(["red", "green", "blue"]);
        let comments = ["nearfar sample locations".to_owned()];
        ply::write(path, &comments, &[(columns, self.len())], |out| {
            for i in 0..self.len() {
                out.floats(self.p[i].to_array())?;
                out.floats(self.n[i].to_array())?;
                out.floats([self.radius[i]])?;
                out.floats(self.irradiance[i].to_array())?;
                out.bytes(&ply::colour(self.irradiance[i], scale))?;
            }
            Ok(())
        })
    }
}
