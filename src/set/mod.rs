//! Epsilon-pose-sets (Definition 1): the poses where the robot may be, and the checks of its inputs.
//!
//! Two functions make a set of a caller's numbers: [`PoseSet::gaussian`] and [`PoseSet::bounded`] take
//! floats as filters send them, check every one, and return integers that the rest of the core trusts. The
//! integer set *contains* the set that the floats describe: every rounding is outwards. The estimate itself
//! cannot be rounded outwards; its rounding is in the error budget of `contain`. There is no floating-point
//! operation; floats are decoded from their bits.
//!
//! # Headings beyond half a turn
//! The error of the heading is a real number, and the heading of a pose is its wrap: a set that turns by more than half a turn has poses at
//! every heading, each with the place that belongs to its error. A bounded set keeps the bound that was given, so a margin
//! below 1 is the share of this bound that is inside. Facets, cells, batches and the second evaluation use this meaning.
//!
//! ```
//! use posegate::set::{Estimate, InputError, PoseSet, RadiusSquared};
//!
//! let estimate = Estimate { x_m: 1.0, y_m: 2.0, yaw_rad: 0.1 };
//! // epsilon = 0.99: the squared radius 11.345, rounded up.
//! let radius = RadiusSquared::from_q16(743_499).expect("from 1 to 256");
//! // 1 cm, 2 cm and 0.01 rad standard deviation, uncorrelated.
//! let covariance = [[1e-4, 0.0, 0.0], [0.0, 4e-4, 0.0], [0.0, 0.0, 1e-4]];
//! let set = PoseSet::gaussian(estimate, covariance, radius).expect("a covariance");
//! assert_eq!(set.mean().x_um, 1_000_000);
//!
//! // A filter that never filled its covariance is not certain: it is refused.
//! let empty = PoseSet::gaussian(estimate, [[0.0; 3]; 3], radius);
//! assert_eq!(empty, Err(InputError::CovarianceZero));
//! ```

use crate::num::{
    BinaryAngle, Float, FloatUnit, NotConverted, Rounding, UM_PER_M, clamped, converted, is_finite,
};
use crate::pose::Pose;

use self::given::{Given, Target};
use self::trust::Reach;

pub use self::aging::{Aging, MOST_AGES};
pub use self::factor::SqrtFactor;
pub use self::growth::Growth;
pub use self::trust::{CrossTerms, Inflation, SplitWeight, Trust};

pub(crate) use self::carried::{Carriable, PathNoise, carried, metres, radians};
pub(crate) use self::common::{Common, Turn, broad_um};
pub(crate) use self::covariance::ScaledCovariance;
pub(crate) use self::growth::scaled_yaw;

mod aging;
mod carried;
mod common;
mod covariance;
#[cfg(test)]
mod error_budget;
mod factor;
mod given;
mod grown;
mod growth;
mod trust;

/// An estimate of the robot's pose in the world frame, as a filter reports it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Estimate {
    /// x, metres, world frame.
    pub x_m: f64,
    /// y, metres, world frame.
    pub y_m: f64,
    /// Yaw, radians, counter-clockwise; any number of turns below 16,384 rad.
    pub yaw_rad: f64,
}

impl From<nalgebra::Isometry2<f64>> for Estimate {
    fn from(pose: nalgebra::Isometry2<f64>) -> Self {
        Self {
            x_m: pose.translation.x,
            y_m: pose.translation.y,
            yaw_rad: pose.rotation.angle(),
        }
    }
}

/// The reason why an input is not a valid estimate. Each is a denial with its own reason (`gate::Reason` says
/// what to do).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum InputError {
    /// A coordinate of the estimate is NaN or infinite.
    EstimateNotFinite,
    /// The estimate is more than 2000 m from the origin on an axis, or its yaw is 16,384 rad or more.
    EstimateOutOfRange,
    /// An entry of the covariance is NaN or infinite.
    CovarianceNotFinite,
    /// Every entry of the covariance is zero: the filter never filled it.
    CovarianceZero,
    /// The covariance differs from its transpose by more than rounding.
    CovarianceNotSymmetric,
    /// The covariance is not positive definite to 30 bits (a variance of zero, a correlation of 1).
    CovarianceNotPositiveDefinite,
    /// The pose-set is more than 268 m or 32 turns wide.
    CovarianceTooLarge,
    /// An extent of a bounded set is zero, negative, NaN, infinite, or too large to be one.
    BoundInvalid,
    /// The source reports that it does not know its covariance.
    CovarianceUnknown,
    /// The orientation is not a rotation: the length of its quaternion is not 1, or is NaN.
    OrientationInvalid,
    /// The robot is tilted by more than 5 degrees, so its pose is not a pose on the floor.
    Tilted,
}

messages!(InputError {
    EstimateNotFinite => "a coordinate of the estimate is NaN or infinite",
    EstimateOutOfRange => "the estimate is more than 2000 m from the origin on an axis, or its yaw is 16,384 rad or more",
    CovarianceNotFinite => "an entry of the covariance is NaN or infinite",
    CovarianceZero => "every entry of the covariance is zero: the filter never filled it",
    CovarianceNotSymmetric => "the covariance differs from its transpose by more than rounding",
    CovarianceNotPositiveDefinite => "the covariance is not positive definite: a variance is zero or negative, or a correlation is 1",
    CovarianceTooLarge => "the pose-set is more than 268 m or 32 turns wide",
    BoundInvalid => "an extent of the bounded set is zero, negative, NaN, infinite or too large",
    CovarianceUnknown => "the source reports that it does not know its covariance",
    OrientationInvalid => "the orientation is not a rotation: the length of its quaternion is not 1, or is NaN",
    Tilted => "the robot is tilted by more than 5 degrees, so its pose is not a pose on the floor",
});

/// The uncertainty that a source reports for its estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Uncertainty {
    /// Covariance of (x, y, yaw) by rows, in world axes: m^2, m rad, rad^2.
    Gaussian([[f64; 3]; 3]),
    /// A bounded set.
    Bounded {
        /// Radius in the plane, metres.
        translation_m: f64,
        /// Half width in yaw, radians.
        yaw_rad: f64,
    },
}

/// The square of the radius of a Gaussian pose-set: the chi-square quantile with 3 degrees of
/// freedom at the confidence epsilon, unit 2^-16, rounded up.
///
/// From 1 to below 256: epsilon between 0.199 and 1 - 1e-54. A radius outside of this range would in effect
/// switch the check off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RadiusSquared(u32);

impl RadiusSquared {
    /// The largest squared radius: just below 256.
    pub const LARGEST: Self = Self((1 << 24) - 1);

    /// Returns the squared radius `raw / 65536`, or `None` unless it is at least 1 and below 256.
    #[must_use]
    pub const fn from_q16(raw: u32) -> Option<Self> {
        if raw >= 1 << 16 && raw < 1 << 24 {
            Some(Self(raw))
        } else {
            None
        }
    }

    /// Returns the square of the radius in units of 2^-16.
    #[must_use]
    pub const fn q16(self) -> u32 {
        self.0
    }
}

/// The shape of a pose-set relative to its estimate, in world axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Extent {
    /// `{ F u : |u| <= 1 }`: an ellipsoid, the radius included.
    Gaussian(SqrtFactor),
    /// `{ |(dx, dy)| <= translation, |dyaw| <= yaw }`: a cylinder.
    Bounded {
        /// Micrometres, rounded up.
        translation_um: i32,
        /// 2^-24 turn, rounded up; at most 2^30, 64 turns.
        yaw_q24: i32,
    },
    /// An ellipsoid grown by a movement: the Minkowski sum of both.
    Grown {
        /// The ellipsoid.
        factor: SqrtFactor,
        /// The movement.
        by: Growth,
    },
}

/// An epsilon-pose-set: every pose where the robot may be, at the stated confidence.
///
/// [`PoseSet::gaussian`] and [`PoseSet::bounded`] make it; the core grows it and widens it by a trust. All keep its numbers in range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PoseSet {
    mean: Pose,
    extent: Extent,
    common: Common,
    /// `None` if the extent itself is the given set.
    given: Option<Given>,
}

impl PoseSet {
    /// Returns the Gaussian set `{ (x + e_x, y + e_y, wrap(yaw + e_yaw)) : e' P^-1 e <= r2 }` about an estimate (Definition 1); e_yaw is any real
    /// number.
    ///
    /// `covariance` is P of `(x, y, yaw)` in world axes: m^2, m rad, rad^2, by rows; a
    /// `nalgebra::Matrix3<f64>` is accepted. The two halves may differ by rounding (2^-20 of the diagonal);
    /// the set then covers both.
    ///
    /// # Errors
    /// The first [`InputError`] in the order of that enum. Exception: a variance that is not above zero is
    /// reported before the symmetry, which is measured relative to the variances.
    pub fn gaussian(
        estimate: Estimate,
        covariance: impl Into<[[f64; 3]; 3]>,
        radius_squared: RadiusSquared,
    ) -> Result<Self, InputError> {
        let reach = Reach::of(radius_squared, Trust::FULL);
        Self::of_covariance(pose_of(estimate)?, &covariance.into(), reach)
    }

    /// Returns the bounded set `{ |(px-x, py-y)| <= translation, |wrap(pyaw-yaw)| <= yaw }`.
    ///
    /// `translation_m` is at most 268 m, `yaw_rad` is any angle: from half a turn on, it is every heading. From 32 turns on, it
    /// is every heading at every scale, so margins are lower bounds there, too.
    ///
    /// # Errors
    /// [`InputError::BoundInvalid`] unless both extents are finite and above zero, and the errors of the
    /// estimate.
    pub fn bounded(
        estimate: Estimate,
        translation_m: f64,
        yaw_rad: f64,
    ) -> Result<Self, InputError> {
        let spread = Uncertainty::Bounded {
            translation_m,
            yaw_rad,
        };
        let mean = pose_of(estimate)?;
        // A cylinder does not use the radius.
        Self::trusted(mean, spread, RadiusSquared::LARGEST, Trust::FULL)
    }

    /// Returns the set of an uncertainty about a pose, with the trust in its source applied. A covariance is
    /// multiplied by the inflation (a cylinder's extents by its root). [`CrossTerms`] defines the terms
    /// between yaw and plane.
    ///
    /// # Errors
    /// The errors of [`PoseSet::gaussian`] and [`PoseSet::bounded`] that concern the uncertainty.
    pub fn trusted(
        mean: Pose,
        spread: Uncertainty,
        radius_squared: RadiusSquared,
        trust: Trust,
    ) -> Result<Self, InputError> {
        Self::of_spread(mean, &spread, radius_squared, trust)
    }

    /// Returns [`PoseSet::trusted`] without a copy of the covariance.
    pub(crate) fn of_spread(
        mean: Pose,
        spread: &Uncertainty,
        radius_squared: RadiusSquared,
        trust: Trust,
    ) -> Result<Self, InputError> {
        match spread {
            Uncertainty::Gaussian(covariance) => {
                let reach = Reach::of(radius_squared, trust);
                match trust.cross_terms {
                    CrossTerms::Filled => Self::of_covariance(mean, covariance, reach),
                    terms => Self::of_covariance(mean, &terms.of(*covariance), reach),
                }
            }
            Uncertainty::Bounded {
                translation_m,
                yaw_rad,
            } => {
                let (extent, given) = cylinder(*translation_m, *yaw_rad, trust.inflation)?;
                Ok(Self::given(mean, extent, given))
            }
        }
    }

    /// Not inlined: a result of this size is expensive to copy.
    #[inline(never)]
    fn of_covariance(
        mean: Pose,
        covariance: &[[f64; 3]; 3],
        reach: Reach,
    ) -> Result<Self, InputError> {
        let (factor, target) = covariance::factor(covariance, reach)?;
        let given = Given::Ellipsoid(Target::of(&target));
        Ok(Self::given(mean, Extent::Gaussian(factor), given))
    }

    #[cfg_attr(small_code, inline(never))]
    #[cfg_attr(not(small_code), inline(always))]
    fn given(mean: Pose, extent: Extent, given: Given) -> Self {
        Self {
            given: Some(given),
            ..Self::of(mean, extent)
        }
    }

    /// Returns a set from numbers in range.
    #[inline(always)]
    pub(crate) fn of(mean: Pose, extent: Extent) -> Self {
        Self {
            mean,
            extent,
            common: Common::of(mean, extent),
            given: None,
        }
    }

    /// Returns the set grown by a movement: every pose to which the robot may have moved or may move.
    ///
    /// The result is exact but for the rounding of the movement itself. Cost: about a hundred instructions on a Cortex-M4F; a decision about a
    /// grown ellipsoid costs about as much as one about the ellipsoid.
    #[must_use]
    pub fn grown(&self, by: Growth) -> Self {
        let mut grown = *self;
        grown.grow(by);
        grown
    }

    /// Adds a movement to the set, as [`PoseSet::grown`], in place.
    pub fn grow(&mut self, by: Growth) {
        if by.is_none() {
            return;
        }
        match (&mut self.given, self.extent) {
            (Some(Given::Ellipsoid(_)), _) => {}
            (Some(given), Extent::Bounded { .. }) => *given = given.wider(by),
            (given, _) => *given = None,
        }
        self.extent = by.around(self.extent);
        self.common.grow(self.extent, by);
    }

    /// Returns `true` if an offset from the estimate (um, um, 2^-32 turn; a real number of turns) is certain to lead to a pose of the given set,
    /// before outward rounding. For reports.
    fn surely_holds(&self, offset: [i64; 3]) -> bool {
        let given = self.given.unwrap_or_else(|| Given::of(self.extent));
        match self.extent {
            Extent::Grown { factor, by } => {
                let facing = [self.common.cos_q15, self.common.sin_q15];
                given.holds_moved(by, by.aside_um(factor.yaw), facing, offset)
            }
            _ => given.holds(offset),
        }
    }

    /// Returns the largest of 256 shares of an offset from the estimate (um, um, 2^-32 turn) that is certain to lead to a pose of the given set.
    /// Returns no offset if the set is too thin to decide.
    pub(crate) fn farthest_towards(&self, offset: [i64; 3]) -> [i64; 3] {
        const STEPS: i64 = 256;
        // Beyond every set.
        const MOST_UM: i64 = 1 << 30;
        const MOST_TURN: i64 = 1 << 40;
        let [x, y, turn] = offset;
        let [x, y] = [x, y].map(|v| clamped(v, -MOST_UM, MOST_UM));
        let turn = clamped(turn, -MOST_TURN, MOST_TURN);
        let share = |steps: i64| [x, y, turn].map(|v| v.wrapping_mul(steps).wrapping_div(STEPS));
        let (mut inside, mut outside) = (0, STEPS.wrapping_add(1));
        // The last step first: most poses need no more.
        let mut next = STEPS;
        while outside.wrapping_sub(inside) > 1 {
            if self.surely_holds(share(next)) {
                inside = next;
            } else {
                outside = next;
            }
            next = inside.wrapping_add(outside) >> 1;
        }
        share(inside)
    }

    /// Returns the pose at an offset from the estimate: um, um, 2^-32 turn.
    pub(crate) fn at_offset(&self, [x, y, turn]: [i64; 3]) -> Pose {
        let length = |from: i32, by: i64| i64::from(from).saturating_add(by) as i32;
        Pose {
            x_um: length(self.mean.x_um, x),
            y_um: length(self.mean.y_um, y),
            yaw: self.mean.yaw.plus(BinaryAngle(turn as u32)),
        }
    }

    /// Returns the values that every decision about the set needs.
    pub(crate) const fn common(&self) -> &Common {
        &self.common
    }

    /// Returns the estimate, to the micrometre and 2^-32 turn.
    #[must_use]
    pub const fn mean(&self) -> Pose {
        self.mean
    }

    /// Returns the extent about the estimate.
    #[must_use]
    pub const fn extent(&self) -> Extent {
        self.extent
    }
}

/// Returns a bounded set's extents as integers, rounded up.
fn cylinder(
    translation_m: f64,
    yaw_rad: f64,
    inflation: Inflation,
) -> Result<(Extent, Given), InputError> {
    let limit = i64::from(crate::pose::REACH_UM);
    let translation = extent_of(translation_m, u128::from(UM_PER_M), 0, limit, inflation);
    let widest = i64::from(growth::WIDEST_YAW);
    let yaw = extent_of(yaw_rad, Q24_PER_RADIAN_Q52, 52, widest, inflation);
    let (Some(translation), Some(yaw)) = (translation, yaw) else {
        return Err(InputError::BoundInvalid);
    };
    if translation >= limit {
        return Err(InputError::BoundInvalid);
    }
    let extent = Extent::Bounded {
        translation_um: translation as i32,
        yaw_q24: yaw as i32,
    };
    Ok((extent, Given::of_cylinder(translation, yaw, inflation)))
}

/// Returns an extent with its inflation, rounded up and limited. `None` unless it is a number above zero.
fn extent_of(
    value: f64,
    factor: u128,
    shift: i32,
    limit: i64,
    inflation: Inflation,
) -> Option<i64> {
    let float = Float::of(value).filter(|float| float.is_positive())?;
    let extent = float.scaled(factor, shift, Rounding::AwayFromZero);
    // Up to 2^28 times 2^22.
    let extent = inflation.of_length(extent.unwrap_or(i64::MAX).min(limit));
    Some(extent.min(limit))
}

/// 2^24 / (2 pi) * 2^52, rounded up.
pub(crate) const Q24_PER_RADIAN_Q52: u128 = 12_025_407_501_443_077_023_729;

/// Returns the factor of `radius_squared P`.
///
/// # Errors
/// The errors of [`PoseSet::gaussian`] that concern the covariance.
pub(crate) fn factor_of(
    covariance: [[f64; 3]; 3],
    radius_squared: RadiusSquared,
) -> Result<SqrtFactor, InputError> {
    let reach = Reach::of(radius_squared, Trust::FULL);
    match PoseSet::of_covariance(Pose::default(), &covariance, reach)?.extent {
        Extent::Gaussian(factor) => Ok(factor),
        Extent::Bounded { .. } | Extent::Grown { .. } => Err(InputError::BoundInvalid),
    }
}

/// Returns an estimate in micrometres and 2^-32 turn. The error is 0.5 um on each axis, and 0.5 unit and 2^-30 unit of a
/// binary angle.
///
/// # Errors
/// The [`InputError`]s that concern the estimate.
pub fn pose_of(estimate: Estimate) -> Result<Pose, InputError> {
    let Estimate { x_m, y_m, yaw_rad } = estimate;
    if !(is_finite(y_m) && is_finite(yaw_rad)) {
        return Err(InputError::EstimateNotFinite);
    }
    place(x_m, y_m, || {
        BinaryAngle::from_radians(yaw_rad).ok_or(InputError::EstimateOutOfRange)
    })
}

/// Returns a place on the floor, metres, as integers, with a heading from `yaw`.
///
/// # Errors
/// [`InputError`]: of x first, then of y, then of the heading.
pub(crate) fn place(
    x_m: f64,
    y_m: f64,
    yaw: impl FnOnce() -> Result<BinaryAngle, InputError>,
) -> Result<Pose, InputError> {
    Ok(Pose {
        x_um: coordinate(x_m)?,
        y_um: coordinate(y_m)?,
        yaw: yaw()?,
    })
}

/// Returns a coordinate of an estimate, micrometres.
#[cfg_attr(small_code, inline(never))]
#[cfg_attr(not(small_code), inline(always))]
fn coordinate(metres: f64) -> Result<i32, InputError> {
    match converted(metres, &FloatUnit::MICRO, Rounding::Nearest) {
        Ok(um) if um.unsigned_abs() <= 2_000_000_000 => Ok(um as i32),
        Err(NotConverted::NotFinite) => Err(InputError::EstimateNotFinite),
        Ok(_) | Err(NotConverted::TooLarge) => Err(InputError::EstimateOutOfRange),
    }
}

#[cfg(test)]
mod tests;
