//! A table of weights to draw indices from.

/// Draws index `i` with probability `weight[i] / Σ weight`.
#[derive(Clone, Debug, Default)]
pub struct Discrete {
    cdf: Vec<f64>,
}

impl Discrete {
    /// From non-negative weights. Negative and non-finite weights count as zero.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Self {
        let mut sum = 0.0;
        let cdf = weights
            .into_iter()
            .map(|w| {
                sum += if w.is_finite() { w.max(0.0) } else { 0.0 };
                sum
            })
            .collect();
        Self { cdf }
    }
    /// Sum of the weights.
    pub fn total(&self) -> f64 {
        self.cdf.last().copied().unwrap_or(0.0)
    }
    /// Number of entries.
    pub fn len(&self) -> usize {
        self.cdf.len()
    }
    /// True when nothing can be drawn.
    pub fn is_empty(&self) -> bool {
        self.total() <= 0.0
    }
    /// Probability of entry `i`.
    pub fn probability(&self, i: usize) -> f32 {
        let before = if i == 0 { 0.0 } else { self.cdf[i - 1] };
        if self.is_empty() { 0.0 } else { ((self.cdf[i] - before) / self.total()) as f32 }
    }
    /// Index for `u` in \[0, 1), with the remainder of `u` stretched to \[0, 1) again; `None` when
    /// empty.
    pub fn sample(&self, u: f32) -> Option<(usize, f32)> {
        if self.is_empty() {
            return None;
        }
        let x = f64::from(u) * self.total();
        let i = self.cdf.partition_point(|&c| c <= x).min(self.cdf.len() - 1);
        let before = if i == 0 { 0.0 } else { self.cdf[i - 1] };
        let width = self.cdf[i] - before;
        let rest = if width > 0.0 { ((x - before) / width) as f32 } else { 0.0 };
        Some((i, rest.clamp(0.0, 0.999_999_9)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_and_zero_weights() {
        let d = Discrete::new([0.0, 1.0, 3.0, 0.0]);
        let mut count = [0; 4];
        for i in 0..4000 {
            count[d.sample((i as f32 + 0.5) / 4000.0).unwrap().0] += 1;
        }
        assert_eq!(count, [0, 1000, 3000, 0]);
        assert!((d.probability(2) - 0.75).abs() < 1e-6);
        assert!(Discrete::new([0.0, f64::NAN]).sample(0.5).is_none());
    }
}
