//! Where the error of a decomposition picture sits: one part at a time is swapped for an exact one.
//!
//! Every row is the final image on a lattice of pixels, against the same ground truth. They differ
//! in the irradiance at the shading points:
//!
//! * "as rendered": the picture itself, all of it rendered, for its filter needs neighbours.
//! * "exact direct light": the same, with 16 times the shadow rays in the direct light.
//! * "proxy": `gather_rays` cosine rays straight through the proxy: what the method can at best
//!   reach.
//! * "own SH": a fit of `gather_rays` rays at the point itself, no near part.
//! * "SH interpolated": clusters with all hits at full weight, no near part.
//! * "own SH + near …", "SH interpolated + near …": every point its own cluster, or clusters as
//!   rendered, with the sum over near cells assumed visible, or with a ray each.
//!
//! It costs a picture, and `gather_rays` rays four times per lattice point.

use serde::Serialize;

use crate::compare::{Errors, Halves, errors};
use crate::error::Result;
use crate::method::decompose::far::{SampledClusters, sample};
use crate::method::decompose::pass3::{Far, Near, Pass3, PointIrradiance};
use crate::method::decompose::{
    Context, DecomposeSettings, Lengths, NearVisibility, Prepared, prepare,
};
use crate::method::final_gather::gather;
use crate::method::stage::Inputs;
use crate::radiometry::Rgb;
use crate::record::{CameraSamples, camera_samples_where};
use crate::run::Run;
use crate::shading::{DirectSettings, World};

/// One row of the budget.
#[derive(Clone, Debug, Serialize)]
pub struct BudgetRow {
    /// What was swapped.
    pub part: &'static str,
    /// Error of the final image on the lattice.
    #[serde(flatten)]
    pub errors: Errors,
}

/// What the budget is measured against, one value a pixel of the whole image.
#[derive(Debug)]
pub struct Truth {
    /// Mean.
    pub mean: Vec<Rgb>,
    /// Independent halves.
    pub halves: Option<Halves>,
}

struct Lattice<'a> {
    context: Context<'a>,
    prepared: &'a Prepared,
    /// The lattice's pixels, and the camera samples of these alone.
    pixels: Vec<u32>,
    samples: CameraSamples,
    truth: Truth,
    gather_rays: u32,
}

/// The budget on every `stride`-th pixel in x and y.
///
/// # Errors
/// As [`prepare`].
pub fn budget(
    world: &World,
    settings: &DecomposeSettings,
    inputs: Inputs<'_>,
    truth: &Truth,
    stride: u32,
    gather_rays: u32,
    run: &Run,
) -> Result<Vec<BudgetRow>> {
    let prepared = prepare(world, settings, inputs, run)?;
    let wanted = |x: u32, y: u32| x % stride == stride / 2 && y % stride == stride / 2;
    let at = |direct: &DirectSettings| {
        camera_samples_where(world, inputs.record, direct, inputs.seed, run, &wanted)
    };
    let samples = at(inputs.direct)?;
    let (width, height) = (samples.width, samples.height);
    let pixels: Vec<u32> = (0..height)
        .flat_map(|y| (0..width).filter(move |&x| wanted(x, y)).map(move |x| y * width + x))
        .collect();
    let pick = |v: &[Rgb]| pixels.iter().map(|&i| v[i as usize]).collect::<Vec<_>>();
    let truth = Truth {
        mean: pick(&truth.mean),
        halves: truth.halves.as_ref().map(|h| Halves(pick(&h.0), pick(&h.1))),
    };
    let context = prepared.context(world, settings, inputs.seed, run);
    let lattice = Lattice { context, prepared: &prepared, pixels, samples, truth, gather_rays };
    let exact_direct = at(&DirectSettings { light_samples: inputs.direct.light_samples * 16 })?;
    lattice.rows(&exact_direct)
}

impl Lattice<'_> {
    fn rows(&self, exact_direct: &CameraSamples) -> Result<Vec<BudgetRow>> {
        let Context { world, proxy, seed, run, lengths, .. } = self.context;
        let (sampled, picture) = (&self.prepared.sampled, &self.prepared.stage.samples);
        let found = Pass3::new(self.context, sampled).irradiance(&picture.points)?;
        let rendered = totals(&found);
        let of_lattice = rendered.iter().zip(&picture.points.pixel);
        let of_lattice: Vec<Rgb> = of_lattice
            .filter(|(_, pixel)| self.pixels.binary_search(pixel).is_ok())
            .map(|(&e, _)| e)
            .collect();
        let mut rows = vec![
            self.row("as rendered", picture, &rendered),
            self.row("exact direct light", exact_direct, &of_lattice),
        ];
        let points = &self.samples.points;
        let mut row = |part, found: &[Rgb]| rows.push(self.row(part, &self.samples, found));
        row("proxy", &gather(world, proxy, points, self.gather_rays, seed, run)?);

        let all_far = Context { lengths: Lengths { alpha: 0.0, ..lengths }, ..self.context };
        let clusters = sampled.clusters.clone();
        let (sh, _) = sample(&all_far, &picture.points, &clusters)?;
        let whole = SampledClusters { clusters, sh };
        let mut pass3 = Pass3::new(all_far, &whole).with_near(Near::Off);
        let shared = totals(&pass3.irradiance(points)?);
        let mut pass3 = pass3.with_far(Far::Own(self.gather_rays));
        row("own SH, no near sum", &totals(&pass3.irradiance(points)?));
        row("SH interpolated, no near sum", &shared);

        for (own, shared, visibility) in [
            ("own SH + near assumed", "SH interpolated + near assumed", NearVisibility::Assumed),
            ("own SH + near traced", "SH interpolated + near traced", NearVisibility::Traced),
        ] {
            let near = Near::new(&self.context, visibility);
            let mut pass3 = Pass3::new(self.context, sampled).with_near(near);
            let of_clusters = totals(&pass3.irradiance(points)?);
            let mut pass3 = pass3.with_far(Far::Own(self.gather_rays));
            row(own, &totals(&pass3.irradiance(points)?));
            row(shared, &of_clusters);
        }
        Ok(rows)
    }

    fn row(&self, part: &'static str, samples: &CameraSamples, irradiance: &[Rgb]) -> BudgetRow {
        let indirect = samples.reflect(irradiance);
        let image: Vec<Rgb> = self
            .pixels
            .iter()
            .map(|&i| i as usize)
            .map(|i| samples.emission[i] + samples.direct[i] + indirect[i])
            .collect();
        BudgetRow { part, errors: errors(&image, &self.truth.mean, self.truth.halves.as_ref()) }
    }
}

fn totals(found: &[PointIrradiance]) -> Vec<Rgb> {
    found.iter().map(|f| f.total).collect()
}
