//! A length as it is written in settings: scene units, or percent of the extent.
//!
//! ```text
//! 0.5, inf    scene units
//! "2%"        0.02 · extent of the world                    (bare 2% on the command line)
//! ```
//! Settings never hold a length as a plain number; [`Length::resolve`] gives scene units once the
//! scene is known.

use serde::{Serialize, Serializer};

use crate::settings::{Range, Value, from};

/// A length, at least 0; NaN is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Length {
    /// Scene units.
    Units(f32),
    /// Percent of the extent: how large the surroundings of what the camera sees are
    /// (`shading::World::extent`).
    Percent(f32),
}

impl Length {
    /// In scene units.
    pub fn resolve(self, extent: f32) -> f32 {
        match self {
            Self::Units(v) => v,
            // Divided in 64 bits, so that "5%" is 0.05 and not its neighbour.
            Self::Percent(p) => (f64::from(p) / 100.0) as f32 * extent,
        }
    }
}

impl std::str::FromStr for Length {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let (digits, percent) =
            text.trim().strip_suffix('%').map_or((text.trim(), false), |d| (d.trim(), true));
        match digits.parse::<f32>() {
            Ok(v) if percent && v.is_finite() => Ok(Self::Percent(v)),
            Ok(v) if !percent => Ok(Self::Units(v)),
            _ => Err(format!("\"{text}\" is not a length{}", Self::SPELLING)),
        }
    }
}

impl std::fmt::Display for Length {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Units(v) => v.fmt(f),
            Self::Percent(p) => write!(f, "{p}%"),
        }
    }
}

impl Serialize for Length {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Units(v) => s.serialize_f32(*v),
            Self::Percent(_) => s.collect_str(self),
        }
    }
}

impl Value for Length {
    const KIND: &'static str = "length";
    const NUMERIC: bool = true;
    const RANGE: Range = from(0.0);
    const SPELLING: &'static str =
        "; a number in scene units (0.5), inf, or percent of the extent (\"2%\")";
    fn read(value: &toml::Value) -> Option<Self> {
        match value.as_str() {
            Some(text) => text.parse().ok(),
            None => f32::read(value).map(Self::Units),
        }
    }
    fn show(&self) -> String {
        self.to_string()
    }
    fn number(&self) -> Option<f64> {
        match self {
            Self::Units(v) | Self::Percent(v) => v.number(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_read_and_resolved() {
        assert_eq!("2%".parse(), Ok(Length::Percent(2.0)));
        assert_eq!("inf".parse(), Ok(Length::Units(f32::INFINITY)));
        for bad in ["", "x%", "inf%", "nan%", "two"] {
            assert!(bad.parse::<Length>().is_err(), "{bad}");
        }
        assert_eq!(Length::read(&toml::Value::Float(0.25)), Some(Length::Units(0.25)));
        assert_eq!(Length::read(&toml::Value::Boolean(true)), None);
        for (percent, share) in [(2.0, 0.02), (5.0, 0.05), (10.0, 0.1)] {
            assert_eq!(Length::Percent(percent).resolve(7.0), share * 7.0);
        }
    }
}
