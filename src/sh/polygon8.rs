//! The moments of eight triangles at once: the inner loop of the near sum.
//!
//! Same quantities as [`super::moments`], in f32 on eight lanes, without a branch: each edge is
//! clipped to the horizon by itself, and the edge along the horizon closes the polygon. The solid
//! angle is summed per edge against the direction of the centroid.
//!
//! Accuracy: about 1e-6 absolute in G for triangles as large as their distance. Cost: four edges of
//! two arctangents and two square roots.

use glam::Vec3;

use super::MOMENTS;
use crate::ffi::lanes::Lanes;

type V<L> = [L; 3];

/// The three components `f(0)` to `f(2)`.
#[inline(always)]
fn each<L>(mut f: impl FnMut(usize) -> L) -> V<L> {
    [f(0), f(1), f(2)]
}
/// Scalar products.
#[inline(always)]
pub fn dot<L: Lanes>(a: V<L>, b: V<L>) -> L {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}
/// Vector products.
#[inline(always)]
pub fn cross<L: Lanes>(a: V<L>, b: V<L>) -> V<L> {
    [
        a[1].mul_sub(b[2], a[2] * b[1]),
        a[2].mul_sub(b[0], a[0] * b[2]),
        a[0].mul_sub(b[1], a[1] * b[0]),
    ]
}
#[inline(always)]
fn scale<L: Lanes>(a: V<L>, s: L) -> V<L> {
    each(|i| a[i] * s)
}
#[inline(always)]
fn lerp<L: Lanes>(a: V<L>, b: V<L>, t: L) -> V<L> {
    each(|i| (b[i] - a[i]).mul_add(t, a[i]))
}
#[inline(always)]
fn pick<L: Lanes>(mask: L, a: V<L>, b: V<L>) -> V<L> {
    each(|i| mask.select(a[i], b[i]))
}
#[inline(always)]
fn unit<L: Lanes>(a: V<L>) -> V<L> {
    let l2 = dot(a, a);
    let inverse = L::ONE / l2.max(L::splat(1e-30)).sqrt();
    scale(a, inverse)
}

/// Arctangent of y/x for y ≥ 0, in \[0, π\]; the polynomial on \[0, 1\] is Abramowitz & Stegun
/// 4.4.49 (error below 2e-8, f32 rounding above it).
#[inline(always)]
fn atan2_upper<L: Lanes>(y: L, x: L) -> L {
    let ax = x.abs();
    let (low, high) = (y.min(ax), y.max(ax));
    let r = low / high.max(L::splat(1e-30));
    let z = r * r;
    let mut p = L::splat(0.002_866_225_7);
    for c in [
        -0.016_165_737,
        0.042_909_61,
        -0.075_289_64,
        0.106_562_64,
        -0.142_088_99,
        0.199_935_5,
        -0.333_331_45,
        1.0,
    ] {
        p = p.mul_add(z, L::splat(c));
    }
    let a = p * r;
    let a = y.gt(ax).select(L::splat(std::f32::consts::FRAC_PI_2) - a, a);
    x.ge(L::ZERO).select(a, L::splat(std::f32::consts::PI) - a)
}

/// An arc of the spherical polygon, from unit vector `start` to `end`, in the lanes of `valid`.
#[derive(Clone, Copy)]
struct Arc<L> {
    start: V<L>,
    end: V<L>,
    valid: L,
}

#[inline(always)]
fn add_arc<L: Lanes>(m: &mut [L; MOMENTS], arc: Arc<L>, n: V<L>, apex: V<L>) {
    let (s, e) = (arc.start, arc.end);
    let c = cross(s, e);
    let sin = dot(c, c).sqrt();
    let valid = arc.valid & sin.gt(L::splat(1e-7));
    let cos = dot(s, e);
    let edge_n = scale(c, L::ONE / sin.max(L::splat(1e-20)));
    let t = cross(edge_n, s);
    let theta = valid & atan2_upper(sin, cos);
    let w = valid & dot(n, edge_n);
    let sc = sin * cos;
    let half = L::splat(0.5);
    m[0] = (half * w).mul_add(theta, m[0]);
    let (vs, vt) = (w * sin, w * (L::ONE - cos));
    let (qs, qt, qst) = ((theta + sc) * half * w, (theta - sc) * half * w, sin * sin * half * w);
    // Q = s·(qs s + qst t)ᵀ + t·(qt t + qst s)ᵀ.
    let p = each(|k| qs.mul_add(s[k], qst * t[k]));
    let q = each(|k| qt.mul_add(t[k], qst * s[k]));
    for k in 0..3 {
        m[1 + k] += vs.mul_add(s[k], vt * t[k]);
        m[4 + k] += s[k].mul_add(p[k], t[k] * q[k]);
        m[11 + k] = (half * theta).mul_add(edge_n[k], m[11 + k]);
    }
    for (slot, i, j) in [(7, 0, 1), (8, 1, 2), (9, 0, 2)] {
        m[slot] += s[i].mul_add(p[j], t[i] * q[j]);
    }
    let numerator = valid & dot(apex, c);
    let denominator = L::ONE + dot(apex, s) + cos + dot(e, apex);
    let angle = atan2_upper(numerator.abs(), denominator) * L::splat(2.0);
    m[10] += numerator.ge(L::ZERO).select(angle, -angle);
}

/// Moments of eight triangles with corners `v` relative to the point, above the horizon of the unit
/// normal `n`; lane by lane, positive when seen clockwise, i.e. for det(v₀, v₁, v₂) > 0.
#[inline(always)]
pub fn moments8<L: Lanes>(v: &[V<L>; 3], n: Vec3) -> [L; MOMENTS] {
    let n = each(|k| L::splat(n[k]));
    let h = each(|i| dot(v[i], n));
    let apex = unit(each(|k| v[0][k] + v[1][k] + v[2][k]));
    let mut m = [L::ZERO; MOMENTS];
    let none = [L::ZERO; 3];
    let (mut exit, mut entry, mut crossing) = (none, none, L::ZERO);
    let u = [unit(v[0]), unit(v[1]), unit(v[2])];
    let mut arcs = [Arc { start: none, end: none, valid: L::ZERO }; 4];
    for i in 0..3 {
        let j = (i + 1) % 3;
        let (above_i, above_j) = (h[i].ge(L::ZERO), h[j].ge(L::ZERO));
        let difference = h[i] - h[j];
        let fraction = h[i] / difference.abs().gt(L::splat(1e-30)).select(difference, L::ONE);
        let cut = unit(lerp(v[i], v[j], fraction));
        arcs[i] = Arc {
            start: pick(above_i, u[i], cut),
            end: pick(above_j, u[j], cut),
            valid: above_i | above_j,
        };
        let (leaves, enters) = (above_i & !above_j, above_j & !above_i);
        exit = pick(leaves, cut, exit);
        entry = pick(enters, cut, entry);
        crossing |= leaves;
    }
    arcs[3] = Arc { start: exit, end: entry, valid: crossing };
    let count = if crossing.any() { 4 } else { 3 };
    for &arc in &arcs[..count] {
        add_arc(&mut m, arc, n, apex);
    }
    m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ffi::lanes::{Eight, Kernel, run, run_plain};
    use crate::sampling::{Rng, Stream, sample_uniform_sphere};
    use crate::sh::{ShRgb, moments};

    /// Moments of up to eight triangles; lanes past the last one begin again.
    #[derive(Clone, Copy)]
    struct Moments<'a>(&'a [[Vec3; 3]], Vec3);
    impl Kernel for Moments<'_> {
        type Output = [Eight; MOMENTS];
        #[inline(always)]
        fn run<L: Lanes>(self) -> [Eight; MOMENTS] {
            let t = self.0;
            let corner = |c: usize, k: usize| Eight::from_fn(|lane| t[lane % t.len()][c][k]);
            let v = each(|c| each(|k| L::load(&corner(c, k))));
            moments8(&v, self.1).map(L::store)
        }
    }

    fn random_point(rng: &mut Rng) -> Vec3 {
        Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 2.0 - Vec3::ONE
    }

    #[test]
    fn equals_the_double_precision_form() {
        let mut rng = Rng::new(5, Stream::Test, 0, 0);
        let (mut sum, mut count) = (0.0f64, 0.0f64);
        for _ in 0..20_000 {
            let n = sample_uniform_sphere(rng.next_2d());
            let triangles: Vec<[Vec3; 3]> =
                (0..8).map(|_| std::array::from_fn(|_| random_point(&mut rng))).collect();
            let fast = run(Moments(&triangles, n));
            assert_eq!(fast, run_plain(Moments(&triangles, n)), "one form only");
            for (lane, t) in triangles.iter().enumerate() {
                // Triangles whose plane nearly holds the point have an ill-defined winding: the
                // near sum rejects them.
                let det = t[0].dot(t[1].cross(t[2]));
                if det.abs() < 0.05 {
                    continue;
                }
                let exact = moments(t, n);
                for k in 0..MOMENTS {
                    let difference = (f64::from(fast[k].0[lane]) - exact[k]).abs();
                    sum += difference;
                    count += 1.0;
                    // Worst case: a triangle of 4 sr whose edge passes close to the point's
                    // antipode loses five digits of f32 to cancellation.
                    assert!(
                        difference < 5e-4,
                        "moment {k}: {} {} {t:?} {n}",
                        fast[k].0[lane],
                        exact[k]
                    );
                }
            }
        }
        assert!(sum / count < 1e-6, "mean error {}", sum / count);
    }

    /// The key identity: triangles that tile the sphere around the point reproduce the cosine
    /// convolution exactly.
    #[test]
    fn closed_box_sums_to_the_convolution() {
        let mut rng = Rng::new(5, Stream::Test, 1, 0);
        let corner = |i: usize| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32);
        let faces =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        for _ in 0..50 {
            let x =
                Vec3::new(rng.next_f32(), rng.next_f32(), rng.next_f32()) * 0.9 + Vec3::splat(0.05);
            let n = sample_uniform_sphere(rng.next_2d());
            let mut field = ShRgb::default();
            for c in field.0.iter_mut().take(9) {
                *c = random_point(&mut rng);
            }
            let (mut slow, mut fast) = ([0.0f64; MOMENTS], [0.0f64; MOMENTS]);
            for f in faces {
                for t in [[f[0], f[1], f[2]], [f[0], f[2], f[3]]] {
                    let mut v = t.map(|i| corner(i) - x);
                    if v[0].dot(v[1].cross(v[2])) < 0.0 {
                        v.swap(1, 2);
                    }
                    for (s, m) in slow.iter_mut().zip(moments(&v, n)) {
                        *s += m;
                    }
                    for (s, m) in fast.iter_mut().zip(run(Moments(&[v], n))) {
                        *s += f64::from(m.0[3]);
                    }
                }
            }
            assert!(
                (slow[0] / std::f64::consts::PI - 1.0).abs() < 1e-6,
                "form factors of a closed box sum to one"
            );
            let q = crate::sh::Quadratic::new(&field, n);
            let expected = field.irradiance(n);
            for m in [slow, fast] {
                let sum = q.integral(&m.map(|v| v as f32));
                assert!((sum - expected).length() < 2e-5, "{sum} {expected}");
            }
        }
    }

    #[test]
    fn rectangles_have_their_closed_forms() {
        use crate::sh::form_integral;
        let pi = std::f64::consts::PI;
        // Parallel 1.3 × 0.7 at height 0.9, corner above the point.
        let (a, b, h) = (1.3f32, 0.7, 0.9);
        let r = [
            Vec3::new(0.0, 0.0, h),
            Vec3::new(a, 0.0, h),
            Vec3::new(a, b, h),
            Vec3::new(0.0, b, h),
        ];
        assert!((form_integral(&r, Vec3::Z) / pi - 0.137_671_753_1).abs() < 1e-7);
        // Perpendicular: distance 0.8, width 1.7 from the foot, height 1.1.
        let (d, w, h) = (0.8f32, 1.7, 1.1);
        let r = [
            Vec3::new(d, 0.0, 0.0),
            Vec3::new(d, 0.0, h),
            Vec3::new(d, w, h),
            Vec3::new(d, w, 0.0),
        ];
        assert!((form_integral(&r, Vec3::Z).abs() / pi - 0.096_121_683_4).abs() < 1e-7);
        // The same wall reaching below the horizon counts only what is above.
        let r = [
            Vec3::new(d, 0.0, -5.0),
            Vec3::new(d, 0.0, h),
            Vec3::new(d, w, h),
            Vec3::new(d, w, -5.0),
        ];
        assert!((form_integral(&r, Vec3::Z).abs() / pi - 0.096_121_683_4).abs() < 1e-7);
        // Half of the hemisphere behind an infinite wall at the foot.
        let far = 1e5;
        let r = [
            Vec3::new(1e-4, -far, 0.0),
            Vec3::new(1e-4, -far, far),
            Vec3::new(1e-4, far, far),
            Vec3::new(1e-4, far, 0.0),
        ];
        assert!((form_integral(&r, Vec3::Z).abs() / pi - 0.5).abs() < 1e-4);
    }

    #[test]
    fn subdivision_changes_nothing() {
        let mut rng = Rng::new(5, Stream::Test, 2, 0);
        for _ in 0..200 {
            let t: [Vec3; 3] = std::array::from_fn(|_| random_point(&mut rng));
            let n = sample_uniform_sphere(rng.next_2d());
            let m = [(t[0] + t[1]) * 0.5, (t[1] + t[2]) * 0.5, (t[2] + t[0]) * 0.5];
            let whole = moments(&t, n);
            let parts =
                [[t[0], m[0], m[2]], [m[0], t[1], m[1]], [m[2], m[1], t[2]], [m[0], m[1], m[2]]];
            // Midpoints are rounded to f32: the parts tile the triangle to 1e-7.
            for (k, &moment) in whole.iter().enumerate() {
                assert!(
                    (parts.iter().map(|p| moments(p, n)[k]).sum::<f64>() - moment).abs()
                        < 1e-4 * (1.0 / t[0].dot(t[1].cross(t[2])).abs() as f64).max(1.0)
                );
            }
        }
    }
}
