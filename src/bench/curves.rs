//! Quality against cost: the curve of one method's sweep, read at equal error or at equal cost.
//!
//! A [`Curve`] is the lower envelope of a sweep's (cost, error) pairs: the least cost for at most
//! an error. Cost is seconds, or a number of records. Between its points it is straight in log cost
//! over log error:
//!
//! ```text
//! ln c(e) = ln c₀ + (ln c₁ − ln c₀) · (ln e − ln e₀) / (ln e₁ − ln e₀)         e₁ ≤ e ≤ e₀
//! ```
//!
//! Above the largest error of the sweep the cheapest point is an upper bound of the cost; below the
//! smallest the error is "not reached", unless the curve has an [`Extension`]: an unbiased estimate
//! of n independent samples has error V/n, so that c(e) = c_last + s · (V/e − n_last), with V =
//! n_last e_last of the sweep's last point and s the cost of one sample, the slope of the least
//! squares line through (n, c).
//! Not     a statement about the spread of the measurements: points enter as they are.

use serde::Serialize;

/// What is known of a cost or an error that is read off a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum At {
    /// Between two points.
    Known(f64),
    /// No more than this: the cheapest (for a cost) or the last (for an error) point does at least
    /// as well.
    AtMost(f64),
    /// By the 1/n law, beyond what was measured.
    Extended(f64),
    /// The sweep does not go there.
    NotReached,
}

impl At {
    /// The number, if there is one.
    pub fn value(self) -> Option<f64> {
        match self {
            Self::Known(v) | Self::AtMost(v) | Self::Extended(v) => Some(v),
            Self::NotReached => None,
        }
    }
}

/// How a ratio relates to its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Relation {
    /// Both sides are interpolated between measured points.
    Equal,
    /// The true ratio is this or less.
    AtMost,
    /// The true ratio is this or more.
    AtLeast,
    /// Both cheapest points do better: only upper bounds are known of both.
    BoundsOnly,
    /// One of the two does not get there.
    NotReached,
}

/// Cost of `other` over cost of `base`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ratio {
    /// The number; none when not reached.
    pub value: Option<f64>,
    /// What it says.
    pub relation: Relation,
    /// True when a curve was extended by 1/n to get it.
    pub extended: bool,
}

/// The 1/n law beyond the last point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extension {
    /// n · error of the last point.
    pub variance: f64,
    /// Cost of one sample.
    pub cost_per_sample: f64,
    /// Samples, cost and error of the last point.
    pub last: [f64; 3],
}

impl Extension {
    /// From at least two (samples, cost, error); none when the cost does not grow with samples or
    /// the last error is not positive.
    pub fn fit(points: &[[f64; 3]]) -> Option<Self> {
        let last = *points.iter().max_by(|a, b| a[0].total_cmp(&b[0]))?;
        let n = points.len() as f64;
        let (mx, my) = (
            points.iter().map(|p| p[0]).sum::<f64>() / n,
            points.iter().map(|p| p[1]).sum::<f64>() / n,
        );
        let (mut xy, mut xx) = (0.0, 0.0);
        for p in points {
            xy += (p[0] - mx) * (p[1] - my);
            xx += (p[0] - mx).powi(2);
        }
        let cost_per_sample = xy / xx;
        (cost_per_sample.is_finite() && cost_per_sample > 0.0 && last[2] > 0.0).then_some(Self {
            variance: last[0] * last[2],
            cost_per_sample,
            last,
        })
    }

    /// Cost of an error below the last point's.
    pub fn cost(&self, error: f64) -> f64 {
        self.last[1] + self.cost_per_sample * (self.variance / error - self.last[0])
    }

    /// Error at a cost above the last point's.
    pub fn error(&self, cost: f64) -> f64 {
        self.variance / (self.last[0] + (cost - self.last[1]) / self.cost_per_sample)
    }
}

/// The lower envelope of a sweep.
#[derive(Clone, Debug, Default)]
pub struct Curve {
    /// (cost, error): cost rises, error falls.
    points: Vec<(f64, f64)>,
    extension: Option<Extension>,
}

impl Curve {
    /// The envelope of (cost, error) pairs in any order. Pairs with a number that is not positive
    /// and finite cannot stand on a logarithmic scale and are left out.
    pub fn new(pairs: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let mut all: Vec<(f64, f64)> = pairs
            .into_iter()
            .filter(|(c, e)| c.is_finite() && e.is_finite() && *c > 0.0 && *e > 0.0)
            .collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut points: Vec<(f64, f64)> = Vec::new();
        for p in all {
            if points.last().is_none_or(|l| p.1 < l.1) {
                points.push(p);
            }
        }
        Self { points, extension: None }
    }

    /// The same curve, going on by the 1/n law below its last error.
    #[must_use]
    pub fn extended(mut self, extension: Option<Extension>) -> Self {
        self.extension = extension;
        self
    }

    /// Points of the envelope: cost rises, error falls.
    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }

    /// The extension, if there is one.
    pub fn extension(&self) -> Option<&Extension> {
        self.extension.as_ref()
    }

    /// Least cost for at most `error`.
    pub fn cost_at(&self, error: f64) -> At {
        let (Some(first), Some(last)) = (self.points.first(), self.points.last()) else {
            return At::NotReached;
        };
        if error > first.1 || (error == first.1 && self.points.len() == 1) {
            return At::AtMost(first.0);
        }
        if error < last.1 {
            return self
                .extension
                .filter(|x| error < x.last[2])
                .map_or(At::NotReached, |x| At::Extended(x.cost(error)));
        }
        let bracket = self.points.windows(2).find(|w| w[1].1 <= error);
        bracket.map_or(At::NotReached, |w| {
            At::Known(log_log((w[0].1, w[0].0), (w[1].1, w[1].0), error))
        })
    }

    /// Least error for at most `cost`.
    pub fn error_at(&self, cost: f64) -> At {
        let (Some(first), Some(last)) = (self.points.first(), self.points.last()) else {
            return At::NotReached;
        };
        if cost < first.0 {
            return At::NotReached;
        }
        if cost > last.0 {
            return self
                .extension
                .filter(|x| cost > x.last[1])
                .map_or(At::AtMost(last.1), |x| At::Extended(x.error(cost)));
        }
        let bracket = self.points.windows(2).find(|w| w[1].0 >= cost);
        At::Known(bracket.map_or(last.1, |w| log_log(w[0], w[1], cost)))
    }
}

/// Value at `x` of the line through two points, straight in both logarithms.
fn log_log(a: (f64, f64), b: (f64, f64), x: f64) -> f64 {
    if a.0 == b.0 {
        return b.1;
    }
    let t = (x.ln() - a.0.ln()) / (b.0.ln() - a.0.ln());
    (a.1.ln() + t * (b.1.ln() - a.1.ln())).exp()
}

/// `other` over `base`, both costs at one error, or both errors at one cost.
pub fn ratio(other: At, base: At) -> Ratio {
    let extended = matches!(other, At::Extended(_)) || matches!(base, At::Extended(_));
    let relation = match (other, base) {
        (At::NotReached, _) | (_, At::NotReached) => Relation::NotReached,
        (At::AtMost(_), At::AtMost(_)) => Relation::BoundsOnly,
        (At::AtMost(_), _) => Relation::AtMost,
        (_, At::AtMost(_)) => Relation::AtLeast,
        _ => Relation::Equal,
    };
    let known = !matches!(relation, Relation::NotReached | Relation::BoundsOnly);
    let value = other.value().zip(base.value()).filter(|_| known).map(|(o, b)| o / b);
    Ratio { value, relation, extended: extended && value.is_some() }
}

impl std::fmt::Display for Ratio {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Some(v) = self.value else {
            return f.pad(if self.relation == Relation::BoundsOnly {
                "bounds only"
            } else {
                "not reached"
            });
        };
        let sign = match self.relation {
            Relation::AtMost => "≤ ",
            Relation::AtLeast => "≥ ",
            _ => "",
        };
        let number = if v >= 100.0 { format!("{v:.0}") } else { format!("{v:.2}") };
        f.pad(&format!("{sign}{number}{}", if self.extended { " e" } else { "" }))
    }
}

/// Errors at which two curves are worth comparing, falling: those of the base's own points, and
/// twice, four and eight times its largest.
pub fn levels(base: &Curve) -> Vec<f64> {
    let Some(first) = base.points.first() else { return Vec::new() };
    [8.0, 4.0, 2.0]
        .map(|k| k * first.1)
        .into_iter()
        .chain(base.points.iter().map(|p| p.1))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-12 * b.abs().max(1.0)
    }

    #[test]
    fn the_envelope_keeps_what_is_cheapest_for_its_error() {
        let c = Curve::new([
            (4.0, 0.1),
            (1.0, 0.5),
            (2.0, 0.6),
            (8.0, 0.1),
            (3.0, 0.2),
            (5.0, 0.01),
            (1.0, 0.7),
            (9.0, -1.0),
            (0.0, 0.001),
            (2.0, f64::NAN),
        ]);
        assert_eq!(c.points(), [(1.0, 0.5), (3.0, 0.2), (4.0, 0.1), (5.0, 0.01)]);
        assert!(Curve::new([]).points().is_empty());
        assert_eq!(
            (Curve::new([]).cost_at(1.0), Curve::new([]).error_at(1.0)),
            (At::NotReached, At::NotReached)
        );
    }

    #[test]
    fn a_power_law_is_read_off_exactly() {
        // e = 3 c^−1.5, so c = (3/e)^(2/3).
        let c = Curve::new([1.0, 2.0, 10.0, 64.0].map(|c: f64| (c, 3.0 * c.powf(-1.5))));
        for cost in [1.0, 1.7, 2.0, 5.0, 30.0, 64.0] {
            let error = 3.0 * f64::powf(cost, -1.5);
            let (At::Known(found), At::Known(back)) = (c.error_at(cost), c.cost_at(error)) else {
                panic!("{cost}")
            };
            assert!(
                near(found, error) && (back / cost - 1.0).abs() < 1e-9,
                "{cost}: {found} {back}"
            );
        }
        assert_eq!(c.cost_at(5.0), At::AtMost(1.0));
        assert_eq!(c.cost_at(1e-3), At::NotReached);
        assert_eq!(c.error_at(0.5), At::NotReached);
        assert_eq!(c.error_at(100.0), At::AtMost(3.0 / 512.0));
    }

    #[test]
    fn one_point_is_a_bound() {
        let c = Curve::new([(2.0, 0.1)]);
        assert_eq!(
            (c.cost_at(0.1), c.cost_at(0.2), c.cost_at(0.05)),
            (At::AtMost(2.0), At::AtMost(2.0), At::NotReached)
        );
        assert_eq!(
            (c.error_at(2.0), c.error_at(3.0), c.error_at(1.0)),
            (At::Known(0.1), At::AtMost(0.1), At::NotReached)
        );
    }

    #[test]
    fn the_one_over_n_law_goes_on() {
        // Start-up 0.5, 0.25 per sample, variance 8.
        let sweep = [1.0, 4.0, 16.0].map(|n: f64| [n, 0.5 + 0.25 * n, 8.0 / n]);
        let x = Extension::fit(&sweep).unwrap();
        assert!(near(x.variance, 8.0) && near(x.cost_per_sample, 0.25));
        let c = Curve::new(sweep.map(|p| (p[1], p[2]))).extended(Some(x));
        let At::Extended(cost) = c.cost_at(8.0 / 1600.0) else { panic!() };
        assert!(near(cost, 0.5 + 400.0));
        let At::Extended(error) = c.error_at(400.5) else { panic!() };
        assert!(near(error, 8.0 / 1600.0));
        assert!(matches!(c.cost_at(1.0), At::Known(_)));
        assert_eq!(Extension::fit(&[]), None);
        assert_eq!(Extension::fit(&[[4.0, 1.0, 0.1]]), None);
        assert_eq!(Extension::fit(&[[1.0, 1.0, 0.1], [2.0, 2.0, -0.1]]), None);
    }

    #[test]
    fn ratios_keep_what_is_known_of_them() {
        use At::{AtMost, Extended, Known, NotReached};
        for (other, base, value, relation, extended, text) in [
            (Known(6.0), Known(2.0), Some(3.0), Relation::Equal, false, "3.00"),
            (AtMost(6.0), Known(2.0), Some(3.0), Relation::AtMost, false, "≤ 3.00"),
            (Known(6.0), AtMost(2.0), Some(3.0), Relation::AtLeast, false, "≥ 3.00"),
            (Extended(600.0), Known(2.0), Some(300.0), Relation::Equal, true, "300 e"),
            (Extended(6.0), AtMost(2.0), Some(3.0), Relation::AtLeast, true, "≥ 3.00 e"),
            (AtMost(6.0), AtMost(2.0), None, Relation::BoundsOnly, false, "bounds only"),
            (Known(6.0), NotReached, None, Relation::NotReached, false, "not reached"),
            (NotReached, Known(1.0), None, Relation::NotReached, false, "not reached"),
        ] {
            let r = ratio(other, base);
            assert_eq!((r, r.to_string().as_str()), (Ratio { value, relation, extended }, text));
        }
    }

    #[test]
    fn levels_go_beyond_what_is_cheapest() {
        assert_eq!(
            levels(&Curve::new([(1.0, 0.5), (2.0, 0.1), (4.0, 0.03)])),
            [4.0, 2.0, 1.0, 0.5, 0.1, 0.03]
        );
        assert!(levels(&Curve::default()).is_empty());
    }
}
