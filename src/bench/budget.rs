//! Where the error of a decomposition picture sits: one part at a time is swapped for an exact one.
//!
//! Every row is the final image on a lattice of pixels, against the same two-half ground truth (see
//! [`Halves`]):
//!
//! | Row | Indirect irradiance at a shading point |
//! |---|---|
//! | as rendered | the method as set |
//! | exact direct light | the same, with 16 times the shadow rays in the direct light |
//! | proxy | gather of `gather_rays` cosine rays straight through the proxy: what the method can at best reach |
//! | own SH | fit of `gather_rays` rays at the point itself, no near sum |
//! | SH interpolated | clusters with all hits at full weight, no near sum |
//! | own SH + near … | as the method, but every point is its own cluster |
//! | near off, assumed, traced | the method with the near sum left out, unoccluded, with a ray per cell |
//!
//! Cost    `gather_rays` rays three times per lattice point.

use rayon::prelude::*;
use serde::Serialize;

use crate::compare::{Errors, Halves, errors};
use crate::error::Result;
use crate::method::decompose::far::{sample, sample_cluster};
use crate::method::decompose::interpolate::FarField;
use crate::method::decompose::near::NearTree;
use crate::method::decompose::reconstruct::{point, reconstruct};
use crate::method::decompose::{DecomposeSettings, NearVisibility, Prepared, prepare};
use crate::method::gather::gather;
use crate::method::stage::Inputs;
use crate::photon::Proxy;
use crate::radiometry::Rgb;
use crate::record::{CameraSamples, ShadingPoints, camera_samples_where};
use crate::run::{RayKind, Run};
use crate::sampling::{Rng, Stream};
use crate::sh::ShRgb;
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
    world: &'a World,
    proxy: Proxy<'a>,
    samples: CameraSamples,
    pixels: Vec<u32>,
    truth: Truth,
    settings: &'a DecomposeSettings,
    alpha: f32,
    gather_rays: u32,
    seed: u64,
    run: &'a Run,
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
    let lattice = Lattice {
        world,
        proxy: prepared.stage.proxy(),
        samples,
        pixels,
        truth,
        settings,
        alpha: prepared.lengths.alpha,
        gather_rays,
        seed: inputs.seed,
        run,
    };
    let exact_direct = at(&DirectSettings { light_samples: inputs.direct.light_samples * 16 })?;
    lattice.rows(&prepared, &exact_direct)
}

impl Lattice<'_> {
    fn rows(&self, prepared: &Prepared, exact_direct: &CameraSamples) -> Result<Vec<BudgetRow>> {
        let tree = self.run.install(|| NearTree::new(self.proxy));
        let with = |near_visibility| DecomposeSettings { near_visibility, ..self.settings.clone() };
        let radius = prepared.lengths.blend_radius;
        let power = self.settings.blend_normal_power;
        let field = FarField::new(&prepared.clusters, &prepared.sh, radius, power);
        let clustered = |near| -> Result<Vec<Rgb>> {
            let found = reconstruct(
                self.world,
                self.proxy,
                &self.samples.points,
                &field,
                Some(&tree),
                None,
                &with(near),
                self.seed,
                self.run,
            )?;
            Ok(found.iter().map(|f| f.total).collect())
        };
        let rendered = clustered(self.settings.near_visibility)?;
        let mut rows = vec![
            self.row("as rendered", &self.samples, &rendered),
            self.row("exact direct light", exact_direct, &rendered),
        ];
        rows.push(self.row(
            "proxy",
            &self.samples,
            &gather(
                self.world,
                self.proxy,
                &self.samples.points,
                self.gather_rays,
                self.seed,
                self.run,
            )?,
        ));
        let off = with(NearVisibility::Off);
        rows.push(self.row("own SH, no near sum", &self.samples, &self.own(&tree, 0.0, &off)?));
        let (whole, _) = sample(
            self.world,
            self.proxy,
            &prepared.stage.samples.points,
            &prepared.clusters,
            &plain(self.settings),
            self.seed,
            self.run,
        )?;
        let whole_field = FarField::new(&prepared.clusters, &whole, radius, power);
        let found = reconstruct(
            self.world,
            self.proxy,
            &self.samples.points,
            &whole_field,
            Some(&tree),
            None,
            &off,
            self.seed,
            self.run,
        )?;
        rows.push(self.row(
            "SH interpolated, no near sum",
            &self.samples,
            &found.iter().map(|f| f.total).collect::<Vec<_>>(),
        ));
        for (own, shared, near) in [
            ("own SH + near assumed", "SH interpolated + near assumed", NearVisibility::Assumed),
            ("own SH + near traced", "SH interpolated + near traced", NearVisibility::Traced),
        ] {
            rows.push(self.row(own, &self.samples, &self.own(&tree, self.alpha, &with(near))?));
            rows.push(self.row(shared, &self.samples, &clustered(near)?));
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

    fn each(
        &self,
        name: &'static str,
        rays: u64,
        f: impl Fn(usize, &ShadingPoints) -> Rgb + Sync,
    ) -> Result<Vec<Rgb>> {
        let points = &self.samples.points;
        let phase = self.run.phase(name, points.len() as u64);
        let out = self.run.install(|| {
            (0..points.len())
                .into_par_iter()
                .map(|i| {
                    if self.run.cancelled() {
                        return Rgb::ZERO;
                    }
                    phase.advance(1);
                    f(i, points)
                })
                .collect()
        });
        self.run.rays.add(RayKind::Sample, rays * points.len() as u64);
        self.run.check()?;
        Ok(out)
    }

    /// Every point its own cluster, with near hits damped up to `alpha`.
    fn own(&self, tree: &NearTree, alpha: f32, settings: &DecomposeSettings) -> Result<Vec<Rgb>> {
        let rich = DecomposeSettings { rays: self.gather_rays, ..settings.clone() };
        self.each("own SH", u64::from(self.gather_rays), |i, points| {
            let sh: ShRgb = sample_cluster(
                self.world,
                self.proxy,
                points,
                &[i as u32],
                &rich,
                alpha,
                self.seed,
                i as u64,
            );
            let mut rng = Rng::new(self.seed, Stream::Near, i as u64, 1);
            point(
                self.world,
                Some(tree),
                None,
                &sh,
                points.p[i],
                points.ns[i],
                settings,
                alpha,
                &mut rng,
            )
            .0
            .total
        })
    }
}

/// The far sampling of a method without a near part.
fn plain(settings: &DecomposeSettings) -> DecomposeSettings {
    DecomposeSettings { alpha: crate::method::decompose::Length::Units(0.0), ..settings.clone() }
}
