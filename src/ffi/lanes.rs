//! Eight `f32` at once: by AVX2 and FMA where the CPU has them, by plain code elsewhere, with the
//! same bits.
//!
//! A loop that is worth vectors is written once as a [`Kernel`], generic over [`Lanes`]. [`run`]
//! asks the CPU, once a process, and runs the kernel in the form that fits. So the program can be
//! compiled for any x86-64 and is as fast as one compiled for the machine; where the compiler may
//! assume AVX2 and FMA, the question costs nothing.
//!
//! Guarantees  both forms give the same bits: every operation of [`Lanes`] is exact, correctly
//!             rounded or a choice of bits, multiply-adds are fused in both, and sums across lanes
//!             have one order. Not guaranteed: which NaN comes out of a NaN.
//! Cost        the plain form calls the C library for each multiply-add unless the compiler may
//!             assume FMA: several times slower, meant for old machines only.
//! Rule        [`Kernel::run`] and every function it hands lanes to are `#[inline(always)]`: a
//!             function that stays outside is compiled without AVX2, and is slow, not wrong.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, BitAnd, BitAndAssign, BitOr, BitOrAssign, Div, Mul, MulAssign};
use std::ops::{Neg, Not, Sub};

/// Eight numbers in memory, aligned to be loaded at once.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub struct Eight(pub [f32; 8]);

impl Eight {
    /// The numbers `f(0)` to `f(7)`.
    pub fn from_fn(f: impl FnMut(usize) -> f32) -> Self {
        Self(std::array::from_fn(f))
    }

    /// A mask: all bits set in the lanes where `f` holds, none elsewhere.
    pub fn mask(mut f: impl FnMut(usize) -> bool) -> Self {
        Self::from_fn(|lane| f32::from_bits(if f(lane) { u32::MAX } else { 0 }))
    }
}

/// Eight numbers in registers. A comparison gives a mask: all bits set in the lanes where it holds;
/// `&`, `|` and `!` work on bits.
pub trait Lanes:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + Not<Output = Self>
    + AddAssign
    + MulAssign
    + BitAndAssign
    + BitOrAssign
{
    /// Zero in every lane.
    const ZERO: Self;
    /// One in every lane.
    const ONE: Self;
    /// `x` in every lane.
    fn splat(x: f32) -> Self;
    /// From memory.
    fn load(from: &Eight) -> Self;
    /// To memory.
    fn store(self) -> Eight;
    /// Bytes as numbers.
    fn from_bytes(bytes: &[u8; 8]) -> Self;
    /// `self · a + b`, rounded once.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// `self · a − b`, rounded once.
    fn mul_sub(self, a: Self, b: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// The larger; `other` where either is NaN or both are equal.
    fn max(self, other: Self) -> Self;
    /// The smaller; `other` where either is NaN or both are equal.
    fn min(self, other: Self) -> Self;
    /// Mask of `self > other`.
    fn gt(self, other: Self) -> Self;
    /// Mask of `self ≥ other`.
    fn ge(self, other: Self) -> Self;
    /// Mask of `self ≤ other`.
    fn le(self, other: Self) -> Self;
    /// `self` as a mask: the bits of `yes` where it is set, of `no` elsewhere.
    fn select(self, yes: Self, no: Self) -> Self;
    /// Sign bits, lane 0 lowest: a mask as a number.
    fn to_bitmask(self) -> u32;
    /// Sum of the lanes: ((0+4)+(2+6)) + ((1+5)+(3+7)).
    fn sum(self) -> f32;
    /// Whether a mask is set in any lane.
    #[inline(always)]
    fn any(self) -> bool {
        self.to_bitmask() != 0
    }
}

/// Work that is written once for both forms of [`Lanes`].
pub trait Kernel {
    /// What comes out.
    type Output;
    /// Does the work; implementations are `#[inline(always)]`.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// Runs a kernel in the form that fits this CPU.
#[inline(always)]
pub fn run<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        // SAFETY: the CPU has both features.
        return unsafe { avx2::run(kernel) };
    }
    run_plain(kernel)
}

/// Runs a kernel in the plain form, which every CPU has. Out of line, so that it never grows the
/// caller.
#[inline(never)]
pub fn run_plain<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<Plain>()
}

/// The operators that follow from others, the same for both forms.
macro_rules! assigning {
    ($lanes:ty, $($of:ident $f:ident $op:tt),*) => {$(
        impl $of for $lanes {
            #[inline(always)]
            fn $f(&mut self, other: Self) {
                *self = *self $op other;
            }
        }
    )*};
}

/// The form for every CPU.
#[derive(Clone, Copy, Debug)]
struct Plain([f32; 8]);

impl Plain {
    #[inline(always)]
    fn each(self, f: impl Fn(f32) -> f32) -> Self {
        Self(self.0.map(f))
    }
    #[inline(always)]
    fn with(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
    #[inline(always)]
    fn bits(self, other: Self, f: impl Fn(u32, u32) -> u32) -> Self {
        self.with(other, |a, b| f32::from_bits(f(a.to_bits(), b.to_bits())))
    }
    #[inline(always)]
    fn holds(self, other: Self, f: impl Fn(f32, f32) -> bool) -> Self {
        self.with(other, |a, b| f32::from_bits(if f(a, b) { u32::MAX } else { 0 }))
    }
}

macro_rules! plain {
    ($($of:ident $f:ident $by:ident $op:tt),*) => {$(
        impl $of for Plain {
            type Output = Self;
            #[inline(always)]
            fn $f(self, other: Self) -> Self {
                self.$by(other, |a, b| a $op b)
            }
        }
    )*};
}
plain!(Add add with +, Sub sub with -, Mul mul with *, Div div with /);
plain!(BitAnd bitand bits &, BitOr bitor bits |);
assigning!(Plain, AddAssign add_assign +, MulAssign mul_assign *);
assigning!(Plain, BitAndAssign bitand_assign &, BitOrAssign bitor_assign |);

impl Neg for Plain {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.each(|a| -a)
    }
}
impl Not for Plain {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        self.each(|a| f32::from_bits(!a.to_bits()))
    }
}

impl Lanes for Plain {
    const ZERO: Self = Self([0.0; 8]);
    const ONE: Self = Self([1.0; 8]);
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; 8])
    }
    #[inline(always)]
    fn load(from: &Eight) -> Self {
        Self(from.0)
    }
    #[inline(always)]
    fn store(self) -> Eight {
        Eight(self.0)
    }
    #[inline(always)]
    fn from_bytes(bytes: &[u8; 8]) -> Self {
        Self(bytes.map(f32::from))
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].mul_add(a.0[i], b.0[i])))
    }
    #[inline(always)]
    fn mul_sub(self, a: Self, b: Self) -> Self {
        self.mul_add(a, -b)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.each(f32::sqrt)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.each(f32::abs)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.with(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.with(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn gt(self, other: Self) -> Self {
        self.holds(other, |a, b| a > b)
    }
    #[inline(always)]
    fn ge(self, other: Self) -> Self {
        self.holds(other, |a, b| a >= b)
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self {
        self.holds(other, |a, b| a <= b)
    }
    #[inline(always)]
    fn select(self, yes: Self, no: Self) -> Self {
        (self & yes) | (!self & no)
    }
    #[inline(always)]
    fn to_bitmask(self) -> u32 {
        (0..8).map(|i| (self.0[i].to_bits() >> 31) << i).sum()
    }
    #[inline(always)]
    fn sum(self) -> f32 {
        let [a, b, c, d, e, f, g, h] = self.0;
        ((a + e) + (c + g)) + ((b + f) + (d + h))
    }
}

/// The form for CPUs with AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
mod avx2 {
    use std::arch::x86_64::*;
    use std::ops::{Add, AddAssign, BitAnd, BitAndAssign, BitOr, BitOrAssign, Div, Mul};
    use std::ops::{MulAssign, Neg, Not, Sub};

    use super::{Eight, Kernel, Lanes};

    /// Eight numbers in one register. No value of this type exists outside of [`run`]: the type is
    /// private, and a kernel meets it only as its parameter `L`. So where one of its operations is
    /// called, the CPU has AVX2 and FMA.
    #[derive(Clone, Copy, Debug)]
    pub(super) struct Avx2(__m256);

    /// Runs a kernel with AVX2 and FMA.
    #[target_feature(enable = "avx2,fma")]
    pub(super) fn run<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Avx2>()
    }

    /// Calls an instruction of AVX, AVX2 or FMA.
    macro_rules! cpu {
        ($call:expr) => {{
            // SAFETY: the CPU has AVX2 and FMA, see `Avx2`.
            unsafe { $call }
        }};
    }

    macro_rules! instruction {
        ($($of:ident $f:ident $call:ident),*) => {$(
            impl $of for Avx2 {
                type Output = Self;
                #[inline(always)]
                fn $f(self, other: Self) -> Self {
                    Self(cpu!($call(self.0, other.0)))
                }
            }
        )*};
    }
    instruction!(Add add _mm256_add_ps, Sub sub _mm256_sub_ps);
    instruction!(Mul mul _mm256_mul_ps, Div div _mm256_div_ps);
    instruction!(BitAnd bitand _mm256_and_ps, BitOr bitor _mm256_or_ps);
    assigning!(Avx2, AddAssign add_assign +, MulAssign mul_assign *);
    assigning!(Avx2, BitAndAssign bitand_assign &, BitOrAssign bitor_assign |);

    impl Neg for Avx2 {
        type Output = Self;
        #[inline(always)]
        fn neg(self) -> Self {
            Self(cpu!(_mm256_xor_ps(self.0, _mm256_set1_ps(-0.0))))
        }
    }
    impl Not for Avx2 {
        type Output = Self;
        #[inline(always)]
        fn not(self) -> Self {
            Self(cpu!(_mm256_xor_ps(self.0, _mm256_castsi256_ps(_mm256_set1_epi32(-1)))))
        }
    }

    impl Lanes for Avx2 {
        // SAFETY: both are eight numbers, and every bit pattern is a value.
        const ZERO: Self = Self(unsafe { std::mem::transmute::<[f32; 8], __m256>([0.0; 8]) });
        // SAFETY: as above.
        const ONE: Self = Self(unsafe { std::mem::transmute::<[f32; 8], __m256>([1.0; 8]) });
        #[inline(always)]
        fn splat(x: f32) -> Self {
            Self(cpu!(_mm256_set1_ps(x)))
        }
        #[inline(always)]
        fn load(from: &Eight) -> Self {
            // SAFETY: the CPU has AVX; the reference is valid, and its type is aligned to 32.
            Self(unsafe { _mm256_load_ps(from.0.as_ptr()) })
        }
        #[inline(always)]
        fn store(self) -> Eight {
            let mut to = Eight::default();
            // SAFETY: the CPU has AVX; the reference is valid, and its type is aligned to 32.
            unsafe { _mm256_store_ps(to.0.as_mut_ptr(), self.0) };
            to
        }
        #[inline(always)]
        fn from_bytes(bytes: &[u8; 8]) -> Self {
            let bytes = i64::from_le_bytes(*bytes);
            Self(cpu!(_mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_set1_epi64x(bytes)))))
        }
        #[inline(always)]
        fn mul_add(self, a: Self, b: Self) -> Self {
            Self(cpu!(_mm256_fmadd_ps(self.0, a.0, b.0)))
        }
        #[inline(always)]
        fn mul_sub(self, a: Self, b: Self) -> Self {
            Self(cpu!(_mm256_fmsub_ps(self.0, a.0, b.0)))
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            Self(cpu!(_mm256_sqrt_ps(self.0)))
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Self(cpu!(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)))
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Self(cpu!(_mm256_max_ps(self.0, other.0)))
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            Self(cpu!(_mm256_min_ps(self.0, other.0)))
        }
        #[inline(always)]
        fn gt(self, other: Self) -> Self {
            Self(cpu!(_mm256_cmp_ps::<_CMP_GT_OQ>(self.0, other.0)))
        }
        #[inline(always)]
        fn ge(self, other: Self) -> Self {
            Self(cpu!(_mm256_cmp_ps::<_CMP_GE_OQ>(self.0, other.0)))
        }
        #[inline(always)]
        fn le(self, other: Self) -> Self {
            Self(cpu!(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)))
        }
        #[inline(always)]
        fn select(self, yes: Self, no: Self) -> Self {
            Self(cpu!(_mm256_or_ps(_mm256_and_ps(yes.0, self.0), _mm256_andnot_ps(self.0, no.0))))
        }
        #[inline(always)]
        fn to_bitmask(self) -> u32 {
            cpu!(_mm256_movemask_ps(self.0)) as u32
        }
        #[inline(always)]
        fn sum(self) -> f32 {
            // SAFETY: the CPU has AVX, see `Avx2`.
            unsafe {
                let four =
                    _mm_add_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
                let two = _mm_add_ps(four, _mm_movehl_ps(four, four));
                _mm_cvtss_f32(_mm_add_ss(two, _mm_shuffle_ps::<1>(two, two)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every operation on three inputs, the results' bits one after another.
    struct Everything<'a>([&'a Eight; 3]);
    impl Kernel for Everything<'_> {
        type Output = Vec<u32>;
        #[inline(always)]
        fn run<L: Lanes>(self) -> Vec<u32> {
            let [a, b, c] = self.0.map(L::load);
            let mask = a.gt(b);
            let results = [
                a + b,
                a - b,
                a * b,
                a / b,
                -a,
                a & b,
                a | b,
                !a,
                a.mul_add(b, c),
                a.mul_sub(b, c),
                a.abs().sqrt(),
                a.abs(),
                a.max(b),
                a.min(b),
                mask,
                a.ge(b),
                a.le(b),
                mask.select(b, c),
                L::ONE - L::ZERO,
                L::splat(b.sum()),
                L::from_bytes(&[0, 1, 2, 127, 128, 129, 254, 255]),
            ];
            let mut bits: Vec<u32> =
                results.iter().flat_map(|r| r.store().0.map(f32::to_bits)).collect();
            bits.extend([mask.to_bitmask(), u32::from(mask.any())]);
            bits
        }
    }

    #[test]
    fn both_forms_give_the_same_bits() {
        use crate::sampling::{Rng, Stream};
        let mut rng = Rng::new(3, Stream::Test, 9, 0);
        let odd = [0.0, -0.0, 1.0, f32::INFINITY, f32::MIN_POSITIVE, 1e-45, 16_777_217.0, -3e38];
        for round in 0..2000 {
            // Numbers of close exponents, so that fused and unfused products differ; every tenth
            // lane one of the odd numbers.
            let mut number = || match rng.next_f32() {
                x if x < 0.1 => odd[(x * 80.0) as usize],
                x => (x - 0.55) * (2.0 * rng.next_f32() - 1.0).exp2(),
            };
            let x: [Eight; 3] = std::array::from_fn(|_| Eight::from_fn(|_| number()));
            let kernel = || Everything([&x[0], &x[1], &x[2]]);
            let (vector, plain) = (run(kernel()), run_plain(kernel()));
            for (i, (v, p)) in vector.iter().zip(&plain).enumerate() {
                let nan = f32::from_bits(*v).is_nan() && f32::from_bits(*p).is_nan();
                // A mask and a NaN look alike; masks are compared by `to_bitmask` as well.
                assert!(v == p || nan, "round {round}, operation {}: {v:x} {p:x}", i / 8);
            }
        }
    }

    #[test]
    fn operations_mean_what_they_say() {
        let a = Plain([1.0, -2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
        assert_eq!(a.sum(), 32.0);
        assert_eq!(a.gt(Plain::ZERO).to_bitmask(), 0b1111_1101);
        assert_eq!(a.gt(Plain::splat(6.5)).select(Plain::ONE, a).0[5..], [6.0, 1.0, 1.0]);
        // 1 + 2⁻²³ squared less 1 + 2⁻²² is 2⁻⁴⁶ when rounded once, 0 when rounded twice.
        let b = Plain::splat(1.0 + f32::EPSILON);
        assert_eq!(b.mul_sub(b, Plain::splat(1.0 + 2.0 * f32::EPSILON)).0[0], 2f32.powi(-46));
    }
}
