//! Owen-scrambled Sobol points, padded in pairs of dimensions `[Burley20]`.
//!
//! Each pair of dimensions is the two-dimensional Sobol (0,2)-sequence under its own nested uniform
//! shuffle of the index and its own nested uniform (Owen) scramble of the values, both done by
//! hashing. Guarantees: every power-of-two prefix of samples is stratified in every pair and every
//! elementary interval; samples are unbiased and, over seeds, independent. Not guaranteed:
//! stratification across different pairs.

use super::rng::{Stream, hash_key, hash64};
use glam::Vec2;

/// Sample generator of one element (pixel, cell, cluster).
#[derive(Clone, Copy, Debug)]
pub struct Sobol {
    key: u64,
}

impl Sobol {
    /// The generator of one (seed, stream, element).
    pub fn new(seed: u64, stream: Stream, element: u64) -> Self {
        Self { key: hash_key(seed, stream, element) }
    }

    /// Sample `index` in dimension pair `pair`, uniform in \[0, 1)².
    pub fn sample_2d(&self, index: u32, pair: u32) -> Vec2 {
        let h = hash64(self.key ^ u64::from(pair).wrapping_mul(0x9e6c_63d0_876a_3f6b));
        let h2 = hash64(h ^ 0x5851_f42d_4c95_7f2d);
        let i = owen(index.reverse_bits(), h as u32).reverse_bits();
        let i = i.reverse_bits(); // value of dimension 0 is the reversed index
        let x = owen_value(i, (h >> 32) as u32);
        let y = owen_value(sobol_1(i.reverse_bits()), h2 as u32);
        Vec2::new(unit(x), unit(y))
    }

    /// Sample `index` in dimension `pair` (the first of the pair), uniform in \[0, 1).
    pub fn sample_1d(&self, index: u32, pair: u32) -> f32 {
        self.sample_2d(index, pair).x
    }
}

/// Hash whose every bit depends only on lower bits: a nested uniform permutation of bit-reversed
/// values.
fn owen(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x
}

fn owen_value(x: u32, seed: u32) -> u32 {
    owen(x.reverse_bits(), seed).reverse_bits()
}

/// Second Sobol dimension: the Pascal matrix modulo 2, C(i, k) odd exactly when the bits of k are
/// among those of i; so bit k of the result is the sum over all supersets, five butterflies.
fn sobol_1(index: u32) -> u32 {
    let mut y = index;
    y ^= (y >> 1) & 0x5555_5555;
    y ^= (y >> 2) & 0x3333_3333;
    y ^= (y >> 4) & 0x0f0f_0f0f;
    y ^= (y >> 8) & 0x00ff_00ff;
    y ^= (y >> 16) & 0x0000_ffff;
    y.reverse_bits()
}

fn unit(x: u32) -> f32 {
    (x >> 8) as f32 * (1.0 / 16_777_216.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_elementary_interval_holds_one_point() {
        for element in 0..20 {
            let s = Sobol::new(3, Stream::Test, element);
            for pair in 0..3 {
                for log_x in 0..=8u32 {
                    let (nx, ny) = (1usize << log_x, 1usize << (8 - log_x));
                    let mut seen = vec![0; 256];
                    for i in 0..256 {
                        let p = s.sample_2d(i, pair);
                        seen[(p.x * nx as f32) as usize * ny + (p.y * ny as f32) as usize] += 1;
                    }
                    assert!(
                        seen.iter().all(|&c| c == 1),
                        "element {element} pair {pair} {nx}x{ny}"
                    );
                }
            }
        }
    }

    #[test]
    fn second_dimension_by_its_direction_numbers() {
        let slow = |mut index: u32| {
            let (mut v, mut r) = (1u32 << 31, 0);
            while index != 0 {
                r ^= if index & 1 != 0 { v } else { 0 };
                index >>= 1;
                v ^= v >> 1;
            }
            r
        };
        for i in 0..1000u32 {
            let i = hash64(u64::from(i)) as u32 >> (i % 32);
            assert_eq!(sobol_1(i), slow(i));
        }
    }

    #[test]
    fn pairs_are_independent() {
        let s = Sobol::new(3, Stream::Test, 5);
        let n = 4096;
        let mut c = 0.0f64;
        for i in 0..n {
            c += f64::from((s.sample_1d(i, 0) - 0.5) * (s.sample_1d(i, 1) - 0.5));
        }
        assert!((c / f64::from(n)).abs() < 5.0 / 12.0 / f64::from(n).sqrt());
    }
}
