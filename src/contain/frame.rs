//! The points P of a pose-set in one frame of a facet layout: to first order in the yaw offset, with a
//! bound on the rest.
//!
//! The set is `{ p = m + d, yaw = theta + t : d = X u, t = f u1, |u| <= 1 }` (a disc:
//! `|d| <= rho, |t| <= f`). With `J` a quarter turn:
//!
//! - World axes, `A = R(theta) v`: `P = (m + A) + d + t J A + e`, `|e| <= t^2 |A| / 2`.
//! - Robot axes, `M = R(-theta) (m - q)`, `D = R(-theta) d`: `P = R(-t) (M + D)`. A facet `a . P <= b`,
//!   divided by `cos t`, is `a.(M + D) - tan t a.J (M + D) <= b / cos t`. For `|t| <= 1/2` it follows
//!   from `a.M + a.D - t a.J M - t a.J D + 3/8 |t|^3 |M + D| + 9/16 t^2 |b| <= b`. The product `t a.J D`
//!   of two parts of the set is the *bend*, which [`super::facets`] bounds. A disc does not change when
//!   it is rotated: it has no bend, and `3/8 |t|^3 |M| + 9/16 t^2 (|b| + rho)` suffices.

use super::compact::QuantizedPoseSet;
use crate::set::{Extent, Turn};
use crate::table::{Axes, Facets, Frame};

/// A set with the values that all frames of a layout share. "Units" are the extent's, unless stated
/// otherwise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ready<'s> {
    pub set: QuantizedPoseSet<'s>,
    /// Upper bound of the length of an offset in the plane along any facet's normal, units.
    pub broad: i32,
    /// Bound on the terms beyond first order for arms (world axes), units, rounded up.
    rest_arm: i32,
    /// As `rest_arm`, in robot axes.
    rest_robot: i32,
    /// Upper bound of a bend in robot axes, units.
    bend: i32,
}

/// The points of a set in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct FramePoints {
    pub axes: Axes,
    /// P of the estimate, length units.
    pub x: i32,
    /// As `x`.
    pub y: i32,
    /// The effect of the yaw on P: a column in addition to the extent's, as a lever in length units.
    pub lever: [i32; 2],
    /// Bound on the terms beyond first order and the bend.
    pub rest: i32,
    /// Upper bound of the bend.
    pub bend: i32,
}

impl<'s> Ready<'s> {
    /// Returns `None` if the set exceeds the bounds above: it turns by more than half a radian about a
    /// lever.
    #[inline(always)]
    pub fn of(set: QuantizedPoseSet<'s>, facets: &Facets<'_>) -> Option<Self> {
        // A normal is longer than 1 by 2^-8 at most; entries of a factor are rounded.
        let broad = set.broad.wrapping_add(set.broad >> 7).wrapping_add(3);
        let mut ready = Self {
            set,
            broad: broad as i32,
            rest_arm: 0,
            rest_robot: 0,
            bend: 0,
        };
        let lever = u32::from(facets.lever());
        if lever == 0 {
            return Some(ready);
        }
        let turn = &set.common.turn;
        if !(turn.radians_q15 <= Turn::LARGEST) {
            return None;
        }
        let (radians, square, cube) = (
            turn.radians_q15.unsigned_abs(),
            turn.square_q15,
            turn.cube_q15,
        );
        // |v| f^2 / 2: 2^15 * 2^13.
        let arm = u32::from(facets.arm()).wrapping_mul(square);
        // A disc's radius is added to |b|, an ellipsoid's |D| to |M|; length units.
        let across = broad.wrapping_shr(set.finer).wrapping_add(1);
        let (near, away) = match set.set.extent() {
            Extent::Bounded { .. } => (across, 0),
            Extent::Gaussian(_) | Extent::Grown { .. } => {
                // f |X|, an upper bound of the bend: 2^14 * 2^14.1.
                let bend = broad.wrapping_mul(radians) >> 15;
                ready.bend = bend.wrapping_add(2) as i32;
                (0, across)
            }
        };
        // 9/16 f^2 (|b| + rho) and 3/8 f^3 (|M| + |D|): below 2^16 * 2^13.1 and 2^16 * 2^12.1.
        let near = u32::from(facets.farthest()).wrapping_add(near);
        let away = lever.wrapping_add(away);
        let robot = (near.wrapping_mul(square) >> 3)
            .wrapping_mul(9)
            .wrapping_add((away.wrapping_mul(cube) >> 2).wrapping_mul(3));
        let fine = 16u32.wrapping_sub(set.finer);
        // A normal is longer than 1 by 2^-8 at most.
        let arm = arm.wrapping_shr(fine);
        ready.rest_arm = arm.wrapping_add(arm >> 8).wrapping_add(2) as i32;
        ready.rest_robot = robot.wrapping_shr(fine).wrapping_add(2) as i32;
        Some(ready)
    }

    /// Returns the points of the set in a frame.
    #[inline(always)]
    pub fn seen(&self, frame: &Frame<'_>) -> FramePoints {
        let (vx, vy) = (i32::from(frame.x), i32::from(frame.y));
        match frame.axes {
            Axes::World if vx == 0 && vy == 0 => FramePoints {
                axes: frame.axes,
                x: self.set.x,
                y: self.set.y,
                lever: [0; 2],
                rest: 0,
                bend: 0,
            },
            Axes::World => {
                let [ax, ay] = self.outwards([vx, vy]);
                FramePoints {
                    axes: frame.axes,
                    x: self.set.x.wrapping_add(ax),
                    y: self.set.y.wrapping_add(ay),
                    lever: [ay.wrapping_neg(), ax],
                    rest: self.rest_arm,
                    bend: 0,
                }
            }
            Axes::Robot => {
                // Each is at most the layout's lever, 32,000, and so is their length.
                let (dx, dy) = (self.set.x.wrapping_sub(vx), self.set.y.wrapping_sub(vy));
                let (c, s) = (self.set.common.cos_q15, self.set.common.sin_q15);
                let x = q15(c.wrapping_mul(dx).wrapping_add(s.wrapping_mul(dy)));
                let y = q15(c.wrapping_mul(dy).wrapping_sub(s.wrapping_mul(dx)));
                FramePoints {
                    axes: frame.axes,
                    x,
                    y,
                    lever: [y, x.wrapping_neg()],
                    rest: self.rest_robot,
                    bend: self.bend,
                }
            }
        }
    }

    /// Returns a vector of robot axes in world axes, `R(theta)`, to the nearest; below 2^15.
    #[inline(always)]
    pub fn outwards(&self, [x, y]: [i32; 2]) -> [i32; 2] {
        let (c, s) = (self.set.common.cos_q15, self.set.common.sin_q15);
        [
            q15(c.wrapping_mul(x).wrapping_sub(s.wrapping_mul(y))),
            q15(s.wrapping_mul(x).wrapping_add(c.wrapping_mul(y))),
        ]
    }
}

#[inline(always)]
const fn q15(value: i32) -> i32 {
    value.wrapping_add(1 << 14) >> 15
}
