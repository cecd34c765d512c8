//! Where the error of a decomposition picture sits: one part at a time is swapped for an exact one.
//!
//! The first row is the picture itself: all its pixels, the figures of `nearfar compare` to the
//! last bit (before any denoising). The others are the final image on a lattice of pixels, against
//! the same ground truth. They differ in the irradiance at the shading points:
//!
//! * "as rendered, on the lattice": the picture's own; the row that the next ones compare with.
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

use crate::compare::{Errors, Truth, errors, errors_at};
use crate::error::Result;
use crate::method::decompose::far::{SampledClusters, sample};
use crate::method::decompose::pass3::{Far, Near, Pass3, PointIrradiance};
use crate::method::decompose::{
    Context, DecomposeSettings, Lengths, NearVisibility, Prepared, picture, prepare,
};
use crate::method::final_gather::{Rays, gather};
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

struct Lattice<'a> {
    context: Context<'a>,
    prepared: &'a Prepared,
    /// The lattice's pixels, and the camera samples of these alone.
    pixels: Vec<u32>,
    samples: CameraSamples,
    truth: &'a Truth,
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
    let context = prepared.context(world, settings, inputs.seed, run);
    let lattice = Lattice { context, prepared: &prepared, pixels, samples, truth, gather_rays };
    let exact_direct = at(&DirectSettings {
        light_samples: Some(inputs.direct.light_samples() * 16),
        ..*inputs.direct
    })?;
    lattice.rows(&exact_direct)
}

impl Lattice<'_> {
    fn rows(&self, exact_direct: &CameraSamples) -> Result<Vec<BudgetRow>> {
        let Context { world, proxy, seed, run, lengths, .. } = self.context;
        let (sampled, whole_view) = (&self.prepared.sampled, &self.prepared.stage.samples);
        let film = picture(world, self.context.settings, self.prepared, seed, run)?.film;
        let layer = |name: &str| film.rgb(name).unwrap_or_default();
        let (beauty, indirect) = (layer(""), layer("indirect"));
        let on_lattice: Vec<Rgb> = self.pixels.iter().map(|&i| beauty[i as usize]).collect();
        let mut rows = vec![
            BudgetRow { part: "as rendered", errors: errors(&beauty, self.truth) },
            self.judge("as rendered, on the lattice", &on_lattice),
            self.judge("exact direct light", &self.image(exact_direct, &indirect)),
        ];
        let points = &self.samples.points;
        let mut row = |part, found: &[Rgb]| rows.push(self.row(part, &self.samples, found));
        row("proxy", &gather(world, proxy, points, Rays::cosine(self.gather_rays), seed, run)?);

        let all_far = Context { lengths: Lengths { alpha: 0.0, ..lengths }, ..self.context };
        let clusters = sampled.clusters.clone();
        let (sh, _) = sample(&all_far, &whole_view.points, &clusters)?;
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
        self.judge(part, &self.image(samples, &samples.reflect(irradiance)))
    }

    /// The lattice's pixels of a picture whose indirect light is given by pixel.
    fn image(&self, samples: &CameraSamples, indirect: &[Rgb]) -> Vec<Rgb> {
        let pixels = self.pixels.iter().map(|&i| i as usize);
        pixels.map(|i| samples.emission[i] + samples.direct[i] + indirect[i]).collect()
    }

    fn judge(&self, part: &'static str, image: &[Rgb]) -> BudgetRow {
        BudgetRow { part, errors: errors_at(&self.pixels, image, self.truth) }
    }
}

fn totals(found: &[PointIrradiance]) -> Vec<Rgb> {
    found.iter().map(|f| f.total).collect()
}
