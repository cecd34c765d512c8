//! The text of a Mitsuba 3 scene.

use std::fmt::Write as _;

use glam::{DVec3, Vec2, Vec3};

use crate::radiometry::{MAX_ALBEDO, Rgb};
use crate::scene::{Light, Material, Placement, Scene, Texture};

/// A scene description under construction: shapes may name materials that are described later.
#[derive(Debug)]
pub struct Document {
    origin: DVec3,
    head: String,
    materials: String,
    body: String,
}

fn numbers(v: Vec3) -> String {
    format!("{}, {}, {}", v.x, v.y, v.z)
}

/// A point in the user's space.
fn place(p: DVec3) -> String {
    format!("{}, {}, {}", p.x, p.y, p.z)
}

fn point(name: &str, p: DVec3) -> String {
    format!("<point name=\"{name}\" x=\"{}\" y=\"{}\" z=\"{}\"/>", p.x, p.y, p.z)
}

fn area(radiance: Rgb) -> String {
    format!(
        "<emitter type=\"area\"><rgb name=\"radiance\" value=\"{}\"/></emitter>",
        numbers(radiance)
    )
}

const BLACK: &str = "<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0\"/></bsdf>";

impl Document {
    /// Integrator and sensor. Mitsuba's `path` takes a masked surface for solid when it asks
    /// whether a light is seen, and finds the light behind it by chance only; `volpath` asks
    /// through masks.
    pub fn new(scene: &Scene) -> Self {
        let c = &scene.camera;
        let masked = scene.materials.iter().any(|m| m.opacity_texture.is_some() || m.opacity < 0.5);
        let integrator = if masked { "volpath" } else { "path" };
        let head = format!(
            r#"<?xml version="1.0" encoding="utf-8"?>
<scene version="3.0.0">
    <default name="spp" value="64"/>
    <default name="width" value="{}"/>
    <default name="height" value="{}"/>
    <default name="integrator" value="{integrator}"/>
    <integrator type="$integrator"/>
    <sensor type="perspective">
        <string name="fov_axis" value="y"/>
        <float name="fov" value="{}"/>
        <float name="near_clip" value="1e-4"/>
        <float name="far_clip" value="1e8"/>
        <transform name="to_world"><lookat origin="{}" target="{}" up="{}"/></transform>
        <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
        <film type="hdrfilm">
            <integer name="width" value="$width"/>
            <integer name="height" value="$height"/>
            <string name="pixel_format" value="rgb"/>
            <string name="component_format" value="float32"/>
            <rfilter type="box"/>
        </film>
    </sensor>
"#,
            c.width,
            c.height,
            c.vfov_deg,
            place(c.eye.as_dvec3() + scene.origin),
            place(c.target.as_dvec3() + scene.origin),
            numbers(c.up)
        );
        Self { origin: scene.origin, head, materials: String::new(), body: String::new() }
    }

    /// A PLY file of one material. Without `normals` faces are flat, where Mitsuba would make
    /// normals of its own.
    pub fn mesh(&mut self, file: &str, id: u32, material: &Material, normals: bool) {
        let light = if material.emits() { area(material.emission) } else { String::new() };
        let faces = if normals { "" } else { "<boolean name=\"face_normals\" value=\"true\"/>" };
        let _ = writeln!(
            self.body,
            "    <shape type=\"ply\"><string name=\"filename\" value=\"{file}\"/>{}{faces}<ref \
             id=\"material-{id}\"/>{light}</shape>",
            self.moved()
        );
    }

    /// What brings a mesh file into the user's space.
    fn moved(&self) -> String {
        let DVec3 { x, y, z } = self.origin;
        if self.origin == DVec3::ZERO {
            return String::new();
        }
        format!(
            "<transform name=\"to_world\"><translate x=\"{x}\" y=\"{y}\" z=\"{z}\"/></transform>"
        )
    }

    /// A two-sided diffuse material, under a mask where it has one.
    pub fn material(
        &mut self,
        id: u32,
        material: &Material,
        [albedo, mask]: [Option<&Texture>; 2],
    ) {
        let bitmap = |slot: &str, file: &str, texture: &Texture, more: &str| {
            let placed = placement(&texture.placement);
            format!(
                "<texture type=\"bitmap\" name=\"{slot}\"><string name=\"filename\" \
                 value=\"{file}-{id}.png\"/>{placed}{more}</texture>"
            )
        };
        let plain_albedo = material.albedo.clamp(Rgb::ZERO, Rgb::splat(MAX_ALBEDO));
        let reflectance = match albedo {
            Some(texture) => bitmap("reflectance", "texture", texture, ""),
            None => format!("<rgb name=\"reflectance\" value=\"{}\"/>", numbers(plain_albedo)),
        };
        let plain = |id: &str| {
            format!(
                "<bsdf type=\"twosided\"{id}><bsdf type=\"diffuse\">{reflectance}</bsdf></bsdf>"
            )
        };
        let named = format!(" id=\"material-{id}\"");
        let nearest = "<string name=\"filter_type\" value=\"nearest\"/><boolean name=\"raw\" \
                       value=\"true\"/>";
        let text = if let Some(mask) = mask {
            format!(
                "<bsdf type=\"mask\"{named}>{}{}</bsdf>",
                bitmap("opacity", "mask", mask, nearest),
                plain("")
            )
        } else if material.opacity < 0.5 {
            format!(
                "<bsdf type=\"mask\"{named}><float name=\"opacity\" value=\"0\"/>{}</bsdf>",
                plain("")
            )
        } else {
            plain(&named)
        };
        let _ = writeln!(self.materials, "    {text}");
    }

    /// A light; `around` is a ball that holds the scene. The quad's mesh is `quad-NUMBER.ply`.
    pub fn light(&mut self, number: usize, light: &Light, around: (Vec3, f32)) {
        let rgb =
            |name: &str, value: Rgb| format!("<rgb name=\"{name}\" value=\"{}\"/>", numbers(value));
        let user = |p: Vec3| p.as_dvec3() + self.origin;
        let text = match *light {
            Light::Quad { radiance, .. } => {
                let file = format!("<string name=\"filename\" value=\"quad-{number}.ply\"/>");
                format!(
                    "<shape type=\"ply\">{file}{}<boolean name=\"face_normals\" \
                     value=\"true\"/>{BLACK}{}</shape>",
                    self.moved(),
                    area(radiance)
                )
            }
            Light::Sphere { center, radius, radiance } => {
                let center = point("center", user(center));
                format!(
                    "<shape type=\"sphere\">{center}<float name=\"radius\" \
                     value=\"{radius}\"/>{BLACK}{}</shape>",
                    area(radiance)
                )
            }
            Light::Sun { direction_to_sun, irradiance, angular_radius_deg: 0.0 } => {
                let d = -direction_to_sun;
                let direction = format!(
                    "<vector name=\"direction\" x=\"{}\" y=\"{}\" z=\"{}\"/>",
                    d.x, d.y, d.z
                );
                format!(
                    "<emitter type=\"directional\">{direction}{}</emitter>",
                    rgb("irradiance", irradiance)
                )
            }
            Light::Sun { direction_to_sun, irradiance, angular_radius_deg } => {
                // So far away that its direction is the same to a thousandth of a degree for all of
                // the scene.
                let (center, radius) = around;
                let distance = 2e4 * radius;
                let center = user(center);
                let at = center + (direction_to_sun * distance).as_dvec3();
                let angle = angular_radius_deg.to_radians();
                let up = direction_to_sun.any_orthonormal_vector();
                let disc = format!(
                    "<transform name=\"to_world\"><scale value=\"{}\"/><lookat origin=\"{}\" \
                     target=\"{}\" up=\"{}\"/></transform>",
                    distance * angle.tan(),
                    place(at),
                    place(center),
                    numbers(up)
                );
                let radiance = irradiance / (std::f32::consts::PI * angle.sin().powi(2));
                format!("<shape type=\"disk\">{disc}{BLACK}{}</shape>", area(radiance))
            }
            Light::Sky { radiance } => {
                format!("<emitter type=\"constant\">{}</emitter>", rgb("radiance", radiance))
            }
            Light::Environment { ref map } => {
                let m = map.world_from_map;
                let rows: Vec<String> = (0..3)
                    .map(|i| format!("{} 0", m.row(i).to_array().map(|v| v.to_string()).join(" ")))
                    .collect();
                let matrix = format!(
                    "<transform name=\"to_world\"><matrix value=\"{} 0 0 0 1\"/></transform>",
                    rows.join(" ")
                );
                format!(
                    "<emitter type=\"envmap\"><string name=\"filename\" \
                     value=\"environment-{number}.exr\"/>{matrix}</emitter>"
                )
            }
            Light::Point { position, intensity } => {
                let at = point("position", user(position));
                format!("<emitter type=\"point\">{at}{}</emitter>", rgb("intensity", intensity))
            }
            Light::Spot { position, direction, intensity, inner_deg, outer_deg } => {
                let up = direction.any_orthonormal_vector();
                let at = format!(
                    "<transform name=\"to_world\"><lookat origin=\"{}\" target=\"{}\" \
                     up=\"{}\"/></transform>",
                    place(user(position)),
                    place(user(position) + direction.as_dvec3()),
                    numbers(up)
                );
                let cone = format!(
                    "<float name=\"cutoff_angle\" value=\"{outer_deg}\"/><float \
                     name=\"beam_width\" value=\"{}\"/>",
                    inner_deg.min(outer_deg * 0.999)
                );
                format!(
                    "<emitter type=\"spot\">{at}{cone}{}</emitter>",
                    rgb("intensity", intensity)
                )
            }
        };
        let _ = writeln!(self.body, "    {text}");
    }

    /// The whole text.
    pub fn finish(self) -> String {
        format!("{}{}{}</scene>\n", self.head, self.materials, self.body)
    }
}

/// Where a texture lies, as Mitsuba takes it: v points down there.
fn placement(p: &Placement) -> String {
    let mut text = String::new();
    if (p.scale, p.offset) != (Vec2::ONE, Vec2::ZERO) {
        let down = 1.0 - p.scale.y - p.offset.y;
        text = format!(
            "<transform name=\"to_uv\"><scale x=\"{}\" y=\"{}\"/><translate x=\"{}\" \
             y=\"{down}\"/></transform>",
            p.scale.x, p.scale.y, p.offset.x
        );
    }
    if p.clamp {
        text += "<string name=\"wrap_mode\" value=\"clamp\"/>";
    }
    text
}
