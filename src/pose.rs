//! Poses in SE(2) as integers, and the transform between the world frame and a task's goal frame.
//!
//! ```
//! use posegate::num::BinaryAngle;
//! use posegate::pose::{GoalFrame, Pose};
//!
//! // A dock at (2 m, 0), approached along +y: its x axis is the world's y axis.
//! let quarter = BinaryAngle(1 << 30);
//! let dock = GoalFrame {
//!     pose: Pose { x_um: 2_000_000, y_um: 0, yaw: quarter },
//!     cos_q30: 0,
//!     sin_q30: 1 << 30,
//! };
//! // A robot 0.3 m before the dock and facing it.
//! let robot = Pose { x_um: 2_000_000, y_um: -300_000, yaw: quarter };
//! let relative = dock.pose_to_goal(robot).expect("within 268 m");
//! assert_eq!((relative.x_um, relative.y_um), (-300_000, 0));
//! assert_eq!(relative.yaw, BinaryAngle(0));
//! ```

use crate::num::{BinaryAngle, product};

/// A planar pose `(x, y, yaw)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pose {
    /// x, micrometres.
    pub x_um: i32,
    /// y, micrometres.
    pub y_um: i32,
    /// Heading, counter-clockwise from the frame's x axis.
    pub yaw: BinaryAngle,
}

/// Limit of the distance of a pose from the goal, on each axis, within which the transform into the goal
/// frame has its stated error: 2^28 um (268 m).
pub const REACH_UM: i32 = 1 << 28;

/// Upper bound of the distance, on each axis, of a [`Pose`] that was moved into the goal frame from the
/// true one, in whole micrometres: the sum of [`GoalFrame::pose_to_goal`]'s error table, 2.42, rounded
/// up.
pub const MOVE_ERROR_UM: i64 = 3;

/// A task's goal pose x* (frame g in the world) with its cosine and sine, as a table stores them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GoalFrame {
    /// The goal pose in the world.
    pub pose: Pose,
    /// Cosine of the goal's yaw, unit 2^-30, within one unit of the true one.
    pub cos_q30: i32,
    /// Sine of the goal's yaw, unit 2^-30, within one unit of the true one.
    pub sin_q30: i32,
}

impl GoalFrame {
    /// Returns a world pose in the goal frame: `T_w_g^-1 p`.
    ///
    /// `None` if the pose is 2^28 um or more from the goal on an axis.
    ///
    /// | rounding, on each axis | at most |
    /// |---|---|
    /// | the estimate, to the micrometre (0.5 on each axis, rotated) | 0.71 um |
    /// | the goal pose, to the micrometre (0.5 on each axis, rotated) | 0.71 um |
    /// | cosine and sine, one unit of 2^-30 each, times 2^28 um each | 0.50 um |
    /// | this function's last shift, to the nearest | 0.50 um |
    /// | **sum** | **2.42 um**, in code [`MOVE_ERROR_UM`] |
    ///
    /// The yaw is exact except for the rounding of the estimate's and the goal's yaw (0.5 unit and
    /// 2^-30 unit each, of 2^-32 turn).
    #[must_use]
    pub fn pose_to_goal(&self, pose: Pose) -> Option<Pose> {
        let dx = within_reach(i64::from(pose.x_um).wrapping_sub(i64::from(self.pose.x_um)))?;
        let dy = within_reach(i64::from(pose.y_um).wrapping_sub(i64::from(self.pose.y_um)))?;
        let (x_um, y_um) = self.turn_to_goal(dx, dy);
        Some(Pose {
            x_um,
            y_um,
            yaw: pose.yaw.minus(self.pose.yaw),
        })
    }

    /// Rotates a vector of the world into the goal frame, micrometres. Both inputs must be within [`REACH_UM`]. The
    /// error on each axis is at most 1 um (0.5 from cosine and sine, 0.5 from the shift).
    #[must_use]
    pub fn turn_to_goal(&self, x_um: i32, y_um: i32) -> (i32, i32) {
        let (c, s) = (self.cos_q30, self.sin_q30);
        (
            shifted(product(c, x_um).wrapping_add(product(s, y_um))),
            shifted(product(c, y_um).wrapping_sub(product(s, x_um))),
        )
    }

    /// Returns a pose of the goal frame in the world, saturating at the ends of the number range. For
    /// reports, not for decisions.
    #[must_use]
    pub fn pose_to_world(&self, pose: Pose) -> Pose {
        let (c, s) = (self.cos_q30, self.sin_q30);
        let dx = shifted(product(c, pose.x_um).wrapping_sub(product(s, pose.y_um)));
        let dy = shifted(product(s, pose.x_um).wrapping_add(product(c, pose.y_um)));
        Pose {
            x_um: self.pose.x_um.saturating_add(dx),
            y_um: self.pose.y_um.saturating_add(dy),
            yaw: self.pose.yaw.plus(pose.yaw),
        }
    }
}

/// Returns `Some` if the length is below [`REACH_UM`] in magnitude.
fn within_reach(length: i64) -> Option<i32> {
    let length = i32::try_from(length).ok()?;
    (length.unsigned_abs() < REACH_UM.unsigned_abs()).then_some(length)
}

/// Returns a sum of two products of a Q30 number and a length, shifted to the nearest micrometre. The
/// sum is below 2^60, the result below 2^30.
#[cfg_attr(small_code, inline(never))]
fn shifted(sum: i64) -> i32 {
    (sum.wrapping_add(1 << 29) >> 30) as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;
    use proptest::prelude::*;

    proptest! {
        /// The error table of `pose_to_goal`, compared with f64 (whose own error is 1e-7 um here).
        #[test]
        fn goal_transform_stays_within_stated_error(
            goal in (-1e3f64..1e3, -1e3f64..1e3, -7.0f64..7.0),
            offset in (-180.0f64..180.0, -180.0f64..180.0, -7.0f64..7.0),
        ) {
            let fixed = |v: f64| (v * 1e6).round() as i32;
            let frame = GoalFrame {
                pose: Pose {
                    x_um: fixed(goal.0),
                    y_um: fixed(goal.1),
                    yaw: BinaryAngle::from_radians(goal.2).unwrap(),
                },
                cos_q30: (goal.2.cos() * f64::from(1 << 30)).round() as i32,
                sin_q30: (goal.2.sin() * f64::from(1 << 30)).round() as i32,
            };
            let world = (goal.0 + offset.0, goal.1 + offset.1);
            let pose = Pose {
                x_um: fixed(world.0),
                y_um: fixed(world.1),
                yaw: BinaryAngle::from_radians(goal.2 + offset.2).unwrap(),
            };
            let got = frame.pose_to_goal(pose).unwrap();
            let (s, c) = goal.2.sin_cos();
            let expected = (c * offset.0 + s * offset.1, c * offset.1 - s * offset.0);
            let limit = MOVE_ERROR_UM as f64;
            prop_assert!((f64::from(got.x_um) - expected.0 * 1e6).abs() <= limit);
            prop_assert!((f64::from(got.y_um) - expected.1 * 1e6).abs() <= limit);
            let yaw = got.yaw.minus(BinaryAngle::from_radians(offset.2).unwrap()).signed();
            prop_assert!(yaw.abs() <= 2);
            let back = frame.pose_to_world(got);
            prop_assert!((back.x_um - pose.x_um).abs() <= 3 && (back.y_um - pose.y_um).abs() <= 3);
            prop_assert_eq!(back.yaw, pose.yaw);
        }
    }

    #[test]
    fn far_from_the_goal_is_refused() {
        let frame = GoalFrame {
            pose: Pose {
                x_um: -2_000_000_000,
                y_um: 0,
                yaw: BinaryAngle(0),
            },
            cos_q30: 1 << 30,
            sin_q30: 0,
        };
        let at = |x_um| Pose {
            x_um,
            y_um: 0,
            yaw: BinaryAngle::from_radians(TAU / 4.0).unwrap(),
        };
        assert!(frame.pose_to_goal(at(2_000_000_000)).is_none());
        assert!(frame.pose_to_goal(at(-2_000_000_000 + REACH_UM)).is_none());
        let near = frame
            .pose_to_goal(at(-2_000_000_000 + REACH_UM - 1))
            .unwrap();
        assert_eq!(
            (near.x_um, near.y_um, near.yaw.0),
            (REACH_UM - 1, 0, 1 << 30)
        );
    }
}
