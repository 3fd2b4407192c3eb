//! Nested bounds: shapes for a smaller, the requested and a larger share of the errors, and all bounds between and
//! beyond them. At places where tags flip, errors that are half as frequent are hardly larger; elsewhere they may be
//! several times as large. A common factor for both would be too large for one of them.

use super::smooth::InterpolationWeights;

/// The smallest ratio of a shape to the one before. With it the rounding of a step exceeds the errors of logarithms.
pub(super) const LEAST_RATIO: f64 = 1.002;

/// Bounds by a *step*: at step i they are the i-th shape, and between two shapes their logarithms are linear in the
/// step. Each further step beyond the last shape doubles it; each step below the first one halves it.
#[derive(Clone, Debug)]
pub(super) struct Family {
    /// The logarithms of the shapes at the corners: at least one shape, each above the one before.
    logs: Vec<Vec<f64>>,
}

impl Family {
    /// Returns `None` unless there is a shape, all shapes have equally many corners, and at each corner a shape is at
    /// least nearly [`LEAST_RATIO`] times the one before.
    pub(super) fn new(shapes: &[Vec<f64>]) -> Option<Self> {
        let logs: Vec<Vec<f64>> = shapes
            .iter()
            .map(|shape| shape.iter().map(|value| libm::log(*value)).collect())
            .collect();
        let corners = logs.first()?.len();
        let least = 0.5 * (LEAST_RATIO - 1.0);
        let ascends = |pair: &[Vec<f64>]| {
            pair[1].len() == corners && pair[0].iter().zip(&pair[1]).all(|(a, b)| b - a >= least)
        };
        let finite = logs.iter().flatten().all(|log| log.is_finite());
        (finite && logs.windows(2).all(ascends)).then_some(Self { logs })
    }

    /// Converts a number of a file to a step; for a single shape the number is a factor. `None` if it is impossible.
    pub(super) fn step_of(&self, number: f64) -> Option<f64> {
        let step = match self.logs.len() {
            1 => libm::log2(number),
            _ => number,
        };
        step.is_finite().then_some(step)
    }

    /// Returns the score of an error, given by its logarithm: the smallest step (for a single shape the smallest
    /// factor) with which the bound at a place is at least the error.
    pub(super) fn score(&self, spot: &InterpolationWeights, log_error: f64) -> f64 {
        match self.logs.as_slice() {
            [shape] => libm::exp(log_error - spot.value(shape)),
            _ => self.step(spot, log_error),
        }
    }

    /// Returns the logarithm of the bound at a corner.
    pub(super) fn log(&self, corner: usize, step: f64) -> f64 {
        let last = self.logs.len() - 1;
        let end = last as f64;
        if step <= 0.0 {
            return self.logs[0][corner] + step * core::f64::consts::LN_2;
        }
        if step >= end {
            return self.logs[last][corner] + (step - end) * core::f64::consts::LN_2;
        }
        let below = (step as usize).min(last - 1);
        let (low, high) = (self.logs[below][corner], self.logs[below + 1][corner]);
        low + (step - below as f64) * (high - low)
    }

    fn step(&self, spot: &InterpolationWeights, log_error: f64) -> f64 {
        let mut low = spot.value(&self.logs[0]);
        if log_error <= low {
            return (log_error - low) / core::f64::consts::LN_2;
        }
        for (below, shape) in self.logs[1..].iter().enumerate() {
            let high = spot.value(shape);
            if log_error <= high {
                return below as f64 + (log_error - low) / (high - low);
            }
            low = high;
        }
        (self.logs.len() - 1) as f64 + (log_error - low) / core::f64::consts::LN_2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::Axis;
    use crate::smooth::Lattice;

    fn lattice() -> Lattice {
        let axis = || Axis::new(std::vec![1.0, 2.0], false).unwrap();
        Lattice::over(&[axis(), axis(), axis()])
    }

    /// Three shapes with different ratios at each of eight corners.
    fn family() -> Family {
        let corner = |k: u32| 0.01 * f64::from(1 + k);
        let of = |by: fn(u32) -> f64| (0..8).map(|k| corner(k) * by(k)).collect();
        Family::new(&[
            of(|_| 1.0),
            of(|k| 1.1 + 0.3 * f64::from(k)),
            of(|k| 9.0 + f64::from(k)),
        ])
        .unwrap()
    }

    /// The bound at the score of an error is the error, at the corners and between them.
    #[test]
    fn score_is_the_inverse_of_the_bound() {
        let (lattice, family) = (lattice(), family());
        for through in [[0.0; 3], [0.3, 0.7, 0.2], [1.0, 0.5, 0.9]] {
            let spot = lattice.spot([0; 3], through);
            for error in [1e-5, 0.01, 0.03, 0.06, 0.2, 0.5, 3.0] {
                let step = family.score(&spot, libm::log(error));
                let logs: Vec<f64> = (0..8).map(|corner| family.log(corner, step)).collect();
                let off = spot.value(&logs) - libm::log(error);
                assert!(off.abs() < 1e-12, "{through:?} {error}: {off}");
            }
        }
    }

    /// A single shape has factors, and the bound at a factor is the shape times the factor.
    #[test]
    fn single_shape_has_factors() {
        let family = Family::new(&[std::vec![0.02; 8]]).unwrap();
        let spot = lattice().spot([0; 3], [0.5; 3]);
        let factor = family.score(&spot, libm::log(0.05));
        assert!((factor - 2.5).abs() < 1e-12, "{factor}");
        let step = family.step_of(factor).unwrap();
        assert!((libm::exp(family.log(3, step)) - 0.05).abs() < 1e-12);
        assert_eq!(family.step_of(0.0), None);
        assert_eq!(family.step_of(f64::NAN), None);
    }

    #[test]
    fn shapes_must_ascend() {
        assert!(Family::new(&[std::vec![1.0, 2.0], std::vec![1.1, 2.0]]).is_none());
        assert!(Family::new(&[std::vec![1.0, 2.0], std::vec![1.1]]).is_none());
        assert!(Family::new(&[]).is_none());
    }
}
