//! Statistics of errors.

/// Statistics of errors, with `evo`'s names, in the unit of the errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// The number of errors.
    pub count: usize,
    /// The root mean square.
    pub rmse: f64,
    /// The mean error.
    pub mean: f64,
    /// The median. For an even number of errors, the mean of the two in the middle.
    pub median: f64,
    /// The standard deviation, with the factor 1 / N.
    pub std: f64,
    /// The smallest error.
    pub min: f64,
    /// The largest error.
    pub max: f64,
    /// The sum of squares, in the square of the unit.
    pub sse: f64,
    /// The root of the sum of squares: the paper's Eq. 1 as printed, without 1 / N.
    pub sum_norm: f64,
}

impl Statistics {
    /// Returns the statistics of these errors; `None` if there are none.
    #[must_use]
    pub fn of(errors: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = errors.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        let count = sorted.len();
        let share = |sum: f64| sum / count as f64;
        let mean = share(sorted.iter().sum());
        let sse: f64 = sorted.iter().map(|error| error * error).sum();
        let spread = sorted.iter().map(|error| (error - mean) * (error - mean));
        let (low, high) = (sorted[(count - 1) / 2], sorted[count / 2]);
        Some(Self {
            count,
            rmse: libm::sqrt(share(sse)),
            mean,
            median: 0.5 * (low + high),
            std: libm::sqrt(share(spread.sum())),
            min,
            max,
            sse,
            sum_norm: libm::sqrt(sse),
        })
    }

    /// Returns the statistics by name, without the count.
    #[must_use]
    pub const fn named(&self) -> [(&'static str, f64); 8] {
        [
            ("rmse", self.rmse),
            ("mean", self.mean),
            ("median", self.median),
            ("std", self.std),
            ("min", self.min),
            ("max", self.max),
            ("sse", self.sse),
            ("sum_norm", self.sum_norm),
        ]
    }
}
