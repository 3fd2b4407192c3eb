//! One increment of the odometry.

use crate::motion::MotionBounds;
use crate::num::{BinaryAngle, Float, Rounding, sqrt_ceil};
use crate::set::Q24_PER_RADIAN_Q52;

/// A movement since the previous increment, in the robot's axes at its start. It states its begin time, so that a lost increment is
/// detected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Increment {
    pub(super) step: Step,
    pub(super) begins_ms: u32,
}

/// A movement up to a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Step {
    /// Along the robot's axis, micrometres: from -4 m to 4 m.
    pub x_um: i32,
    /// To the robot's left, micrometres.
    pub y_um: i32,
    /// Counter-clockwise, 2^-32 turn.
    pub turn: i32,
    /// The time at its end, milliseconds of the controller's clock.
    pub stamp_ms: u32,
}

/// Half a turn, 2^-24 turn.
const HALF_TURN_Q24: u64 = 1 << 23;
/// The largest entry of an increment on an axis, micrometres.
const LONGEST: i32 = 1 << 22;

impl Increment {
    /// Returns an increment from metres ahead, metres to the left, and radians counter-clockwise, each to the nearest unit, and the times of
    /// its beginning and its end: the end of one increment is the beginning of the next. `None` if a number is not finite, a length is
    /// above 2^22 um (4.19 m), or the turn is half a turn or more.
    #[must_use]
    pub fn of(ahead_m: f64, left_m: f64, turn_rad: f64, span_ms: [u32; 2]) -> Option<Self> {
        let length = |value: f64| {
            let um = Float::of(value)?.scaled(1_000_000, 0, Rounding::Nearest)?;
            i32::try_from(um).ok()
        };
        let q24 = Float::of(turn_rad)?.scaled(Q24_PER_RADIAN_Q52, 52, Rounding::AwayFromZero)?;
        let is_turn = q24.unsigned_abs() < HALF_TURN_Q24;
        let turn = BinaryAngle::from_radians(turn_rad).filter(|_| is_turn)?;
        Self::new(length(ahead_m)?, length(left_m)?, turn.signed(), span_ms)
    }

    /// Returns an increment from micrometres and units of 2^-32 turn, and the times of its beginning and its end. `None` if a length is
    /// above 2^22 um (4.19 m).
    #[must_use]
    pub const fn new(
        ahead_um: i32,
        left_um: i32,
        turn: i32,
        [begins_ms, stamp_ms]: [u32; 2],
    ) -> Option<Self> {
        let is_short = ahead_um.unsigned_abs() <= LONGEST.unsigned_abs()
            && left_um.unsigned_abs() <= LONGEST.unsigned_abs();
        if !is_short {
            return None;
        }
        Some(Self {
            step: Step {
                x_um: ahead_um,
                y_um: left_um,
                turn,
                stamp_ms,
            },
            begins_ms,
        })
    }

    /// Returns the times of the movement's beginning and end, milliseconds of the controller's clock.
    #[must_use]
    pub const fn span_ms(&self) -> [u32; 2] {
        [self.begins_ms, self.step.stamp_ms]
    }

    /// Returns the movement ahead and to the left, micrometres, and the turn counter-clockwise, 2^-32 turn. Axes are the
    /// robot's at the beginning.
    #[must_use]
    pub const fn entries(&self) -> [i32; 3] {
        [self.step.x_um, self.step.y_um, self.step.turn]
    }
}

impl Step {
    /// Returns the length of the movement, micrometres, rounded up.
    pub fn length_um(&self) -> u32 {
        if self.y_um == 0 {
            return self.x_um.unsigned_abs();
        }
        sqrt_ceil(self.length_squared()) as u32
    }

    /// Returns the square of the length of the movement, um^2: at most 2^45.
    fn length_squared(&self) -> u64 {
        let [x, y] = [self.x_um, self.y_um].map(|v| u64::from(v.unsigned_abs()));
        x.wrapping_mul(x).wrapping_add(y.wrapping_mul(y))
    }

    /// Returns the magnitude of the turn, 2^-24 turn, rounded up.
    pub fn turn_q24(&self) -> u32 {
        self.turn.unsigned_abs().wrapping_add(0xff) >> 8
    }

    /// Returns `true` if a robot can make this movement within `ms` and one millisecond for the rounding of both stamps.
    pub fn is_within(&self, bounds: MotionBounds, ms: u32) -> bool {
        let most = bounds.within(ms.saturating_add(1));
        let length_um = u64::from(most.translation_um().unsigned_abs().saturating_add(2));
        self.length_squared() <= length_um.wrapping_mul(length_um)
            && self.turn_q24() <= most.yaw_q24().unsigned_abs().saturating_add(2)
    }

    /// Returns the last `after / whole` of the movement.
    pub fn part(&self, [after, whole]: [u32; 2]) -> Self {
        let share = |value: i32| {
            let product = i64::from(value).wrapping_mul(i64::from(after));
            product.checked_div(i64::from(whole)).unwrap_or(0) as i32
        };
        Self {
            x_um: share(self.x_um),
            y_um: share(self.y_um),
            turn: share(self.turn),
            stamp_ms: self.stamp_ms,
        }
    }
}
