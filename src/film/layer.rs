//! A layer of an image: its name, the channels that it has, and what they mean.
//!
//! To add a layer: whoever computes it declares it once as a constant, sets it under that name
//! ([`super::Film::set_rgb`], [`super::Film::set_xyz`], [`super::Film::set`]) and lists it in the
//! `LAYERS` of the method beside it, which `Method::layers` hands on; a test compares this list
//! with what the method makes. EXR names a channel `layer.channel`; a layer of one channel whose
//! name has no suffix of its own stands alone (`samples`).

/// Channels of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// R, G, B.
    Rgb,
    /// X, Y, Z.
    Xyz,
    /// One value under this suffix, such as `depth.Z` or `cluster.id`.
    One(&'static str),
    /// One value under the layer's own name, such as `samples`.
    Alone,
}

/// A named layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layer {
    /// Name, as in `--aov`.
    pub name: &'static str,
    /// Its channels.
    pub channels: Channels,
    /// What it holds, with its unit.
    pub meaning: &'static str,
}

impl Layer {
    /// A colour.
    pub const fn rgb(name: &'static str, meaning: &'static str) -> Self {
        Self { name, channels: Channels::Rgb, meaning }
    }
    /// A vector.
    pub const fn xyz(name: &'static str, meaning: &'static str) -> Self {
        Self { name, channels: Channels::Xyz, meaning }
    }
    /// One value under a suffix.
    pub const fn one(name: &'static str, suffix: &'static str, meaning: &'static str) -> Self {
        Self { name, channels: Channels::One(suffix), meaning }
    }
    /// One value under the layer's own name.
    pub const fn alone(name: &'static str, meaning: &'static str) -> Self {
        Self { name, channels: Channels::Alone, meaning }
    }
    /// Full names of its channels.
    pub fn channel_names(&self) -> Vec<String> {
        let dotted = |suffixes: &[&str]| {
            suffixes.iter().map(|s| format!("{}.{s}", self.name)).collect::<Vec<_>>()
        };
        match self.channels {
            Channels::Rgb => dotted(&["R", "G", "B"]),
            Channels::Xyz => dotted(&["X", "Y", "Z"]),
            Channels::One(suffix) => dotted(&[suffix]),
            Channels::Alone => vec![self.name.to_owned()],
        }
    }
}

/// Light from sun, lamps and emitters, reflected once.
pub const DIRECT: Layer =
    Layer::rgb("direct", "light from sun, lamps and emitters, reflected once, W/(sr m²)");
/// What shines by itself.
pub const EMISSION: Layer =
    Layer::rgb("emission", "emitters and background that the camera sees, W/(sr m²)");
/// All light that is neither direct nor emission.
pub const INDIRECT: Layer =
    Layer::rgb("indirect", "all other light reflected to the camera, W/(sr m²)");
/// Indirect irradiance.
pub const IRRADIANCE: Layer =
    Layer::rgb("irradiance", "indirect irradiance, mean weighted by albedo, W/m²");
/// Albedo.
pub const ALBEDO: Layer = Layer::rgb("albedo", "mean albedo");
/// Shading normal.
pub const NORMAL: Layer = Layer::xyz("N", "mean shading normal, world space");
/// Position.
pub const POSITION: Layer = Layer::xyz("P", "mean position of the hits");
/// Depth.
pub const DEPTH: Layer =
    Layer::one("depth", "Z", "mean depth along the view axis; infinite where nothing is hit");
/// Number of samples.
pub const SAMPLES: Layer = Layer::alone("samples", "path-traced samples of the pixel");

/// The layer that a channel belongs to: `direct.R` → `direct`, `samples` → `samples`; R, G, B and
/// with them the beauty have none.
pub fn layer_of(channel: &str) -> &str {
    match channel.split_once('.') {
        Some((layer, _)) => layer,
        None if ["R", "G", "B"].contains(&channel) => "",
        None => channel,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_and_layers_name_each_other() {
        let layers = [
            Layer::rgb("far", ""),
            Layer::xyz("N", ""),
            Layer::one("depth", "Z", ""),
            Layer::alone("samples", ""),
        ];
        let names: Vec<String> = layers.iter().flat_map(Layer::channel_names).collect();
        let expected = ["far.R", "far.G", "far.B", "N.X", "N.Y", "N.Z", "depth.Z", "samples"];
        assert_eq!(names, expected);
        for layer in layers {
            assert!(layer.channel_names().iter().all(|c| layer_of(c) == layer.name));
        }
        assert_eq!(layer_of("R"), "");
    }
}
