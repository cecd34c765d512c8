//! Curves with a width: hair, fur, grass.

use glam::Vec3;

/// How control points make a curve. All give `p(t) = Σ Bᵢ(t) pᵢ` a span, width likewise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Basis {
    /// Straight from point to point; n − 1 spans.
    #[default]
    Linear,
    /// Cubic through all points, the ends continued by reflection; n − 1 spans.
    CatmullRom,
    /// Uniform cubic B-spline, which starts and ends near the second point from either end; n − 3
    /// spans.
    Bspline,
    /// Cubic Bézier spans that share their end points: n = 3 m + 1 points, m spans.
    Bezier,
}

impl Basis {
    /// Spans of a curve of `points` control points; none when there cannot be such a curve.
    pub fn spans(self, points: usize) -> Option<usize> {
        match self {
            Self::Linear | Self::CatmullRom => (points >= 2).then(|| points - 1),
            Self::Bspline => (points >= 4).then(|| points - 3),
            Self::Bezier => (points >= 4 && points % 3 == 1).then(|| (points - 1) / 3),
        }
    }

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::CatmullRom => "catmull-rom",
            Self::Bspline => "bspline",
            Self::Bezier => "bezier",
        }
    }

    /// What number of points it needs.
    pub fn needs(self) -> &'static str {
        match self {
            Self::Linear | Self::CatmullRom => "at least 2 points",
            Self::Bspline => "at least 4 points",
            Self::Bezier => "4, 7, 10, … points",
        }
    }
}

/// Curves of one material. Arrays over points have equal length.
#[derive(Clone, Debug, Default)]
pub struct Curves {
    /// Name for messages.
    pub name: String,
    /// Control points of all curves, root to tip.
    pub points: Vec<Vec3>,
    /// Diameter at every control point, scene units.
    pub widths: Vec<f32>,
    /// First point of every curve, then the number of points.
    pub starts: Vec<u32>,
    /// How points make curves.
    pub basis: Basis,
    /// Material: index into [`super::Scene::materials`].
    pub material: u32,
}

impl Curves {
    /// Number of curves.
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// True without curves.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Point numbers of a curve.
    pub fn curve(&self, curve: usize) -> std::ops::Range<usize> {
        self.starts[curve] as usize..self.starts[curve + 1] as usize
    }

    /// Adds a curve of (point, width).
    pub fn push_curve(&mut self, points: impl IntoIterator<Item = (Vec3, f32)>) {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        for (p, w) in points {
            self.points.push(p);
            self.widths.push(w);
        }
        self.starts.push(self.points.len() as u32);
    }
}
