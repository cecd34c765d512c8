//! What a number may be: from or above a least value, to a greatest one.

use std::fmt;

/// An interval of numbers. NaN lies in none, infinity only where [`Range::or_inf`] admits it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    low: f64,
    /// `low` itself is excluded.
    open: bool,
    high: Option<f64>,
    infinite: bool,
}

/// At least `low`.
pub const fn from(low: f64) -> Range {
    Range { low, open: false, high: None, infinite: false }
}

/// More than `low`.
pub const fn above(low: f64) -> Range {
    Range { low, open: true, high: None, infinite: false }
}

impl Range {
    /// At most `high`.
    #[must_use]
    pub const fn to(self, high: f64) -> Self {
        Self { high: Some(high), ..self }
    }

    /// Or infinite.
    #[must_use]
    pub const fn or_inf(self) -> Self {
        Self { infinite: true, ..self }
    }

    /// Whether a number lies in it.
    pub fn contains(&self, v: f64) -> bool {
        if v == f64::INFINITY {
            return self.infinite;
        }
        v.is_finite()
            && (v > self.low || (!self.open && v == self.low))
            && self.high.is_none_or(|high| v <= high)
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.open, self.high) {
            (false, None) => write!(f, "at least {}", self.low)?,
            (true, None) => write!(f, "above {}", self.low)?,
            (false, Some(high)) => write!(f, "{} to {high}", self.low)?,
            (true, Some(high)) => write!(f, "above {} to {high}", self.low)?,
        }
        if self.infinite { write!(f, ", or inf") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_nan_and_infinity() {
        let (closed, open) = (from(-1.0).to(1.0), above(0.0).or_inf());
        assert!(closed.contains(-1.0) && closed.contains(1.0) && !closed.contains(1.5));
        assert!(!open.contains(0.0) && open.contains(1e300) && open.contains(f64::INFINITY));
        for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(!closed.contains(wrong) && !from(0.0).contains(wrong), "{wrong}");
        }
        assert_eq!(closed.to_string(), "-1 to 1");
        assert_eq!(open.to_string(), "above 0, or inf");
    }
}
