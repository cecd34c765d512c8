//! Pass 3: irradiance at every shading point, far and near together.
//!
//! ```text
//! E = max(0, E_far + E_near)        E_near may be negative: it takes away what is hidden
//! ```
//!
//! Only the sum is clamped: single terms may be negative and must stay so, or a closed surround
//! would no longer cancel the far field exactly.
//!
//! There is one entry, [`Pass3::irradiance`], which pictures, films, the budget and the tests
//! share, filter included. [`Pass3::new`] takes the far and the near part that the settings name;
//! [`Pass3::with_far`] and [`Pass3::with_near`] swap one of them for another, and
//! [`Pass3::keeping`] keeps the near part between the frames of a film. [`picture`](mod@picture)
//! makes a film with layers of the result.

pub mod picture;

use std::ops::Range;

use super::far::{Bundle, FarField, SampledClusters};
use super::near::boxes::NearBoxes;
use super::near::cells::{CellSum, NearTree};
use super::near::filter::{NearPart, Window, filter};
use super::near::rays::ShortRays;
use super::{Context, NearVisibility, Receiver};
use crate::error::Result;
use crate::journal::stored;
use crate::radiometry::Rgb;
use crate::record::ShadingPoints;
use crate::run::RayKind;
use crate::sampling::{Rng, Stream};
use crate::sh::ShRgb;

/// Irradiance at one point and where it comes from.
#[derive(Clone, Copy, Debug, Default)]
pub struct PointIrradiance {
    /// Irradiance, W/m².
    pub total: Rgb,
    /// Far part alone, as interpolated.
    pub far: Rgb,
    /// Cluster of the largest weight; none where the point sampled its own hemisphere.
    pub cluster: Option<u32>,
    /// Near cells that took part, or short rays that hit something near.
    pub near_cells: u32,
    /// Closeness of what is near, 1/length (short rays only).
    pub closeness: f32,
}

stored!(PointIrradiance { total, far, cluster, near_cells, closeness });

/// The far field at one point.
#[derive(Clone, Copy, Debug)]
pub struct FarAt {
    /// Distant incident radiance.
    pub sh: ShRgb,
    /// Cluster of the largest weight; none where the point sampled its own hemisphere.
    pub cluster: Option<u32>,
    /// Alpha there, scene units.
    pub alpha: f32,
}

/// Where the far field comes from.
#[derive(Debug)]
pub enum Far<'a> {
    /// From the clusters around the point; where none may serve it the point samples its own
    /// hemisphere, by a quarter of a cluster's rays, for such points are few.
    Blended(FarField<'a>),
    /// From the point's own hemisphere everywhere, by so many rays.
    Own(u32),
}

impl Far<'_> {
    /// Rays of a point that samples its own hemisphere.
    fn own_rays(&self, context: &Context<'_>) -> u32 {
        match self {
            Self::Blended(_) => context.settings.rays.div_ceil(4),
            Self::Own(rays) => *rays,
        }
    }

    /// The field at point `i`.
    fn at(&self, context: &Context<'_>, points: &ShadingPoints, i: usize) -> FarAt {
        let alpha = context.lengths.alpha;
        if let Self::Blended(field) = self
            && let Some(far) = field.at(points.p[i], points.ns[i])
        {
            return FarAt { sh: far.sh, cluster: Some(far.cluster), alpha: alpha * far.scale };
        }
        let bundle = Bundle {
            members: &[i as u32],
            rays: self.own_rays(context),
            alpha,
            stream: Stream::FarPoint,
            element: i as u64,
        };
        FarAt { sh: bundle.fit(context, points), cluster: None, alpha }
    }

    /// By cluster, those that may not share their near part with it.
    fn hidden_pairs(&self) -> Vec<Vec<u32>> {
        match self {
            Self::Blended(field) => field.hidden_pairs(),
            Self::Own(_) => Vec::new(),
        }
    }
}

/// How the near part is found.
#[derive(Debug)]
pub enum Near<'a> {
    /// Not at all.
    Off,
    /// By the sum over near cells, with a ray each where `traced`.
    Cells {
        /// The cells.
        tree: NearTree,
        /// Whether their visibility is tested.
        traced: bool,
    },
    /// By short rays, filtered.
    Rays,
    /// By short rays that are kept from picture to picture, filtered.
    Boxes(&'a mut NearBoxes),
}

impl Near<'_> {
    /// As `visibility` says; builds the tree of cells where it is needed (phase `reconstruct`).
    pub fn new(context: &Context<'_>, visibility: NearVisibility) -> Self {
        let cells = |traced| {
            let _phase = context.run.phase("reconstruct", 1);
            Self::Cells { tree: context.run.install(|| NearTree::new(context.proxy)), traced }
        };
        match visibility {
            NearVisibility::Off => Self::Off,
            NearVisibility::Assumed => cells(false),
            NearVisibility::Traced => cells(true),
            NearVisibility::Rays => Self::Rays,
        }
    }
}

/// Rays shot in pass 3.
#[derive(Clone, Copy, Default)]
struct Shot {
    near: u64,
    own: u64,
}

/// Pass 3, ready to be asked.
#[derive(Debug)]
pub struct Pass3<'a> {
    context: Context<'a>,
    far: Far<'a>,
    near: Near<'a>,
}

impl<'a> Pass3<'a> {
    /// With the far and the near part that the settings name.
    pub fn new(context: Context<'a>, sampled: &'a SampledClusters) -> Self {
        let near = Near::new(&context, context.settings.near_visibility);
        Self { context, far: Far::Blended(FarField::of(&context, sampled)), near }
    }

    /// With another far field.
    #[must_use]
    pub fn with_far(self, far: Far<'a>) -> Self {
        Self { far, ..self }
    }

    /// With another near part.
    #[must_use]
    pub fn with_near(self, near: Near<'a>) -> Self {
        Self { near, ..self }
    }

    /// Keeps what short rays find in `boxes`; without short rays there is nothing to keep.
    #[must_use]
    pub fn keeping(self, boxes: &'a mut NearBoxes) -> Self {
        match self.near {
            Near::Rays => self.with_near(Near::Boxes(boxes)),
            _ => self,
        }
    }

    /// Irradiance at every point of the world's present camera, in the order of its pixels (phases
    /// `near` and `reconstruct`).
    ///
    /// # Errors
    /// [`crate::error::Error::Interrupted`].
    pub fn irradiance(&mut self, points: &ShadingPoints) -> Result<Vec<PointIrradiance>> {
        const BLOCK: usize = 256;
        let Self { context, far, near } = self;
        let run = context.run;
        let kept = match near {
            Near::Boxes(boxes) => Some(boxes.at(context, points, &|i| far.at(context, points, i))?),
            _ => None,
        };
        let phase = run.phase("reconstruct", points.len() as u64);
        let block = |(): &mut (), range: Range<usize>| {
            let mut shot = Shot::default();
            let found = range.map(|i| self.point(points, i, kept.as_deref(), &mut shot)).collect();
            run.rays.add(RayKind::Visibility, shot.near);
            run.rays.add(RayKind::Sample, shot.own);
            found
        };
        let mut found = phase.blocks((points.len(), BLOCK), (), block)?;
        self.filter(points, &mut found);
        found.iter_mut().for_each(|f| f.total = f.total.max(Rgb::ZERO));
        Ok(found)
    }

    /// Irradiance at point `i`, neither filtered nor clamped, with the near part of all points
    /// where it is `kept`.
    fn point(
        &self,
        points: &ShadingPoints,
        i: usize,
        kept: Option<&[NearPart]>,
        shot: &mut Shot,
    ) -> PointIrradiance {
        let (context, at) = (&self.context, Receiver::of(points, i));
        let FarAt { sh, cluster, alpha } = self.far.at(context, points, i);
        if cluster.is_none() {
            shot.own += u64::from(self.far.own_rays(context));
        }
        let (near, near_cells) = match &self.near {
            Near::Off => (NearPart::default(), 0),
            Near::Cells { tree, traced } => {
                let mut rng = Rng::new(context.seed, Stream::Near, i as u64, 0);
                let cells = CellSum { tree, traced: *traced, alpha };
                let (irradiance, sum) = cells.near(context, &sh, &at, &mut rng);
                shot.near += u64::from(sum.rays);
                (NearPart { irradiance, closeness: 0.0 }, sum.cells)
            }
            Near::Boxes(_) => (kept.map_or_else(NearPart::default, |kept| kept[i]), 0),
            Near::Rays => {
                let count = context.settings.near_rays;
                shot.near += u64::from(count);
                let element = context.settings.near_noise().element(points, i);
                ShortRays { count, alpha, element }.near(context, &sh, &at)
            }
        };
        let far = sh.irradiance(at.ns);
        PointIrradiance {
            total: far + near.irradiance,
            far,
            cluster,
            near_cells,
            closeness: near.closeness,
        }
    }

    /// Takes the noise of short rays away.
    fn filter(&self, points: &ShadingPoints, found: &mut [PointIrradiance]) {
        let Context { world, settings, run, .. } = self.context;
        if settings.near_filter() == 0 || !matches!(self.near, Near::Rays | Near::Boxes(_)) {
            return;
        }
        let near: Vec<NearPart> = found
            .iter()
            .map(|f| NearPart { irradiance: f.total - f.far, closeness: f.closeness })
            .collect();
        let hidden = run.install(|| self.far.hidden_pairs());
        let apart = |i: usize, j: usize| match (found[i].cluster, found[j].cluster) {
            (Some(a), Some(b)) => hidden.get(a as usize).is_some_and(|h| h.contains(&b)),
            _ => !hidden.is_empty(),
        };
        let window = Window {
            width: world.camera.width,
            radius: settings.near_filter(),
            reach: settings.near_filter_reach,
        };
        let near = run.install(|| filter(points, &near, window, apart));
        found.iter_mut().zip(near).for_each(|(f, near)| f.total = f.far + near);
    }
}
