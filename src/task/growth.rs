//! The change of the pose knowledge along a path: navigation's F, in integers.
//!
//! # Rounding
//! Models are floats, evaluated once and rounded up. Lengths are rounded to the micrometre after 2^-40 of them is
//! added, angles to 2^-24 turn. The covariance that the odometry adds is rounded after 2^-40 of its diagonal is added
//! (the float products err by 2^-50 of it).
//!
//! A path's integers hold for every start and every end of the estimate in the [`PathTolerance`] cylinders about the
//! path's ends; [`MotionUpdate::begins_at`] tests a start. A robot that localizes starts where its observation puts it,
//! which is farther from the end and needs more turning. Poses are compared as integers, so a path is measured from its rounded start, and the bounded
//! model counts the rounding of its end. A controller that stops late has driven farther. Poses between
//! legs are assumed to be reached.
//!
//! A Gaussian error `F u` is carried by the integer lever: `F1 = G F`. Each entry of the first column is rounded to the
//! nearest micrometre, with a lever whose ends are rounded to the micrometre. The columns are therefore off by a vector
//! e with `|e| <= 3 + 8 (yaw in turns)` um on an axis, and 2^-28 of the distance.
//! `(F1 + E)(F1 + E)' <= (1 + 2^-12) F1 F1' + (1 + 2^12) E E'`. Then `r2 N` is added and the sum is factored with
//! outward rounding ([`crate::set`]).

use super::knowledge::{Random, angle_q24, length_um};
use super::model::ModelError;
use super::path::{Ends, Leg, Travel, travel};
use super::{BoundedDriveModel, Cylinder, Odometry, PoseErrorSet, Risk};
use crate::num::BinaryAngle;
use crate::pose::Pose;
use crate::set::{Estimate, InputError, RadiusSquared, ScaledCovariance, pose_of};

/// Tolerances of a path's start and end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PathTolerance {
    /// Largest distance of the estimate from the path's beginning.
    pub start: Cylinder,
    /// Largest distance from the path's end at which the controller may stop.
    pub end: Cylinder,
}

/// Why a path gives no [`MotionUpdate`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum GrowthError {
    /// A gain of the model is negative, NaN or infinite.
    Model(ModelError),
    /// The path has no leg: nothing is driven, so the estimate does not move to the path's end.
    NoLegs,
    /// A pose of the path is not valid.
    Pose(InputError),
    /// The path is longer than 1073 m, or the uncertainty that it adds is out of range.
    TooLarge,
}

impl core::fmt::Display for GrowthError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Model(error) => write!(f, "{error}"),
            Self::NoLegs => f.write_str("the path has no leg"),
            Self::Pose(error) => write!(f, "a pose of the path is not valid: {error}"),
            Self::TooLarge => f.write_str(
                "the path is longer than 1073 m, or the uncertainty that it adds is out of range",
            ),
        }
    }
}

impl core::error::Error for GrowthError {}

/// The change that driving a path makes to a [`PoseErrorSet`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotionUpdate {
    from: Pose,
    to: Pose,
    within: PathTolerance,
    model: Model,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Model {
    Bounded {
        /// Total length driven, micrometres, below 2^30.
        length_um: i64,
        /// `k_slip L`, micrometres.
        slip_um: i64,
        /// `k_turn A + k_drift L`, 2^-24 turn.
        turn_q24: i64,
    },
    Gaussian {
        /// Vector from start to end, micrometres, each entry below 2^30.
        step_um: [i32; 2],
        /// Upper bound of the distance from a start to the end, micrometres, below 2^30.
        farthest_um: i64,
        /// `r2 N`.
        noise: ScaledCovariance,
        radius_squared: RadiusSquared,
        /// Probability that the noise is outside of its ellipsoid.
        risk: Risk,
    },
}

/// Exclusive upper bound of a path's length.
const LONGEST_UM: i64 = 1 << 30;

impl MotionUpdate {
    /// Evaluates the bounded model for a path, driven as one motion: its total length and turning count once.
    ///
    /// # Errors
    /// [`GrowthError`] if the model or the path is invalid, or the result is out of range.
    pub fn bounded(
        from: &Estimate,
        legs: &[Leg],
        drift: &BoundedDriveModel,
        within: PathTolerance,
    ) -> Result<Self, GrowthError> {
        drift.check().map_err(GrowthError::Model)?;
        if legs.is_empty() {
            return Err(GrowthError::NoLegs);
        }
        let start = pose(from)?;
        let Travel {
            length_m,
            turning_rad,
            to,
        } = travel(&unrounded(start), legs, &within.ends());
        let [slip, turn] = drift.added(length_m, turning_rad);
        let model = Model::Bounded {
            length_um: path_um(length_m)?,
            slip_um: path_um(slip)?,
            turn_q24: angle_q24(outwards(turn)).ok_or(GrowthError::TooLarge)?,
        };
        Ok(Self {
            from: start,
            to: pose(&to)?,
            within,
            model,
        })
    }

    /// Evaluates the odometry model for a path, for sets of this radius; `risk` is one minus their confidence.
    ///
    /// # Errors
    /// [`GrowthError`] if the model or the path is invalid, or the result is out of range.
    pub fn gaussian(
        from: &Estimate,
        legs: &[Leg],
        odometry: &Odometry,
        within: PathTolerance,
        radius_squared: RadiusSquared,
        risk: Risk,
    ) -> Result<Self, GrowthError> {
        odometry.check().map_err(GrowthError::Model)?;
        if legs.is_empty() {
            return Err(GrowthError::NoLegs);
        }
        let start = pose(from)?;
        let from = &unrounded(start);
        let end = pose(&travel(from, legs, &Ends::default()).to)?;
        let noise = odometry.noise(from, legs, &within.ends());
        let noise = ScaledCovariance::of_noise(noise.transpose().into(), radius_squared)
            .ok_or(GrowthError::TooLarge)?;
        let step = |a: i32, b: i32| {
            let step = i64::from(b).wrapping_sub(i64::from(a));
            i32::try_from(step)
                .ok()
                .filter(|step| step.unsigned_abs() < LONGEST_UM.unsigned_abs() as u32)
                .ok_or(GrowthError::TooLarge)
        };
        let step_um = [step(start.x_um, end.x_um)?, step(start.y_um, end.y_um)?];
        let farthest_um = length(step_um)
            .wrapping_add(1)
            .wrapping_add(i64::from(within.away_um()));
        let model = Model::Gaussian {
            step_um,
            farthest_um,
            noise,
            radius_squared,
            risk,
        };
        Ok(Self {
            from: start,
            to: end,
            within,
            model,
        })
    }

    /// Returns the pose where the path begins.
    #[must_use]
    pub const fn from(&self) -> Pose {
        self.from
    }

    /// Returns the pose where the path ends. The estimate then lies within [`PathTolerance::end`] of it.
    #[must_use]
    pub const fn to(&self) -> Pose {
        self.to
    }

    /// Returns the tolerances of the estimate at the path's ends.
    #[must_use]
    pub const fn within(&self) -> PathTolerance {
        self.within
    }

    /// Returns `true` if the path may start at every estimate within `spread` of `pose`.
    #[must_use]
    pub fn begins_at(&self, pose: Pose, spread: Cylinder) -> bool {
        Self::off(self.from, pose, spread).is_some_and(|all| self.within.start.holds(all))
    }

    /// Returns the largest distance from `from` to a pose within `spread` of `pose`; `None` if it is 268 m or more.
    #[must_use]
    pub fn off(from: Pose, pose: Pose, spread: Cylinder) -> Option<Cylinder> {
        let across = |a: i32, b: i32| i32::try_from(i64::from(a).wrapping_sub(i64::from(b))).ok();
        let [dx, dy] = [across(pose.x_um, from.x_um)?, across(pose.y_um, from.y_um)?];
        // Rounded up to a whole 2^-24 turn.
        let turned = (pose.yaw.minus(from.yaw).signed().unsigned_abs() >> 8)
            .wrapping_add(u32::from(pose.yaw != from.yaw));
        Cylinder::from_um_q24(length([dx, dy]), i64::from(turned))?.plus(spread)
    }

    /// Returns the knowledge after the path; `None` if it is out of range or has another radius.
    #[must_use]
    pub fn after(&self, before: &PoseErrorSet) -> Option<PoseErrorSet> {
        match &self.model {
            Model::Bounded {
                length_um,
                slip_um,
                turn_q24,
            } => {
                let error = before.enclosing()?;
                // One unit more of each, since the path's end is rounded.
                let yaw = i64::from(error.yaw_q24())
                    .wrapping_add(*turn_q24)
                    .wrapping_add(1);
                let translation = i64::from(error.translation_um())
                    .wrapping_add(*slip_um)
                    .wrapping_add(chord(*length_um, yaw))
                    .wrapping_add(1);
                Some(PoseErrorSet {
                    certain: Cylinder::from_um_q24(translation, yaw)?,
                    doubt: before.risk(),
                    random: None,
                })
            }
            Model::Gaussian {
                step_um,
                farthest_um,
                noise,
                radius_squared,
                risk,
            } => {
                let certain = before.certain;
                let swung = chord(*farthest_um, i64::from(certain.yaw_q24()));
                let translation = i64::from(certain.translation_um()).wrapping_add(swung);
                let grown = match before.random {
                    None => *noise,
                    Some(random) if random.radius_squared == *radius_squared => {
                        let away = self.within.away_um();
                        ScaledCovariance::carried(&random.factor, *step_um, away)?.plus(noise)?
                    }
                    Some(_) => return None,
                };
                Some(PoseErrorSet {
                    certain: Cylinder::from_um_q24(translation, i64::from(certain.yaw_q24()))?,
                    doubt: before.doubt,
                    random: Some(Random {
                        factor: grown.factor()?,
                        radius_squared: *radius_squared,
                        risk: before.random.map_or(*risk, |random| random.risk.max(*risk)),
                    }),
                })
            }
        }
    }
}

impl PathTolerance {
    /// Returns the tolerances in metres and radians, rounded outwards.
    fn ends(&self) -> Ends {
        Ends {
            start: self.start.metres_radians(),
            end: self.end.metres_radians(),
        }
    }

    /// Returns how much longer the distance may be, micrometres: below 2^29.
    fn away_um(&self) -> i32 {
        self.start
            .translation_um()
            .saturating_add(self.end.translation_um())
    }
}

impl BoundedDriveModel {
    /// Returns the error that driving adds: to the position, metres, and to the heading, radians.
    #[allow(clippy::float_arithmetic)]
    fn added(&self, length_m: f64, turning_rad: f64) -> [f64; 2] {
        [
            self.k_slip * length_m,
            self.k_turn * turning_rad + self.k_drift * length_m,
        ]
    }
}

impl Cylinder {
    /// Returns metres and radians, rounded outwards by 2^-40 of them.
    #[allow(clippy::float_arithmetic)]
    fn metres_radians(self) -> [f64; 2] {
        let turn = core::f64::consts::TAU / 16_777_216.0;
        [
            outwards(f64::from(self.translation_um()) * 1e-6),
            outwards(f64::from(self.yaw_q24()) * turn),
        ]
    }
}

/// Returns an upper bound: floating-point errors are far below 2^-40 of the value.
#[allow(clippy::float_arithmetic)]
pub(super) fn outwards(value: f64) -> f64 {
    value * (1.0 + 1.0 / 1_099_511_627_776.0)
}

fn path_um(metres: f64) -> Result<i64, GrowthError> {
    length_um(outwards(metres))
        .filter(|um| *um < LONGEST_UM)
        .ok_or(GrowthError::TooLarge)
}

fn pose(estimate: &Estimate) -> Result<Pose, GrowthError> {
    pose_of(*estimate).map_err(GrowthError::Pose)
}

/// Returns the estimate that a rounded pose stands for. A path is measured from it: starts are compared with rounded poses.
#[allow(clippy::float_arithmetic)]
fn unrounded(pose: Pose) -> Estimate {
    Estimate {
        x_m: f64::from(pose.x_um) / 1e6,
        y_m: f64::from(pose.y_um) / 1e6,
        yaw_rad: f64::from(pose.yaw.signed()) * (core::f64::consts::TAU / 4_294_967_296.0),
    }
}

/// Returns the length of a vector, micrometres, rounded up.
fn length([x, y]: [i32; 2]) -> i64 {
    let square = |v: i32| u64::from(v.unsigned_abs()).wrapping_mul(u64::from(v.unsigned_abs()));
    crate::num::sqrt_ceil(square(x).wrapping_add(square(y)))
}

/// Returns the chord `2 L sin(yaw / 2)` of a path below 2^31 um that is turned by `yaw`, micrometres, rounded up. For
/// half a turn and more it is the diameter.
pub(super) fn chord(length_um: i64, yaw_q24: i64) -> i64 {
    let half = crate::num::clamped(yaw_q24, 0, 1 << 23) as u32;
    // 2^-24 turn is 2^8 units of an angle; half of it 2^7.
    let [_, sin] = BinaryAngle(half << 7).cos_sin_q30();
    let sin = i64::from(sin)
        .wrapping_add(crate::num::COS_SIN_ERROR_Q30)
        .min(1 << 30);
    // Below 2^31 * 2^30.
    (length_um.wrapping_mul(sin) >> 29).wrapping_add(1)
}
