//! A Gaussian pose-set about a goal, whitened.

use posegate::confidence::{probability, radius_squared};
use posegate::shape::PoseDeg;

/// The distribution of the robot's pose for an estimate at its goal: the density N(x*, P), restricted to the pose-set
/// at confidence epsilon (Definition 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian {
    covariance: [[f64; 3]; 3],
    epsilon: f64,
    r2: f64,
}

/// The reason why numbers are not a Gaussian pose-set.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GaussianError {
    /// A standard deviation is not above zero, or not finite.
    #[error("sigma_{axis} is {sigma}; expected a finite number above 0")]
    Sigma {
        /// `x`, `y` or `yaw`.
        axis: &'static str,
        /// The given value, metres or radians.
        sigma: f64,
    },
    /// An entry of the covariance is not finite.
    #[error(
        "the covariance's entry in row {row}, column {column} is {value}; expected a finite number"
    )]
    NotFinite {
        /// Row, from 1.
        row: usize,
        /// Column, from 1.
        column: usize,
        /// The given value.
        value: f64,
    },
    /// Two mirrored entries differ.
    #[error(
        "the covariance is not symmetric: row {row}, column {column} is {upper}, and row {column}, column {row} is {lower}"
    )]
    NotSymmetric {
        /// Row, from 1.
        row: usize,
        /// Column, from 1.
        column: usize,
        /// The entry above the diagonal.
        upper: f64,
        /// The entry below the diagonal.
        lower: f64,
    },
    /// The covariance is not positive definite: some direction has no spread.
    #[error("the covariance is not positive definite")]
    NotPositiveDefinite,
    /// The confidence is not a probability between 0 and 1.
    #[error("epsilon is {0}; expected a number between 0 and 1, such as 0.99")]
    Epsilon(f64),
    /// The pose-set covers too many turns of the heading.
    #[error("the pose-set covers {0} turns of the heading; expected no more than 64")]
    Turns(f64),
}

/// Largest number of turns of the heading that a pose-set may cover.
const TURNS: f64 = 64.0;

impl Gaussian {
    /// Creates a pose-set from the standard deviations of x, y (metres) and yaw (radians), and its confidence.
    ///
    /// # Errors
    /// An error if a sigma is not above zero, epsilon is not between 0 and 1, or the headings cover more
    /// than 64 turns.
    pub fn of_sigmas(sigmas: [f64; 3], epsilon: f64) -> Result<Self, GaussianError> {
        for (axis, sigma) in ["x", "y", "yaw"].into_iter().zip(sigmas) {
            if !(sigma > 0.0 && (sigma * sigma).is_normal()) {
                return Err(GaussianError::Sigma { axis, sigma });
            }
        }
        let mut covariance = [[0.0; 3]; 3];
        for (axis, sigma) in sigmas.into_iter().enumerate() {
            covariance[axis][axis] = sigma * sigma;
        }
        Self::new(covariance, epsilon)
    }

    /// Creates a pose-set from the covariance of (x, y, yaw) by rows, in m and rad and in world axes, and its
    /// confidence.
    ///
    /// # Errors
    /// An error if an entry is not finite, if mirrored entries differ by more than 1e-9 of the product of the standard
    /// deviations, if the covariance is not positive definite (to 1e-12 of its diagonal), if epsilon is not between 0
    /// and 1, or if the headings cover more than 64 turns.
    pub fn new(covariance: [[f64; 3]; 3], epsilon: f64) -> Result<Self, GaussianError> {
        let entries = (0..9).map(|k| (k / 3, k % 3));
        for (row, column) in entries {
            let value = covariance[row][column];
            if !value.is_finite() {
                return Err(GaussianError::NotFinite {
                    row: row + 1,
                    column: column + 1,
                    value,
                });
            }
        }
        if (0..3).any(|i| !(covariance[i][i] > 0.0)) {
            return Err(GaussianError::NotPositiveDefinite);
        }
        let mut even = covariance;
        for (row, column) in [(0, 1), (0, 2), (1, 2)] {
            let (upper, lower) = (covariance[row][column], covariance[column][row]);
            let scale = libm::sqrt(covariance[row][row]) * libm::sqrt(covariance[column][column]);
            if !((upper - lower).abs() <= 1e-9 * scale) {
                return Err(GaussianError::NotSymmetric {
                    row: row + 1,
                    column: column + 1,
                    upper,
                    lower,
                });
            }
            let middle = 0.5 * upper + 0.5 * lower;
            (even[row][column], even[column][row]) = (middle, middle);
        }
        let r2 = radius_squared(epsilon).ok_or(GaussianError::Epsilon(epsilon))?;
        let this = Self {
            covariance: even,
            epsilon,
            r2,
        };
        let white = this
            .whitened(0.0)
            .ok_or(GaussianError::NotPositiveDefinite)?;
        let turns = 2.0 * white.radius * white.yaw / core::f64::consts::TAU;
        if turns > TURNS {
            return Err(GaussianError::Turns(turns));
        }
        Ok(this)
    }

    /// The covariance of (x, y, yaw) by rows, m and rad, world axes.
    #[must_use]
    pub const fn covariance(&self) -> [[f64; 3]; 3] {
        self.covariance
    }

    /// The confidence of the pose-set.
    #[must_use]
    pub const fn epsilon(&self) -> f64 {
        self.epsilon
    }

    /// Returns the density's integral over the pose-set: epsilon, up to the rounding of the radius.
    #[must_use]
    pub fn mass(&self) -> f64 {
        probability(self.r2)
    }

    /// Returns the density's integral over the part of the pose-set that a plane cuts off. `scale` is the scale of
    /// the pose-set that touches the plane; the result is 0 if it is at least 1.
    #[must_use]
    pub fn cap(&self, scale: f64) -> f64 {
        let radius = libm::sqrt(self.r2);
        let near = scale.max(0.0) * radius;
        if near >= radius {
            return 0.0;
        }
        // Along the plane's normal z the rest is a disc with the mass 1 - exp(-(r^2 - z^2) / 2).
        let normal = |z: f64| 0.5 * libm::erfc(z * core::f64::consts::FRAC_1_SQRT_2);
        let rim = libm::exp(-0.5 * self.r2) / libm::sqrt(core::f64::consts::TAU);
        (normal(near) - normal(radius) - rim * (radius - near)).max(0.0)
    }

    /// Returns the pose-set in the axes of a goal.
    pub(super) fn at(&self, goal: PoseDeg) -> WhitenedPoseSet {
        // A positive definite matrix stays positive definite in rotated axes, except for rounding.
        self.whitened(goal.yaw_deg).unwrap_or(WhitenedPoseSet {
            radius: 0.0,
            yaw: 0.0,
            drift: [0.0; 2],
            spread: [[0.0; 2]; 2],
        })
    }

    /// Returns the factor in axes rotated by `axes_deg` degrees; `None` if the covariance is not positive definite.
    fn whitened(&self, axes_deg: f64) -> Option<WhitenedPoseSet> {
        let [c, s] = <f64 as posegate::shape::Scalar>::cos_sin_deg(axes_deg);
        let p = &self.covariance;
        let yaw = libm::sqrt(p[2][2]);
        let level = |v: [f64; 2]| [c * v[0] + s * v[1], c * v[1] - s * v[0]];
        let drift = level([p[0][2] / yaw, p[1][2] / yaw]);
        // Rotate row by row, then column by column.
        let rows = [level([p[0][0], p[1][0]]), level([p[0][1], p[1][1]])];
        let [xx, xy] = level([rows[0][0], rows[1][0]]);
        let [_, yy] = level([rows[0][1], rows[1][1]]);
        let rest = |whole: f64, taken: f64| {
            let left = whole - taken;
            (left > 1e-12 * whole).then(|| libm::sqrt(left))
        };
        let x = rest(xx, drift[0] * drift[0])?;
        let across = (xy - drift[0] * drift[1]) / x;
        let y = rest(yy, drift[1] * drift[1] + across * across)?;
        Some(WhitenedPoseSet {
            radius: libm::sqrt(self.r2),
            yaw,
            drift,
            spread: [[x, 0.0], [across, y]],
        })
    }
}

/// The pose-set as the image of a ball, in the goal frame: yaw is `yaw u1`, the position `drift u1 + spread (u2,
/// u3)`, with `|u| <= radius`; u has the standard normal density.
#[derive(Clone, Copy, Debug)]
pub(super) struct WhitenedPoseSet {
    pub radius: f64,
    /// Radians.
    pub yaw: f64,
    /// Metres.
    pub drift: [f64; 2],
    /// By rows, metres; lower triangular.
    pub spread: [[f64; 2]; 2],
}

impl WhitenedPoseSet {
    /// Returns the position of the centre of a heading's disc.
    pub(super) fn middle(&self, u1: f64) -> [f64; 2] {
        self.drift.map(|drift| drift * u1)
    }

    /// Maps a direction in the disc to metres.
    pub(super) fn to_metres(self, [u, v]: [f64; 2]) -> [f64; 2] {
        self.spread.map(|[a, b]| a * u + b * v)
    }

    /// Maps a direction in metres to the disc.
    pub(super) fn whiten(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [[a, _], [b, c]] = self.spread;
        let u = x / a;
        [u, (y - b * u) / c]
    }
}
