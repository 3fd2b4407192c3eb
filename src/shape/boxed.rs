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
