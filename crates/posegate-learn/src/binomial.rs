//! The binomial distribution, confidence limits of its probability, and ranks that bound a quantile.

/// Returns `P(X <= k)` for X binomial with `n` and `p` in [0, 1]. Relative error below 1e-9 for n up to a
/// million.
#[must_use]
pub fn at_most(k: u64, n: u64, p: f64) -> f64 {
    if k >= n || p <= 0.0 {
        return 1.0;
    }
    if p >= 1.0 {
        return 0.0;
    }
    // Sums the shorter tail, from its largest term outwards.
    if (k as f64) < n as f64 * p {
        tail(k, n, p)
    } else {
        1.0 - tail(n - k - 1, n, 1.0 - p)
    }
}

/// Returns `P(X <= k)` for k below the mean: the terms fall from k downwards.
fn tail(k: u64, n: u64, p: f64) -> f64 {
    let (a, b) = (k as f64, n as f64);
    let choose = libm::lgamma(b + 1.0) - libm::lgamma(a + 1.0) - libm::lgamma(b - a + 1.0);
    let first = choose + a * libm::log(p) + (b - a) * libm::log1p(-p);
    let (mut term, mut sum) = (1.0, 0.0);
    for i in (0..=k).rev() {
        sum += term;
        if term < 1e-18 * sum {
            break;
        }
        term *= i as f64 / (n - i + 1) as f64 * (1.0 - p) / p;
    }
    libm::exp(first) * sum
}

/// Returns the Clopper-Pearson limits of a probability, given `k` successes in `n` trials. Each limit is wrong
/// with probability at most `(1 - confidence) / 2`; rounded outwards by 1e-12.
#[must_use]
pub fn clopper_pearson(k: u64, n: u64, confidence: f64) -> [f64; 2] {
    let half = 0.5 * (1.0 - confidence);
    let low = if k == 0 {
        0.0
    } else {
        // P(X >= k | low) = half.
        bisect(|p| 1.0 - at_most(k - 1, n, p) < half) - 1e-12
    };
    let high = if k >= n {
        1.0
    } else {
        bisect(|p| at_most(k, n, p) > half) + 1e-12
    };
    [low.max(0.0), high.min(1.0)]
}

/// Returns the point at which a predicate that is true at 0 and false at 1 changes.
fn bisect(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Returns the smallest rank k for which the k-th smallest of `n` scores is an upper bound on the q-quantile of
/// their distribution with the given confidence. It is at least the rank `ceil((n + 1) q)` of split conformal
/// prediction. `None` if even the largest score is not such a bound.
#[must_use]
pub fn rank(n: u64, q: f64, confidence: f64) -> Option<u64> {
    // The k-th smallest score is below the quantile if at least k scores are.
    let does = |k: u64| at_most(k - 1, n, q) >= confidence;
    if n == 0 || !does(n) {
        return None;
    }
    let (mut low, mut high) = (1, n);
    while low < high {
        let middle = low + (high - low) / 2;
        if does(middle) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    let conformal = conformal_rank(n, q)?;
    Some(high.max(conformal))
}

/// Returns the rank `ceil((n + 1) q)` of split conformal prediction; `None` if there are too few scores.
#[must_use]
pub fn conformal_rank(n: u64, q: f64) -> Option<u64> {
    // A product that is a whole number except for its rounding error is not rounded up.
    let rank = libm::ceil((n as f64 + 1.0) * q - 1e-9).max(1.0) as u64;
    (rank <= n).then_some(rank)
}

/// Returns the fewest and the most hits of `n` that a test at the given level accepts for a probability `p`. A
/// count outside has a probability of at most `(1 - level) / 2` on either side.
#[must_use]
pub fn acceptance(n: u64, p: f64, level: f64) -> [u64; 2] {
    let half = 0.5 * (1.0 - level);
    let first = |holds: &dyn Fn(u64) -> bool| {
        let (mut low, mut high) = (0, n);
        while low < high {
            let middle = low + (high - low) / 2;
            if holds(middle) {
                high = middle;
            } else {
                low = middle + 1;
            }
        }
        high
    };
    [
        first(&|k| at_most(k, n, p) > half),
        first(&|k| at_most(k, n, p) >= 1.0 - half),
    ]
}

/// Returns the k-th smallest of some numbers (from 1). None of them may be NaN.
pub(super) fn order_statistic(numbers: &[f64], k: u64) -> Option<f64> {
    let mut sorted: Vec<f64> = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted
        .get(usize::try_from(k).ok()?.checked_sub(1)?)
        .copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_equal_the_sum_of_terms() {
        for (n, p) in [(1, 0.3), (7, 0.5), (40, 0.95), (300, 0.01)] {
            let mut term = libm::pow(1.0 - p, n as f64);
            let mut sum = 0.0;
            for k in 0..n {
                sum += term;
                let got = at_most(k, n, p);
                assert!((got - sum).abs() < 1e-12, "{n} {p} {k}: {got} {sum}");
                term *= (n - k) as f64 / (k + 1) as f64 * p / (1.0 - p);
            }
            assert_eq!(at_most(n, n, p), 1.0);
        }
    }

    #[test]
    fn limits_equal_published_ones() {
        // Clopper and Pearson's own kind of table: 0 of 10, 1 of 10, 5 of 10 at 95 %.
        for (k, low, high) in [
            (0, 0.0, 0.308_497),
            (1, 0.002_529, 0.445_016),
            (5, 0.187_086, 0.812_914),
            (10, 0.691_503, 1.0),
        ] {
            let [l, h] = clopper_pearson(k, 10, 0.95);
            assert!((l - low).abs() < 1e-6 && (h - high).abs() < 1e-6, "{l} {h}");
        }
    }

    #[test]
    fn rank_bounds_the_quantile() {
        // 59 scores are the fewest whose largest is above the 95 % quantile with 95 % confidence.
        assert_eq!(rank(58, 0.95, 0.95), None);
        assert_eq!(rank(59, 0.95, 0.95), Some(59));
        assert_eq!(rank(298, 0.99, 0.95), None);
        assert_eq!(rank(299, 0.99, 0.95), Some(299));
        // With a rank that is smaller by one, the confidence is not reached.
        let k = rank(1000, 0.9, 0.95).unwrap();
        assert!(at_most(k - 1, 1000, 0.9) >= 0.95 && at_most(k - 2, 1000, 0.9) < 0.95);
        // Never below the rank of split conformal prediction.
        assert_eq!(rank(99, 0.5, 0.01), Some(50));
        assert_eq!(conformal_rank(18, 0.95), None);
        assert_eq!(conformal_rank(19, 0.95), Some(19));
        assert_eq!(conformal_rank(20, 0.95), Some(20));
        assert_eq!(order_statistic(&[3.0, 1.0, 2.0], 2), Some(2.0));
        assert_eq!(order_statistic(&[3.0], 2), None);
    }

    #[test]
    fn acceptance_limits_have_the_stated_level() {
        let [low, high] = acceptance(500, 0.95, 0.99);
        assert!(at_most(low - 1, 500, 0.95) <= 0.005 && at_most(low, 500, 0.95) > 0.005);
        assert!(1.0 - at_most(high, 500, 0.95) <= 0.005);
        assert!(1.0 - at_most(high - 1, 500, 0.95) > 0.005);
    }
}
