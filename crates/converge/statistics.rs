//! What is told of many numbers: spreads, the Pareto front, the order of convergence, the time to an error.

use serde::{Deserialize, Serialize};

/// How several runs of the same spread.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// The middle one, or the mean of the two in the middle.
    pub median: f64,
    /// The first quartile, by linear interpolation.
    pub lower: f64,
    /// The third quartile.
    pub upper: f64,
    /// The least.
    pub least: f64,
    /// The most.
    pub most: f64,
    /// How many there were.
    pub runs: usize,
}

impl Spread {
    /// `None`: there are fewer than two, which don't spread, or one is no number.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        if values.len() < 2 || values.iter().any(|value| !value.is_finite()) {
            return None;
        }
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let place = share * (sorted.len() - 1) as f64;
            let below = place.floor() as usize;
            let above = (below + 1).min(sorted.len() - 1);
            sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
        };
        Some(Self {
            median: at(0.5),
            lower: at(0.25),
            upper: at(0.75),
            least: sorted[0],
            most: sorted[sorted.len() - 1],
            runs: sorted.len(),
        })
    }
}

/// Those of `points` (cost, error) that no other beats in one without being worse in the other: indices, cheapest first. Of equal
/// points the first counts; what is not finite never does.
#[must_use]
pub fn pareto_front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len())
        .filter(|i| points[*i].0.is_finite() && points[*i].1.is_finite())
        .collect();
    order.sort_by(|a, b| {
        let ((cost_a, error_a), (cost_b, error_b)) = (points[*a], points[*b]);
        cost_a
            .total_cmp(&cost_b)
            .then(error_a.total_cmp(&error_b))
            .then(a.cmp(b))
    });
    let mut best = f64::INFINITY;
    order.retain(|i| {
        let better = points[*i].1 < best;
        best = best.min(points[*i].1);
        better
    });
    order
}

/// The order `p` of an error that falls as `x^-p`, with its 95 % confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// Positive where the error falls.
    pub order: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// The fitted error at `x` = 1.
    pub constant: f64,
    /// How many points were fitted.
    pub points: usize,
}

/// Fits `error = constant x^-p` to points (x, error) by least squares in logarithms; the interval is Student's, which takes the points'
/// errors as independent and alike.
///
/// `None`: fewer than three points (two lie on every line: no interval), all at one `x`, or one of them without a logarithm.
#[must_use]
pub fn order_of_convergence(points: &[(f64, f64)]) -> Option<Order> {
    let positive = |value: f64| value > 0.0 && value.is_finite();
    if points.len() < 3 || !points.iter().all(|(x, y)| positive(*x) && positive(*y)) {
        return None;
    }
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let mean_x = logs.iter().map(|p| p.0).sum::<f64>() / n;
    let mean_y = logs.iter().map(|p| p.1).sum::<f64>() / n;
    let xx: f64 = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
    let xy: f64 = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    // Of logarithms that differ by rounding alone no slope can be told.
    if xx < 1e-12 {
        return None;
    }
    let slope = xy / xx;
    let residual = |p: &(f64, f64)| p.1 - mean_y - slope * (p.0 - mean_x);
    let squares: f64 = logs.iter().map(|p| residual(p).powi(2)).sum();
    let freedom = points.len() - 2;
    let standard_error = (squares / freedom as f64 / xx).sqrt();
    let reach = student_95(freedom) * standard_error;
    Some(Order {
        order: -slope,
        low: -slope - reach,
        high: -slope + reach,
        constant: (mean_y - slope * mean_x).exp(),
        points: points.len(),
    })
}

/// Two-sided 95 % quantiles of Student's t for 1 to 30 degrees of freedom (Abramowitz and Stegun, table 26.10).
const STUDENT_95: [f64; 30] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160,
    2.145, 2.131, 2.120, 2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056,
    2.052, 2.048, 2.045, 2.042,
];

/// The normal distribution's, which Student's approaches.
const NORMAL_95: f64 = 1.960;

/// For at least one degree of freedom. Beyond the table: its leading correction, 1.96 + 2.37 / f, right to a thousandth.
fn student_95(freedom: usize) -> f64 {
    STUDENT_95
        .get(freedom.max(1) - 1)
        .copied()
        .unwrap_or(NORMAL_95 + 2.372 / freedom as f64)
}

/// When an error is reached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TimeTo {
    /// After this cost, between two points of the front or at one.
    Cost(f64),
    /// The cheapest point is better already: at most this.
    AtMost(f64),
    /// No point is as good.
    NotReached,
}

/// The cost at which `front` (as [`pareto_front`] orders it: cost rises, error falls) reaches `error`: on the straight line in logarithms
/// between the two points about it. Never beyond the ends.
#[must_use]
pub fn time_to_error(front: &[(f64, f64)], error: f64) -> TimeTo {
    let reached = front.iter().position(|point| point.1 <= error);
    match reached {
        None => TimeTo::NotReached,
        Some(index) if front[index].1 == error => TimeTo::Cost(front[index].0),
        Some(0) => TimeTo::AtMost(front[0].0),
        Some(index) => TimeTo::Cost(between(front[index - 1], front[index], error)),
    }
}

/// Errors have logarithms here but for one of exactly 0, which is reached nowhere before its point.
fn between(before: (f64, f64), after: (f64, f64), error: f64) -> f64 {
    if !(after.1 > 0.0 && before.0 > 0.0) {
        return after.0;
    }
    let share = (before.1 / error).ln() / (before.1 / after.1).ln();
    (before.0.ln() + share * (after.0 / before.0).ln()).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_needs_two_and_orders_them() {
        assert_eq!(Spread::of(&[]), None);
        assert_eq!(Spread::of(&[1.0]), None);
        assert_eq!(Spread::of(&[1.0, f64::NAN]), None);
        let spread = Spread::of(&[5.0, 1.0, 2.0, 4.0, 3.0]).unwrap();
        let told = (
            spread.least,
            spread.lower,
            spread.median,
            spread.upper,
            spread.most,
        );
        assert_eq!(told, (1.0, 2.0, 3.0, 4.0, 5.0));
        let even = Spread::of(&[4.0, 1.0, 2.0, 3.0]).unwrap();
        assert_eq!((even.lower, even.median, even.upper), (1.75, 2.5, 3.25));
    }

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [
            (3.0, 0.1),
            (1.0, 0.5),
            (2.0, 0.5), // beaten by the one before: as wrong, dearer
            (2.0, 0.3),
            (2.0, 0.2), // beats the one before at the same cost
            (4.0, 0.1), // beaten by the first
            (0.5, f64::NAN),
            (f64::INFINITY, 0.0),
        ];
        assert_eq!(pareto_front(&points), [1, 4, 0]);
        assert_eq!(pareto_front(&[(1.0, 1.0), (1.0, 1.0)]), [0]);
        assert!(pareto_front(&[]).is_empty());
    }

    #[test]
    fn an_exact_power_law_has_its_order_and_no_spread() {
        let points: Vec<(f64, f64)> = (0..6)
            .map(|k| 4.0_f64.powi(k))
            .map(|n| (n, 0.25 * n.powf(-0.75)))
            .collect();
        let order = order_of_convergence(&points).unwrap();
        for found in [order.order, order.low, order.high] {
            assert!((found - 0.75).abs() < 1e-6, "{order:?}");
        }
        assert!((order.constant - 0.25).abs() < 1e-6);
        assert_eq!(order.points, 6);
    }

    /// By hand: logarithms x = 0, 1, 2, 3 and y = 0, -1, -1, -2 have the slope -0.6, the residuals 0.1, -0.3, 0.3, -0.1, so a
    /// standard error of sqrt(0.2 / 2 / 5) and, with two degrees of freedom, t = 4.303.
    #[test]
    fn the_interval_is_students() {
        let points: Vec<(f64, f64)> = [(0.0, 0.0), (1.0, -1.0), (2.0, -1.0), (3.0, -2.0)]
            .iter()
            .map(|(x, y): &(f64, f64)| (x.exp(), y.exp()))
            .collect();
        let order = order_of_convergence(&points).unwrap();
        assert!((order.order - 0.6).abs() < 1e-9, "{order:?}");
        let reach = 4.303 * (0.2_f64 / 2.0 / 5.0).sqrt();
        assert!((order.high - order.order - reach).abs() < 1e-9, "{order:?}");
        assert!((order.order - order.low - reach).abs() < 1e-9, "{order:?}");
    }

    #[test]
    fn where_no_order_can_be_told_none_is() {
        assert_eq!(order_of_convergence(&[(1.0, 1.0), (2.0, 0.5)]), None);
        let zero = [(1.0, 1.0), (2.0, 0.5), (4.0, 0.0)];
        assert_eq!(order_of_convergence(&zero), None);
        let one_place = [(2.0, 1.0), (2.0, 0.5), (2.0, 0.25)];
        assert_eq!(order_of_convergence(&one_place), None);
        let nan = [(1.0, 1.0), (2.0, f64::NAN), (4.0, 0.25)];
        assert_eq!(order_of_convergence(&nan), None);
    }

    /// A fit that could not tell an order from another would be worth nothing: noise of a tenth leaves an interval that holds the
    /// truth and not half of it.
    #[test]
    fn another_order_lies_outside_of_the_interval() {
        let noise = [1.05, 0.93, 1.08, 0.97, 1.02, 0.95];
        let points: Vec<(f64, f64)> = (0..6)
            .map(|k| 2.0_f64.powi(k))
            .zip(noise)
            .map(|(n, noise)| (n, noise * n.powf(-0.75)))
            .collect();
        let order = order_of_convergence(&points).unwrap();
        assert!(order.low < 0.75 && 0.75 < order.high, "{order:?}");
        assert!(order.low > 0.5 && order.high < 1.0, "{order:?}");
    }

    #[test]
    fn quantiles_fall_towards_the_normal_distributions() {
        for freedom in 1..100 {
            assert!(student_95(freedom) > student_95(freedom + 1), "{freedom}");
        }
        assert!((student_95(60) - 2.000).abs() < 1e-3);
        assert!((student_95(120) - 1.980).abs() < 1e-3);
    }

    #[test]
    fn a_time_is_read_off_the_front_and_never_beyond_it() {
        let front = [(1.0, 0.1), (4.0, 0.025), (64.0, 0.0)];
        assert_eq!(time_to_error(&front, 0.2), TimeTo::AtMost(1.0));
        assert_eq!(time_to_error(&front, 0.1), TimeTo::Cost(1.0));
        let TimeTo::Cost(halfway) = time_to_error(&front, 0.05) else {
            panic!("not between")
        };
        assert!((halfway - 2.0).abs() < 1e-12, "{halfway}");
        assert_eq!(time_to_error(&front, 0.01), TimeTo::Cost(64.0));
        assert_eq!(time_to_error(&front[..2], 0.01), TimeTo::NotReached);
        assert_eq!(time_to_error(&[], 0.01), TimeTo::NotReached);
    }
}
