//! Light sources: next-event estimation, densities for multiple importance sampling, photon
//! emission.
//!
//! Computes   E(p, n) = Σ_lights ∫ L cos θ V dω by samples, and photons of flux Φ / p.
//! Input      [`Scene`], [`Geometry`]: emissive mesh triangles, quads (as triangles), spheres,
//!            suns, points, spots; the sky, a map of it.
//! Output     [`LightTable`], built once. The sky is *not* part of next-event estimation, but for
//!            the bright part of a map ([`Sky`]): cosine-sampled rays find it with little noise; it
//!            is part of photon emission.
//! Method     A light is picked in two steps: a group by its estimated unoccluded irradiance at p
//!            (`pick`), then a light of the group by power. Up to 64 lights are groups of their
//!            own. Triangles are sampled by area, spheres by the cone around them (a sample counts
//!            only if its ray meets the tessellated sphere), suns by their disc. Guarantees every
//!            point of every light that can reach p has a positive density;
//!            [`LightTable::pdf_solid_angle`] is exactly the density of [`LightTable::sample`].
//! Not        occlusion. A narrow spot or a lamp behind a wall is picked as if it were visible.
//! Cost       O(groups) ≤ 64 per sample and per density; about 100 B per emissive triangle.
//! Knobs      `direct.light_samples` (shadow rays per camera sample, default 1).

mod direct;
mod photon_emission;
mod pick;
mod sample;
mod sky;
#[cfg(test)]
mod tests;

use glam::Vec3;

use crate::math::{Aabb, Ray};
use crate::radiometry::Rgb;
use crate::sampling::Discrete;
use crate::scene::{Light, Material, Scene};
use crate::settings::section;
use crate::tessellate::Geometry;

pub use direct::{direct_irradiance, light_visible, seen_irradiance, shadow_ray};
use pick::{Groups, MOST, MOST_FINE};
use sky::Bright;
pub use sky::Sky;

/// One connection to a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction to the light.
    pub wi: Vec3,
    /// Shadow ray: open segment from the shading point to just short of the light.
    pub ray: Ray,
    /// Radiance over the density of the whole choice (light and point), so that E ≈ cos θ ·
    /// `weight` when unoccluded.
    pub weight: Rgb,
    /// Density of `wi` per steradian, including the choice of light; infinite for delta lights.
    pub pdf_solid_angle: f32,
    /// Set for tessellated sphere lights: the sample counts only if the closest hit of `ray` is a
    /// triangle of this scene light.
    pub must_hit_light: Option<u32>,
}

impl LightSample {
    /// True for a point on emissive triangles, which rays of the surface may meet as well.
    pub fn is_on_surface(&self) -> bool {
        let bounded = self.must_hit_light.is_some() || self.ray.t_max.is_finite();
        bounded && self.pdf_solid_angle.is_finite()
    }
}

/// A photon leaving a light.
#[derive(Clone, Copy, Debug)]
pub struct PhotonEmission {
    /// Ray of the photon.
    pub ray: Ray,
    /// Flux of all lights divided by the density of this choice, W per channel: divide by the
    /// number of photons tried.
    pub flux: Rgb,
    /// It is the sky's: no shadow ray computes its first hit.
    pub from_sky: bool,
}

section! {
    /// How direct light is sampled.
    pub struct DirectSettings in "direct" {
        /// Points on lights, each with a shadow ray, per camera sample. A single light without
        /// extent takes one.
        light_samples: Option<u32> = None, follows "denoise: 2 with a denoiser, else 4",
            in from(1.0).to(4096.0), unit "shadow rays";
        /// Whether lamps are chosen by what of them is seen around a point.
        learned: bool = true;
    }
}

impl DirectSettings {
    /// Shadow rays of a camera sample, where no denoiser follows.
    pub fn light_samples(&self) -> u32 {
        self.light_samples.unwrap_or(4)
    }
}

/// A masked triangle emits only where it exists.
#[derive(Clone, Debug)]
struct Cutout {
    material: Material,
    uvs: [glam::Vec2; 3],
    texture: Option<crate::scene::Texture>,
}

impl Cutout {
    fn exists(&self, b: glam::Vec2) -> bool {
        let uv = self.uvs[0] * (1.0 - b.x - b.y) + self.uvs[1] * b.x + self.uvs[2] * b.y;
        self.material.opacity * self.texture.as_ref().map_or(1.0, |t| t.mask(uv)) >= 0.5
    }
}

/// A source of direct light, in the form it is sampled.
#[derive(Clone, Debug)]
enum Source {
    Triangle {
        v0: Vec3,
        e1: Vec3,
        e2: Vec3,
        normal: Vec3,
        area: f32,
        radiance: Rgb,
        cutout: Option<Box<Cutout>>,
    },
    /// `radius` encloses the tessellation; `faces` are its triangles with their areas.
    Sphere {
        light: u32,
        center: Vec3,
        radius: f32,
        radiance: Rgb,
        faces: Vec<[Vec3; 3]>,
        pick_face: Discrete,
        area: f32,
    },
    DeltaSun {
        to_sun: Vec3,
        irradiance: Rgb,
    },
    Sun {
        to_sun: Vec3,
        radiance: Rgb,
        one_minus_cos: f32,
    },
    Map(Bright),
    Point {
        position: Vec3,
        intensity: Rgb,
    },
    Spot {
        position: Vec3,
        axis: Vec3,
        intensity: Rgb,
        cos_inner: f32,
        cos_outer: f32,
    },
}

/// All lights but none of their shadows.
#[derive(Debug, Default)]
pub struct LightTable {
    /// The sky without suns and without the bright part of a map.
    pub sky: Sky,
    sources: Vec<Source>,
    /// Source of every triangle of the geometry; `u32::MAX` for none. Empty without sources of that
    /// kind.
    source_of_triangle: Vec<u32>,
    groups: Groups,
    fine: Groups,
    /// Photon emission: sources in order, then the sky.
    emission: Discrete,
    power: Rgb,
    center: Vec3,
    radius: f32,
    diagonal: f32,
}

impl LightTable {
    /// True when a single shadow ray is all there is to know: one light, without extent.
    pub fn is_one_delta(&self) -> bool {
        matches!(
            self.sources.as_slice(),
            [Source::DeltaSun { .. } | Source::Point { .. } | Source::Spot { .. }]
        )
    }
    /// True for one light that shadow rays go to: what they differ in is what hides it, not which
    /// of many they asked.
    pub fn is_one(&self) -> bool {
        self.sources.len() == 1
    }
    /// How many groups of lights a choice made beforehand tells apart ([`LightTable::sample_by`]).
    pub fn choices(&self) -> usize {
        self.fine.len()
    }
    /// About the unoccluded irradiance at `p` with normal `n` from one of these groups.
    pub fn importance(&self, choice: usize, p: Vec3, n: Vec3) -> f32 {
        self.fine.importance(&self.sources, choice, p, n)
    }
    /// Collects emissive triangles and lights. Lights of zero power are left out.
    pub fn new(scene: &Scene, geometry: &Geometry) -> Self {
        let mut table = Self {
            sky: Sky::new(
                scene
                    .lights
                    .iter()
                    .map(|l| if let Light::Sky { radiance } = l { *radiance } else { Rgb::ZERO })
                    .sum(),
            ),
            diagonal: geometry.bounds.diagonal(),
            ..Self::default()
        };
        if !geometry.bounds.is_empty() {
            table.center = geometry.bounds.center();
            table.radius = 0.5001 * table.diagonal;
        }
        let is_sphere = |light: u32| {
            light != u32::MAX && matches!(scene.lights[light as usize], Light::Sphere { .. })
        };
        for t in 0..geometry.len() as u32 {
            if geometry.material(t).emits() && !is_sphere(geometry.light_of[t as usize]) {
                table.claim(t, geometry.len());
                table.sources.push(triangle_source(geometry, t));
            }
        }
        let mut of_light = std::collections::BTreeMap::<u32, Vec<u32>>::new();
        for t in (0..geometry.len() as u32).filter(|&t| is_sphere(geometry.light_of[t as usize])) {
            of_light.entry(geometry.light_of[t as usize]).or_default().push(t);
        }
        for (index, light) in scene.lights.iter().enumerate() {
            match *light {
                Light::Sphere { center, radiance, .. } if radiance.max_element() > 0.0 => {
                    let Some(triangles) = of_light.get(&(index as u32)) else { continue };
                    triangles.iter().for_each(|&t| table.claim(t, geometry.len()));
                    let faces: Vec<_> = triangles.iter().map(|&t| geometry.corners(t)).collect();
                    let radius =
                        faces.iter().flatten().map(|p| p.distance(center)).fold(0.0, f32::max)
                            * (1.0 + 1e-6);
                    let pick_face =
                        Discrete::new(triangles.iter().map(|&t| f64::from(geometry.area(t))));
                    let area = pick_face.total() as f32;
                    table.sources.push(Source::Sphere {
                        light: index as u32,
                        center,
                        radius,
                        radiance,
                        faces,
                        pick_face,
                        area,
                    });
                }
                Light::Sun { direction_to_sun, irradiance, angular_radius_deg }
                    if irradiance.max_element() > 0.0 =>
                {
                    let to_sun = direction_to_sun.normalize();
                    table.sources.push(if angular_radius_deg > 0.0 {
                        let sin = angular_radius_deg.to_radians().sin();
                        let half = (angular_radius_deg.to_radians() * 0.5).sin();
                        Source::Sun {
                            to_sun,
                            radiance: irradiance / (std::f32::consts::PI * sin * sin),
                            one_minus_cos: 2.0 * half * half,
                        }
                    } else {
                        Source::DeltaSun { to_sun, irradiance }
                    });
                }
                Light::Environment { ref map } => {
                    table.sources.extend(table.sky.set_map(map).map(Source::Map))
                }
                Light::Point { position, intensity } if intensity.max_element() > 0.0 => {
                    table.sources.push(Source::Point { position, intensity })
                }
                Light::Spot { position, direction, intensity, inner_deg, outer_deg }
                    if intensity.max_element() > 0.0 =>
                {
                    table.sources.push(Source::Spot {
                        position,
                        axis: direction.normalize(),
                        intensity,
                        cos_inner: inner_deg.to_radians().cos(),
                        cos_outer: outer_deg.to_radians().cos(),
                    })
                }
                _ => {}
            }
        }
        let mut powers: Vec<Rgb> = table.sources.iter().map(|s| table.power_of(s)).collect();
        table.groups = Groups::new(&table.sources, &powers, MOST);
        table.fine = Groups::new(&table.sources, &powers, MOST_FINE);
        powers.push(table.sky.integral() * (std::f32::consts::PI * table.radius * table.radius));
        table.emission = Discrete::new(powers.iter().map(|p| f64::from(p.element_sum())));
        table.power = powers.iter().copied().sum();
        table
    }

    fn claim(&mut self, triangle: u32, triangles: usize) {
        if self.source_of_triangle.is_empty() {
            self.source_of_triangle = vec![u32::MAX; triangles];
        }
        self.source_of_triangle[triangle as usize] = self.sources.len() as u32;
    }

    /// Flux of all lights, W per channel. The sun's and the sky's are what enters the scene's
    /// bounding sphere.
    pub fn power(&self) -> Rgb {
        self.power
    }

    /// Says everything about the lights as text, for fingerprints of a scene; not for people.
    pub fn describe(&self, write: &mut dyn FnMut(&str)) {
        write(&format!("{:?}", self.sky.constant));
        if self.sky.has_map() {
            write(&format!("{:?}", self.sky));
        }
        for source in &self.sources {
            match source {
                // Emissive triangles follow from geometry and materials.
                Source::Triangle { .. } => {}
                other => write(&format!("{other:?}")),
            }
        }
    }

    /// True when nothing emits, not even the sky.
    pub fn is_dark(&self) -> bool {
        self.emission.is_empty()
    }

    /// True when next-event estimation has nothing to sample (the sky alone does not count).
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Radiance from a direction that meets no surface: the sky and the disc of every sun that has
    /// one.
    pub fn background(&self, dir: Vec3) -> Rgb {
        self.sky.radiance(dir) + self.sun_disc(dir)
    }

    /// Radiance of the sun discs around the unit direction `dir` and of the bright part of a map,
    /// without the sky.
    pub fn sun_disc(&self, dir: Vec3) -> Rgb {
        self.groups.suns.iter().map(|&i| sun_disc(&self.sources[i as usize], dir)).sum()
    }
}

/// Radiance of one sun disc; by the chord, which is precise for narrow discs: |a − b|² = 2 (1 −
/// cos).
fn sun_disc(source: &Source, dir: Vec3) -> Rgb {
    match *source {
        Source::Sun { to_sun, radiance, one_minus_cos }
            if to_sun.distance_squared(dir) <= 2.0 * one_minus_cos =>
        {
            radiance
        }
        Source::Map(ref bright) => bright.part.texel(dir),
        _ => Rgb::ZERO,
    }
}

fn triangle_source(geometry: &Geometry, t: u32) -> Source {
    let [a, b, c] = geometry.corners(t);
    let material = geometry.material(t);
    let cutout = (material.opacity_texture.is_some() || material.opacity < 0.5).then(|| {
        let corner = |u, v| geometry.uv(t, u, v);
        Box::new(Cutout {
            material: material.clone(),
            uvs: [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)],
            texture: material.opacity_texture.map(|i| geometry.textures[i as usize].clone()),
        })
    });
    Source::Triangle {
        v0: a,
        e1: b - a,
        e2: c - a,
        normal: geometry.face_normals[t as usize],
        area: geometry.area(t),
        radiance: material.emission,
        cutout,
    }
}

impl Source {
    /// Box around a source with a place; `None` for suns.
    fn bounds(&self) -> Option<Aabb> {
        match *self {
            Self::Triangle { v0, e1, e2, .. } => Some(Aabb::around([v0, v0 + e1, v0 + e2])),
            Self::Sphere { center, radius, .. } => {
                Some(Aabb { min: center - radius, max: center + radius })
            }
            Self::Point { position, .. } | Self::Spot { position, .. } => {
                Some(Aabb { min: position, max: position })
            }
            Self::DeltaSun { .. } | Self::Sun { .. } | Self::Map(_) => None,
        }
    }
}

/// Share of a spot's intensity at `cos` from its axis: smoothstep in the cosine between the two
/// half angles.
fn spot_falloff(cos: f32, cos_inner: f32, cos_outer: f32) -> f32 {
    if cos >= cos_inner {
        1.0
    } else if cos <= cos_outer {
        0.0
    } else {
        let t = (cos - cos_outer) / (cos_inner - cos_outer);
        t * t * (3.0 - 2.0 * t)
    }
}
