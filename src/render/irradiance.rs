//! Irradiance at given points: what sensors and texels ask for, and no camera needs to see.
//!
//! ```text
//! E(p, n) = E_direct + π / rays · Σ_r L(p, wi_r)        wi_r cosine-distributed around n
//! ```
//! `E_direct` is the light of sun, lamps and emitters by `direct.light_samples` shadow rays; the
//! sum is everything else, the sky included: final gathering by `gather.rays` rays through the
//! proxy, which is made for what the first of these rays meet.
//!
//! Input   positions and normals, world space. Output  one [`PointIrradiance`] a point, W/m².
//! Guarantees  the same bits for any number of threads. Unbiased for the light of the proxy.
//! Not         a test whether a point lies inside a wall: such a point is dark.
//! Cost        `gather.rays + direct.light_samples` rays a point, and the proxy.

use glam::Vec3;
use rayon::prelude::*;

use super::Renderer;
use crate::error::{Error, Result};
use crate::math::{Frame, Ray, offset_origin};
use crate::method::final_gather::{Rays, gather};
use crate::proxy::{Landing, Need, Proxy};
use crate::radiometry::Rgb;
use crate::record::ShadingPoints;
use crate::run::RayKind;
use crate::sampling::{Sobol, Stream, sample_cosine_hemisphere};
use crate::shading::direct_irradiance;

/// Rays of a point whose landings the proxy is made for.
const SCOUTS: u32 = 16;

/// Points with the directions they face; arrays of equal length.
#[derive(Clone, Debug, Default)]
pub struct SurfacePoints {
    /// Position, world space.
    pub p: Vec<Vec3>,
    /// Normal of the plane that is lit; need not be unit.
    pub n: Vec<Vec3>,
}

/// Light that arrives at a point, per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointIrradiance {
    /// From sun, lamps and emitters, unscattered, W/m².
    pub direct: Rgb,
    /// Everything else, the sky's own light included, W/m².
    pub indirect: Rgb,
}

impl PointIrradiance {
    /// All of it, W/m².
    pub fn total(&self) -> Rgb {
        self.direct + self.indirect
    }
}

/// The points as receivers, lifted off what they lie on.
fn receivers(points: &SurfacePoints, scale: f32) -> Result<ShadingPoints> {
    let SurfacePoints { p, n } = points;
    if p.len() != n.len() {
        let counts = format!("{} positions, but {} normals: give one to each", p.len(), n.len());
        return Err(Error::Usage(counts));
    }
    let normals: Vec<Vec3> = n.iter().map(|n| n.normalize_or_zero()).collect();
    let bad = |(p, n): (&Vec3, &Vec3)| !p.is_finite() || *n == Vec3::ZERO;
    if let Some(i) = p.iter().zip(&normals).position(bad) {
        let (p, n) = (p[i], n[i]);
        return Err(Error::Usage(format!(
            "point {i}: position {p} must be finite, and normal {n} have a direction"
        )));
    }
    let lifted = p.iter().zip(&normals).map(|(&p, &n)| offset_origin(p, n, scale)).collect();
    let (ng, ns) = (normals.clone(), normals);
    Ok(ShadingPoints { p: lifted, ng, ns, ..ShadingPoints::default() })
}

impl Renderer<'_> {
    /// Irradiance at `points`, in their order.
    ///
    /// # Errors
    /// [`Error::Usage`] for arrays of unequal length, positions that are not finite and normals
    /// without a direction; settings out of range; [`Error::Interrupted`].
    pub fn irradiance(&self, points: &SurfacePoints) -> Result<Vec<PointIrradiance>> {
        let (world, config, run) = (self.world(), self.config(), self.run());
        let inputs = config.inputs(world.around.extent);
        inputs.validate()?;
        let at = receivers(points, world.diagonal)?;
        let seed = config.seed;
        let landings: Vec<Landing> = run.install(|| {
            let scouts = |i: usize| {
                let sobol = Sobol::new(seed, Stream::Gather, i as u64);
                let (p, frame) = (at.p[i], Frame::from_normal(at.ns[i]));
                let rays = (0..SCOUTS.min(config.gather.rays())).map(move |r| {
                    let wi = sample_cosine_hemisphere(sobol.sample_2d(r, 0));
                    Ray::new(p, frame.world_from_local(wi))
                });
                rays.filter_map(|ray| {
                    world.rays.closest(&ray).map(|hit| Landing::new(world, &ray, &hit))
                })
                .collect::<Vec<_>>()
            };
            (0..at.len()).into_par_iter().flat_map_iter(scouts).collect()
        });
        run.rays.add(RayKind::Sample, at.len() as u64 * u64::from(SCOUTS));
        let proxy = Proxy::new(world, inputs.proxy(), Need::Landings(&landings), run)?;
        let indirect = gather(world, &proxy, &at, Rays::cosine(config.gather.rays()), seed, run)?;
        let phase = run.phase("direct", at.len() as u64);
        let lit = |i: usize| {
            let sobol = Sobol::new(seed, Stream::Direct, i as u64);
            let count = config.direct.light_samples();
            let mut sample = |k: u32| (sobol.sample_1d(k, 0), sobol.sample_2d(k, 1));
            let (p, n) = (points.p[i], at.ns[i]);
            let (direct, rays) = direct_irradiance(world, [p, n, n], None, count, &mut sample);
            run.rays.add(RayKind::Shadow, rays);
            phase.advance(1);
            PointIrradiance { direct, indirect: indirect[i] }
        };
        let found = run.install(|| (0..at.len()).into_par_iter().map(lit).collect());
        run.check()?;
        Ok(found)
    }
}
