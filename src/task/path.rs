//! Paths that a robot drives from its estimated pose to a target pose.
//!
//! Uses floats, on a host and when a controller starts: no decision is made here.
#![allow(clippy::float_arithmetic)]

use core::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::set::Estimate;

/// One leg of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Leg {
    /// Turn towards the end pose, drive there straight, turn to its heading: rot1, trans, rot2. A turn in place if
    /// the position stays the same.
    Straight(Estimate),
    /// A circular arc that starts in the robot's current heading.
    Arc {
        /// End point, metres.
        x_m: f64,
        /// End point, metres.
        y_m: f64,
    },
}

/// A leg as the odometry model describes it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Motion {
    /// First turn, radians in `[-pi, pi)`; 0 for a turn in place.
    pub rot1: f64,
    /// Length driven, metres; for an arc the arc length.
    pub length: f64,
    /// Last turn, radians in `[-pi, pi)`.
    pub rot2: f64,
    /// Vector from start to end, world axes, metres.
    pub step: [f64; 2],
    /// Unit vector from start to end, world axes; for a turn in place the heading before the turn.
    pub ahead: [f64; 2],
}

impl Motion {
    /// Returns the straight-line distance from start to end, metres.
    #[must_use]
    pub fn chord(&self) -> f64 {
        libm::hypot(self.step[0], self.step[1])
    }

    /// Returns the largest magnitudes of rot1 and rot2 if the leg's ends may be off by up to `ends.start` and
    /// `ends.end`.
    ///
    /// Ends that are off by `away` in total turn the direction between them by at most
    /// `asin(away / chord) <= pi/2 away / chord`. A robot that does not start at an arc's start, or does not end
    /// at its end, turns and drives straight.
    #[must_use]
    pub fn largest_turns(&self, ends: &Ends) -> [f64; 2] {
        let [rot1, rot2] = [libm::fabs(self.rot1), libm::fabs(self.rot2)];
        let chord = self.chord();
        let away_m = ends.away();
        let ([_, askew], [_, left]) = (ends.start, ends.end);
        if away_m <= 0.0 && chord <= 0.0 {
            return [rot1, libm::fmin(rot2 + askew + left, PI)];
        }
        let aside = if away_m < chord {
            FRAC_PI_2 * (away_m / chord)
        } else {
            PI
        };
        [
            libm::fmin(rot1 + aside + askew, PI),
            libm::fmin(rot2 + aside + left, PI),
        ]
    }
}

/// Tolerances at the ends of a path or of a leg: metres and radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ends {
    /// Tolerance of the estimate at the start: position (m), heading (rad).
    pub start: [f64; 2],
    /// Tolerance of the estimate at the end: position (m), heading (rad).
    pub end: [f64; 2],
}

impl Ends {
    /// Returns how much longer the distance between the ends may be, metres.
    #[must_use]
    pub fn away(&self) -> f64 {
        self.start[0] + self.end[0]
    }

    /// Returns the tolerances of one leg of many. Only the path's own ends may be off; the poses between legs are
    /// reached exactly.
    #[must_use]
    pub fn of_leg(&self, is_first: bool, is_last: bool) -> Self {
        let kept = |own, end| if own { end } else { [0.0, 0.0] };
        Self {
            start: kept(is_first, self.start),
            end: kept(is_last, self.end),
        }
    }
}

impl Leg {
    /// Returns the motion from a pose and the pose where it ends.
    #[must_use]
    pub fn motion(&self, from: &Estimate) -> (Motion, Estimate) {
        let (x_m, y_m) = match self {
            Self::Straight(to) => (to.x_m, to.y_m),
            Self::Arc { x_m, y_m } => (*x_m, *y_m),
        };
        let step = [x_m - from.x_m, y_m - from.y_m];
        let chord = libm::hypot(step[0], step[1]);
        let bearing = if chord > 0.0 {
            libm::atan2(step[1], step[0])
        } else {
            from.yaw_rad
        };
        let rot1 = wrapped(bearing - from.yaw_rad);
        let ahead = if chord > 0.0 {
            [step[0] / chord, step[1] / chord]
        } else {
            cos_sin(wrapped(bearing))
        };
        match self {
            Self::Straight(to) => {
                let motion = Motion {
                    rot1,
                    length: chord,
                    rot2: wrapped(to.yaw_rad - bearing),
                    step,
                    ahead,
                };
                (motion, *to)
            }
            Self::Arc { .. } => {
                // The angle between tangent and chord is half of the arc's angle.
                let longer = if libm::fabs(rot1) > 1e-6 {
                    rot1 / cos_sin(rot1)[1]
                } else {
                    1.0 + rot1 * rot1
                };
                let motion = Motion {
                    rot1,
                    length: chord * longer,
                    rot2: rot1,
                    step,
                    ahead,
                };
                let end = Estimate {
                    x_m,
                    y_m,
                    yaw_rad: wrapped(bearing + rot1),
                };
                (motion, end)
            }
        }
    }
}

/// Length, turning and end of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Travel {
    /// Length of the path, metres.
    pub length_m: f64,
    /// Total turning, radians: the sum of `|rot1| + |rot2|`.
    pub turning_rad: f64,
    /// End pose.
    pub to: Estimate,
}

/// Measures a path whose ends may be off. Exact if the ends are exact, else upper bounds.
#[must_use]
pub fn travel(from: &Estimate, legs: &[Leg], ends: &Ends) -> Travel {
    let mut travel = Travel {
        length_m: if legs.is_empty() { 0.0 } else { ends.away() },
        turning_rad: 0.0,
        to: *from,
    };
    let last = legs.len().saturating_sub(1);
    for (number, leg) in legs.iter().enumerate() {
        let (motion, end) = leg.motion(&travel.to);
        let [rot1, rot2] = motion.largest_turns(&ends.of_leg(number == 0, number == last));
        travel.length_m += motion.length;
        travel.turning_rad += rot1 + rot2;
        travel.to = end;
    }
    travel
}

/// Returns cosine and sine of an angle within `[-pi, pi]`, to 1e-14: the Taylor series of a 16th of the angle,
/// squared four times as a complex number. (`libm`'s functions have a branch for large angles that the compiler
/// cannot prove free of panics.)
fn cos_sin(angle: f64) -> [f64; 2] {
    let x = angle / 16.0;
    let t = x * x;
    // Omitted terms are below 1e-18 at pi / 16.
    let cos =
        1.0 - t / 2.0 * (1.0 - t / 12.0 * (1.0 - t / 30.0 * (1.0 - t / 56.0 * (1.0 - t / 90.0))));
    let sin = x
        * (1.0
            - t / 6.0 * (1.0 - t / 20.0 * (1.0 - t / 42.0 * (1.0 - t / 72.0 * (1.0 - t / 110.0)))));
    let (mut c, mut s) = (cos, sin);
    for _ in 0..4 {
        (c, s) = (c * c - s * s, 2.0 * c * s);
    }
    [c, s]
}

/// Wraps an angle of magnitude below 2^14 radians to `[-pi, pi)`.
pub fn wrapped(angle: f64) -> f64 {
    let turns = (angle + PI) / TAU;
    // Round down: a cast rounds towards zero.
    let whole = turns as i64 as f64;
    let whole = if whole > turns { whole - 1.0 } else { whole };
    let wrapped = angle - TAU * whole;
    if wrapped >= PI {
        wrapped - TAU
    } else {
        wrapped
    }
}
