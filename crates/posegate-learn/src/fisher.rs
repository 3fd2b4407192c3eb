//! Quantiles of the F distribution.

/// Returns the p-quantile of the F distribution with `a` and `b` degrees of freedom, to a relative error of 1e-9; p is above 0 and below 1.
pub(super) fn fisher_quantile(p: f64, a: f64, b: f64) -> f64 {
    // The share beyond f is I_y(b/2, a/2) with y = b / (b + a f), which rises with y.
    let beyond = 1.0 - p;
    let (mut low, mut high) = (0.0f64, 1.0f64);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if incomplete_beta(middle, 0.5 * b, 0.5 * a) < beyond {
            low = middle;
        } else {
            high = middle;
        }
    }
    // A smaller y is a larger f.
    b / a * (1.0 - low) / low.max(1e-300)
}

/// Returns the regularised incomplete beta function by its continued fraction.
fn incomplete_beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(1.0 - x, b, a);
    }
    let front = libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b);
    let front = libm::exp(front + a * libm::log(x) + b * libm::log1p(-x)) / a;
    // Lentz's method. The fraction converges in some tens of terms on this side of the mean.
    let away = |value: f64| if value.abs() < 1e-300 { 1e-300 } else { value };
    let (mut c, mut d) = (1.0, 1.0 / away(1.0 - (a + b) * x / (a + 1.0)));
    let mut fraction = d;
    for m in 1..500 {
        let m = f64::from(m);
        for term in [
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        ] {
            d = 1.0 / away(1.0 + term * d);
            c = away(1.0 + term / c);
            fraction *= d * c;
        }
        if (d * c - 1.0).abs() < 1e-15 {
            break;
        }
    }
    front * fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_equal_published_ones() {
        for (p, a, b, expected) in [
            (0.95, 3.0, 10.0, 3.708_26),
            (0.99, 3.0, 10.0, 6.552_31),
            (0.95, 1.0, 1.0, 161.447_6),
            (0.95, 3.0, 2.0, 19.164_3),
            (0.999, 3.0, 60.0, 6.171_2),
            (0.5, 4.0, 4.0, 1.0),
        ] {
            let found = fisher_quantile(p, a, b);
            assert!(
                (found / expected - 1.0).abs() < 2e-5,
                "{p} {a} {b}: {found}"
            );
        }
        // With two and b degrees of freedom the share beyond f is (1 + 2 f / b)^(-b/2).
        let f = fisher_quantile(0.9999, 2.0, 7.0);
        let beyond = (1.0 + 2.0 * f / 7.0f64).powf(-3.5);
        assert!((beyond / 1e-4 - 1.0).abs() < 1e-8, "{beyond}");
    }
}
