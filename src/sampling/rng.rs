//! Counter-keyed generator: the state is a hash of the key, successive values are SplitMix64 steps.

/// Who draws: passes never share numbers.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// Camera samples and path tracing, keyed by pixel.
    Camera = 1,
    /// Photon emission and walks, keyed by photon.
    Photon,
    /// Radiosity of cells, keyed by cell.
    Cell,
    /// Clustering.
    Cluster,
    /// Far-field rays, keyed by cluster.
    Far,
    /// Near-field Monte Carlo, keyed by shading point.
    Near,
    /// Gather references and budgets, keyed by pixel.
    Gather,
    /// Direct light at camera samples, keyed by pixel.
    Direct,
    /// Built-in scenes.
    Scene,
    /// Tests and benchmarks.
    Test,
    /// Rays that link cells, keyed by cell side or pixel.
    Link,
    /// Hemispheres of irradiance cache records, keyed by record.
    Cache,
    /// Light on surface elements, keyed by piece; jitter of receivers.
    Points,
}

/// A well-mixed 64-bit hash (SplitMix64 finaliser).
pub fn hash64(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// A stream of random numbers for one key.
#[derive(Clone, Debug)]
pub struct Rng(u64);

impl Rng {
    /// The generator of one (seed, stream, element, sample).
    pub fn new(seed: u64, stream: Stream, element: u64, sample: u64) -> Self {
        let mut h = hash64(seed.wrapping_add(0x9e37_79b9_7f4a_7c15));
        h = hash64(h ^ (stream as u64).wrapping_mul(0xd134_2543_de82_ef95));
        h = hash64(h ^ element.wrapping_mul(0xaf25_1af3_b0f0_25b5));
        Self(hash64(h ^ sample.wrapping_mul(0xb564_ef22_ec7a_ece5)))
    }
    /// Next 64 bits.
    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        hash64(self.0)
    }
    /// Uniform in \[0, 1).
    pub fn next_f32(&mut self) -> f32 {
        (self.next_u64() >> 40) as f32 * (1.0 / 16_777_216.0)
    }
    /// Uniform in the unit square.
    pub fn next_2d(&mut self) -> glam::Vec2 {
        glam::Vec2::new(self.next_f32(), self.next_f32())
    }
    /// Uniform in 0..n (n > 0).
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.next_u64()) * n as u128) >> 64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frozen_vector() {
        let mut r = Rng::new(1, Stream::Camera, 2, 3);
        let first = [r.next_u64(), r.next_u64()];
        let mut again = Rng::new(1, Stream::Camera, 2, 3);
        assert_eq!(first, [again.next_u64(), again.next_u64()]);
        assert_ne!(first[0], Rng::new(1, Stream::Photon, 2, 3).next_u64());
        assert_ne!(first[0], Rng::new(1, Stream::Camera, 3, 2).next_u64());
    }

    #[test]
    fn mean_and_variance() {
        let mut r = Rng::new(7, Stream::Test, 0, 0);
        let n = 1_000_000;
        let (mut s, mut q) = (0.0f64, 0.0f64);
        for _ in 0..n {
            let x = f64::from(r.next_f32());
            s += x;
            q += x * x;
        }
        let (m, v) = (s / n as f64, q / n as f64 - (s / n as f64).powi(2));
        assert!((m - 0.5).abs() < 5.0 * (1.0 / 12.0 / n as f64).sqrt());
        assert!((v - 1.0 / 12.0).abs() < 5e-4);
    }
}
