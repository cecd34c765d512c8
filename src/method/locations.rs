//! Where a method took its samples of indirect light: cluster centres, cache records. One list for the picture, the file and the counts.

use glam::Vec3;

use crate::radiometry::Rgb;
use crate::record::CameraSamples;

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
}
