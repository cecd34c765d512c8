//! Pass 1: what the camera sees, and the points that need indirect light.
//!
//! ```text
//! pixel = mean over camera samples of
//!         [ seen emission + albedo · (direct irradiance + E(point of the sample)) / π ]
//! ```
//! Camera samples (`spp` a pixel, drawn by the pixel filter) carry visibility, albedo and direct
//! light. Indirect irradiance E is evaluated at **shading points**: the samples of one pixel that
//! lie on one surface (like normal, like plane) share a point at their mean position (on a curved
//! surface at the first one's), weighted by their summed albedo. A pixel across an edge gets a
//! point for each side, so edges stay antialiased at about 1.1 points a pixel.
//!
//! Input   [`World`], [`RecordSettings`], seed. Output  [`CameraSamples`]; the source's "pass 1"
//!         `[Course07]`.
//! Guarantees  samples and points do not depend on the method or the thread count. Sky light on
//!             surfaces is not in `direct`; the sky that the camera sees is in `emission`. Cost
//!             `spp · (1 + light_samples)` rays a pixel; about 100 B a pixel.

use std::ops::Range;

use glam::{DVec3, Vec2, Vec3};

use crate::error::Result;
use crate::film::{Film, Layer, layer};
use crate::guide::LampGuide;
use crate::journal::stored;
use crate::math::{Ray, offset_origin};
use crate::radiometry::Rgb;
use crate::run::{RayKind, Run};
use crate::sampling::{FilterShape, PixelFilter, Sobol, Stream};
use crate::settings::section;
use crate::shading::{DirectSettings, Surface, World, direct_irradiance};

section! {
    /// How the camera is sampled.
    pub struct RecordSettings in "record" {
        /// Camera samples per pixel, of every method but path tracing.
        spp: u32 = 16, in from(1.0).to(4096.0), unit "samples per pixel";
        /// Pixel filter, of every method: path tracing too.
        filter: FilterShape = FilterShape::Box;
        /// Where the filter ends, from the pixel's centre.
        filter_radius: Option<f32> = None,
            follows "½ for the box, 1 for the tent, 1½ for the Gaussian",
            in above(0.0).to(8.0), unit "pixels";
        /// Cosine of the largest angle between normals that share a shading point.
        share_normal_cos: f32 = 0.97, in from(-1.0).to(1.0);
        /// Largest distance of a sample from the plane of the point it shares.
        share_plane: f32 = 0.5, unit "pixel footprints";
    }
}

impl RecordSettings {
    /// The pixel filter with its radius.
    pub fn pixel_filter(&self) -> PixelFilter {
        PixelFilter {
            shape: self.filter,
            radius: self.filter_radius.unwrap_or(self.filter.default_radius()),
        }
    }
}

/// Points that need indirect irradiance; arrays of equal length, ordered by pixel.
#[derive(Clone, Debug, Default)]
pub struct ShadingPoints {
    /// Position, lifted off the surface on the seen side.
    pub p: Vec<Vec3>,
    /// Unit geometric normal of the seen side.
    pub ng: Vec<Vec3>,
    /// Unit shading normal of the seen side.
    pub ns: Vec<Vec3>,
    /// Σ albedo of the samples that share the point, over `spp`: the pixel's indirect light is Σ
    /// `albedo_weight · E / π`.
    pub albedo_weight: Vec<Rgb>,
    /// Pixel (row · width + column).
    pub pixel: Vec<u32>,
    /// Side of a pixel at the point, scene units.
    pub footprint: Vec<f32>,
}

impl ShadingPoints {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.p.len()
    }
    /// True without points.
    pub fn is_empty(&self) -> bool {
        self.p.is_empty()
    }
}

/// Pass 1's result: per pixel everything but indirect light, and the points that need it.
#[derive(Clone, Debug, Default)]
pub struct CameraSamples {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Zero of positions in the user's space.
    pub origin: DVec3,
    /// Emission and background that the camera sees, per pixel.
    pub emission: Vec<Rgb>,
    /// Direct light reflected to the camera, per pixel.
    pub direct: Vec<Rgb>,
    /// Mean albedo, per pixel.
    pub albedo: Vec<Rgb>,
    /// Mean shading normal, per pixel (not unit at edges; zero where nothing is hit).
    pub normal: Vec<Vec3>,
    /// Mean position of the hits, per pixel.
    pub position: Vec<Vec3>,
    /// Mean depth along the view axis, per pixel; infinite where nothing is hit.
    pub depth: Vec<f32>,
    /// Points that need indirect light.
    pub points: ShadingPoints,
}

/// Size of the cells that learn which lamps are seen, over the extent.
const GUIDE_CELL: f32 = 0.014;

struct Group {
    first: Surface,
    /// Largest distance of a sample from the first one's plane.
    bend: f32,
    p: Vec3,
    ns: Vec3,
    albedo: Rgb,
    count: f32,
}

#[derive(Default)]
struct Row {
    emission: Vec<Rgb>,
    direct: Vec<Rgb>,
    albedo: Vec<Rgb>,
    normal: Vec<Vec3>,
    position: Vec<Vec3>,
    depth: Vec<f32>,
    points: ShadingPoints,
    camera_rays: u64,
    shadow_rays: u64,
}

stored!(ShadingPoints { p, ng, ns, albedo_weight, pixel, footprint });
stored!(Row {
    emission,
    direct,
    albedo,
    normal,
    position,
    depth,
    points,
    camera_rays,
    shadow_rays,
});

impl Row {
    fn skip(&mut self) {
        self.emission.push(Rgb::ZERO);
        self.direct.push(Rgb::ZERO);
        self.albedo.push(Rgb::ZERO);
        self.normal.push(Vec3::ZERO);
        self.position.push(Vec3::ZERO);
        self.depth.push(f32::INFINITY);
    }
}

/// Shoots the camera samples (phase `record`).
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn camera_samples(
    world: &World,
    settings: &RecordSettings,
    direct: &DirectSettings,
    seed: u64,
    run: &Run,
) -> Result<CameraSamples> {
    camera_samples_where(world, settings, direct, seed, run, &|_, _| true)
}

/// As [`camera_samples`], but only in the pixels (x, y) that are `wanted`; the others stay black
/// and without points.
///
/// # Errors
/// [`crate::error::Error::Interrupted`].
pub fn camera_samples_where(
    world: &World,
    settings: &RecordSettings,
    direct: &DirectSettings,
    seed: u64,
    run: &Run,
    wanted: &(dyn Fn(u32, u32) -> bool + Sync),
) -> Result<CameraSamples> {
    let (width, height) = (world.camera.width, world.camera.height);
    let lamps = match direct.learned && direct.light_samples() > 0 {
        true => LampGuide::new(world, GUIDE_CELL * world.around.extent, seed, run)?,
        false => None,
    };
    let eye = Eye { world, settings, direct, lamps: lamps.as_ref(), seed };
    let phase = run.phase("record", u64::from(height));
    let look = |y: usize| {
        let (mut row, y) = (Row::default(), y as u32);
        if !run.cancelled() {
            for x in 0..width {
                if wanted(x, y) {
                    eye.pixel(x, y, &mut row);
                    row.camera_rays += u64::from(settings.spp);
                } else {
                    row.skip();
                }
            }
        }
        run.rays.add(RayKind::Primary, row.camera_rays);
        run.rays.add(RayKind::Shadow, row.shadow_rays);
        row
    };
    let look_all = |(): &mut (), rows: Range<usize>| rows.map(look).collect();
    let rows: Vec<Row> = phase.blocks((height as usize, 1), (), look_all)?;
    let mut out = CameraSamples { width, height, origin: world.origin, ..CameraSamples::default() };
    for row in rows {
        out.emission.extend(row.emission);
        out.direct.extend(row.direct);
        out.albedo.extend(row.albedo);
        out.normal.extend(row.normal);
        out.position.extend(row.position);
        out.depth.extend(row.depth);
        out.points.p.extend(row.points.p);
        out.points.ng.extend(row.points.ng);
        out.points.ns.extend(row.points.ns);
        out.points.albedo_weight.extend(row.points.albedo_weight);
        out.points.pixel.extend(row.points.pixel);
        out.points.footprint.extend(row.points.footprint);
    }
    Ok(out)
}

/// What a pixel is looked at with.
struct Eye<'a> {
    world: &'a World,
    settings: &'a RecordSettings,
    direct: &'a DirectSettings,
    lamps: Option<&'a LampGuide>,
    seed: u64,
}

impl Eye<'_> {
    fn pixel(&self, x: u32, y: u32, row: &mut Row) {
        let Self { world, settings, direct: direct_settings, lamps, seed } = *self;
        let index = y * world.camera.width + x;
        let lens = Sobol::new(seed, Stream::Camera, u64::from(index));
        let lamp = Sobol::new(seed, Stream::Direct, u64::from(index));
        let (_, _, forward) = world.camera.axes();
        let (spp, filter) = (settings.spp as f32, settings.pixel_filter());
        let (mut emission, mut direct, mut albedo, mut normal, mut position, mut depth) =
            (Rgb::ZERO, Rgb::ZERO, Rgb::ZERO, Vec3::ZERO, Vec3::ZERO, 0.0);
        let mut groups: Vec<Group> = Vec::new();
        let mut hits = 0.0;
        for s in 0..settings.spp {
            let dir = world
                .camera
                .direction(Vec2::new(x as f32, y as f32) + filter.position(lens.sample_2d(s, 0)));
            let Some(surface) = world.closest(&Ray::new(world.camera.eye, dir)) else {
                emission += world.lights.background(dir);
                continue;
            };
            hits += 1.0;
            emission += surface.le;
            albedo += surface.albedo;
            normal += surface.ns;
            position += surface.p;
            let z = (surface.p - world.camera.eye).dot(forward);
            depth += z;
            if surface.albedo == Rgb::ZERO {
                continue;
            }
            let count = direct_settings.light_samples();
            let choice = lamps.and_then(|lamps| lamps.at(surface.p, surface.ns));
            let (e, rays) = direct_irradiance(
                world,
                [surface.p, surface.ng, surface.ns],
                choice,
                count,
                &mut |i| {
                    let k = s * count + i;
                    (lamp.sample_1d(k, 0), lamp.sample_2d(k, 1))
                },
            );
            row.shadow_rays += rays;
            direct += surface.albedo * e * std::f32::consts::FRAC_1_PI;
            let reach = settings.share_plane * z * world.camera.pixel_angle();
            let shared = groups.iter_mut().find(|g| {
                g.first.ns.dot(surface.ns) >= settings.share_normal_cos
                    && g.first.ng.dot(surface.ng) >= settings.share_normal_cos
                    && g.first.ng.dot(surface.p - g.first.p).abs() <= reach
            });
            match shared {
                Some(g) => {
                    g.bend = g.bend.max(g.first.ng.dot(surface.p - g.first.p).abs());
                    g.p += surface.p;
                    g.ns += surface.ns;
                    g.albedo += surface.albedo;
                    g.count += 1.0;
                }
                None => groups.push(Group {
                    first: surface,
                    bend: 0.0,
                    p: surface.p,
                    ns: surface.ns,
                    albedo: surface.albedo,
                    count: 1.0,
                }),
            }
        }
        row.emission.push(emission / spp);
        row.direct.push(direct / spp);
        row.albedo.push(albedo / spp);
        row.normal.push(normal / spp);
        row.position.push(if hits > 0.0 { position / hits } else { Vec3::ZERO });
        row.depth.push(if hits > 0.0 { depth / hits } else { f32::INFINITY });
        for g in groups {
            // On a curved surface the mean would lie inside the body, and rays from there would
            // meet its inner side.
            let flat =
                g.bend <= offset_origin(g.first.p, g.first.ng, world.diagonal).distance(g.first.p);
            let p = if flat { g.p / g.count } else { g.first.p };
            row.points.p.push(offset_origin(p, g.first.ng, world.diagonal));
            row.points.ng.push(g.first.ng);
            row.points.ns.push(g.ns.normalize_or(g.first.ns));
            row.points.albedo_weight.push(g.albedo / spp);
            row.points.pixel.push(index);
            row.points
                .footprint
                .push((p - world.camera.eye).dot(forward) * world.camera.pixel_angle());
        }
    }
}

/// Layers of [`CameraSamples::compose`], which all methods that start from camera samples share.
pub const LAYERS: [Layer; 8] = [
    layer::DIRECT,
    layer::EMISSION,
    layer::INDIRECT,
    layer::IRRADIANCE,
    layer::ALBEDO,
    layer::NORMAL,
    layer::POSITION,
    layer::DEPTH,
];

impl CameraSamples {
    /// The image for an irradiance at every shading point, with the layers that all methods share:
    /// beauty, direct, emission, indirect, irradiance (albedo-weighted mean), albedo, N, P, depth.
    ///
    /// `irradiance` has one entry a point.
    pub fn compose(&self, irradiance: &[Rgb]) -> Film {
        let pixels = (self.width * self.height) as usize;
        let indirect = self.reflect(irradiance);
        let mut film = Film::new(self.width, self.height);
        let beauty: Vec<Rgb> =
            (0..pixels).map(|i| self.emission[i] + self.direct[i] + indirect[i]).collect();
        film.set_rgb("", &beauty);
        film.set_rgb("direct", &self.direct);
        film.set_rgb("emission", &self.emission);
        film.set_rgb("indirect", &indirect);
        film.set_rgb("irradiance", &self.mean(irradiance));
        film.set_rgb("albedo", &self.albedo);
        film.set_xyz("N", &self.normal);
        film.set_xyz("P", &self.position);
        film.origin = self.origin;
        film.set("depth.Z", self.depth.clone());
        film
    }

    /// Per pixel Σ `albedo_weight · value / π`: what a value of irradiance at the points adds to
    /// the picture.
    pub fn reflect(&self, values: &[Rgb]) -> Vec<Rgb> {
        let mut out = vec![Rgb::ZERO; (self.width * self.height) as usize];
        for ((&pixel, &weight), &value) in
            self.points.pixel.iter().zip(&self.points.albedo_weight).zip(values)
        {
            out[pixel as usize] += weight * value * std::f32::consts::FRAC_1_PI;
        }
        out
    }

    /// Per pixel the mean of a quantity of the points, weighted by albedo.
    pub fn mean(&self, values: &[Rgb]) -> Vec<Rgb> {
        let pixels = (self.width * self.height) as usize;
        let (mut sum, mut weight) = (vec![Rgb::ZERO; pixels], vec![0.0; pixels]);
        for ((&pixel, &albedo), &value) in
            self.points.pixel.iter().zip(&self.points.albedo_weight).zip(values)
        {
            let w = albedo.element_sum();
            sum[pixel as usize] += value * w;
            weight[pixel as usize] += w;
        }
        sum.iter().zip(&weight).map(|(&s, &w)| if w > 0.0 { s / w } else { Rgb::ZERO }).collect()
    }
}
