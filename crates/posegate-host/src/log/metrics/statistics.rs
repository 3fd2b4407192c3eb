//! Statistics of errors.

/// Statistics of errors, with `evo`'s names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// How many errors there are.
    pub count: usize,
    /// The root of the mean square.
    pub rmse: f64,
    /// The mean.
    pub mean: f64,
    /// The median; of an even number the mean of the two in the middle.
    pub median: f64,
    /// The standard deviation, by 1 / N.
    pub std: f64,
    /// The least.
    pub min: f64,
    /// The largest.
    pub max: f64,
    /// The sum of squares.
    pub sse: f64,
    /// The root of the sum of squares: the paper's Eq. 1 as it is printed, without 1 / N.
    pub sum_norm: f64,
}

impl Statistics {
    /// Of these errors; `None` of none.
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

    /// By name, without the count.
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
