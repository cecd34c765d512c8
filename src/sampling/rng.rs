//! Random numbers by key: who draws ([`Stream`]), for which element, with which seed.
//!
//! The state of a generator is a hash of its key; successive values are SplitMix64 steps. The same
//! key gives the same numbers whatever the number of threads and the order of work. Two streams
//! never share numbers: each has a number of its own, or sets a bit of the element that no element
//! of its sibling has (elements are below 2⁴⁰). The user's seed is `config::RenderConfig::seed`.

/// Who draws: passes never share numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// Camera samples and path tracing, keyed by pixel.
    Camera,
    /// Photon emission and walks, keyed by photon.
    Photon,
    /// Radiosity of cells, keyed by cell.
    Cell,
    /// Clustering.
    Cluster,
    /// Far-field rays of a cluster, keyed by cluster.
    Far,
    /// Far-field rays of a single shading point, keyed by point.
    FarPoint,
    /// Near-field rays and Monte Carlo, keyed by shading point.
    Near,
    /// Gather references and budgets, keyed by pixel.
    Gather,
    /// Direct light at camera samples, keyed by pixel.
    Direct,
    /// Built-in scenes.
    Scene,
    /// Tests and benchmarks.
    Test,
    /// Rays that link cells, keyed by cell side.
    Link,
    /// Rays that link what a camera sees, keyed by [`pixel_of_view`].
    LinkView,
    /// Hemispheres of irradiance cache records, keyed by record.
    Cache,
    /// Light on surface elements, keyed by piece or by side of an element.
    Element,
    /// Jitter of receivers, keyed by shading point.
    Receiver,
    /// Shadow rays of a bench, keyed by ray.
    BenchShadow,
    /// Photons of a bench, keyed by photon.
    BenchPhoton,
    /// Gather rays of a bench, keyed by ray.
    BenchGather,
    /// Points and rays of the proxy's places, keyed by the hash of a place.
    Place,
    /// Points and shadow rays of places at the edge of a light, keyed by the hash of a place.
    PlaceEdge,
    /// Paths that end the light of places, keyed by the hash of a place and the path.
    PlaceWalk,
    /// Rays that measure the surroundings of what is seen, keyed by lattice point.
    Extent,
    /// What a lattice of pixels sees and the rays of cells, for guides, keyed by either.
    Guide,
    /// Independent halves of a picture that converges; a seed of its own for each.
    Converge,
}

/// Bit of the element by which a stream stands apart from its sibling.
const SIBLING: u64 = 1 << 40;

impl Stream {
    /// The number that is hashed, and bits that every element has set.
    fn key(self) -> (u64, u64) {
        match self {
            Self::Camera => (1, 0),
            Self::Photon => (2, 0),
            Self::Cell => (3, 0),
            Self::Cluster => (4, 0),
            Self::Far => (5, 0),
            Self::FarPoint => (5, SIBLING),
            Self::Near => (6, 0),
            Self::Gather => (7, 0),
            Self::Direct => (8, 0),
            Self::Scene => (9, 0),
            Self::Test => (10, 0),
            Self::Link => (11, 0),
            Self::LinkView => (11, SIBLING),
            Self::Cache => (12, 0),
            Self::Element => (13, 0),
            Self::Receiver => (14, 0),
            Self::BenchShadow => (15, 0),
            Self::BenchPhoton => (16, 0),
            Self::BenchGather => (17, 0),
            Self::Place => (18, 0),
            Self::PlaceWalk => (19, 0),
            Self::Extent => (20, 0),
            Self::Guide => (21, 0),
            Self::PlaceEdge => (22, 0),
            Self::Converge => (0x636f_6e76_6572_6765, 0),
        }
    }
}

/// Key of a pixel (row · width + column) in one of several views, for [`Stream::LinkView`].
pub fn pixel_of_view(view: usize, pixel: u32) -> u64 {
    ((view as u64) << 41) | u64::from(pixel)
}

/// Hash of a seed, a stream and an element: where both kinds of generators begin.
pub(super) fn hash_key(seed: u64, stream: Stream, element: u64) -> u64 {
    let (number, sibling) = stream.key();
    let h = hash64(seed.wrapping_add(0x9e37_79b9_7f4a_7c15));
    let h = hash64(h ^ number.wrapping_mul(0xd134_2543_de82_ef95));
    hash64(h ^ (element | sibling).wrapping_mul(0xaf25_1af3_b0f0_25b5))
}

/// A seed of its own for part `index` of a stream: whole renders that are to be independent.
pub fn sub_seed(seed: u64, stream: Stream, index: u64) -> u64 {
    hash64(seed ^ stream.key().0 ^ index)
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
        let h = hash_key(seed, stream, element);
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
    fn streams_never_share_numbers() {
        let all = [
            Stream::Camera,
            Stream::Photon,
            Stream::Cell,
            Stream::Cluster,
            Stream::Far,
            Stream::FarPoint,
            Stream::Near,
            Stream::Gather,
            Stream::Direct,
            Stream::Scene,
            Stream::Test,
            Stream::Link,
            Stream::LinkView,
            Stream::Cache,
            Stream::Element,
            Stream::Receiver,
            Stream::BenchShadow,
            Stream::BenchPhoton,
            Stream::BenchGather,
            Stream::Converge,
        ];
        for (i, &a) in all.iter().enumerate() {
            for &b in &all[i + 1..] {
                for element in [0, 1, u64::from(u32::MAX), pixel_of_view(3, 5)] {
                    assert_ne!(hash_key(1, a, element), hash_key(1, b, element), "{a:?} {b:?}");
                }
            }
        }
        assert_ne!(pixel_of_view(1, 0), pixel_of_view(0, u32::MAX));
        assert_ne!(sub_seed(1, Stream::Converge, 0), sub_seed(1, Stream::Converge, 1));
    }

    /// Pictures depend on these bits; the constants were worked out by another program.
    #[test]
    fn frozen_keys() {
        let first = |stream, element| Rng::new(1, stream, element, 3).next_u64();
        assert_eq!(first(Stream::Camera, 2), 0xaa8b_3229_7f01_4a35);
        assert_eq!(first(Stream::Near, 2), 0xb655_20c0_e3e9_9bc5);
        assert_eq!(first(Stream::Element, 2), 0xa62c_c4ec_3aec_9e48);
        assert_eq!(first(Stream::FarPoint, 7), first(Stream::Far, 1 << 40 | 7));
        assert_eq!(
            first(Stream::LinkView, pixel_of_view(2, 7)),
            first(Stream::Link, 2 << 41 | 1 << 40 | 7)
        );
        assert_eq!(sub_seed(9, Stream::Converge, 1), hash64(9 ^ 0x636f_6e76_6572_6765 ^ 1));
    }

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
