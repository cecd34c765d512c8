//! A grid of weights to draw cells from: a row by its sum, then a column of the row.
//!
//! Two numbers give a cell and a place inside it, so that stratified numbers stay stratified. Cost
//! O(log rows + log columns) a draw, 8 B a cell.

use glam::Vec2;

use super::Discrete;

/// Draws cell (x, y) with probability `weight[y · width + x] / Σ weight`.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    rows: Discrete,
    columns: Vec<Discrete>,
}

impl Grid {
    /// From non-negative weights, row by row; `width` above 0. Negative and non-finite weights
    /// count as zero.
    pub fn new(width: usize, weights: &[f64]) -> Self {
        let columns: Vec<Discrete> =
            weights.chunks(width.max(1)).map(|row| Discrete::new(row.iter().copied())).collect();
        Self { rows: Discrete::new(columns.iter().map(Discrete::total)), columns }
    }
    /// True when nothing can be drawn.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
    /// Probability of cell (x, y).
    pub fn probability(&self, x: usize, y: usize) -> f32 {
        if self.is_empty() {
            0.0
        } else {
            self.rows.probability(y) * self.columns[y].probability(x)
        }
    }
    /// Cell (x, y) for `u` in \[0, 1)², and a uniform place inside it; `None` when empty.
    pub fn sample(&self, u: Vec2) -> Option<(usize, usize, Vec2)> {
        let (y, v) = self.rows.sample(u.y)?;
        let (x, u) = self.columns[y].sample(u.x)?;
        Some((x, y, Vec2::new(u, v)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Rng, Stream};

    #[test]
    fn frequencies_pass_chi_square() {
        let weights: Vec<f64> = (0..24).map(|i| f64::from((i * 7) % 5)).collect();
        let grid = Grid::new(6, &weights);
        let (mut count, mut rng, n) = (vec![0.0f64; 24], Rng::new(1, Stream::Test, 0, 0), 200_000);
        let mut place = Vec2::ZERO;
        for _ in 0..n {
            let (x, y, at) = grid.sample(rng.next_2d()).unwrap();
            count[y * 6 + x] += 1.0;
            place += at / n as f32;
        }
        let (mut chi, mut sum) = (0.0, 0.0);
        for (i, c) in count.iter().enumerate() {
            let p = f64::from(grid.probability(i % 6, i / 6));
            assert!((p - weights[i] / weights.iter().sum::<f64>()).abs() < 1e-6);
            sum += p;
            if p > 0.0 {
                chi += (c - p * f64::from(n)).powi(2) / (p * f64::from(n))
            } else {
                assert_eq!(*c, 0.0)
            }
        }
        assert!((sum - 1.0).abs() < 1e-5);
        // 18 degrees of freedom: mean 18, 42.3 is exceeded once in a thousand.
        assert!(chi < 42.3, "{chi}");
        assert!((place - 0.5).abs().max_element() < 0.01, "{place}");
        assert!(Grid::new(3, &[0.0; 6]).sample(Vec2::ZERO).is_none());
    }
}
