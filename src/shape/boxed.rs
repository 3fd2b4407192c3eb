//! Boxes: x, y and yaw each in an interval.

/// `x`, `y`, `yaw` each in a closed interval, in the goal frame.
///
/// The yaw interval is an arc: a yaw is inside when yaw + 360 k lies in `[lo, hi]` for some
/// integer k, with `lo <= hi <= lo + 360`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxSet {
    /// `[lo, hi]`, metres.
    pub x: [f64; 2],
    /// `[lo, hi]`, metres.
    pub y: [f64; 2],
    /// `[lo, hi]`, degrees.
    pub yaw_deg: [f64; 2],
}

impl BoxSet {
    /// Distance to the nearer border on each axis, positive inside; yaw in radians.
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
        // The representative nearest to the middle of the arc is the one that can be inside.
        let middle = 0.5 * (lo + hi);
        let nearest = yaw - turn * libm::round((yaw - middle) / turn);
        let slack = if self.yaw_deg[1] - self.yaw_deg[0] >= 360.0 {
            core::f64::consts::PI
        } else {
            within(nearest, [lo, hi])
        };
        note("yaw", slack);
    }
}
