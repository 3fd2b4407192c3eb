//! The knowledge of the robot's pose between tasks.

use crate::num::{Float, Rounding, UM_PER_M, sqrt_ceil};
use crate::pose::{Pose, REACH_UM};
use crate::set::{
    Extent, InputError, PoseSet, Q24_PER_RADIAN_Q52, RadiusSquared, SqrtFactor, factor_of,
};

/// All positions within a distance and all headings within an angle. Unlike a pose-set it may be a single pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Cylinder {
    /// Micrometres, from 0 to 2^28.
    translation_um: i32,
    /// 2^-24 turn, from 0 to half a turn.
    yaw_q24: i32,
}

/// Half a turn: every heading.
const EVERY_HEADING: i32 = 1 << 23;

impl Cylinder {
    /// A single pose.
    pub const POINT: Self = Self {
        translation_um: 0,
        yaw_q24: 0,
    };

    /// Creates a cylinder from metres and radians, rounded up. `None` if one is negative or not finite, or the length
    /// is 268 m or more. Angles beyond half a turn mean every heading.
    #[must_use]
    pub fn new(translation_m: f64, yaw_rad: f64) -> Option<Self> {
        Self::from_um_q24(length_um(translation_m)?, angle_q24(yaw_rad)?)
    }

    /// Creates a cylinder from micrometres and 2^-24 turns; `None` if one is negative or the length is 2^28 or more.
    #[must_use]
    pub fn from_um_q24(translation_um: i64, yaw_q24: i64) -> Option<Self> {
        if translation_um < 0 || translation_um >= i64::from(REACH_UM) || yaw_q24 < 0 {
            return None;
        }
        Some(Self {
            translation_um: translation_um as i32,
            yaw_q24: yaw_q24.min(i64::from(EVERY_HEADING)) as i32,
        })
    }

    /// Returns the largest distance, micrometres, from 0 to 2^28.
    #[must_use]
    pub const fn translation_um(self) -> i32 {
        self.translation_um
    }

    /// Returns the largest angle, 2^-24 turn; half a turn is every heading.
    #[must_use]
    pub const fn yaw_q24(self) -> i32 {
        self.yaw_q24
    }

    /// Returns the Minkowski sum of both cylinders; `None` if it is 268 m or more.
    #[must_use]
    pub fn plus(self, other: Self) -> Option<Self> {
        Self::from_um_q24(
            i64::from(self.translation_um).wrapping_add(i64::from(other.translation_um)),
            i64::from(self.yaw_q24).wrapping_add(i64::from(other.yaw_q24)),
        )
    }

    /// Returns `true` if `other` lies in this cylinder.
    #[must_use]
    pub const fn holds(self, other: Self) -> bool {
        other.translation_um <= self.translation_um && other.yaw_q24 <= self.yaw_q24
    }
}

/// Returns a length in micrometres, rounded up; `None` if it is negative, not finite, or 2^40 or more.
pub(super) fn length_um(metres: f64) -> Option<i64> {
    let float = Float::of(metres).filter(|float| !float.negative || float.is_zero())?;
    float
        .scaled(u128::from(UM_PER_M), 0, Rounding::AwayFromZero)
        .filter(|um| *um < 1 << 40)
}

/// Returns an angle in 2^-24 turn, rounded up, at most every heading; `None` if it is negative or not finite.
pub(super) fn angle_q24(radians: f64) -> Option<i64> {
    let float = Float::of(radians).filter(|float| !float.negative || float.is_zero())?;
    Some(
        float
            .scaled(Q24_PER_RADIAN_Q52, 52, Rounding::AwayFromZero)
            .unwrap_or(i64::MAX)
            .min(i64::from(EVERY_HEADING)),
    )
}

/// Probability that a statement is false, rounded up: unit 2^-32. Risks are added, which holds without independence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Risk(u32);

impl Risk {
    /// The statement is certain.
    pub const NONE: Self = Self(0);

    /// Returns `1 - epsilon`, rounded up; `None` unless epsilon is above 0 and at most 1.
    #[must_use]
    pub fn from_confidence(epsilon: f64) -> Option<Self> {
        let float = Float::of(epsilon).filter(|float| float.is_positive())?;
        let whole = 1i64 << 32;
        // To the nearest, and one unit outwards.
        let held = float.scaled(1 << 32, 0, Rounding::Nearest)?;
        match held {
            held if held == whole && epsilon.to_bits() == 1f64.to_bits() => Some(Self::NONE),
            held if held > whole || epsilon.to_bits() > 1f64.to_bits() => None,
            held => Some(Self::from_wide(whole.wrapping_sub(held).wrapping_add(1))),
        }
    }

    /// Returns a risk from units of 2^-32.
    #[must_use]
    pub const fn from_q32(units: u32) -> Self {
        Self(units)
    }

    /// Returns the risk in units of 2^-32, saturated at the largest value.
    #[must_use]
    pub const fn q32(self) -> u32 {
        self.0
    }

    /// Returns the sum: an upper bound of the probability that either statement is false.
    #[must_use]
    pub const fn plus(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }

    fn from_wide(units: i64) -> Self {
        Self(u32::try_from(units).unwrap_or(u32::MAX))
    }
}

/// A normally distributed error: its ellipsoid at a confidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Random {
    pub factor: SqrtFactor,
    pub radius_squared: RadiusSquared,
    /// Probability that the error is outside of the ellipsoid.
    pub risk: Risk,
}

/// The knowledge of the pose: the truth is the estimate, plus an error in a cylinder, plus a normally distributed error
/// (in world axes). Either part may be zero.
///
/// If neither part is zero, the first error may have turned the axes in which the second one is given. Of a set with
/// both parts, only the cylinder that encloses everything may be used, because a turn does not change it
/// ([`PoseErrorSet::about`] uses it).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub struct PoseErrorSet {
    pub(super) certain: Cylinder,
    /// Probability that the error is outside of the cylinder: not zero if the cylinder encloses an ellipsoid.
    pub(super) doubt: Risk,
    pub(super) random: Option<Random>,
}

impl PoseErrorSet {
    /// Creates the knowledge that the error is certain to be in a cylinder. After a localization, that is the largest
    /// error of an observation (r_l).
    pub const fn bounded(within: Cylinder) -> Self {
        Self {
            certain: within,
            doubt: Risk::NONE,
            random: None,
        }
    }

    /// Creates the knowledge that the error is normally distributed with this covariance (world axes; m^2, m rad,
    /// rad^2). `risk` is one minus the confidence of the radius.
    ///
    /// # Errors
    /// Those of [`PoseSet::gaussian`] that concern the covariance.
    pub fn gaussian(
        covariance: [[f64; 3]; 3],
        radius_squared: RadiusSquared,
        risk: Risk,
    ) -> Result<Self, InputError> {
        Ok(Self {
            certain: Cylinder::POINT,
            doubt: Risk::NONE,
            random: Some(Random {
                factor: factor_of(covariance, radius_squared)?,
                radius_squared,
                risk,
            }),
        })
    }

    /// Returns `true` if the set about a single pose is an ellipsoid, not a cylinder.
    #[must_use]
    pub fn is_ellipsoid(&self) -> bool {
        self.random.is_some() && self.certain == Cylinder::POINT
    }

    /// Returns the probability that the truth is outside of the set that [`about`](Self::about) returns.
    #[must_use]
    pub fn risk(&self) -> Risk {
        self.random
            .map_or(self.doubt, |random| self.doubt.plus(random.risk))
    }

    /// Returns the cylinder that encloses the error; `None` if it is 268 m or more.
    #[must_use]
    pub fn enclosing(&self) -> Option<Cylinder> {
        match self.random {
            None => Some(self.certain),
            Some(random) => self.certain.plus(cylinder_of(&random.factor)?),
        }
    }

    /// Returns the pose-set of an estimate within the cylinder `spread` about `mean`: the ellipsoid itself if
    /// `spread` and the cylinder part are single poses, else the cylinder that encloses everything. `None` if it is 268
    /// m or more.
    ///
    /// A set that is a single pose becomes a set of one micrometre and 2^-24 turn.
    #[must_use]
    pub fn about(&self, mean: Pose, spread: Cylinder) -> Option<PoseSet> {
        if let Some(random) = self.random
            && self.certain == Cylinder::POINT
            && spread == Cylinder::POINT
        {
            return Some(PoseSet::of(mean, Extent::Gaussian(random.factor)));
        }
        let all = self.enclosing()?.plus(spread)?;
        let extent = Extent::Bounded {
            translation_um: all.translation_um.max(1),
            yaw_q24: all.yaw_q24.max(1),
        };
        Some(PoseSet::of(mean, extent))
    }
}

/// Returns the smallest cylinder about the mean that encloses a pose-set, rounded up; `None` if it is 268 m or more.
#[must_use]
pub fn enclosing(set: &PoseSet) -> Option<Cylinder> {
    match set.extent() {
        Extent::Gaussian(factor) => cylinder_of(&factor),
        Extent::Bounded {
            translation_um,
            yaw_q24,
        } => Cylinder::from_um_q24(i64::from(translation_um), i64::from(yaw_q24)),
        Extent::Grown { factor, by } => {
            let moved =
                Cylinder::from_um_q24(i64::from(by.translation_um()), i64::from(by.yaw_q24()));
            cylinder_of(&factor)?.plus(moved?)
        }
    }
}

/// Returns the smallest cylinder about an ellipsoid, rounded up: its longest half axis in the plane and its yaw.
fn cylinder_of(factor: &SqrtFactor) -> Option<Cylinder> {
    let dot = |a: [i32; 3], b: [i32; 3]| {
        a.iter().zip(b).fold(0i64, |sum, (a, b)| {
            sum.wrapping_add(i64::from(*a).wrapping_mul(i64::from(b)))
        })
    };
    // Sums of three products below 2^56 each.
    let (xx, xy, yy) = (
        dot(factor.x_um(), factor.x_um()),
        dot(factor.x_um(), factor.y_um()),
        dot(factor.y_um(), factor.y_um()),
    );
    // The larger eigenvalue is the middle of the diagonal plus the root of (half the diagonal's difference)^2 + xy^2.
    // Large values are scaled down by 2^shift first, rounded up.
    let middle = (xx.wrapping_add(yy) >> 1).wrapping_add(1);
    let half = (xx.wrapping_sub(yy).unsigned_abs() >> 1).wrapping_add(1);
    let across = xy.unsigned_abs();
    let shift = 33u32.saturating_sub(half.max(across).leading_zeros());
    let fine = |v: u64| v.wrapping_shr(shift).wrapping_add(1);
    // Below 2^31 each.
    let (h, b) = (fine(half), fine(across));
    let root = sqrt_ceil(h.wrapping_mul(h).wrapping_add(b.wrapping_mul(b)));
    let largest = middle
        .unsigned_abs()
        .checked_add(root.unsigned_abs().wrapping_shl(shift))?;
    Cylinder::from_um_q24(sqrt_ceil(largest), i64::from(factor.yaw_q24()))
}
