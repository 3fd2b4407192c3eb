//! Confidence limits of a probability that are valid at every evaluation.

/// Returns limits of a probability after `successes` of `count` trials: a confidence sequence.
///
/// With a probability of at least `1 - alpha`, the limits contain the true probability after *every* trial. So they
/// may be evaluated after each trial, with any stopping rule. (Clopper-Pearson limits allow one evaluation, after a
/// number of trials that was fixed beforehand.) The limits enclose the p for which the likelihood ratio
///
/// ```text
/// B(successes + 1/2, failures + 1/2) / B(1/2, 1/2) / (p^successes (1 - p)^failures)
/// ```
///
/// is below `1 / alpha`. For the true p this ratio is a martingale that starts at 1 (Ville's inequality). It assumes
/// that each trial succeeds with probability p, for any results of earlier trials. `alpha` is above 0 and below 1.
/// The limits are rounded outwards by 1e-12.
#[must_use]
pub fn confidence_sequence(successes: u64, count: u64, alpha: f64) -> [f64; 2] {
    let (s, f) = (
        successes.min(count) as f64,
        count.saturating_sub(successes) as f64,
    );
    let mixture = log_beta(s + 0.5, f + 0.5) - log_beta(0.5, 0.5);
    let threshold = -libm::log(alpha);
    // The ratio decreases up to the share of successes, where it is at most 1, and then increases.
    let is_contradicted = |p: f64| {
        let likelihood = times_log(s, libm::log(p)) + times_log(f, libm::log1p(-p));
        mixture - likelihood >= threshold
    };
    let share = if count == 0 { 0.5 } else { s / (s + f) };
    // The border between `outside`, which is contradicted, and `inside`, which is not.
    let border = |mut outside: f64, mut inside: f64| {
        if !is_contradicted(outside) {
            return outside;
        }
        for _ in 0..60 {
            let middle = 0.5 * (outside + inside);
            if is_contradicted(middle) {
                outside = middle;
            } else {
                inside = middle;
            }
        }
        outside
    };
    [
        (border(0.0, share) - 1e-12).max(0.0),
        (border(1.0, share) + 1e-12).min(1.0),
    ]
}

/// Returns `times` multiplied by the logarithm of a number; 0 if `times` is 0, even if the number is 0.
fn times_log(times: f64, log: f64) -> f64 {
    if times == 0.0 { 0.0 } else { times * log }
}

fn log_beta(a: f64, b: f64) -> f64 {
    libm::lgamma(a) + libm::lgamma(b) - libm::lgamma(a + b)
}

#[cfg(test)]
mod tests;
