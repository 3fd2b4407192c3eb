//! Quantiles of the normal distribution, of Student's t distribution and of the F distribution.

/// Returns the quantile of the standard normal distribution.
pub(super) fn normal_quantile(probability: f64) -> f64 {
    let (mut low, mut high) = (-10.0, 10.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if 0.5 * libm::erfc(-middle * core::f64::consts::FRAC_1_SQRT_2) < probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Returns the quantile of Student's t distribution with some degrees of freedom, for a probability of 1/2 or more.
/// Absolute error below 1e-6 for quantiles up to 1e6, the largest number that is returned.
pub(super) fn t_quantile(probability: f64, degrees: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1e6);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if beyond(middle, degrees) > 1.0 - probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Returns the probability that a t variable exceeds `t`, at least 0.
fn beyond(t: f64, degrees: f64) -> f64 {
    0.5 * incomplete_beta(0.5 * degrees, 0.5, degrees / (degrees + t * t))
}

/// Returns the p-quantile of the F distribution with `a` and `b` degrees of freedom, to a relative error of 1e-9; p is above 0 and below 1.
pub(super) fn fisher_quantile(p: f64, a: f64, b: f64) -> f64 {
    // The share beyond f is I_y(b/2, a/2) with y = b / (b + a f), which rises with y.
    let beyond = 1.0 - p;
    let (mut low, mut high) = (0.0f64, 1.0f64);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if incomplete_beta(0.5 * b, 0.5 * a, middle) < beyond {
            low = middle;
        } else {
            high = middle;
        }
    }
    // A smaller y is a larger f.
    b / a * (1.0 - low) / low.max(1e-300)
}

/// Returns the regularised incomplete beta function, by its continued fraction (Lentz).
fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    // The fraction converges fast on this side of the mean.
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(b, a, 1.0 - x);
    }
    const TINY: f64 = 1e-300;
    let kept = |value: f64| {
        if libm::fabs(value) < TINY {
            TINY
        } else {
            value
        }
    };
    let front = libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b)
        + a * libm::log(x)
        + b * libm::log1p(-x);
    let (mut c, mut d) = (1.0, 1.0 / kept(1.0 - (a + b) * x / (a + 1.0)));
    let mut sum = d;
    for m in 1..500 {
        let m = f64::from(m);
        for term in [
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        ] {
            d = 1.0 / kept(1.0 + term * d);
            c = kept(1.0 + term / c);
            sum *= c * d;
        }
        if libm::fabs(c * d - 1.0) < 1e-15 {
            break;
        }
    }
    libm::exp(front) * sum / a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_equal_published_ones() {
        for (probability, degrees, expected) in [
            (0.95, 1.0, 6.313_752),
            (0.95, 2.0, 2.919_986),
            (0.975, 5.0, 2.570_582),
            (0.95, 9.0, 1.833_113),
            (0.8, 4.0, 0.940_965),
            (0.995, 35.0, 2.723_806),
            (0.95, 1e6, 1.644_855),
        ] {
            let found = t_quantile(probability, degrees);
            assert!((found - expected).abs() < 2e-6, "{degrees}: {found}");
        }
        assert!((normal_quantile(0.975) - 1.959_964).abs() < 1e-6);
        assert!(t_quantile(0.5, 3.0).abs() < 1e-6);
    }

    #[test]
    fn fisher_quantiles_equal_published_ones() {
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
