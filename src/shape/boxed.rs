//! Boxes: x, y and yaw each in an interval.

use super::Tolerance;

/// `x`, `y`, `yaw` each in a closed interval, in the goal frame.
///
/// The yaw interval is an arc: a yaw is inside if yaw + 360 k lies in `[lo, hi]` for some integer k, with
/// `lo <= hi <= lo + 360`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxSet {
    /// `[lo, hi]`, metres.
    pub x: [f64; 2],
    /// `[lo, hi]`, metres.
    pub y: [f64; 2],
    /// `[lo, hi]`, degrees.
    pub yaw_deg: [f64; 2],
}

/// Returns `true` if an arc in degrees is the whole circle, except for the rounding of its decimal ends (1e-9
/// deg, a hundredth of a unit of a table's headings).
#[must_use]
pub fn is_whole_circle([lo, hi]: [f64; 2]) -> bool {
    hi - lo >= 360.0 - 1e-9
}

/// Returns `true` if the interval in degrees is a valid arc: not reversed, and no more than the whole circle.
#[must_use]
pub fn is_arc([lo, hi]: [f64; 2]) -> bool {
    lo <= hi && hi - lo <= 360.0 + 1e-9
}

impl BoxSet {
    /// Returns the box for a goal that may be off by a tolerance. Its sides shrink by the largest distance
    /// that one of its points can move, its arc by the turn. The result may be empty.
    #[must_use]
    pub(crate) fn within(self, tolerance: Tolerance) -> Self {
        if tolerance.is_none() {
            return self;
        }
        let farthest = |[lo, hi]: [f64; 2]| lo.abs().max(hi.abs());
        let reach = tolerance.reach(libm::hypot(farthest(self.x), farthest(self.y)));
        let less = |[lo, hi]: [f64; 2], by: f64| [lo + by, hi - by];
        Self {
            x: less(self.x, reach),
            y: less(self.y, reach),
            yaw_deg: if is_whole_circle(self.yaw_deg) {
                self.yaw_deg
            } else {
                less(self.yaw_deg, tolerance.turn_deg)
            },
        }
    }

    /// Returns `true` if the box contains no pose.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        [self.x, self.y, self.yaw_deg]
            .iter()
            .any(|[lo, hi]| lo > hi)
    }

    /// Computes the distance to the nearer border on each axis, positive inside; yaw in radians.
    pub(crate) fn slacks(
        &self,
        x: f64,
        y: f64,
        yaw: f64,
        note: &mut impl FnMut(&'static str, f64),
    ) {
        let within = |value: f64, [lo, hi]: [f64; 2]| (value - lo).min(hi - value);
        note("x", within(x, self.x));
        note("y", within(y, self.y));
        let [lo, hi] = self.yaw_deg.map(f64::to_radians);
        let turn = core::f64::consts::TAU;
        // Only the representative nearest to the middle of the arc can be inside.
        let middle = 0.5 * (lo + hi);
        let nearest = yaw - turn * libm::round((yaw - middle) / turn);
        let slack = if is_whole_circle(self.yaw_deg) {
            core::f64::consts::PI
        } else {
            within(nearest, [lo, hi])
        };
        note("yaw", slack);
    }
}
